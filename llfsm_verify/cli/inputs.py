"""The files that a check reads, found without checking anything: so also while something in them is wrong."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from llfsm_verify.arrangement.formats import Given, read_arrangement
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.logic.reading import read_source as read_property_source


def files_read(
    arrangement: str | Path, properties: Sequence[str | Path], lines: Sequence[str] = (), syntax: str = "llfsm"
) -> list[Path]:
    """The arrangement, the machine files it names, the property files, and the automata that they and `lines` name.

    `syntax` is that of properties whose file does not say another. Files that are not there are listed too. What
    cannot be read, or does not parse, names no further files.
    """
    found = [Path(arrangement), *_machine_files(Path(arrangement)), *map(Path, properties)]
    for path in properties:
        try:
            found += _automata([read_property_source(path)], syntax)
        except DiagnosticError:
            continue
    found += _automata((Source("<command line>", line) for line in lines), syntax)
    return list(dict.fromkeys(found))


def _machine_files(path: Path) -> tuple[Path, ...]:
    try:
        return read_arrangement(Given(path)).files
    except DiagnosticError:
        return ()


def _automata(sources: Iterable[Source], syntax: str) -> Iterator[Path]:
    for source in sources:
        try:
            lines = parse_properties([source], syntax)
        except DiagnosticError:
            continue
        for line in lines:
            if line.file is not None:
                yield Path(source.name).parent / line.file
