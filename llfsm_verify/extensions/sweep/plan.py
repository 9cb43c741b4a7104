"""The plan of a sweep: its combinations in a fixed order, each looked at before anything starts, and their tasks."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.metadata import version
from itertools import product
from pathlib import Path

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.sweep.codes import IDLE_EXCLUSION, NO_NAME, NO_PROPERTIES, WRONG_EXCLUSION
from llfsm_verify.extensions.sweep.reading import ARRANGEMENT, PROPERTIES, Given, SweepFile
from llfsm_verify.extensions.sweep.spelling import words
from llfsm_verify.extensions.sweep.task import Task, ValueKind
from llfsm_verify.extensions.sweep.values import NoSuchName, names, with_nodes
from llfsm_verify.plug import (
    Arrangement,
    Draft,
    GivenArrangement,
    Json,
    PropertySet,
    Source,
    Span,
    UnreadablePart,
    bind,
    did_you_mean,
    doubts,
    mark,
    parse_properties,
    properties_beside,
    read_arrangement,
    read_properties,
    resolve,
)

LOOKED_AT = 1_000
"""Combinations up to which each one is loaded before anything starts; of more, each value once."""
MOST_SAID = 20


@dataclass(frozen=True, slots=True)
class Combination:
    """A row to be: its values by the names of axes, in their order, and the check that it is."""

    number: int
    """From 1, in the order of the table."""
    values: Mapping[str, Json]
    task: Task
    root: Path
    """The folder below which the files of the task are."""


@dataclass(frozen=True, slots=True)
class Plan:
    """All combinations, and warnings about the file."""

    sweep: SweepFile
    combinations: tuple[Combination, ...]
    warnings: tuple[Diagnostic, ...]

    @property
    def digest(self) -> str:
        """SHA-256 (hex) of the keys of all tasks, in order."""
        return _digest([each.task.key for each in self.combinations])


def plan(sweep: SweepFile) -> Plan:
    """Read all files and look at all combinations (LOOKED_AT).

    DiagnosticError: what is wrong with the arrangements and property files, also with values in them; a name that an
    arrangement does not have (E591); nothing is left to check (E595).
    """
    chosen: list[dict[str, Given]] = []
    used: set[int] = set()
    for values in product(*(axis.values for axis in sweep.axes)):
        row = dict(zip((axis.name for axis in sweep.axes), values, strict=True))
        met = {i for i, each in enumerate(sweep.exclude) if each.meets({name: g.value for name, g in row.items()})}
        used |= met
        if not met:
            chosen.append(row)
    idle = tuple(
        Diagnostic(IDLE_EXCLUSION, "this excludes no combination", each.place, hint="leave it out")
        for i, each in enumerate(sweep.exclude)
        if i not in used
    )
    if not chosen:
        raise DiagnosticError(
            Diagnostic(WRONG_EXCLUSION, "everything is excluded", sweep.exclude[0].place, hint="leave one of them out")
        )
    files = _Files(sweep)
    doubted = _look_through(files, chosen)
    return Plan(
        sweep,
        tuple(files.combination(i, row) for i, row in enumerate(chosen, 1)),
        (*idle, *_bare(files, sweep), *doubted),
    )


def _bare(files: _Files, sweep: SweepFile) -> Iterator[Diagnostic]:
    """Warnings about arrangements of which nothing is asked, one a place."""
    seen: set[int] = set()
    for at in sweep.axes[0].values:
        place = mark(at.node)
        asked = any(axis.name == PROPERTIES for axis in sweep.axes) or files.names({ARRANGEMENT: at})
        if not asked and place.start not in seen:
            seen.add(place.start)
            message = f"no property file stands beside `{at.value}`, so nothing but faults is looked for"
            yield Diagnostic(NO_PROPERTIES, message, place, hint="name property files under `properties`")


def _look_through(files: _Files, chosen: Sequence[Mapping[str, Given]]) -> tuple[Diagnostic, ...]:
    """Warnings about properties. DiagnosticError: combinations that cannot be loaded, whose properties do not fit."""
    found: dict[tuple[str, str, int], Diagnostic] = {}
    bound: set[tuple[str, str]] = set()
    doubted: dict[str, Diagnostic] = {}
    for row in _some(chosen):
        try:
            arrangement = files.resolved(row)
            together = str(row[ARRANGEMENT].value), str(row[PROPERTIES].value) if PROPERTIES in row else ""
            if together not in bound:
                bound.add(together)
                bind(arrangement, files.properties(row))
                doubted |= {each.render(): each for each in doubts(arrangement, files.properties(row))}
        except DiagnosticError as error:
            for each in error.diagnostics:
                said = each if each.span is None or _is_ours(each.span, row) else _with_values(each, row)
                place = (said.file or "", 0) if said.span is None else (said.span.source.name, said.span.start)
                found.setdefault((said.code, *place), said)
            if len(found) >= MOST_SAID:
                break
    if found:
        raise DiagnosticError(found.values())
    return tuple(doubted.values())


def _some(chosen: Sequence[Mapping[str, Given]]) -> Sequence[Mapping[str, Given]]:
    """Few enough to be loaded: of many, those in which an arrangement has a value for the first time."""
    if len(chosen) <= LOOKED_AT:
        return chosen
    seen: set[tuple[str, str, str]] = set()
    found = []
    for row in chosen:
        new = {(str(row[ARRANGEMENT].value), name, words(given.value)) for name, given in row.items()}
        if not new <= seen:
            seen |= new
            found.append(row)
    return [*found[:LOOKED_AT], found[-1]]


def _is_ours(span: Span, row: Mapping[str, Given]) -> bool:
    return any(given.node.span.source is span.source for given in row.values())


def _with_values(found: Diagnostic, row: Mapping[str, Given]) -> Diagnostic:
    said = ", ".join(f"{name} = {words(given.value)}" for name, given in row.items() if name not in _FILES)
    return replace(found, notes=(*found.notes, f"with {said}")) if said else found


_FILES = (ARRANGEMENT, PROPERTIES)


class _Files:
    """The texts of a sweep, each read once."""

    def __init__(self, sweep: SweepFile) -> None:
        self.sweep = sweep
        self.kinds: dict[str, ValueKind] = {axis.name: axis.kind for axis in sweep.axes if axis.kind is not None}
        self._drafts: dict[str, Draft] = {}
        self._properties: dict[tuple[str, ...], tuple[PropertySet, tuple[Source, ...]]] = {}
        self._texts: dict[tuple[str, tuple[str, ...]], _Texts] = {}

    def _path(self, name: Json) -> Path:
        return self.sweep.folder / str(name)

    def draft(self, at: Given) -> Draft:
        """An arrangement as it is written."""
        name = str(at.value)
        if name not in self._drafts:
            self._drafts[name] = read_arrangement(GivenArrangement(self._path(name), named_at=mark(at.node)))
        return self._drafts[name]

    def resolved(self, row: Mapping[str, Given]) -> Arrangement:
        """An arrangement with the values of a row. DiagnosticError."""
        values = [(self.kinds[name], name, given.node) for name, given in row.items() if name in self.kinds]
        try:
            return resolve(with_nodes(self.draft(row[ARRANGEMENT]), values))
        except NoSuchName as wrong:
            raise self._unknown(wrong, str(row[ARRANGEMENT].value)) from None

    def _unknown(self, wrong: NoSuchName, arrangement: str) -> DiagnosticError:
        """E591, with what there is instead, or which arrangements have it."""
        axis = next(axis for axis in self.sweep.axes if axis.name == wrong.name and axis.kind == wrong.kind)
        what = {
            "constant": f"no machine of {arrangement} has a constant `{wrong.name}`",
            "parameter": f"{arrangement} has no parameter `{wrong.name}`",
            "initial": f"{arrangement} has no variable `{wrong.name}`",
        }[wrong.kind]
        having = [str(at.value) for at in self.sweep.axes[0].values if self._has(at, wrong)]
        if having:
            more = f" and {len(having) - 3:,} others" if len(having) > 3 else ""
            hint = f"write a sweep of its own for those that have it: {', '.join(having[:3])}{more}"
        else:
            there = f"there are: {', '.join(wrong.known[:20])}" if wrong.known else "leave it out: there are none"
            hint = did_you_mean(wrong.name, wrong.known) or there
        return DiagnosticError(Diagnostic(NO_NAME, what, axis.place, hint=hint))

    def _has(self, at: Given, wrong: NoSuchName) -> bool:
        try:
            draft = self.draft(at).arrangement
        except DiagnosticError:
            return False  # which is said when it is looked at
        return not isinstance(draft, UnreadablePart) and wrong.name in names(draft, wrong.kind)

    def names(self, row: Mapping[str, Given]) -> tuple[str, ...]:
        """The property files of a row, as they are opened."""
        if PROPERTIES in row:
            return (str(self._path(row[PROPERTIES].value)),)
        return tuple(map(str, properties_beside(self._path(row[ARRANGEMENT].value))))

    def properties(self, row: Mapping[str, Given]) -> PropertySet:
        """What is asked. DiagnosticError."""
        return self._asked(self.names(row))[0]

    def _asked(self, names: tuple[str, ...]) -> tuple[PropertySet, tuple[Source, ...]]:
        if names not in self._properties:
            sources = [read_properties(name) for name in names]
            found = parse_properties(sources, str(self.sweep.options.get("syntax", "llfsm")))
            automata = (
                Path(one.span.source.name).parent / one.text for one in found if one.kind.startswith("automaton")
            )
            extra = [Source(str(path), path.read_text(encoding="utf-8")) for path in automata if path.is_file()]
            self._properties[names] = found, (*sources, *extra)
        return self._properties[names]

    def combination(self, number: int, row: Mapping[str, Given]) -> Combination:
        """One of them, with its task."""
        names = self.names(row)
        both = str(row[ARRANGEMENT].value), names
        if both not in self._texts:
            draft = self.draft(row[ARRANGEMENT])
            sources = (*draft.sources, *self._asked(names)[1])
            self._texts[both] = _Texts.of(draft.path, names, sources)
        texts, sweep = self._texts[both], self.sweep
        values = tuple((self.kinds[name], name, given.value) for name, given in row.items() if name in self.kinds)
        options = tuple(sweep.options.items())
        key = _digest([texts.digest, values, options, sweep.timeout, sweep.memory])
        task = Task(key, texts.files, texts.arrangement, texts.properties, values, options, sweep.timeout, sweep.memory)
        return Combination(number, {name: given.value for name, given in row.items()}, task, texts.root)


@dataclass(frozen=True)
class _Texts:
    """What an arrangement and property files read, by paths below the folder that holds all of them."""

    root: Path
    files: tuple[tuple[str, str], ...]
    arrangement: str
    properties: tuple[str, ...]

    @classmethod
    def of(cls, arrangement: str, properties: tuple[str, ...], sources: Iterable[Source]) -> _Texts:
        texts = {_absolute(source.name): source.text for source in sources}
        root = Path(os.path.commonpath([path.parent for path in texts]))

        def below(path: str | Path) -> str:
            return _absolute(path).relative_to(root).as_posix()

        files = tuple(sorted((below(path), text) for path, text in texts.items()))
        return cls(root, files, below(arrangement), tuple(map(below, properties)))

    @cached_property
    def digest(self) -> str:
        """SHA-256 (hex) of all of it, and of our version: another one may decide otherwise."""
        return _digest([version("llfsm-verify"), self.files, self.arrangement, self.properties])


def _absolute(path: str | Path) -> Path:
    return Path(os.path.normpath(Path(path).absolute()))


def _digest(value: object) -> str:
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"))
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
