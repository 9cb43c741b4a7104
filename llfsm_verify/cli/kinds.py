"""Files given in another's place on the command line: what their mistakes come from is said instead of them."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Sequence
from dataclasses import replace

from llfsm_verify.arrangement.files import STDIN
from llfsm_verify.arrangement.kinds import Kind, other_kind
from llfsm_verify.diagnostics import Diagnostic


def by_kind(diagnostics: Sequence[Diagnostic], options: Namespace) -> list[Diagnostic]:
    """The same diagnostics, those of a file of another kind than its place asks for replaced by a single one (E019).

    The arrangement itself, and the machine files it names, are looked at by the loader.
    """
    wanted = _places(options)
    found: list[Diagnostic] = []
    replaced: set[str] = set()
    for diagnostic in diagnostics:
        name = diagnostic.span.source.name if diagnostic.span is not None else ""
        if name in replaced:
            continue
        other = None
        if diagnostic.span is not None and name in wanted:
            other = other_kind(diagnostic.span.source, wanted[name])
        if other is not None:
            replaced.add(name)
        found.append(_as_called(other or diagnostic, options))
    return found


def _as_called(diagnostic: Diagnostic, options: Namespace) -> Diagnostic:
    """The same diagnostic; where it says how to name the files, by the command that was called with property files."""
    if diagnostic.code != "E019" or diagnostic.hint is None or getattr(options, "command", None) != "lint":
        return diagnostic
    return replace(diagnostic, hint=diagnostic.hint.replace("llfsm-verify ARRANGEMENT", "llfsm lint ARRANGEMENT"))


def _places(options: Namespace) -> dict[str, Kind]:
    """What the files named on the command line should be."""
    properties: list[str] = getattr(options, "properties", [])
    traces: list[str] = getattr(options, "traces", [])
    wanted: dict[str, Kind] = {STDIN if name == "-" else name: "properties" for name in properties}
    return wanted | dict.fromkeys(traces, "trace")
