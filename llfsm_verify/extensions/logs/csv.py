"""Logs as CSV (RFC 4180): the first line names the columns."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from llfsm_verify.plug import NoColumn, Row, Unreadable, Wanted


def read_csv(path: str, wanted: Wanted) -> Iterator[Row]:
    """The rows; blanks around a cell do not count. Raises as `plug.LOGS` says."""
    if wanted.topic is not None:
        raise NoColumn(wanted.topic, ())
    with Path(path).open(encoding="utf-8-sig", newline="") as file:
        reader = csv.reader(file, strict=True)
        try:
            names = [name.strip() for name in next(reader, [])]
            if not names:
                raise Unreadable(
                    "its first line names no columns", "write the names of the columns into the first line"
                )
            counts = Counter(names)
            for name in wanted.columns:
                if name not in counts:
                    raise NoColumn(name, names)
                if counts[name] > 1:
                    raise Unreadable(f"line 1: two columns are called `{name}`", "give one of them another name")
            places = [(name, names.index(name)) for name in wanted.columns]
            for cells in reader:
                if not cells:
                    continue
                if len(cells) != len(names):
                    said = f"line {reader.line_num} has {len(cells)} cells, and the first has {len(names)}"
                    raise Unreadable(said, "give each line a cell for each column; one with a comma stands in quotes")
                texts = ((name, cells[at].strip()) for name, at in places)
                yield Row(f"line {reader.line_num}", {name: text for name, text in texts if text})
        except csv.Error as error:
            raise Unreadable(f"line {reader.line_num}: {error}") from None
        except UnicodeDecodeError as error:
            raise Unreadable(f"it is not UTF-8 ({error.reason})") from None
