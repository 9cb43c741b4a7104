"""What is done when engines disagree: both results are saved before the command ends."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.cli.io.output import tell
from llfsm_verify.diagnostics import DiagnosticError, Disagreement
from llfsm_verify.logic.properties import PropertySet

FOLDER = "disagreement"
"""Where results are saved, unless the user names a folder for traces."""


@contextmanager
def both_saved(arrangement: Arrangement, properties: PropertySet, folder: str | None) -> Iterator[None]:
    """Save what two engines say that disagree; that this fails matters less than that they do, so it is only said."""
    try:
        yield
    except Disagreement as error:
        from llfsm_verify.report.saving import save_disagreement
        from llfsm_verify.verification.differential import EnginesDisagree

        if not isinstance(error, EnginesDisagree):
            raise
        place = Path(folder or FOLDER)
        try:
            save_disagreement(error, arrangement, properties, place)
        except DiagnosticError as unsaved:
            tell(unsaved.diagnostics[0])
        else:
            tell(f"what both say is saved in {place}")
        raise
