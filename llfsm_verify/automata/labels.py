"""Sets of letters as Boolean functions of the atoms: truth tables for few atoms, decision diagrams for many."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any, Protocol, Self, TypeVar

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.diagrams import Diagrams
from llfsm_verify.limits import tick

MAX_CUBES = 200_000
"""A set of letters, and a whole automaton, is not written with more cubes (the parity of n atoms has 2 ** (n - 1))."""
MAX_PIECES = 2_000_000
"""Parts of a set of letters that are looked at for its cubes: there can be many where few cubes are left."""
MAX_TABLE = 14
"""Up to this many atoms a set of letters is a truth table (an integer of 2 ** atoms bits), beyond it a diagram."""


class Label(Protocol):
    """A set of letters. Equal sets are equal objects; `bool` is false for the empty set only.

    A truth table is a plain integer, whose complement has bits beyond the table: cut them with the alphabet's `true`.
    """

    def __and__(self, other: Self, /) -> Self: ...
    def __or__(self, other: Self, /) -> Self: ...
    def __invert__(self) -> Self: ...
    def __bool__(self) -> bool: ...
    def __hash__(self) -> int: ...


L = TypeVar("L", bound=Label)


class Alphabet(Protocol[L]):
    """All letters over `size` atoms."""

    @property
    def size(self) -> int: ...
    @property
    def true(self) -> L: ...
    @property
    def false(self) -> L: ...

    def atom(self, i: int) -> L:
        """The letters in which atom i holds."""

    def split(self, lower: L, upper: L, first: int) -> tuple[int, L, L, L, L]:
        """The first atom from `first` on that `lower` or `upper` depends on, and their cofactors.

        In the order: atom, lower without it, lower with it, upper without it, upper with it. At least one depends.
        """


class TruthTables:
    """The alphabet whose sets of letters are integers: bit k is the letter k (the mask of the atoms that hold)."""

    def __init__(self, size: int) -> None:
        self.size = size
        self.true = (1 << (1 << size)) - 1
        self.false = 0
        self._atoms: list[int] = []
        for i in range(size):
            block = ((1 << (1 << i)) - 1) << (1 << i)  # a half without, a half with the atom
            self._atoms.append(block * (self.true // ((1 << (2 << i)) - 1)))

    def atom(self, i: int) -> int:
        return self._atoms[i]

    def split(self, lower: int, upper: int, first: int) -> tuple[int, int, int, int, int]:
        for i in range(first, self.size):
            on, shift = self._atoms[i], 1 << i
            l1, u1 = lower & on, upper & on
            l0, u0 = lower ^ l1, upper ^ u1
            if l1 != l0 << shift or u1 != u0 << shift:
                return i, l0 | l0 << shift, l1 | l1 >> shift, u0 | u0 << shift, u1 | u1 >> shift
        raise ValueError("a constant has no cofactors")


def alphabet_of(size: int) -> Alphabet[Any]:
    """All letters over so many atoms, with sets that fit their number."""
    return TruthTables(size) if size <= MAX_TABLE else Diagrams(size)


Cube = tuple[int, int]
"""A conjunction of literals: the mask of the atoms that hold, the mask of those that do not."""

_Cover = tuple[list[Cube], L]


def cubes(alphabet: Alphabet[L], label: L) -> list[Cube]:
    """`label` as an irredundant disjunction of prime cubes (none for the empty set).

    Source: Minato, Fast generation of irredundant sum-of-products forms from binary decision diagrams, SASIMI 1992.
    Without recursion: the generators below are run on a stack. AutomatonTooLarge: there are more than `MAX_CUBES`, or
    it takes more than `MAX_PIECES` parts of `label` to find them.
    """
    stack: list[Generator[tuple[L, L, int], _Cover[L], _Cover[L]]] = [_prime_cover(alphabet, label, label, 0)]
    answer: _Cover[L] | None = None
    left = MAX_PIECES
    while stack:
        tick()
        try:
            request = stack[-1].send(answer) if answer is not None else next(stack[-1])
            left -= 1
            if left < 0:
                raise AutomatonTooLarge("parts of letters that become cubes", MAX_PIECES)
            stack.append(_prime_cover(alphabet, *request))
            answer = None
        except StopIteration as end:
            answer = end.value
            stack.pop()
    assert answer is not None
    return answer[0]


def _prime_cover(
    alphabet: Alphabet[L], lower: L, upper: L, first: int
) -> Generator[tuple[L, L, int], _Cover[L], _Cover[L]]:
    """Cubes between `lower` and `upper`, which depend on atoms from `first` on only, with their union."""
    if not lower:
        return [], alphabet.false
    if upper == alphabet.true:
        return [(0, 0)], alphabet.true
    i, l0, l1, u0, u1 = alphabet.split(lower, upper, first)
    cubes0, f0 = yield l0 & ~u1, u0, i + 1
    cubes1, f1 = yield l1 & ~u0, u1, i + 1
    both, f = yield (l0 & ~f0) | (l1 & ~f1), u0 & u1, i + 1
    bit, on = 1 << i, alphabet.atom(i)
    if len(cubes0) + len(cubes1) + len(both) > MAX_CUBES:
        raise AutomatonTooLarge("transitions", MAX_CUBES)
    found = [(p, n | bit) for p, n in cubes0] + [(p | bit, n) for p, n in cubes1] + both
    return found, (f0 & ~on) | (f1 & on) | f


def of_cube(alphabet: Alphabet[L], positive: int, negative: int) -> L:
    """The letters in which the atoms of `positive` hold and those of `negative` do not."""
    label = alphabet.true
    for i in reversed(range(alphabet.size)):
        if positive >> i & 1:
            label = label & alphabet.atom(i)
        elif negative >> i & 1:
            label = label & ~alphabet.atom(i)
    return label
