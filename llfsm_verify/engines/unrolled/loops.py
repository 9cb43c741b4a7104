"""Where an unrolled run goes back to: at most one loop, from its last point to an earlier one."""

from __future__ import annotations

import z3

from llfsm_verify.backends.smt.arithmetic import OURS
from llfsm_verify.backends.smt.relation import Terms
from llfsm_verify.backends.smt.unrolling import Point


class Loops:
    """The loop of a run that grows point by point; it is closed, or not, where the run ends.

    `starts[i]`: after the last point comes point i again, whose predecessor has the configuration of the last point.
    `inside[i]`: point i is in the loop. Source: as `encoding`. With `observe: cycle`, loops go from letter to letter.
    """

    def __init__(self, terms: Terms, name: str = "") -> None:
        self._terms = terms
        self._keys = [key for key, _, _ in terms.configuration]
        self._name = name
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
        start = z3.Bool(f"{OURS}loop{self._name}@{number}")
        self.starts[number] = start
        inside, shown = (z3.Bool(f"{OURS}{what}{self._name}@{number}") for what in ("inside", "shown"))
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
