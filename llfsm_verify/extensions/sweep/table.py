"""The rows of a sweep as a table for people, as CSV and as JSON."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from textwrap import wrap

from llfsm_verify import SweepRow as Row
from llfsm_verify.extensions.sweep.rows import FAULTS, row_data
from llfsm_verify.extensions.sweep.spelling import words
from llfsm_verify.plug import Json, counted, without_controls

NONE = "–"
"""In place of a verdict that was not asked for, or did not come."""
MOST_NUMBERS = 12
Column = tuple[str, list[str]]


def properties_of(rows: Sequence[Row]) -> list[str]:
    """What was asked in any row, `faults` last."""
    names = dict.fromkeys(name for row in rows for name in row.verdicts if name != FAULTS)
    return [*names, *([FAULTS] if any(FAULTS in row.verdicts for row in rows) else [])]


def text_table(rows: Sequence[Row], numbers: Sequence[int], width: int) -> str:
    """What differs between rows, each in a column; what does not is said once above. Then reasons, by rows.

    `numbers`: of the rows in the sweep. Where the verdicts of properties do not fit into `width`, those that do not
    hold are named instead.
    """
    varied = {name: [words(row.values[name]) for row in rows] for name in (rows[0].values if rows else ())}
    asked = {name: [row.verdicts.get(name, NONE) for row in rows] for name in properties_of(rows)}
    same = [f"{name} = {texts[0]}" for name, texts in varied.items() if len(set(texts)) == 1]
    same += [f"{name} {texts[0]}" for name, texts in asked.items() if len(set(texts)) == 1]
    first = [("row", list(map(str, numbers))), *_different(varied), ("verdict", [row.verdict for row in rows])]
    last = [("seconds", [f"{row.seconds:.2f}" for row in rows]),
            ("MiB", [f"{row.memory / 2**20:,.0f}" if row.memory else NONE for row in rows])]  # fmt: skip
    columns = [*first, *_different(asked), *last]
    if sum(2 + max(map(len, (name, *texts))) for name, texts in columns) - 2 > width:
        columns = [*first, *last, *_different({"not holding": [_not_holding(row) for row in rows]})]
    said = wrap(f"In all rows: {', '.join(same)}", max(width, 20)) if same and len(rows) > 1 else []
    lines = [*said, *([""] if said else [])]
    notes = _notes(rows, numbers)
    return "\n".join(map(without_controls, [*lines, *_aligned(columns), *([""] if notes else []), *notes])) + "\n"


def _different(columns: Mapping[str, list[str]]) -> list[Column]:
    return [(name, texts) for name, texts in columns.items() if len(texts) == 1 or len(set(texts)) > 1]


def _not_holding(row: Row) -> str:
    found: dict[str, list[str]] = {}
    for name, verdict in row.verdicts.items():
        if verdict != "holds":
            found.setdefault(verdict, []).append(name)
    return "; ".join(f"{verdict}: {', '.join(names)}" for verdict, names in found.items())


def _aligned(columns: Sequence[Column]) -> list[str]:
    """Lines of cells; columns of numbers are flush right."""
    cells = [(name, *texts) for name, texts in columns]
    wide = [max(map(len, texts)) for texts in cells]
    right = [all(text.replace(",", "").replace(".", "").lstrip("-").isdigit() or text == NONE for text in texts)
             and set(texts) != {NONE} for _, texts in columns]  # fmt: skip
    return [
        "  ".join(text.rjust(w) if r else text.ljust(w) for text, w, r in zip(line, wide, right, strict=True)).rstrip()
        for line in zip(*cells, strict=True)
    ]


def _notes(rows: Sequence[Row], numbers: Sequence[int]) -> list[str]:
    """Why something is unknown or failed, each sentence once with the rows that it is about."""
    found: dict[str, list[int]] = {}
    for number, row in zip(numbers, rows, strict=True):
        said = [f"{name} is unknown because {reason}" for name, reason in row.reasons.items()]
        if row.message:
            said.append(f"{row.state}: {row.message}")
        for each in said:
            found.setdefault(each, []).append(number)
    lines = []
    for sentence, of in found.items():
        some = ", ".join(map(str, of[:MOST_NUMBERS])) + (", …" if len(of) > MOST_NUMBERS else "")
        lines += f"row{'' if len(of) == 1 else 's'} {some}: {sentence}".splitlines()
    return lines


def summary(rows: Sequence[Row], wanted: int) -> str:
    """How many there are of each verdict, in a line."""
    counts: dict[str, int] = {}
    for row in rows:
        counts[row.verdict] = counts.get(row.verdict, 0) + 1
    said = ", ".join(f"{verdict} {number:,}" for verdict, number in sorted(counts.items()))
    of = "" if len(rows) == wanted else f" of {wanted:,}"
    return f"{len(rows):,}{of} {counted(wanted, 'combination').partition(' ')[2]}" + (f": {said}" if said else "")


def csv_table(rows: Sequence[Row], numbers: Sequence[int]) -> str:
    """A line a row, with a column for each value and each property."""
    axes, asked = list(rows[0].values) if rows else [], properties_of(rows)
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    rest = ("states", "seconds", "memory", "reasons", "traces", "message")
    writer.writerow(["row", *axes, "state", "verdict", *asked, *rest])
    for number, row in zip(numbers, rows, strict=True):
        reasons = "; ".join(f"{name}: {reason}" for name, reason in row.reasons.items())
        writer.writerow([
            number, *(words(row.values[name]) for name in axes), row.state, row.verdict,
            *(row.verdicts.get(name, "") for name in asked), row.states, row.seconds, row.memory, reasons,
            "; ".join(row.traces.values()), row.message,
        ])  # fmt: skip
    return out.getvalue()


def json_table(rows: Sequence[Row], numbers: Sequence[int], wanted: int, exit_code: int) -> str:
    """All of it as one object."""
    found: list[Json] = [
        {"row": number, **row_data(row), "verdict": row.verdict} for number, row in zip(numbers, rows, strict=True)
    ]
    value: Json = {"format": 1, "combinations": wanted, "rows": found, "exit_code": exit_code}
    return json.dumps(value, indent=2, ensure_ascii=False) + "\n"
