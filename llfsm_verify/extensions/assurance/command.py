"""`llfsm report`: a page for a safety case."""

from __future__ import annotations

import hashlib
from argparse import Namespace
from pathlib import Path

from llfsm_verify.plug import (
    CommandParser,
    UsageError,
    arrangement_argument,
    engine_argument,
    limit_arguments,
    output_argument,
    property_files,
    property_lines,
)

UNWRITABLE = "E490"


def arguments(parser: CommandParser) -> None:
    """Add the arguments of `llfsm report`."""
    parser.about(
        "Check an arrangement as `llfsm verify --strict` does, and write a page about it for a safety case (Markdown).",
        "llfsm report --assurance arrangement.yaml properties.ltl --certificate proof.cert -o assurance.md",
    )
    add = parser.add_argument
    arrangement_argument(parser)
    property_files(parser)
    property_lines(parser)
    add("--assurance", action="store_true", help="required: the page has claims, hashes, assumptions, and what is open")
    engine_argument(parser)
    limit_arguments(parser)
    add("--certificate", metavar="FILE", help="write what proves the verdicts, and name it on the page")
    output_argument(parser)


def run(options: Namespace) -> int:
    """Returns the exit code of the check, under --strict; raises DiagnosticError for wrong files, and for what cannot
    be written."""
    from llfsm_verify.extensions.assurance.page import Checked, assurance
    from llfsm_verify.plug import (
        EarlyVerdicts,
        Options,
        asked_properties,
        limits_of,
        open_draft,
        policy_digest,
        ready,
        told,
        verify,
        write_certificate,
        write_whole,
    )  # fmt: skip

    if not options.assurance:
        raise UsageError("say which report: --assurance")
    draft, arrangement = open_draft(options.arrangement)
    properties = told(asked_properties(options), arrangement)
    ready(arrangement, properties, options.certificate, ("E451", "E450"), "the certificate", whole=True)
    ready(arrangement, properties, options.output, (UNWRITABLE, UNWRITABLE), "the report")
    limits = limits_of(options)
    with EarlyVerdicts(p.name for p in properties.goals) as early:
        wanted = Options(limits, vacuity="all", strict=True, decided=early.add)
        result = verify(arrangement, properties, wanted, options.engine)
    certificate = None
    if options.certificate is not None:
        write_certificate(options, result, arrangement, properties, limits_of(options))
        path = Path(options.certificate)
        if path.exists():
            certificate = options.certificate, hashlib.sha256(path.read_bytes()).hexdigest()
    page = assurance(Checked(result, arrangement, properties, draft.sources, policy_digest(arrangement), certificate))
    write_whole(page, options.output, UNWRITABLE, "the report")
    return result.exit_code
