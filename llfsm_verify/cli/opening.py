"""What most commands begin with: the arrangement, after what is to be said of its file."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING

from llfsm_verify.cli.usage import UsageError

if TYPE_CHECKING:
    from llfsm_verify.arrangement.draft import Draft
    from llfsm_verify.arrangement.model import Arrangement


def open_draft(path: str) -> tuple[Draft, Arrangement]:
    """What is read of an arrangement, and the arrangement; its warnings are said. DiagnosticError."""
    from llfsm_verify.arrangement.formats import Given, read_arrangement
    from llfsm_verify.arrangement.resolve.arrangement import resolve

    draft = read_arrangement(Given(path))
    arrangement = resolve(draft)
    for warning in arrangement.warnings:
        print(warning.render(), file=sys.stderr)
    return draft, arrangement


def open_arrangement(path: str) -> Arrangement:
    """The arrangement alone; see `open_draft`."""
    return open_draft(path)[1]


def refuse_two_inputs(paths: Iterable[str]) -> None:
    """UsageError: standard input (`-`) is named twice."""
    if list(paths).count("-") > 1:
        raise UsageError("standard input can be read only once")
