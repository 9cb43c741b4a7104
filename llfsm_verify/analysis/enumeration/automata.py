"""The tree of the signatures found, run beside a property: as a monitor of new bad prefixes, and for infinite runs."""

from __future__ import annotations

from llfsm_verify.analysis.enumeration.signatures import Tree
from llfsm_verify.automata.safety import PrefixMonitor


class NewPrefixes:
    """A monitor of the bad prefixes of another one whose signature is new. Protocol `automata.safety.PrefixMonitor`.

    The low `bits` bits of letters are those of the property, the others tell what fired. A bad prefix with a signature
    that was found before leads to a state in which nothing is new any more: the first failure counts.
    """

    OLD = 0

    def __init__(self, monitor: PrefixMonitor, bits: int, tree: Tree) -> None:
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
    """The automaton of the infinite runs that are new (`automata.omega.moves.Lazy`): no beginning of them is a bad
    prefix of the monitor (those are looked for by themselves), and their signature is none of those found.

    Letters are those of `NewPrefixes`. Transitions fire for the first time finitely often, so a run stays in one state
    of the tree in the end.
    """

    acceptance_sets = 1

    def __init__(self, monitor: PrefixMonitor | None, bits: int, firings: int, tree: Tree) -> None:
        """`monitor` None: there are no bad prefixes. `bits` of the property and `firings` bits make a letter."""
        self._monitor = monitor
        self._bits = bits
        self._tree = tree
        first = 0 if monitor is None else monitor.initial()
        self.is_empty = first is None
        self._pairs: list[tuple[int, int]] = [(first or 0, Tree.ROOT)]
        self._numbers = {self._pairs[0]: 0}
        self.relevant = (1 << bits + firings) - 1

    def __call__(self, state: int, letter: int) -> tuple[tuple[int, int], ...]:
        """(acceptance, target) of the one move, if there is one."""
        watching, place = self._pairs[state]
        if self._monitor is not None:
            following = self._monitor.step(watching, letter & ((1 << self._bits) - 1))
            if following is None:
                return ()
            watching = following
        place = self._tree.after(place, letter >> self._bits)
        pair = (watching, place)
        number = self._numbers.setdefault(pair, len(self._pairs))
        if number == len(self._pairs):
            self._pairs.append(pair)
        return ((int(self._tree.is_new(place)), number),)
