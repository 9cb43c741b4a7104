"""The number of the format that files are written in, and what is said of a file with another one."""

from __future__ import annotations

FORMAT = 1
"""Of arrangements, machines, property files, traces, results, findings of lint and answers to queries.

It grows when a reader of the old one could go wrong.
"""

_MOST_DIGITS = 9


def judge_format(written: str, what: str, key: str) -> tuple[str, str] | None:
    """What is wrong with a file (`what`, as in *the machine*) whose `key` says that it has the format `written`, and a
    hint; None where the format is ours.

    A later format may have what is unknown here, so nothing else should be said of such a file.
    """
    if written == str(FORMAT):
        return None
    if written.isascii() and written.isdigit() and len(written) <= _MOST_DIGITS and int(written) > FORMAT:
        message = f"{what} is of format {int(written)}, but this version of llfsm-verify knows only {FORMAT}"
        return message, "install a later version of llfsm-verify"
    return f"there is no format `{written[:20]}` of files", f"write `{key}: {FORMAT}`"
