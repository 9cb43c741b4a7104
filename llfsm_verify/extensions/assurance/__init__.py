"""A page for a safety case: what was checked, claims, hashes, assumptions, and what is open, as Markdown.

What a user writes:

    $ llfsm report --assurance arrangement.yaml properties.ltl --certificate proof.cert -o assurance.md

Mistakes:

    error: say which report: --assurance
    no/such/folder/page.md: error[E490]: the report cannot be written: No such file or directory
    arrangement.yaml: error[E451]: the certificate would replace a file that was read
"""

from __future__ import annotations

from llfsm_verify.plug import CommandEntry

ENTRIES = {
    "llfsm_verify.commands": (
        CommandEntry(
            name="report",
            place=f"{__name__}.command:arguments",
            about="write a page for a safety case",
            group="check",
            runs=f"{__name__}.command:run",
        ),
    ),
}
