"""More counterexamples to the same property, each of which takes another path than all before."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from llfsm_verify.analysis.enumeration.automata import NewPrefixes, NewRuns
from llfsm_verify.analysis.enumeration.signatures import Firing, Signature, Tree, firings, observed, signature_of
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.checking.goals.goal import Goal, Unconfirmed
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.replay.confirm import Disagreement
from llfsm_verify.checking.trace import Trace
from llfsm_verify.checking.verdict import Options, PropertyResult
from llfsm_verify.engines.explicit.counterexamples import Counterexamples
from llfsm_verify.engines.explicit.search import Excluded, Search
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.kripke.labels.wide import labels_of
from llfsm_verify.limits import Budget, LimitReached
from llfsm_verify.program.cone import cone
from llfsm_verify.program.program import Program

if TYPE_CHECKING:
    from llfsm_verify.kripke.labels.labels import Labels

MOST_NODES = 1_000_000
"""Nodes of the graph in which other counterexamples are looked for."""
NO_MORE = "in every other run that violates it the transitions fire for the first time in one of these orders"


class Others:
    """Looks for other counterexamples, in a graph of its own whose letters also tell which transitions fired."""

    def __init__(self, problem: Problem, options: Options, budget: Budget) -> None:
        self._problem = problem
        self._budget = budget
        program = problem.program(keep_all_bits=options.keep_all_bits)
        self._firings: list[Firing] = []
        atoms = list(problem.atoms)
        for firing in firings(program):
            atom = observed(firing, program)
            if atom is not None:
                self._firings.append(firing)
                atoms.append(atom)
        self._wide = replace(problem, atoms=tuple(atoms))
        wide = self._wide.program(keep_all_bits=options.keep_all_bits)
        self._explorer = Explorer(wide, budget, labels=_labels(wide, budget) if options.labels else None)
        self._search = Search(self._explorer, self._wide, (), budget)
        self._counterexamples = Counterexamples(self._wide, self._explorer)

    def of(self, result: PropertyResult, goal: Goal, wanted: int) -> PropertyResult:
        """`result`, which has a trace, with up to `wanted` traces in all, and why there are no more."""
        assert result.trace is not None
        machines = self._machines(goal)
        mine = [f for f in self._firings if f.machine in machines]
        traces = [result.trace]
        only: str | None = None
        try:
            self._explorer.explore(MOST_NODES)
            while len(traces) < wanted:
                found = {signature_of(trace, machines): None for trace in traces}
                other = self._next(goal, mine, list(found))
                if other is None:
                    only = self._why_no_more()
                    break
                if signature_of(other, machines) in found:
                    raise Disagreement(f"property {result.name}: a counterexample is not as different as it was found")
                traces.append(other)
        except (LimitReached, AutomatonTooLarge, Unconfirmed, MemoryError) as limit:
            only = str(limit) or "the memory ran out"
        return replace(result, more=tuple(traces[1:]), only=only)

    def _next(self, goal: Goal, mine: list[Firing], found: list[Signature]) -> Trace | None:
        tree = Tree([f.transition for f in mine], found)
        keys = tuple(f.key for f in mine)
        bits = len(goal.atoms)
        excluded = Excluded(keys, lambda m: NewPrefixes(m, bits, tree), lambda m: NewRuns(m, bits, len(keys), tree))
        walk = self._search.violation(goal, excluded)
        if walk is None:
            return None
        trace, _ = self._counterexamples.of_property(goal, self._search.assumed, walk)
        return trace

    def _why_no_more(self) -> str:
        graph = self._explorer.graph
        if graph.complete:
            return NO_MORE
        return graph.stopped or f"no more were found among the first {len(graph):,} configurations"

    def _machines(self, goal: Goal) -> frozenset[str]:
        """The machines that a property and the assumptions depend on."""
        read = {*goal.atoms, *(name for claim in self._search.assumed for name in claim.atoms)}
        program = replace(self._problem, atoms=tuple(a for a in self._problem.atoms if a.name in read)).program()
        left_out = set(cone(program).left_out)
        return frozenset(m.name for m in program.machines if m.name not in left_out)

    def close(self) -> None:
        """Give the memory of the graph back."""
        self._explorer.close()


def _labels(program: Program, budget: Budget) -> Labels | None:
    """The labels of a program; None, too, when a limit is reached, which ends the exploration just as well."""
    try:
        return labels_of(program, budget)
    except LimitReached:
        return None
