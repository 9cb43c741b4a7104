"""The tree of the signatures found, run beside a property: as a monitor of new bad prefixes, and for infinite runs."""

from __future__ import annotations

from llfsm_verify.automata.safety import Monitor
from llfsm_verify.checking.different.signatures import Tree


class NewPrefixes:
    """A monitor of the bad prefixes of another one whose signature is new. Protocol `automata.safety.Monitor`.

    The low `bits` bits of letters are those of the property, the others tell what fired. A bad prefix with a signature
    that was found before leads to a state in which nothing is new any more: the first failure counts.
    """

    OLD = 0

    def __init__(self, monitor: Monitor, bits: int, tree: Tree) -> None:
        self._monitor = monitor
        self._bits = bits
        self._tree = tree
        self._pairs: list[tuple[int, int]] = [(-1, -1)]
        self._numbers: dict[tuple[int, int], int] = {}

    def initial(self) -> int | None:
        """The state before the first letter; None: the empty word is a bad prefix, and new."""
        state = self._monitor.initial()
        if state is None:
            return None if self._tree.is_new(Tree.ROOT) else self.OLD
        return self._number(state, Tree.ROOT)

    def step(self, state: int, letter: int) -> int | None:
        """The state after `letter`; None: a new bad prefix."""
        if state == self.OLD:
            return self.OLD
        watching, place = self._pairs[state]
        place = self._tree.after(place, letter >> self._bits)
        following = self._monitor.step(watching, letter & ((1 << self._bits) - 1))
        if following is None:
            return None if self._tree.is_new(place) else self.OLD
        return self._number(following, place)

    def _number(self, state: int, place: int) -> int:
        number = self._numbers.setdefault((state, place), len(self._pairs))
        if number == len(self._pairs):
            self._pairs.append((state, place))
        return number


class NewRuns:
    """The automaton of the infinite runs whose signature is new, over letters of firings (`automata.moves.Lazy`).

    Transitions fire for the first time finitely often, so a run stays in one state of the tree in the end.
    """

    acceptance_sets = 1
    is_empty = False

    def __init__(self, bits: int, tree: Tree) -> None:
        self._tree = tree
        self.relevant = (1 << bits) - 1

    def __call__(self, state: int, letter: int) -> tuple[tuple[int, int], ...]:
        """(acceptance, target) of the one move."""
        target = self._tree.after(state, letter)
        return ((int(self._tree.is_new(target)), target),)
