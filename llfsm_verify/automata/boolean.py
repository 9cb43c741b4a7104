"""State formulas as sets of letters, for the labels of symbolic automata."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.diagrams import Diagram, Diagrams
from llfsm_verify.automata.labels import cubes
from llfsm_verify.logic.formula import FALSE, TRUE, Formula, atom, conjunction, disjunction, negation, postorder

Guard = Diagram
"""A set of letters; equal sets are one object; `& | ~` and `bool` (is it not empty) work on it."""

MAX_CLASSES = 10_000


class Guards:
    """The sets of letters over `atoms`; bit i of a letter is atom i."""

    def __init__(self, atoms: Sequence[str]) -> None:
        self.atoms = tuple(atoms)
        self._bits = {key: i for i, key in enumerate(self.atoms)}
        self._diagrams = Diagrams(len(self.atoms))
        self.always: Guard = self._diagrams.true
        self.never: Guard = self._diagrams.false
        self._formulas: dict[Formula, Guard] = {TRUE: self.always, FALSE: self.never}

    def of(self, formula: Formula) -> Guard:
        """The letters in which a state formula holds. ValueError: it is no state formula; KeyError: an unknown atom."""
        known = self._formulas
        for node in postorder(formula):
            if node not in known:
                known[node] = self._guard(node, [known[a] for a in node.args])
        return known[formula]

    def _guard(self, node: Formula, args: list[Guard]) -> Guard:
        match node.op:
            case "atom":
                return self._diagrams.atom(self._bits[node.key])
            case "not":
                return ~args[0]
            case "and":
                result = self.always
                for a in args:
                    result = result & a
                return result
            case "or":
                return self.union(args)
            case "xor":
                return args[0] & ~args[1] | ~args[0] & args[1]
            case "iff":
                return args[0] & args[1] | ~args[0] & ~args[1]
            case "implies":
                return ~args[0] | args[1]
        raise ValueError(f"not a state formula: {node.op}")

    def union(self, guards: Iterable[Guard]) -> Guard:
        """The letters in any of `guards`."""
        result = self.never
        for guard in guards:
            result = result | guard
        return result

    def holds(self, guard: Guard, letter: int) -> bool:
        """`letter`, the mask of the atoms that hold, is in the set."""
        while guard.level < len(self.atoms):
            guard = guard.high if letter >> guard.level & 1 else guard.low
        return guard is self.always

    def cubes(self, guard: Guard) -> Iterator[tuple[int, int]]:
        """Cubes whose union is `guard`: the masks of the atoms that hold and of those that do not."""
        yield from cubes(self._diagrams, guard)

    def example(self, guard: Guard) -> int:
        """A letter of a set that is not empty: the mask of its true atoms, few of them."""
        letter = 0
        while guard is not self.always:
            if not guard:
                raise ValueError("no letter is in the empty set")
            if guard.low:
                guard = guard.low
            else:
                letter |= 1 << guard.level
                guard = guard.high
        return letter

    def cube(self, positive: int, negative: int) -> Guard:
        """The letters in which the atoms of one mask hold and those of the other do not."""
        result = self.always
        for i in reversed(range(len(self.atoms))):
            if positive >> i & 1:
                result = result & self._diagrams.atom(i)
            elif negative >> i & 1:
                result = result & ~self._diagrams.atom(i)
        return result

    def formula(self, guard: Guard) -> Formula:
        """A state formula of the set: the disjunction of its cubes."""
        return disjunction(
            conjunction(
                atom(key) if positive >> i & 1 else negation(atom(key))
                for i, key in enumerate(self.atoms)
                if (positive | negative) >> i & 1
            )
            for positive, negative in self.cubes(guard)
        )

    def partition(
        self, guards: Iterable[Guard], within: Guard | None = None, limit: int = MAX_CLASSES
    ) -> dict[Guard, frozenset[Guard]]:
        """The classes of letters (of `within`) that lie in the same of `guards`: each with the guards it lies in.

        AutomatonTooLarge: there are more than `limit`.
        """
        start = self.always if within is None else within
        classes: dict[Guard, frozenset[Guard]] = {start: frozenset()} if start else {}
        for guard in dict.fromkeys(guards):
            finer: dict[Guard, frozenset[Guard]] = {}
            for part, inside in classes.items():
                common, rest = part & guard, part & ~guard
                if common:
                    finer[common] = inside | {guard}
                if rest:
                    finer[rest] = inside
            if len(finer) > limit:
                raise AutomatonTooLarge("classes of letters in one state", limit)
            classes = finer
        return classes
