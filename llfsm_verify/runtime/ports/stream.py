"""The kind `stream`: lines of JSON through named pipes, descriptors and the standard streams of the process."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from llfsm_verify.runtime.ports import UNKNOWN
from llfsm_verify.runtime.ports.line_port import STANDARD, End, Inherited, LinePort, Named
from llfsm_verify.runtime.ports.port import Kind, Link, Started
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Node, mark
from llfsm_verify.yaml.tables import NUMBER, Field, Table


class Stream(Kind):
    """`read:` and `write:`, each a path, a number of a descriptor, or a word of `STANDARD`."""

    table = Table(
        "lines of JSON, an object each, through pipes and descriptors",
        (
            Field("read", "the path of a named pipe, a number of a descriptor, or `stdin`", NUMBER),
            Field("write", "the path of a named pipe, a number of a descriptor, `stdout` or `stderr`", NUMBER),
        ),
        needs={"inputs": ("read",), "read": ("inputs",), "outputs": ("write",), "write": ("outputs",)},
    )
    keys, required, paths = table.keys, table.required, True

    def settings(self, report: Report, found: Mapping[str, Node], what: str, folder: str) -> Started | None:
        """See `Kind`."""
        for key, entries in (("read", "inputs"), ("write", "outputs")):
            if (key in found) != (entries in found):
                lacking, there = (key, entries) if entries in found else (entries, key)
                report.error(
                    "E034", f"{what} has `{there}` and no `{lacking}`", mark(found[there]), f"write `{lacking}: …`"
                )
                return None
        written = {key: report.scalar(found[key], f"`{key}`") for key in self.keys if key in found}
        given = {key: scalar.text for key, scalar in written.items() if scalar is not None}
        if len(given) < len(written):
            return None
        wrong = next((s for s in written.values() if s is not None and "\0" in s.text), None)
        for key, standard in (("read", "stdout"), ("write", "stdin")):
            scalar = written.get(key)
            if scalar is not None and scalar.text == standard:
                report.error(
                    UNKNOWN, f"{what} cannot {key} {standard}", mark(scalar), "write `read: stdin`, `write: stdout`"
                )
                return None
        if wrong is not None:
            report.error(UNKNOWN, f"{what} names no path", mark(wrong), "write the path of a pipe")
            return None
        places = {key: _place(text, folder) for key, text in given.items()}

        def start(link: Link) -> LinePort:
            ends: dict[str, End] = {
                key: Inherited(at) if isinstance(at, int) else Named(at, output=key == "write")
                for key, at in places.items()
            }
            return LinePort(link, ends.get("read"), ends.get("write"))

        return Started(start, tuple(_words(at, key) for key, at in places.items()))


def _place(text: str, folder: str) -> int | str:
    """A descriptor, or a path seen from where we are."""
    if text in STANDARD:
        return STANDARD[text]
    if text.isascii() and text.isdigit() and len(text) <= 9:
        return int(text)
    return os.path.normpath(Path(folder, text))


def _words(place: int | str, key: str) -> str:
    names = {0: "standard input", 1: "standard output", 2: "standard error"}
    where = names.get(place, f"descriptor {place}") if isinstance(place, int) else f"`{place}`"
    return f"{where} for {'reading' if key == 'read' else 'writing'}"


KIND = Stream()
