"""A formula as a claim about runs, with the clock by which its bounds in time are meant."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from llfsm_verify.automata.automaton import Automaton
from llfsm_verify.automata.ltl.translation import is_safety_property, monitor_of, reader_of
from llfsm_verify.automata.omega.moves import Lazy
from llfsm_verify.automata.safety import PrefixMonitor
from llfsm_verify.logic import formula as f
from llfsm_verify.logic.bounds import TICK, Clock
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.properties import Property
from llfsm_verify.program.program import Program

Word = Sequence[frozenset[str]]
"""Letters, each the keys of its true atoms."""


@dataclass(frozen=True, slots=True)
class Claim:
    """`clock` is needed by formulas with bounds in time, and by no others."""

    formula: f.Formula
    clock: Clock | None = None

    @property
    def atoms(self) -> tuple[str, ...]:
        """The keys of the atoms that it depends on, TICK among them where time matters, in the order of their bits."""
        timed = f.operators(self.formula) & f.TIMED
        return tuple(sorted({*f.atoms(self.formula), *((TICK,) if timed else ())}))

    def automaton(self, *, negate: bool = False) -> Automaton | Lazy:
        """The automaton over `atoms` of the runs for which it is true (`negate`: false). AutomatonTooLarge."""
        return reader_of(self.formula, self.atoms, self.clock, negate=negate)

    def monitor(self) -> PrefixMonitor:
        """The monitor of its bad prefixes. AutomatonTooLarge."""
        return monitor_of(self.formula, self.atoms, self.clock)

    def is_safety(self) -> bool:
        """Whether every run for which it is false has a bad prefix; False also where that is not known."""
        return is_safety_property(self.formula, self.atoms, self.clock)

    def true_on(self, stem: Word, loop: Word) -> bool:
        """Whether it is true for the run `stem` `loop` `loop` …, by the definition. ExpressionTooLarge."""
        delays = None if self.clock is None else self.clock.delays((*stem, *loop))
        return evaluate(self.formula, stem, loop, delays)

    def refuted_by(self, prefix: Word) -> bool:
        """Whether it is false for every continuation of `prefix` that we try. ExpressionTooLarge."""
        tried = _timed(prefix[-1], self.atoms) if TICK in self.atoms else _untimed(prefix[-1], self.atoms)
        return not any(self.true_on((*prefix, *stem), loop) for stem, loop in dict.fromkeys(tried))


def claim_of(line: Property, clock: Clock | None) -> Claim:
    """What an `assume` line or a formula claims, with its edges as searches read them."""
    assert line.formula is not None, "only formulas are assumed"
    edges = line.edges
    return Claim(f.mapped(line.formula, lambda node, _: edges.get(node.key)) if edges else line.formula, clock)


def add_premises(program: Program) -> list[Claim]:
    """Fairness with a premise, as claims over its outputs."""
    return [
        Claim(f.apply("implies", _infinitely_often(c.premise), _infinitely_often(c.goal)))
        for c in program.fairness
        if c.premise is not None
    ]


def unconditional(program: Program) -> list[Claim]:
    """Fairness without a premise, as claims over its outputs."""
    return [Claim(_infinitely_often(c.goal)) for c in program.fairness if c.premise is None]


def _infinitely_often(key: str) -> f.Formula:
    return f.apply("G", f.apply("F", f.atom(key)))


def continuations(last: frozenset[str], atoms: Sequence[str]) -> list[tuple[frozenset[str], ...]]:
    """Loops that could follow the letter `last`, none of which may satisfy what a bad prefix violates: constant words
    over `atoms`, and alternations."""
    universe = frozenset(atoms)
    none = frozenset[str]()
    singles = [frozenset({a}) for a in sorted(universe)[:16]]
    constants = [none, universe, last & universe, universe - last, *singles]
    return [(c,) for c in constants] + [(none, universe), (universe, none)]


def _untimed(last: frozenset[str], atoms: Sequence[str]) -> Iterator[tuple[Word, Word]]:
    """Stems and loops."""
    return (((), loop) for loop in continuations(last, atoms))


def _timed(last: frozenset[str], atoms: Sequence[str]) -> Iterator[tuple[Word, Word]]:
    """Stems and loops: time passes after every letter, or after every second round after it stood still for one."""
    for loop in continuations(last, [a for a in atoms if a != TICK]):
        ticking = tuple(letter | {TICK} for letter in loop)
        yield (), ticking
        yield loop, (*loop, *ticking)
