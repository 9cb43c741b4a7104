"""The past of state formulas, remembered in one bit for each operator beside an automaton of the future."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from llfsm_verify.automata.automaton import Automaton
from llfsm_verify.automata.boolean import Guard, Guards
from llfsm_verify.automata.omega.products import explore
from llfsm_verify.logic.bounds import HIDDEN, rebuilt
from llfsm_verify.logic.formula import (
    FALSE,
    PAST,
    TRUE,
    Formula,
    atom,
    atoms,
    conjunction,
    disjunction,
    is_boolean,
    mapped,
    negation,
    postorder,
)

MAX_STATES = 4_000
MAX_EDGES = 100_000

Bits = int
"""What is remembered: bit i is that of memory i."""


@dataclass(frozen=True, slots=True)
class Memory:
    """A past operator over state formulas, whose atoms are visible ones and those of memories before it.

    It is remembered whether it held (`Y`, `Z`: whether the operand did) in the letter before.
    """

    atom: Formula
    node: Formula

    @property
    def first(self) -> bool:
        """What is remembered before the first letter."""
        return self.node.op in ("Z", "H", "T")

    def now(self, before: bool, args: Sequence[Formula]) -> Formula:
        """Whether it holds in a letter: a state formula, given what is remembered and what the operands are."""
        a, b = args[0], args[-1]
        match self.node.op:
            case "Y" | "Z":
                return TRUE if before else FALSE
            case "O":
                return TRUE if before else a
            case "H":
                return a if before else FALSE
            case "S":
                return disjunction((b, a)) if before else b
            case _:
                return b if before else conjunction((b, a))

    def then(self, now: Formula, args: Sequence[Formula]) -> Formula:
        """What is remembered after a letter in which it is `now`."""
        return args[0] if self.node.op in ("Y", "Z") else now


def memories_of(formula: Formula, visible: Collection[str]) -> tuple[Formula, tuple[Memory, ...]]:
    """`formula` with atoms in place of its past operators over state formulas of `visible` atoms, and these.

    Past operators over formulas of the future stay.
    """
    done: dict[Formula, Formula] = {}
    found: list[Memory] = []
    known = set(visible)
    for node in postorder(formula):
        args = tuple(done[a] for a in node.args)
        same = negation(args[0]) if node.op == "not" else rebuilt(node, args)
        if node.op in PAST and all(is_boolean(a) and known.issuperset(atoms(a)) for a in args):
            name = f"{HIDDEN}memory{len(found)}"
            known.add(name)
            found.append(Memory(atom(name), same))
            done[node] = found[-1].atom
        else:
            done[node] = same
    return done[formula], tuple(found)


def remembering(automaton: Automaton, memories: Sequence[Memory], kept: int) -> Automaton:
    """The automaton over the first `kept` atoms of the words whose letters, with what `memories` say of the letters up
    to there, `automaton` accepts. Its last atoms are those of `memories`.

    AutomatonTooLarge: more than 4,000 states or 100,000 transitions.
    """
    guards = Guards(automaton.atoms[:kept])
    pasts = _Pasts(guards, memories)
    shown = (1 << kept) - 1
    places = [automaton.atoms.index(m.atom.key) for m in memories]
    if automaton.is_empty:
        return Automaton(automaton.atoms[:kept], (), automaton.acceptance_sets)

    def following(node: tuple[int, Bits]) -> Iterator[tuple[int, int, tuple[int, Bits], int]]:
        now, regions = pasts.of(node[1])
        for edge in automaton.edges[node[0]]:
            label = guards.cube(edge.positive & shown, edge.negative & shown)
            for place, holds in zip(places, now, strict=True):
                if edge.positive >> place & 1:
                    label = label & holds
                elif edge.negative >> place & 1:
                    label = label & ~holds
            for region, after in regions:
                for positive, negative in guards.cubes(label & region):
                    yield positive, negative, (edge.target, after), edge.acceptance

    first = (0, sum(1 << i for i, m in enumerate(memories) if m.first))
    return explore(first, following, automaton.atoms[:kept], automaton.acceptance_sets, MAX_STATES, MAX_EDGES)


class _Pasts:
    """What each letter means, by what is remembered."""

    def __init__(self, guards: Guards, memories: Sequence[Memory]) -> None:
        self._guards = guards
        self._memories = memories
        self._known: dict[Bits, tuple[list[Guard], list[tuple[Guard, Bits]]]] = {}

    def of(self, bits: Bits) -> tuple[list[Guard], list[tuple[Guard, Bits]]]:
        """The letters in which each memory's operator holds, and all letters by what is remembered after them."""
        known = self._known.get(bits)
        if known is None:
            known = self._known[bits] = self._of(bits)
        return known

    def _of(self, bits: Bits) -> tuple[list[Guard], list[tuple[Guard, Bits]]]:
        values: dict[Formula, Formula] = {}
        now: list[Guard] = []
        regions: list[tuple[Guard, Bits]] = [(self._guards.always, 0)]
        for i, memory in enumerate(self._memories):
            args = [_with(a, values) for a in memory.node.args]
            value = memory.now(bool(bits >> i & 1), args)
            values[memory.atom] = value
            now.append(self._guards.of(value))
            then = self._guards.of(memory.then(value, args))
            regions = [
                part
                for region, after in regions
                for part in ((region & then, after | 1 << i), (region & ~then, after))
                if part[0]
            ]
        return now, regions


def _with(formula: Formula, values: dict[Formula, Formula]) -> Formula:
    """A state formula with these formulas in place of atoms."""
    return mapped(formula, lambda node, _: values.get(node))
