"""Vectors from a file."""

from __future__ import annotations

import json

from llfsm_verify.analysis.coverage.vectors import Sequence, Vectors
from llfsm_verify.arrangement.files import read_source
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.targets.c99.verifying import FAILED


def read_vectors(path: str) -> Vectors:
    """DiagnosticError: the file cannot be read (E001 to E005), or is none of vectors (E509)."""
    source, _ = read_source(path)
    try:
        whole = json.loads(source.text)
        sequences = tuple(
            Sequence(
                tuple(map(_row, each["inputs"])), tuple(map(_row, each["records"])), int(each.get("fault", 0)),
                _row(each.get("start", ())),
            )
            for each in whole["sequences"]
        )  # fmt: skip
        fields, inputs = (tuple(map(str, whole[key])) for key in ("fields", "inputs"))
        found = Vectors(str(whole["program"]), whole["unit"], inputs, fields, sequences)
    except (ValueError, KeyError, TypeError, RecursionError):
        found = None
    if found is None or not _fits(found):
        raise DiagnosticError(
            Diagnostic(FAILED, "this is not a file of vectors", hint="`llfsm coverage` writes them", file=path)
        )
    return found


def _row(row: list[int]) -> tuple[int, ...]:
    return tuple(map(int, row))


def _fits(vectors: Vectors) -> bool:
    return vectors.unit in ("ringlet", "cycle") and all(
        len(s.inputs) - len(s.records) == (s.fault != 0)
        and all(len(row) == len(vectors.inputs) for row in s.inputs)
        and all(len(row) == len(vectors.fields) for row in (*s.records, *([s.start] if s.start else [])))
        for s in vectors.sequences
    )
