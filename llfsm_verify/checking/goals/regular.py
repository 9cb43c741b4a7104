"""Regular properties as goals: a monitor finds the bad prefixes, and the definition judges their traces."""

from __future__ import annotations

from collections.abc import Sequence

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge
from llfsm_verify.automata.finite.monitor import RegularMonitor
from llfsm_verify.automata.properties import regular_monitor
from llfsm_verify.checking.goals.goal import Unconfirmed
from llfsm_verify.checking.replay.confirm import Letter, ReplayedRun
from llfsm_verify.diagnostics import Disagreement
from llfsm_verify.limits import LimitReached
from llfsm_verify.logic.properties import Property
from llfsm_verify.logic.regular import ExpressionTooLarge, RegularKind
from llfsm_verify.logic.regular_evaluate import is_bad, is_violated


class RegularGoal:
    """An `enforce`, `forbid` or `forbid initially` line. Every violation has a bad prefix."""

    def __init__(self, line: Property) -> None:
        """Raises DiagnosticError (E342, E344) when the property is void."""
        assert line.expression is not None
        assert line.kind in ("enforce", "forbid", "forbid initially")
        self.line = line
        self.atoms = tuple(sorted(line.atoms))
        self._kind: RegularKind = line.kind
        self._expression = line.expression
        self._monitor: RegularMonitor | AutomatonTooLarge | LimitReached
        try:
            self._monitor = regular_monitor(line, self.atoms)
        except (AutomatonTooLarge, LimitReached) as limit:
            self._monitor = limit

    def monitor(self) -> RegularMonitor:
        """Raises AutomatonTooLarge, or LimitReached when time was up before the automaton was made."""
        if isinstance(self._monitor, Exception):
            raise self._monitor
        return self._monitor

    def is_safe(self) -> bool:
        return True

    def is_invariant(self) -> bool:
        return False

    def violations(self) -> Automaton:
        raise AssertionError("a regular property is violated by bad prefixes only")

    def confirm_prefix(self, replayed: ReplayedRun, what: str) -> None:
        if replayed.status:
            raise Disagreement(f"{what}: the executor faults on the trace that the search found")
        try:
            bad = is_bad(self._kind, self._expression, replayed.letters)
        except ExpressionTooLarge as limit:
            raise Unconfirmed(str(limit)) from None
        if not bad:
            raise Disagreement(f"{what}: the run shown does not violate the property")

    def violated_by(self, stem: Sequence[Letter], loop: Sequence[Letter]) -> bool:
        try:
            return is_violated(self._kind, self._expression, stem, loop)
        except ExpressionTooLarge as limit:
            raise Unconfirmed(str(limit)) from None
