"""Properties decided on a log of others: a row is a letter, with the time that the log gives it or of one cycle."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.logs.codes import NOT_GIVEN, UNKNOWN, UNREADABLE
from llfsm_verify.extensions.logs.mapping import LogMapping, read_mapping
from llfsm_verify.extensions.logs.stamps import StampedWatch, Times, is_timed
from llfsm_verify.plug import (
    LOGS,
    Arrangement,
    Decided,
    Formula,
    Letter,
    NoColumn,
    Problem,
    PropertySet,
    Row,
    SlotLetters,
    Unreadable,
    ValueProblem,
    Wanted,
    Watch,
    bind,
    evaluate_formula,
    goals_of,
    watches_of,
)  # fmt: skip

_KEPT = 1 << 16
"""Letters of rows that are remembered, as many rows are equal."""


class LogReading:
    """Properties on a log as far as it was read: `count` rows."""

    def __init__(self, arrangement: Arrangement, properties: PropertySet, mapping_path: str, path: str) -> None:
        """`path`: what the log is called. DiagnosticError: wrong properties, or a wrong mapping (E496, E498)."""
        problem = bind(arrangement, properties, stamped=True)
        of_slots = SlotLetters(problem, problem.program(keep_all_bits=True))
        self.mapping = mapping = read_mapping(mapping_path, of_slots.slots)
        given = [p.formula for p in properties.assumptions if p.formula is not None]
        if mapping.time is None:
            timed = any(is_timed(goal, given) for goal in goals_of(problem))
            problem = bind(arrangement, properties) if timed else problem
            of_slots = SlotLetters(problem, problem.program(keep_all_bits=True)) if timed else of_slots
        self.problem, self.path, self.count = problem, path, 0
        self.letters = _Letters(of_slots, mapping)
        self.watches = _watches(problem, given, stamped=mapping.time is not None)
        self._times = Times(mapping, path)

    @property
    def topic(self) -> str | None:
        """That whose messages are the rows."""
        return self.mapping.topic

    @property
    def slots(self) -> frozenset[str]:
        """The columns that are slots."""
        return frozenset(column.name for column in self.mapping.columns.values())

    @property
    def columns(self) -> frozenset[str]:
        """Those whose cells each row has to have."""
        return self.slots if self.mapping.time is None else self.slots | {self.mapping.time}

    def copied(self) -> LogReading:
        """The same, which then reads for itself."""
        other = copy(self)
        other.letters, other._times = copy(self.letters), copy(self._times)
        other.watches = [watch.copied() for watch in self.watches]
        return other

    def read(self, row: Row) -> Fraction | None:
        """The time of the next row, if the log has times. DiagnosticError (E497); OverflowError: it has no letter."""
        self.count += 1
        stamp = None if self.mapping.time is None else self._times.read(row)
        letter = self.letters.read(row, self.path)
        for watch in self.watches:
            if isinstance(watch, StampedWatch) and stamp is not None:
                watch.read_at(letter, stamp, self.count)
            else:
                watch.read(letter, self.count, self.count)
        return stamp

    def decided(self, open_end: str) -> list[Decided]:
        """What is known of each property; `open_end`: why there is no more."""
        return [
            watch.decided_at(self._times, open_end=open_end)
            if isinstance(watch, StampedWatch)
            else watch.decided(open_end=open_end)
            for watch in self.watches
        ]

    def check(self, form: str) -> list[Decided]:
        """Each property, on a log: its first row is the first letter, and the number of a row is `step`. Bounds in time
        compare the times of rows, or without times count a cycle for each row.

        A verdict by some rows holds whatever came after. Of a log that has ended, as the mapping says, the last row
        repeats forever. ModuleNotFoundError: the package for the format is not installed. DiagnosticError: what is
        wrong with the log (E496, E497).
        """
        path, mapping, watches = self.path, self.mapping, self.watches
        if mapping.ended and Path(path).exists() and not (Path(path).is_file() or Path(path).is_dir()):
            message = "a log with `ended: true` in its mapping may be read twice, and this is not a regular file"
            raise DiagnosticError(Diagnostic(UNREADABLE, message, file=path, hint="write the log to a file first"))
        stamps: list[Fraction] = []
        whole, open_end = True, "the log ends there, and the mapping does not say `ended: true`"
        shown: dict[int, str] = {}
        for row in _rows(path, mapping, form):
            try:
                stamp = self.read(row)
            except OverflowError as overflow:
                whole, open_end = False, f"{overflow} in row {self.count:,}"
                break
            if mapping.time is not None and any(watch.place == (self.count, self.count) for watch in watches):
                shown[self.count] = row.cells[mapping.time]
            if mapping.ended and stamp is not None:
                stamps.append(stamp)
        if not self.count:
            raise DiagnosticError(
                Diagnostic(UNREADABLE, "the log has no rows", file=path, hint="name a log with one row at least")
            )
        if whole and mapping.ended and any(watch.verdict == "undecided" for watch in watches):
            letters = self.letters.anew()
            word = [letters.read(row, path) for row in _rows(path, mapping, form)]  # again: most logs need no letters
            _decide_at_end(watches, self.problem, word, stamps)
        return [replace(decided, time=shown.get(decided.step or 0)) for decided in self.decided(open_end)]


def _rows(path: str, mapping: LogMapping, form: str) -> Iterator[Row]:
    """The rows of the log. DiagnosticError: it cannot be read, or has no such column."""
    wanted = {column.name for column in mapping.columns.values()} | ({mapping.time} if mapping.time else set())
    try:
        yield from LOGS.load(form)(path, Wanted(sorted(wanted), mapping.topic))
    except NoColumn as error:
        raise DiagnosticError(_no_column(error, mapping, path)) from None
    except Unreadable as error:
        raise DiagnosticError(
            Diagnostic(UNREADABLE, f"the log cannot be read: {error}", file=path, hint=error.hint)
        ) from None
    except OSError as error:
        why = error.strerror or "input/output error"
        raise DiagnosticError(Diagnostic(UNREADABLE, f"the log cannot be read: {why}", file=path)) from None


def _watches(problem: Problem, given: Sequence[Formula], *, stamped: bool) -> list[Watch]:
    """One for each property, in their order; those with bounds in time compare stamps, where there are some."""
    goals = goals_of(problem)
    timed = {goal.line.name for goal in goals if stamped and is_timed(goal, given)}
    others = replace(problem, properties=tuple(line for line in problem.properties if line.name not in timed))
    automata = {watch.goal.line.name: watch for watch in watches_of(others, Watch)}
    return [automata.get(goal.line.name) or StampedWatch(goal, given) for goal in goals]


def _decide_at_end(
    watches: Sequence[Watch], problem: Problem, word: Sequence[Letter], stamps: Sequence[Fraction]
) -> None:
    """The last row repeats forever; where rows have times, a cycle apart."""
    period = problem.arrangement.cycle_ms
    stem, loop = word[:-1], word[-1:]
    delays = None if problem.clock is None else problem.clock.delays(word)
    if stamps and period is not None:
        delays = [*(b - a for a, b in pairwise(stamps)), period]
    timed = any(isinstance(watch, StampedWatch) for watch in watches)
    if timed and delays is None:
        for watch in watches:
            watch.reason = "after the end rows have no times: the arrangement has no `cycle_ms`"
        return
    formulas = [p.formula for p in problem.assumptions if p.formula is not None]
    assumed = all(evaluate_formula(formula, stem, loop, delays) for formula in formulas)
    for watch in watches:
        if isinstance(watch, StampedWatch):
            watch.decide_at_end(word, delays or [], assumed=assumed)
        else:
            watch.decide_on_lasso(stem, loop, assumed=assumed)


class _Letters:
    """The letters of rows."""

    def __init__(self, letters: SlotLetters, mapping: LogMapping) -> None:
        """DiagnosticError (E498): an atom needs what no column gives."""
        mistakes = []
        for atom, direct in letters.needed.items():
            needed = letters.through_edges(direct)
            missing = [name for name in needed if name not in mapping.columns]
            if missing:
                mistakes.append(_not_given(atom, missing, letters))
        if mistakes:
            raise DiagnosticError(mistakes)
        self._letters = letters
        self._columns = [(name, column, column.reader()) for name, column in mapping.columns.items()]
        self._before: dict[str, int] = {}
        self._known: dict[tuple[tuple[int, ...], tuple[int, ...]], tuple[Letter, dict[str, int]]] = {}

    def anew(self) -> _Letters:
        """Those of the same log from its first row."""
        other = copy(self)
        other._before = {}
        return other

    def read(self, row: Row, path: str) -> Letter:
        """DiagnosticError (E497): a cell is empty, or its value is not a value of its slot."""
        numbers = tuple(_number(name, column.name, reader, row, path) for name, column, reader in self._columns)
        key = numbers, tuple(self._before.values())
        if key not in self._known:
            if len(self._known) == _KEPT:
                self._known.clear()
            named = {name: number for (name, _, _), number in zip(self._columns, numbers, strict=True)}
            before = dict(self._before)
            self._known[key] = self._letters.letter(named, ticks=True, before=before), before
        letter, before = self._known[key]
        self._before = dict(before)
        return letter


def _number(slot: str, column: str, reader: Callable[[str], int], row: Row, path: str) -> int:
    text, place = row.cells.get(column), f"{row.place}, column `{column}` (`{slot}`)"
    if text is None:
        hint = "write a value into the cell: `values` of a mapping cannot name an empty one"
        raise DiagnosticError(Diagnostic(UNREADABLE, f"{place}: the cell has no value", file=path, hint=hint))
    try:
        return reader(text)
    except ValueProblem as problem:
        raise DiagnosticError(Diagnostic(UNREADABLE, f"{place}: {problem}", file=path, hint=HINT)) from None


HINT = "say under `columns` in the mapping what its cells mean, or correct the log"


def _not_given(atom: str, missing: list[str], letters: SlotLetters) -> Diagnostic:
    span = letters.place(atom)
    if any(name not in letters.slots for name in missing):
        message = f"`{atom}` asks what happened in a step, or whether a machine is loaded, and a row does not tell it"
        return Diagnostic(NOT_GIVEN, message, span, hint="ask for states, variables and inputs")
    names = ", ".join(f"`{name}`" for name in missing[:5])
    message = f"no column gives {names}" + (f", which `{atom}` needs" if missing != [atom] else "")
    return Diagnostic(NOT_GIVEN, message, span, hint=f"add `{missing[0]}: COLUMN` under `columns` of the mapping")


def _no_column(error: NoColumn, mapping: LogMapping, path: str) -> Diagnostic:
    what = "topic" if error.name == mapping.topic else "column"
    if not error.known:
        message = f"a log of this format has no topics: {path}"
        return Diagnostic(UNKNOWN, message, mapping.places.get(error.name), hint="leave out `topic`")
    hint = f"there are: {', '.join(error.known[:12])}" + (", …" if len(error.known) > 12 else "")
    message = f"there is no {what} `{error.name[:60]}` in {path}"
    return Diagnostic(UNKNOWN, message, mapping.places.get(error.name), hint=hint)
