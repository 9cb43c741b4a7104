"""Saving the traces of a result, one file each."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.verdict import PropertyResult, Result
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.logic.properties import Property, PropertySet
from llfsm_verify.report.tracefile import SavedProperty, trace_document


def save_traces(result: Result, arrangement: Arrangement, properties: PropertySet, directory: Path) -> list[Path]:
    """Write `NAME.trace.yaml` for every property with a trace and ``fault-N-CODE.trace.yaml`` for every fault.

    `properties` are those that were checked. The directory is made when it is not there. Returns the files
    written; raises DiagnosticError (E405) when that is not possible.
    """
    documents: list[tuple[Path, str]] = []
    assumptions = tuple((p.name, p.text) for p in properties.assumptions)
    syntaxes = {p.name: p.syntax for p in properties if p.syntax != "llfsm"}
    for item in result.properties:
        if item.trace is not None:
            saved = SavedProperty(item.name, item.kind, saved_text(item, directory))
            text = trace_document(item.trace, arrangement, saved, assumptions, directory, syntaxes)
            documents.append((directory / f"{item.name}.trace.yaml", text))
    for number, finding in enumerate(result.faults.findings, 1):
        text = trace_document(finding.trace, arrangement, finding.site, assumptions, directory, syntaxes)
        documents.append((directory / f"fault-{number}-{finding.site.code}.trace.yaml", text))
    return write_traces(documents, directory)


def write_traces(documents: Sequence[tuple[Path, str]], directory: Path) -> list[Path]:
    """Write trace files, given by path and text, into a directory that is made when it is not there.

    Returns the files written; DiagnosticError (E405) when that is not possible.
    """
    try:
        if documents:
            directory.mkdir(parents=True, exist_ok=True)
        for path, text in documents:
            path.write_text(text, encoding="utf-8")
    except OSError as e:
        reason = e.strerror or "input/output error"
        raise DiagnosticError(
            Diagnostic("E405", f"traces cannot be saved there: {reason}", file=str(directory))
        ) from None
    return [path for path, _ in documents]


def saved_text(item: PropertyResult | Property, directory: Path) -> str:
    """The property's text; the file of an automaton as seen from `directory`."""
    if not item.kind.startswith("automaton"):
        return item.text
    return Path(os.path.relpath(Path(item.span.source.name).parent / item.text, directory)).as_posix()
