"""More counterexamples to the same property, each of which takes another path than all before."""

from __future__ import annotations

from dataclasses import replace

from llfsm_verify.analysis.enumeration.automata import NewPrefixes, NewRuns
from llfsm_verify.analysis.enumeration.signatures import Firing, Signature, Tree, firings, observe, signature_of
from llfsm_verify.analysis.explanation.explain import explain
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.checking.claims import claim_of
from llfsm_verify.checking.engine import Excluded, Explored, Session
from llfsm_verify.checking.goals.goal import Goal, Unconfirmed
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.replay.replayer import Replayer
from llfsm_verify.checking.trace import Trace
from llfsm_verify.checking.verdict import Options, PropertyResult
from llfsm_verify.diagnostics import Disagreement
from llfsm_verify.limits import LimitReached
from llfsm_verify.transforms.cone import cone

MOST_NODES = 1_000_000
"""Nodes of the graph in which other counterexamples are looked for."""
NO_MORE = "in every other run that violates it the transitions fire for the first time in one of these orders"


class Others:
    """Looks for other counterexamples, in a space of its own whose letters also tell which transitions fired."""

    def __init__(self, problem: Problem, options: Options, session: Session) -> None:
        """`session`: whose engine explores that space."""
        self._problem = problem
        self._assumed = [claim_of(p, problem.clock) for p in problem.assumptions]
        program = problem.program(keep_all_bits=options.keep_all_bits)
        self._firings: list[Firing] = []
        atoms = list(problem.atoms)
        for firing in firings(program):
            atom = observe(firing, program)
            if atom is not None:
                self._firings.append(firing)
                atoms.append(atom)
        wide = replace(problem, atoms=tuple(atoms))
        self._explored = session.watching(wide, MOST_NODES)
        self._replayer = Replayer(wide)

    def of(self, result: PropertyResult, goal: Goal, wanted: int) -> PropertyResult:
        """`result`, which has a trace, with up to `wanted` traces in all, and why there are no more."""
        assert result.trace is not None
        if self._explored is None:
            return replace(result, only=f"the engine {result.engine} looks for one only")
        machines = self._machines(goal)
        mine = [f for f in self._firings if f.machine in machines]
        traces = [result.trace]
        only: str | None = None
        try:
            while len(traces) < wanted:
                found = {signature_of(trace, machines): None for trace in traces}
                other = self._next(self._explored, goal, mine, list(found))
                if other is None:
                    only = self._explored.unfinished or NO_MORE
                    break
                if signature_of(other, machines) in found:
                    raise Disagreement(f"property {result.name}: a counterexample is not as different as it was found")
                traces.append(other)
        except (LimitReached, AutomatonTooLarge, Unconfirmed, MemoryError) as limit:
            only = str(limit) or "the memory ran out"
        return replace(result, more=tuple(traces[1:]), only=only)

    def _next(self, explored: Explored, goal: Goal, mine: list[Firing], found: list[Signature]) -> Trace | None:
        tree = Tree([f.transition for f in mine], found)
        keys = tuple(f.key for f in mine)
        bits = len(goal.atoms)
        excluded = Excluded(keys, lambda m: NewPrefixes(m, bits, tree), lambda m: NewRuns(m, bits, len(keys), tree))
        run = explored.find(goal, excluded)
        if run is None:
            return None
        return explain(self._replayer.violation(goal, run), goal, self._problem)

    def _machines(self, goal: Goal) -> frozenset[str]:
        """The machines that a property and the assumptions depend on."""
        read = {*goal.atoms, *(name for claim in self._assumed for name in claim.atoms)}
        program = replace(self._problem, atoms=tuple(a for a in self._problem.atoms if a.name in read)).program()
        left_out = set(cone(program).left_out)
        return frozenset(m.name for m in program.machines if m.name not in left_out)

    def close(self) -> None:
        """Give the memory of the space back."""
        if self._explored is not None:
            self._explored.close()
