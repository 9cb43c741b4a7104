"""Files of test vectors: JSON with the number of its format, written with a row of numbers a line, and read strictly.

{"vectors": 1, "program": "3f…", "unit": "ringlet", "inputs": ["door_open", …], "fields": ["cooking.$state", …],
 "sequences": [{"fault": 0, "inputs": [[0, 1], …], "records": [[2, 0, …], …]}, …]}
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from llfsm_verify.analysis.coverage import BAD_VECTORS
from llfsm_verify.analysis.coverage.vectors import Sequence as Run
from llfsm_verify.analysis.coverage.vectors import Unit, Vectors
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.fileformat import FORMAT, judge_format
from llfsm_verify.files import read_regular
from llfsm_verify.jsonvalue import Json
from llfsm_verify.program.json import program_json
from llfsm_verify.program.program import Program

KEYS: Final = ("vectors", "program", "unit", "inputs", "fields", "sequences")
RUN_KEYS: Final = ("fault", "inputs", "records")
MOST_BYTES: Final = 1 << 28
BEGIN: Final = re.compile(rb'\s*\{\s*"vectors"\s*:')
ANEW: Final = "write it again with `llfsm coverage ARRANGEMENT --vectors FILE`"


def program_hash(program: Program) -> str:
    """What vectors are of: what the program does, without the places in its sources."""
    document = program_json(program)
    faults = [[site.code, site.message] for site in program.faults]
    return hashlib.sha256(json.dumps({**document, "faults": faults}).encode()).hexdigest()


def vectors_text(vectors: Vectors) -> str:
    """The text of the file."""
    head = {
        "vectors": FORMAT, "program": vectors.program, "unit": vectors.unit, "inputs": vectors.inputs,
        "fields": vectors.fields,
    }  # fmt: skip
    runs = ",\n".join(
        f'{{"fault": {run.fault}, "inputs": {_rows(run.inputs)},\n "records": {_rows(run.records)}}}'
        for run in vectors.sequences
    )
    lines = [f'"{key}": {json.dumps(value, ensure_ascii=False)}' for key, value in head.items()]
    return "{" + ",\n ".join([*lines, f'"sequences": [\n{runs}]']) + "}\n"


def _rows(rows: Sequence[Sequence[int]]) -> str:
    return "[" + ",\n  ".join(str(list(row)) for row in rows) + "]"


def may_be_replaced(path: str | Path) -> bool:
    """Whether nothing is there that a person has made: no regular file, or one of test vectors."""
    try:
        return BEGIN.match(read_regular(path, 64)) is not None
    except (OSError, ValueError):
        return not Path(path).is_file()


def is_vectors(path: str | Path) -> bool:
    """Whether a regular file begins as one does; a file that cannot be read does not."""
    try:
        return read_regular(path, 64).lstrip().startswith(b"{")
    except (OSError, ValueError):
        return False  # what is wrong with it is said where files of other kinds are read


def read_vectors(path: str | Path) -> Vectors:
    """The vectors in a file. DiagnosticError (E522): they cannot be read; the message says what is wrong, and where."""
    try:
        data = read_regular(path, MOST_BYTES + 1)
    except OSError as error:
        raise _bad(path, f"the file cannot be read: {error.strerror or 'input/output error'}") from None
    except ValueError:
        raise _bad(path, "this is not the path of a file") from None
    if len(data) > MOST_BYTES:
        raise _bad(path, f"the file is larger than {MOST_BYTES >> 20} MiB")
    try:
        found = json.loads(data.decode("utf-8"), object_pairs_hook=_once, parse_float=_whole, parse_constant=_whole)
    except json.JSONDecodeError as error:
        raise _bad(f"{path}:{error.lineno}:{error.colno}", f"this is not JSON: {error.msg}") from None
    except (ValueError, RecursionError) as error:
        raise _bad(path, f"this is not a file of test vectors: {str(error)[:80]}") from None
    return _Reader(path).vectors(found)


def _once(pairs: list[tuple[str, Json]]) -> dict[str, Json]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("a key is given twice")
    return found


def _whole(text: str) -> Json:
    raise ValueError(f"{text} is not a whole number")


def _bad(path: str | Path, what: str) -> DiagnosticError:
    return DiagnosticError(Diagnostic(BAD_VECTORS, what, hint=ANEW, file=str(path)))


class _Reader:
    """Says where in a file something else stands than belongs there."""

    def __init__(self, path: str | Path) -> None:
        self._path = path

    def vectors(self, value: Json) -> Vectors:
        wrong = judge_format(str(value.get("vectors")), "the file", "vectors") if isinstance(value, dict) else None
        if wrong is not None:
            raise _bad(self._path, wrong[0])
        found = self._object(value, KEYS, "the file")
        unit = found["unit"]
        if unit not in ("ringlet", "cycle"):
            raise self._other("`unit`", '"ringlet" or "cycle"')
        known: Unit = "ringlet" if unit == "ringlet" else "cycle"
        inputs, fields = self._names(found["inputs"], "`inputs`"), self._names(found["fields"], "`fields`")
        program = found["program"]
        if not isinstance(program, str):
            raise self._other("`program`", "a text")
        runs = [
            self._run(run, len(inputs), len(fields), f"`sequences[{number}]`")
            for number, run in enumerate(self._list(found["sequences"], "`sequences`"))
        ]
        return Vectors(program, known, inputs, fields, tuple(runs))

    def _run(self, value: Json, inputs: int, fields: int, where: str) -> Run:
        found = self._object(value, RUN_KEYS, where)
        fault = found["fault"]
        if not isinstance(fault, int) or isinstance(fault, bool) or (fault < 0 and fault != -2):
            raise self._other(f"`fault` of {where}", "0, the number of a fault, or -2")
        given = self._table(found["inputs"], inputs, f"`inputs` of {where}")
        records = self._table(found["records"], fields, f"`records` of {where}")
        if len(given) != len(records) + (fault != 0):
            raise self._other(f"`records` of {where}", f"{len(given) - (fault != 0)} rows")
        return Run(given, records, fault)

    def _object(self, value: Json, keys: Sequence[str], where: str) -> dict[str, Json]:
        if not isinstance(value, dict) or sorted(value) != sorted(keys):
            raise self._other(where, f"an object with {', '.join(f'`{key}`' for key in keys)}")
        return value

    def _list(self, value: Json, where: str) -> list[Json]:
        if not isinstance(value, list):
            raise self._other(where, "a list")
        return value

    def _names(self, value: Json, where: str) -> tuple[str, ...]:
        names = [name for name in self._list(value, where) if isinstance(name, str)]
        if len(set(names)) < len(self._list(value, where)):
            raise self._other(where, "a list of names, each once")
        return tuple(names)

    def _table(self, value: Json, width: int, where: str) -> tuple[tuple[int, ...], ...]:
        rows = []
        for number, row in enumerate(self._list(value, where)):
            cells = self._list(row, f"row {number} of {where}")
            numbers = tuple(n for n in cells if isinstance(n, int) and not isinstance(n, bool))
            if len(cells) != width or len(numbers) != width:
                raise self._other(f"row {number} of {where}", f"{width} whole numbers")
            rows.append(numbers)
        return tuple(rows)

    def _other(self, where: str, wanted: str) -> DiagnosticError:
        return _bad(self._path, f"{where} must be {wanted}")
