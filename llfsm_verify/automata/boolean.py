"""State formulas as binary decision diagrams, for the labels of symbolic automata."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.logic.formula import FALSE, TRUE, Formula, atom, conjunction, disjunction, negation, postorder

Guard = int
"""A set of letters: the number of a diagram's node; equal sets have equal numbers."""
NEVER: Guard = 0
ALWAYS: Guard = 1
MAX_NODES = 1_000_000
_END = 1 << 30


class Guards:
    """The diagrams over `atoms`, ordered as listed; bit i of a letter is atom i.

    Source: Bryant, Graph-based algorithms for Boolean function manipulation, IEEE Trans. Computers C-35 (1986), with
    stacks of its own instead of recursion. AutomatonTooLarge: more than `max_nodes` nodes.
    """

    def __init__(self, atoms: Sequence[str], max_nodes: int = MAX_NODES) -> None:
        self.atoms = tuple(atoms)
        self._bits = {key: i for i, key in enumerate(self.atoms)}
        self._max_nodes = max_nodes
        self._nodes: list[tuple[int, Guard, Guard]] = [(_END, NEVER, NEVER), (_END, ALWAYS, ALWAYS)]
        self._numbers: dict[tuple[int, Guard, Guard], Guard] = {}
        self._both: dict[tuple[Guard, Guard], Guard] = {}
        self._differ: dict[tuple[Guard, Guard], Guard] = {}
        self._formulas: dict[Formula, Guard] = {TRUE: ALWAYS, FALSE: NEVER}

    def _node(self, variable: int, low: Guard, high: Guard) -> Guard:
        if low == high:
            return low
        key = (variable, low, high)
        number = self._numbers.get(key)
        if number is None:
            if len(self._nodes) >= self._max_nodes:
                raise AutomatonTooLarge("nodes of decision diagrams", self._max_nodes)
            number = self._numbers[key] = len(self._nodes)
            self._nodes.append(key)
        return number

    def variable(self, i: int) -> Guard:
        """The letters in which atom number `i` holds."""
        return self._node(i, NEVER, ALWAYS)

    def both(self, a: Guard, b: Guard) -> Guard:
        """The letters in `a` and in `b`."""

        def end(a: Guard, b: Guard) -> Guard | None:
            if NEVER in (a, b):
                return NEVER
            return b if a in (b, ALWAYS) else a if b == ALWAYS else None

        return self._combined(a, b, end, self._both)

    def differ(self, a: Guard, b: Guard) -> Guard:
        """The letters in exactly one of `a` and `b`."""

        def end(a: Guard, b: Guard) -> Guard | None:
            if a == b:
                return NEVER
            return b if a == NEVER else a if b == NEVER else None

        return self._combined(a, b, end, self._differ)

    def complement(self, a: Guard) -> Guard:
        """The letters not in `a`."""
        return self.differ(a, ALWAYS)

    def either(self, a: Guard, b: Guard) -> Guard:
        """The letters in `a` or in `b`."""
        return self.differ(self.differ(a, b), self.both(a, b))

    def without(self, a: Guard, b: Guard) -> Guard:
        """The letters in `a` and not in `b`."""
        return self.differ(a, self.both(a, b))

    def union(self, guards: Iterable[Guard]) -> Guard:
        """The letters in any of `guards`."""
        result = NEVER
        for guard in guards:
            result = self.either(result, guard)
        return result

    def _combined(
        self,
        a: Guard,
        b: Guard,
        end: Callable[[Guard, Guard], Guard | None],
        memo: dict[tuple[Guard, Guard], Guard],
    ) -> Guard:
        root = (a, b) if a <= b else (b, a)
        stack = [root]
        nodes = self._nodes
        while stack:
            pair = stack[-1]
            if pair in memo:
                stack.pop()
                continue
            plain = end(*pair)
            if plain is not None:
                memo[pair] = plain
                stack.pop()
                continue
            (va, la, ha), (vb, lb, hb) = nodes[pair[0]], nodes[pair[1]]
            variable = min(va, vb)
            if va > variable:
                la = ha = pair[0]
            if vb > variable:
                lb = hb = pair[1]
            low, high = (la, lb) if la <= lb else (lb, la), (ha, hb) if ha <= hb else (hb, ha)
            missing = [p for p in (low, high) if p not in memo]
            if missing:
                stack.extend(missing)
            else:
                memo[pair] = self._node(variable, memo[low], memo[high])
                stack.pop()
        return memo[root]

    def of(self, formula: Formula) -> Guard:
        """The letters in which a state formula holds. ValueError: it has another operator; KeyError: an unknown atom."""
        known = self._formulas
        for node in postorder(formula):
            if node not in known:
                known[node] = self._guard(node, [known[a] for a in node.args])
        return known[formula]

    def _guard(self, node: Formula, args: list[Guard]) -> Guard:
        match node.op:
            case "atom":
                return self.variable(self._bits[node.key])
            case "not":
                return self.complement(args[0])
            case "and":
                result = ALWAYS
                for a in args:
                    result = self.both(result, a)
                return result
            case "or":
                return self.union(args)
            case "xor":
                return self.differ(*args)
            case "iff":
                return self.complement(self.differ(*args))
            case "implies":
                return self.either(self.complement(args[0]), args[1])
        raise ValueError(f"not a state formula: {node.op}")

    # ------------------------------------------------------------ looking into a set

    def holds(self, guard: Guard, letter: int) -> bool:
        """`letter`, the mask of the atoms that hold, is in the set."""
        while guard > ALWAYS:
            variable, low, high = self._nodes[guard]
            guard = high if letter >> variable & 1 else low
        return guard == ALWAYS

    def cubes(self, guard: Guard) -> Iterator[tuple[int, int]]:
        """Disjoint sets that make up `guard`, each as the masks of the atoms that hold and that do not."""
        stack = [(guard, 0, 0)] if guard != NEVER else []
        while stack:
            node, positive, negative = stack.pop()
            if node == ALWAYS:
                yield positive, negative
                continue
            variable, low, high = self._nodes[node]
            if high != NEVER:
                stack.append((high, positive | 1 << variable, negative))
            if low != NEVER:
                stack.append((low, positive, negative | 1 << variable))

    def example(self, guard: Guard) -> int:
        """A letter of a set that is not empty: the mask of its true atoms."""
        if guard == NEVER:
            raise ValueError("no letter is in the empty set")
        letter = 0
        while guard != ALWAYS:
            variable, low, high = self._nodes[guard]
            guard, letter = (low, letter) if low != NEVER else (high, letter | 1 << variable)
        return letter

    def cube(self, positive: int, negative: int) -> Guard:
        """The letters in which the atoms of one mask hold and those of the other do not."""
        result = ALWAYS
        for i in reversed(range((positive | negative).bit_length())):
            if (positive | negative) >> i & 1:
                result = self._node(i, *((NEVER, result) if positive >> i & 1 else (result, NEVER)))
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

    def partition(self, guards: Iterable[Guard], within: Guard = ALWAYS, limit: int = 10_000) -> dict[Guard, frozenset[Guard]]:
        """The classes of letters of `within` that lie in the same of `guards`: each with the guards that it lies in.

        AutomatonTooLarge: there are more than `limit`.
        """
        classes: dict[Guard, frozenset[Guard]] = {within: frozenset()} if within != NEVER else {}
        for guard in dict.fromkeys(guards):
            finer: dict[Guard, frozenset[Guard]] = {}
            for part, inside in classes.items():
                common = self.both(part, guard)
                if common != NEVER:
                    finer[common] = inside | {guard}
                rest = self.differ(part, common)
                if rest != NEVER:
                    finer[rest] = inside
            if len(finer) > limit:
                raise AutomatonTooLarge("classes of letters in one state", limit)
            classes = finer
        return classes
