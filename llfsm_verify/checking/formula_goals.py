"""Formulas of temporal logic as goals: closures, negations, and the evaluation of their traces."""

from __future__ import annotations

from collections.abc import Sequence

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge
from llfsm_verify.automata.safety import BadPrefix, Monitor, safety
from llfsm_verify.automata.translate import translate
from llfsm_verify.checking.confirm import Letter, Performance, confirm_bad_prefix
from llfsm_verify.checking.goals import Tick
from llfsm_verify.logic.formula import Formula, atoms, negation
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.properties import Property


class FormulaGoal:
    """A `name: formula` line."""

    def __init__(self, line: Property) -> None:
        assert line.formula is not None
        self.line = line
        self.formula = line.formula
        self.atoms = tuple(sorted(atoms(line.formula)))

    def monitor(self, tick: Tick | None = None, /) -> Monitor | None:
        """The subset construction of the closure; None when the closure is too large."""
        try:
            return BadPrefix(self.formula, self.atoms, tick)
        except AutomatonTooLarge:
            return None

    def is_safe(self, tick: Tick | None = None, /) -> bool:
        return safety(self.formula, tick=tick).holds

    def violations(self, tick: Tick | None = None, /) -> Automaton:
        return automaton_of_formula(negation(self.formula), self.atoms, tick)

    def confirm_prefix(self, performance: Performance, what: str) -> None:
        """No continuation that we try satisfies the formula."""
        confirm_bad_prefix(performance, self.formula, self.atoms, what)

    def violated_by(self, stem: Sequence[Letter], loop: Sequence[Letter]) -> bool:
        return not evaluate(self.formula, stem, loop)


def automaton_of_formula(formula: Formula, keys: Sequence[str], tick: Tick | None = None) -> Automaton:
    """The automaton of the runs that satisfy `formula`, over the atoms `keys`. AutomatonTooLarge."""
    return translate(formula, keys, tick=tick)
