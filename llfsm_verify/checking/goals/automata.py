"""Goals whose violations are words of an automaton: automata from files, and regular expressions. A monitor finds the
bad prefixes, and the definition judges the traces.
"""

from __future__ import annotations

from collections.abc import Sequence

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge
from llfsm_verify.automata.finite.monitor import RegularMonitor
from llfsm_verify.automata.omega.complement import complement, has_complement
from llfsm_verify.automata.omega.products import accepts, disjoint
from llfsm_verify.automata.omega.reduction import closure_of
from llfsm_verify.automata.properties import regular_monitor
from llfsm_verify.automata.safety import BadPrefix, PrefixMonitor
from llfsm_verify.checking.claims import continuations
from llfsm_verify.checking.goals.goal import Unconfirmed
from llfsm_verify.checking.replay.confirm import Letter, ReplayedRun
from llfsm_verify.diagnostics import Disagreement
from llfsm_verify.limits import LimitReached
from llfsm_verify.logic.properties import Property
from llfsm_verify.logic.regular import ExpressionTooLarge, RegularKind
from llfsm_verify.logic.regular_evaluate import is_bad, is_violated

MAX_PAIRS = 50_000
"""Pairs of states up to which it is decided whether an automaton is one of a safety property."""


class AutomatonGoal:
    """An `automaton` line (every run is to be accepted) or an `automaton never` line (no run is)."""

    def __init__(self, line: Property, automaton: Automaton) -> None:
        """`automaton` as the file has it; for an `automaton` line, one that `has_complement`."""
        self.line = line
        self.atoms = automaton.atoms
        self._given = automaton
        self._never = line.kind == "automaton never"
        self._complement: Automaton | None = None

    def monitor(self) -> PrefixMonitor | None:
        """None: the allowed runs are those that an automaton which is not deterministic does not accept."""
        try:
            allowed = self.allowed()
            return None if allowed is None else BadPrefix.of_closure(closure_of(allowed))
        except AutomatonTooLarge:
            return None

    def is_safe(self) -> bool:
        """The closure of the allowed runs has no violating one; not looked at for large automata."""
        try:
            allowed, wrong = self.allowed(), self.violations()
            if allowed is None:
                return False
            closure = closure_of(allowed)
            small = len(closure.edges) * len(wrong.edges) <= MAX_PAIRS
            return small and disjoint(closure, wrong, closure=True)
        except AutomatonTooLarge:
            return False

    def is_invariant(self) -> bool:
        return False

    def violations(self) -> Automaton:
        return self._given if self._never else self._opposite()

    def confirm_prefix(self, replayed: ReplayedRun, what: str) -> None:
        """No continuation that we try has the property."""
        if replayed.status:
            raise Disagreement(f"{what}: the executor faults on the trace that the search found")
        for loop in continuations(replayed.letters[-1], self.atoms):
            if not self.violated_by(replayed.letters, loop):
                raise Disagreement(f"{what}: the run shown could still go on to satisfy the property")

    def violated_by(self, stem: Sequence[Letter], loop: Sequence[Letter]) -> bool:
        """By running the file's own automaton on the letters."""
        return accepts(self._given, stem, loop) == self._never

    def allowed(self) -> Automaton | None:
        """The automaton of the allowed runs; None: it is a complement that is not computed."""
        if not self._never:
            return self._given
        return self._opposite() if has_complement(self._given) else None

    def _opposite(self) -> Automaton:
        if self._complement is None:
            self._complement = complement(self._given)
        return self._complement


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
