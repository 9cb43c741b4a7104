"""What reads a run beside it and says where it is bad: faults, bad prefixes, too many rounds of a violation, loops.

The last two reduce liveness to safety. Rounds: K. Claessen and N. Sörensson, A liveness checking algorithm that counts,
FMCAD 2012. FairLoops: A. Biere, C. Artho and V. Schuppan, Liveness checking as safety checking, FMICS 2002.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count

import z3

from llfsm_verify.backends.smt.arithmetic import OURS, Arithmetic, Term, choose
from llfsm_verify.backends.smt.unrolling import Point
from llfsm_verify.engines.unrolled.runs import Table, Watched, moved
from llfsm_verify.program.program import BOOL, Const, Get, Int, Local
from llfsm_verify.program.terms import const

Scalar = Get | Local
"""A scalar of a configuration, or (Local) of what stands beside it."""
State = Mapping[Scalar, Term]
MOST_PAIRED = 32
"""Bools of which each pair has a clause that they are not both true."""


@dataclass(frozen=True, slots=True)
class Faults:
    """No step ends in a fault."""


@dataclass(frozen=True, slots=True)
class Prefixes:
    """No bad prefix of the monitor `table`."""

    table: Table


@dataclass(frozen=True, slots=True)
class Rounds:
    """No run of all `automata` together meets each acceptance set and shows each letter of `fair` `bound` + 1 times
    over: then none does so forever."""

    automata: tuple[Table, ...]
    fair: tuple[str, ...]
    bound: int


@dataclass(frozen=True, slots=True)
class FairLoops:
    """No run of all `automata` together comes back to where it was, each acceptance set met and each letter of `fair`
    shown in between. Only where every variable is finite does that mean that no run meets all of them forever."""

    automata: tuple[Table, ...]
    fair: tuple[str, ...]


Target = Faults | Prefixes | Rounds | FairLoops
"""What is to be shown unreachable."""


class Reader:
    """Reads a run point by point, one unit of steps after the other; `state` is all that it remembers.

    `groups`: of the Bools of each, exactly one is true. `constraints` hold for every run.
    """

    def __init__(self) -> None:
        self.constraints: list[z3.BoolRef] = []
        self.state: dict[Scalar, Term] = {}
        self.groups: tuple[tuple[Scalar, ...], ...] = ()

    def begin(self, configuration: State) -> None:
        """A unit begins in this configuration."""

    def read(self, point: Point) -> z3.BoolRef:  # noqa: ARG002 - what reads more overrides it
        """Read the letter of a point; true where that is bad."""
        return z3.BoolVal(False)

    def end(self, configuration: State) -> z3.BoolRef:  # noqa: ARG002
        """A unit ends in this configuration; true where that is bad."""
        return z3.BoolVal(False)


def reader(target: Target, name: str, arithmetic: Arithmetic, configuration: State, start: State | None) -> Reader:
    """The reader of a target: before the first letter, or (`start`) in this state, which has all that it remembers.

    `name` tells the constants of one reader from those of another; `configuration` is the one it starts in.
    """
    match target:
        case Prefixes(table):
            return _PrefixReader(table, name, start)
        case Rounds(automata, fair, bound):
            return _RoundsReader(_Runs(automata, fair, name, start), arithmetic, bound, start)
        case FairLoops(automata, fair):
            return _LoopsReader(_Runs(automata, fair, name, start), name, configuration, start)
    return Reader()


def scalars_beside(target: Target, configuration: Sequence[Scalar]) -> tuple[Scalar, ...]:
    """What the reader of a target remembers."""
    match target:
        case Prefixes(table):
            return _states("monitor", table)
        case Rounds(automata, fair, bound):
            single = _sets(automata, fair) == 1
            flags = () if single else _flags(automata, fair)
            return (*_automata_states(automata), *flags, _rounds(bound))
        case FairLoops(automata, fair):
            states = _automata_states(automata)
            copies = tuple(_copy(s) for s in (*configuration, *states))
            return (*states, *_flags(automata, fair), SAVED, *copies)
    return ()


def _states(name: str, table: Table) -> tuple[Scalar, ...]:
    """One Bool a state; none where there is only one state."""
    return tuple(Local(f"{name}={i}", BOOL) for i in range(table.states)) if table.states > 1 else ()


def _automata_states(automata: Sequence[Table]) -> tuple[Scalar, ...]:
    return tuple(s for i, table in enumerate(automata) for s in _states(f"automaton{i}", table))


def _sets(automata: Sequence[Table], fair: Sequence[str]) -> int:
    return sum(t.acceptance_sets for t in automata) + len(fair)


def _flags(automata: Sequence[Table], fair: Sequence[str]) -> tuple[Scalar, ...]:
    return tuple(Local(f"met{i}", BOOL) for i in range(_sets(automata, fair)))


def _rounds(bound: int) -> Scalar:
    return Local("rounds", Int(0, bound))


def text_of(scalar: Scalar) -> str:
    """A name of its own for each scalar: ``n``, ``a[3]``, ``:monitor=2``."""
    if isinstance(scalar, Local):
        return f"{OURS}{scalar.name}"
    if scalar.index is None:
        return scalar.var
    assert isinstance(scalar.index, Const)
    return f"{scalar.var}[{scalar.index.value}]"


def _copy(scalar: Scalar) -> Scalar:
    return Local(f"copy:{text_of(scalar)}", scalar.type)


SAVED = Local("saved", BOOL)


def _group(scalars: Sequence[Scalar], start: State | None) -> list[z3.BoolRef] | None:
    """The Bools of a monitor or an automaton; None: it is in its first state."""
    if start is None:
        return None
    return [start[s].z3 for s in scalars] if scalars else [z3.BoolVal(True)]


class _PrefixReader(Reader):
    def __init__(self, table: Table, name: str, start: State | None) -> None:
        super().__init__()
        self._scalars = _states("monitor", table)
        self._watched = Watched(table, f"{name}.monitor", _group(self._scalars, start))
        self.constraints = self._watched.constraints
        self.groups = (self._scalars,) if self._scalars else ()
        self._keep()

    def _keep(self) -> None:
        if self._scalars:
            self.state = {s: Term(t, BOOL) for s, t in zip(self._scalars, self._watched.states, strict=True)}

    def read(self, point: Point) -> z3.BoolRef:
        bad = self._watched.add(point.letter, point.observed)
        self._keep()
        return bad


class _Runs:
    """Runs of automata beside a run, and whether the letters of `fair` were shown: all that has to happen forever."""

    def __init__(self, automata: Sequence[Table], fair: Sequence[str], name: str, start: State | None) -> None:
        self.automata = automata
        self.fair = fair
        self._name = name
        self._points = count()
        self.flags = _flags(automata, fair)
        self.scalars = [_states(f"automaton{i}", table) for i, table in enumerate(automata)]
        self.states: list[list[z3.BoolRef]] = []
        for table, scalars in zip(automata, self.scalars, strict=True):
            first = [z3.BoolVal(i == 0) for i in range(table.states)]
            self.states.append(_group(scalars, start) or first)
        self.constraints: list[z3.BoolRef] = []

    @property
    def state(self) -> dict[Scalar, Term]:
        return {
            s: Term(t, BOOL)
            for scalars, states in zip(self.scalars, self.states, strict=True)
            for s, t in zip(scalars, states, strict=bool(scalars))
        }

    @property
    def groups(self) -> tuple[tuple[Scalar, ...], ...]:
        return tuple(s for s in self.scalars if s)

    def read(self, point: Point) -> list[z3.BoolRef]:
        """Read a letter; for each of `flags` whether it happens here."""
        number = next(self._points)
        # The first letter does not show what fairness asks for, and nothing is lost without.
        names = {a for t in self.automata for a in t.atoms} | set(self.fair)
        letter = {n: point.letter.get(n, z3.BoolVal(False)) for n in names}
        happens: list[z3.BoolRef] = []
        for i, table in enumerate(self.automata):
            name = f"{OURS}{self._name}.automaton{i}@{number}"
            after = [z3.Bool(f"{name}={q}") for q in range(table.states)]
            marks = [z3.Bool(f"{name}!{k}") for k in range(table.acceptance_sets)]
            self.constraints += exactly_one(after)
            self.constraints.append(moved(table, self.states[i], after, marks, letter, point.observed))
            self.states[i] = after
            happens += marks
        return happens + [z3.And(point.observed, letter[n]) for n in self.fair]


def exactly_one(bools: Sequence[z3.BoolRef]) -> list[z3.BoolRef]:
    """One of them is true: some is, and not two, as clauses for each pair where they are few, else of both halves of
    a half (n log n literals: a deadline has thousands)."""
    return [z3.Or(list(bools)), *_at_most_one(bools)]


def _at_most_one(bools: Sequence[z3.BoolRef]) -> Iterator[z3.BoolRef]:
    if len(bools) <= MOST_PAIRED:
        yield from (z3.Or(z3.Not(a), z3.Not(b)) for i, a in enumerate(bools) for b in bools[:i])
        return
    halves = bools[: len(bools) // 2], bools[len(bools) // 2 :]
    for half in halves:
        yield from _at_most_one(half)
    yield z3.Or([z3.Not(z3.Or(list(half))) for half in halves])


class _RoundsReader(Reader):
    """A round is over at the end of a unit by which all has happened since the last one."""

    def __init__(self, runs: _Runs, arithmetic: Arithmetic, bound: int, start: State | None) -> None:
        super().__init__()
        self._runs = runs
        self._arithmetic = arithmetic
        self._kind = Int(0, bound)
        self.constraints = runs.constraints
        self.groups = runs.groups
        self._kept = () if len(runs.flags) == 1 else runs.flags  # the only flag is never set where a unit ends
        self._met: list[z3.BoolRef] = [z3.BoolVal(False)] * len(runs.flags)
        self._rounds = arithmetic.literal(0, self._kind)
        if start is not None:
            self._rounds = start[_rounds(bound)]
            if self._kept:
                self._met = [start[f].z3 for f in self._kept]
        self._keep()

    def _keep(self) -> None:
        flags = {f: Term(m, BOOL) for f, m in zip(self._kept, self._met, strict=False)}
        self.state = {**self._runs.state, **flags, Local("rounds", self._kind): self._rounds}

    def read(self, point: Point) -> z3.BoolRef:
        self._met = [z3.Or(m, h) for m, h in zip(self._met, self._runs.read(point), strict=True)]
        return z3.BoolVal(False)

    def end(self, configuration: State) -> z3.BoolRef:  # noqa: ARG002
        arithmetic, rounds = self._arithmetic, self._rounds
        over = z3.simplify(z3.And(self._met))
        last = arithmetic.compare("eq", rounds, arithmetic.literal(self._kind.high, self._kind))
        one = const(1)
        wide = Int(0, self._kind.high + 1)
        more = arithmetic.cast(arithmetic.number("add", [rounds, arithmetic.literal(1, one.type)], wide), self._kind)
        self._rounds = choose(arithmetic, Term(over, BOOL), more, rounds, self._kind)
        self._met = [z3.simplify(z3.And(m, z3.Not(over))) for m in self._met]
        self._keep()
        return z3.And(over, last)


class _LoopsReader(Reader):
    """A configuration is saved where some unit begins; a later one that ends in the same closes a loop."""

    def __init__(self, runs: _Runs, name: str, configuration: State, start: State | None) -> None:
        super().__init__()
        self._runs = runs
        self._name = name
        self._units = count()
        self.constraints = runs.constraints
        self.groups = runs.groups
        whole = {**configuration, **runs.state}
        if start is None:
            self._saved = z3.BoolVal(False)
            self._met: list[z3.BoolRef] = [z3.BoolVal(False)] * len(runs.flags)
            self._copies = {s: Term(t.z3, t.type) for s, t in whole.items()}
        else:
            self._saved = start[SAVED].z3
            self._met = [start[f].z3 for f in runs.flags]
            self._copies = {s: start[_copy(s)] for s in whole}
        self._keep()

    def _keep(self) -> None:
        flags = {f: Term(m, BOOL) for f, m in zip(self._runs.flags, self._met, strict=True)}
        copies = {_copy(s): t for s, t in self._copies.items()}
        self.state = {**self._runs.state, **flags, SAVED: Term(self._saved, BOOL), **copies}

    def begin(self, configuration: State) -> None:
        save = z3.Bool(f"{OURS}{self._name}.save@{next(self._units)}")
        now = z3.And(save, z3.Not(self._saved))
        whole = {**configuration, **self._runs.state}
        self._copies = {s: Term(z3.If(now, whole[s].z3, t.z3), t.type) for s, t in self._copies.items()}
        self._saved = z3.Or(self._saved, save)

    def read(self, point: Point) -> z3.BoolRef:
        happened = self._runs.read(point)
        self._met = [z3.And(self._saved, z3.Or(m, h)) for m, h in zip(self._met, happened, strict=True)]
        return z3.BoolVal(False)

    def end(self, configuration: State) -> z3.BoolRef:
        self._keep()
        whole = {**configuration, **self._runs.state}
        same = [t.z3 == whole[s].z3 for s, t in self._copies.items()]
        return z3.And(self._saved, *self._met, *same)
