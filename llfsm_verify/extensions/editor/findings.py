"""What is said of the files of one arrangement: the diagnostics of the command line, and an index of their names.

This runs in a child process (`child.py`), which reads the texts of editors in the place of files. Nothing is explored:
files are read and resolved, and properties are typed.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from typing import Literal

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.editor.codes import ALONE, NO_ARRANGEMENT
from llfsm_verify.extensions.editor.indexing import build_index, index_machine
from llfsm_verify.extensions.editor.names import Index
from llfsm_verify.plug import (
    MACHINES,
    Arrangement,
    Draft,
    FrameLayout,
    GivenArrangement,
    Layout,
    MachineDraft,
    PropertySet,
    Reading,
    Source,
    bind,
    compose,
    doubts,
    find_owners,
    free_inputs,
    inputs_of,
    is_arrangement,
    kind_of,
    lower,
    parse_properties,
    program_slots,
    properties_beside,
    read_arrangement,
    read_ports,
    read_properties,
    read_source,
    resolve,
    runnable,
    written,
)

Sort = Literal["arrangement", "machine", "policy", "ports", "properties", "automaton", "theory"]
_PORTS = re.compile(r"^ports[ \t]*:", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Said:
    """A diagnostic: of the characters `start` to `end` of a file, by its real path."""

    file: str
    start: int
    end: int
    code: str
    message: str
    notes: tuple[str, ...] = ()
    hint: str | None = None
    severity: Literal["error", "warning", "information"] = "error"
    related: tuple[tuple[str, int, int, str], ...] = ()
    """File, line and column (from 0, in characters) of places that notes tell."""


@dataclass(frozen=True, slots=True)
class Findings:
    """All that is known of an arrangement with its properties, or of a file that belongs to none."""

    root: str
    properties: tuple[str, ...]
    sorts: Mapping[str, Sort]
    """The files that were read, by their real paths."""
    texts: Mapping[str, str]
    said: tuple[Said, ...]
    index: Index
    readable: frozenset[str]
    """The files of which the index tells."""
    whole: bool = field(default=False)
    """The arrangement and its properties have no mistakes, so that they can be checked."""


@dataclass(frozen=True, slots=True)
class Asked:
    """A file that changed, and the arrangements with their properties that it is of, where that is known already."""

    path: str
    opened: tuple[str, ...]
    """The files that are open in the editor, those that were opened last first."""
    owners: tuple[tuple[str, tuple[str, ...]], ...] | None = None


def find_all(asked: Asked) -> tuple[Findings, ...]:
    """What is said of the arrangements that the file belongs to, or of the file alone."""
    owners = owners_of(asked.path, asked.opened) if asked.owners is None else asked.owners
    ports = _is_ports(asked.path)
    if not owners:
        return (_alone(asked.path, ports=ports),)
    return tuple(_of(root, properties, asked.path if ports else None) for root, properties in owners)


def owners_of(path: str, opened: Sequence[str]) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """The arrangements that a file belongs to, as `llfsm check` finds them, with their properties. A file of properties
    or ports that belongs to none is taken for one of the only arrangement beside it, or of the one opened last."""
    file = Path(path)
    try:
        found = list(find_owners(file))
    except DiagnosticError:
        found = []
    mine: tuple[str, ...] = ()
    properties = file.suffix == ".ltl"
    if not found and (properties or _is_ports(path)):
        mine = (path,) if properties else ()
        found = _near(file, opened)
    return tuple((str(one), tuple(dict.fromkeys((*map(str, properties_beside(one)), *mine)))) for one in found)


def _near(file: Path, opened: Sequence[str]) -> list[Path]:
    stem = file.name.partition(".")[0]
    beside = [one for one in sorted(file.parent.glob("*.y*ml")) if one != file and is_arrangement(one)]
    named = [one for one in beside if one.name.partition(".")[0] == stem]
    others = [Path(one) for one in opened if one != str(file) and is_arrangement(Path(one))]
    return named[:1] or (beside if len(beside) == 1 else others[:1])


def _is_ports(path: str) -> bool:
    if not path.endswith((".yaml", ".yml")):
        return False
    try:
        source = read_source(path)[0]
    except DiagnosticError:
        return False
    return kind_of(source) is None and _PORTS.search(source.text) is not None


# ---------------------------------------------------------------- an arrangement


class _Collected:
    """Diagnostics and texts, as they come."""

    def __init__(self) -> None:
        self.files: dict[str, str] = {}
        self.texts: dict[str, str] = {}
        self.sorts: dict[str, Sort] = {}
        self.said: list[Diagnostic] = []

    def add(self, sources: Iterable[Source], sort: Sort) -> None:
        for source in sources:
            real = self.files[source.name] = str(Path(source.name).resolve())
            self.texts[real] = source.text
            self.sorts.setdefault(real, sort)

    def findings(self, root: str, properties: Collection[str], index: Index, *, whole: bool = False) -> Findings:
        for diagnostic in self.said:
            if diagnostic.span is not None:
                self.add([diagnostic.span.source], "automaton")
        own = str(Path(root).resolve())
        said = tuple(dict.fromkeys(_said(d, own, self.files) for d in self.said))
        readable = frozenset(r.file for r in index.regions)
        return Findings(root, tuple(properties), self.sorts, self.texts, said, index, readable, whole)


def _of(root: str, properties: tuple[str, ...], ports: str | None) -> Findings:
    found = _Collected()
    draft: Draft | None = None
    arrangement = None
    try:
        draft = read_arrangement(GivenArrangement(root))
        found.add(draft.sources[:1], "arrangement")
        for source in draft.sources[1:]:
            kind = kind_of(source)
            if kind in {"policy", "theory"}:
                found.add([source], kind)
        found.add(draft.sources[1:], "machine")
        arrangement = resolve(draft)
        found.said += arrangement.warnings
    except DiagnosticError as error:
        found.said += error.diagnostics
    for file in draft.files if draft is not None else ():
        found.sorts.setdefault(str(file.resolve()), "machine")
    asked, fine = _properties(found, properties, arrangement)
    if ports is not None:
        _read_ports(found, ports, arrangement)
    files = {name: str(Path(name).resolve()) for name in found.files}
    index = build_index(draft, asked, files)
    return found.findings(root, properties, index, whole=arrangement is not None and fine)


def _properties(
    found: _Collected, files: Sequence[str], arrangement: Arrangement | None
) -> tuple[PropertySet | None, bool]:
    """The properties, as far as they can be read, and whether they fit."""
    sources = []
    for file in files:
        found.sorts.setdefault(str(Path(file).resolve()), "properties")
        try:
            sources.append(read_properties(file))
        except DiagnosticError as error:
            found.said += error.diagnostics
            return None, False
    found.add(sources, "properties")
    try:
        asked = parse_properties(sources)
    except DiagnosticError as error:
        found.said += error.diagnostics
        return None, False
    if arrangement is None:
        return asked, False
    found.said += doubts(arrangement, asked)
    try:
        bind(arrangement, asked)
    except DiagnosticError as error:
        found.said += error.diagnostics
        return asked, False
    return asked, True


def _read_ports(found: _Collected, path: str, arrangement: Arrangement | None) -> None:
    """What is wrong with a file of ports; without an arrangement only as far as YAML goes."""
    found.add([read_source(path)[0]], "ports")
    try:
        if arrangement is None:
            compose(read_source(path)[0], found.said)
            return
        cycle = None if arrangement.timing == "timed" else Fraction(100)
        program = lower(runnable(arrangement, simulated=False, cycle_ms=cycle))
        layout = Layout.of(program)
        slots = program_slots(program, layout, FrameLayout.of(program, layout, 0))
        requests = {plant.request.name: plant.request for plant in arrangement.plants if plant.request is not None}
        read_ports(path, inputs_of(program), slots, requests, free_inputs(program))
    except DiagnosticError as error:
        found.said += error.diagnostics


# ---------------------------------------------------------------- a file that belongs to none


def _alone(path: str, *, ports: bool) -> Findings:
    """What can be said without an arrangement: a machine or a property file is read, and names are not looked up."""
    found, index = _Collected(), Index()
    named = f"write `NAME: {{file: {Path(path).name}}}` under `machines` of an arrangement"
    if path.endswith(".ltl"):
        asked = _properties(found, (path,), None)[0]
        index = build_index(None, asked, {path: str(Path(path).resolve())})
        beside = "call it X.ltl beside X.yaml, properties.ltl beside arrangement.yaml, or open its arrangement"
        return _with_note(found.findings(path, (path,), index), NO_ARRANGEMENT, "properties", beside)
    if ports:
        _read_ports(found, path, None)
        hint = "put it beside its arrangement, X.ports.yaml beside X.yaml, or open that"
        return _with_note(found.findings(path, (), index), NO_ARRANGEMENT, "ports", hint)
    try:
        source = read_source(path)[0]
    except DiagnosticError as error:
        found.said += error.diagnostics
        return found.findings(path, (), index)
    kind = kind_of(source)
    if kind == "machine":
        found.add([source], "machine")
        reading = Reading(Path(path).parent, {path: source.text})
        machine = MACHINES.load(MACHINES.named_by(path) or "yaml")(reading, Path(path), written(source, 0, 1))
        found.said += reading.diagnostics
        if isinstance(machine, MachineDraft):
            index = index_machine(machine, found.files)
        return _with_note(found.findings(path, (), index), ALONE, "machine", named)
    if kind == "policy":
        found.add([source], "policy")
        return _with_note(found.findings(path, (), index), ALONE, "policy", "write `access: {file: …}` there")
    if kind == "arrangement":  # without `machines`, which makes one for `llfsm check`
        return _of(path, (), None)
    return found.findings(path, (), index)


def _with_note(findings: Findings, code: str, what: str, hint: str) -> Findings:
    own = str(Path(findings.root).resolve())
    message = {
        "properties": "no arrangement is known for this property file, so its names are not checked",
        "ports": "no arrangement is known for this file of ports, so its names are not checked",
        "machine": "no arrangement names this machine, so its guards and actions are not checked",
        "policy": "no arrangement names this policy, so it is not checked",
    }[what]
    note = Said(own, 0, 1, code, message, hint=hint, severity="information")
    return replace(findings, said=(*findings.said, note))


# ---------------------------------------------------------------- places


def _said(d: Diagnostic, own: str, files: Mapping[str, str]) -> Said:
    if d.span is not None:
        file, start, end = files[d.span.source.name], d.span.start, max(d.span.end, d.span.start)
    else:
        file, start, end = str(Path(d.file).resolve()) if d.file else own, 0, 1
    related = tuple(place for note in d.notes for place in _places(note, file, files))
    severity: Literal["error", "warning"] = "error" if d.is_error else "warning"
    return Said(file, start, end, d.code, d.message, d.notes, d.hint, severity, related)


def _places(note: str, file: str, files: Mapping[str, str]) -> Iterator[tuple[str, int, int, str]]:
    """The places that a note tells, as in `it is declared at lift.yaml:3:5` and `line 7`."""
    for name, real in files.items():
        for found in re.finditer(re.escape(name) + r":(\d+):(\d+)", note):
            yield real, int(found[1]) - 1, int(found[2]) - 1, note
    near = re.search(r"\bline (\d+)\b", note)
    if near:
        yield file, int(near[1]) - 1, 0, note
