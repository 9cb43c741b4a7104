"""A formula on a run of bounded length, with or without a loop, as constraints that grow linearly with the length."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import count

import z3

from llfsm_verify.backends.smt.arithmetic import OURS
from llfsm_verify.backends.smt.relation import Terms
from llfsm_verify.backends.smt.unrolling import Point
from llfsm_verify.logic.formula import Formula, postorder


class Loops:
    """The loop of a run that grows point by point; it is closed, or not, where the run ends.

    `starts[i]`: after the last point comes point i again, whose predecessor has the configuration of the last point.
    `inside[i]`: point i is in the loop. Source: as `encoding`. With `observe: cycle`, loops go from letter to letter.
    """

    def __init__(self, terms: Terms) -> None:
        self._terms = terms
        self._keys = [key for key, _, _ in terms.configuration]
        self._points: list[Point] = []
        self.starts: dict[int, z3.BoolRef] = {}
        self.inside: list[z3.BoolRef] = []
        self._shown: list[z3.BoolRef] = []
        """By point: the loop has shown a letter by then."""
        self.constraints: list[z3.BoolRef] = []
        """They hold whatever comes; those added last come after the others."""

    @property
    def exists(self) -> z3.BoolRef:
        """The run has a loop."""
        return self.inside[-1]

    def add(self, point: Point) -> None:
        """The run has one point more."""
        number = len(self._points)
        self._points.append(point)
        if number == 0:
            self.inside.append(z3.BoolVal(False))
            self._shown.append(z3.BoolVal(False))
            return
        start = z3.Bool(f"{OURS}loop@{number}")
        self.starts[number] = start
        inside, shown = (z3.Bool(f"{OURS}{what}@{number}") for what in ("inside", "shown"))
        before = self.inside[-1]
        self.constraints += [
            inside == z3.Or(before, start),
            z3.Not(z3.And(before, start)),
            shown == z3.Or(self._shown[-1], z3.And(inside, point.observed)),
        ]
        if not z3.is_true(self._points[-2].observed):
            self.constraints.append(z3.Implies(start, self._points[-2].observed))
        self.inside.append(inside)
        self._shown.append(shown)

    def closed(self) -> list[z3.BoolRef]:
        """What must be true of a loop that ends at the last point."""
        last = self._points[-1]
        found = [z3.Implies(self.exists, z3.And(self._shown[-1], last.observed))]
        for number, start in self.starts.items():
            found.append(z3.Implies(start, self._same(self._points[number - 1], last)))
        return found

    def start(self, model: z3.ModelRef) -> int | None:
        """The point at which the loop of a model starts; None: it has none."""
        return next((i for i, s in self.starts.items() if z3.is_true(model.eval(s, model_completion=True))), None)

    def _same(self, one: Point, other: Point) -> z3.BoolRef:
        return z3.And([one.values[k].z3 == other.values[k].z3 for k in self._keys if not self._equal(one, other, k)])

    def _equal(self, one: Point, other: Point, key: tuple[str, int | None]) -> bool:
        return bool(one.values[key].z3.eq(other.values[key].z3))


FUTURE = frozenset({"X", "F", "G", "U", "W", "R", "M"})
EVENTUAL = frozenset({"F", "U", "M"})
"""What is promised by these has to come."""


class Encoding:
    """The truth of a formula in negation normal form (`rewriting.normal_form.nnf`) on runs that grow point by point.

    Source: Biere, Heljanko, Junttila, Latvala, Schuppan, Linear Encodings of Bounded LTL Model Checking, LMCS 2(5),
    2006, section 4, for letters on the points of which some show none (`observed`): there every formula has the value
    that it has at the next one. Without a loop it is true only if every continuation satisfies it.

    A point's constraints speak of the value at the next point by a name, which the next point defines; `closed` says
    what that name means when there is none.
    """

    def __init__(self, formula: Formula, name: str) -> None:
        self._order = postorder(formula)
        self._root = formula
        asked = {f for f in self._order if f.op in FUTURE and f.op != "X"}
        asked |= {f.args[0] for f in self._order if f.op == "X"}
        self._wanted = [f for f in self._order if f in asked]
        self._name = name
        self._numbers = count()
        self._next: dict[Formula, z3.BoolRef] = {}
        """By temporal subformula, or argument of one: its value at the point that comes next."""
        self._kept: dict[Formula, z3.BoolRef] = {}
        self._at: list[Mapping[Formula, z3.BoolRef]] = []
        self.constraints: list[z3.BoolRef] = []
        """They hold whatever comes; those added last come after the others."""

    def add(self, letter: Mapping[str, z3.BoolRef], observed: z3.BoolRef, loops: Loops) -> None:
        """Read the point after those read so far; `loops` has it already."""
        point = len(self._at)
        # Where every point shows a letter, only what temporal operators ask for is needed at the next one.
        wanted = self._wanted if z3.is_true(observed) else self._order
        following = {f: self._fresh() for f in wanted}
        values: dict[Formula, z3.BoolRef] = {}
        for f in self._order:
            values[f] = self._value(f, values, following, letter)
        if not z3.is_true(observed):
            values = {f: z3.simplify(z3.If(observed, v, following[f])) for f, v in values.items()}
        named = {f: self._named(v) for f, v in values.items()}
        for f, before in self._next.items():
            self.constraints.append(before == named[f])
        self._next = following
        self._at.append(named)
        inside = z3.And(loops.inside[point], observed)
        for f in self._order:
            if f.op in FUTURE and f.op != "X":
                self._promise(f, named, inside)

    def holds(self) -> z3.BoolRef:
        """The formula, at the first point."""
        return self._at[0][self._root]

    def closed(self, loops: Loops) -> list[z3.BoolRef]:
        """What makes the run end here: it goes back to where the loop starts, or could go on in any way."""
        found: list[z3.BoolRef] = []
        for f, beyond in self._next.items():
            again = [z3.And(start, self._at[i][f]) for i, start in loops.starts.items()]
            found.append(beyond == z3.Or(again))
        for f, kept in self._kept.items():
            value = self._at[-1][f]
            if f.op in EVENTUAL:
                found.append(z3.Implies(z3.And(loops.exists, value), kept))
            else:
                found.append(z3.Implies(z3.And(loops.exists, kept), value))
        return found

    def _promise(self, f: Formula, values: Mapping[Formula, z3.BoolRef], inside: z3.BoolRef) -> None:
        goal = self._goal(f, values)
        before = self._kept.get(f)
        if f.op in EVENTUAL:
            now = z3.And(inside, goal)
            self._kept[f] = self._named(now if before is None else z3.Or(before, now))
        else:
            now = z3.Implies(inside, goal)
            self._kept[f] = self._named(now if before is None else z3.And(before, now))

    def _goal(self, f: Formula, values: Mapping[Formula, z3.BoolRef]) -> z3.BoolRef:
        """What has to come (`F U M`), or to be forever (`G W R`), for `f`."""
        args = [values[a] for a in f.args]
        match f.op:
            case "F" | "G" | "U" | "R":
                return args[-1]
            case "M":
                return z3.And(args[0], args[1])
        return z3.Or(args[0], args[1])

    def _value(
        self,
        f: Formula,
        values: Mapping[Formula, z3.BoolRef],
        following: Mapping[Formula, z3.BoolRef],
        letter: Mapping[str, z3.BoolRef],
    ) -> z3.BoolRef:
        args = [values[a] for a in f.args]
        match f.op:
            case "true" | "false":
                return z3.BoolVal(f.op == "true")
            case "atom":
                return letter[f.key]
            case "not":
                return z3.Not(args[0])
            case "and":
                return z3.And(args)
            case "or":
                return z3.Or(args)
            case "X":
                return following[f.args[0]]
            case "F":
                return z3.Or(args[0], following[f])
            case "G":
                return z3.And(args[0], following[f])
            case "U" | "W":
                return z3.Or(args[1], z3.And(args[0], following[f]))
            case "R" | "M":
                return z3.And(args[1], z3.Or(args[0], following[f]))
        raise AssertionError(f.op)

    def _fresh(self) -> z3.BoolRef:
        return z3.Bool(f"{OURS}{self._name}#{next(self._numbers)}")

    def _named(self, term: z3.BoolRef) -> z3.BoolRef:
        """A name for a term, so that it is written once."""
        simple = z3.simplify(term)
        if z3.is_const(simple) or (z3.is_not(simple) and z3.is_const(simple.arg(0))):
            return simple
        name = self._fresh()
        self.constraints.append(name == simple)
        return name
