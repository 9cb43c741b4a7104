"""From a walk of the search to a counterexample: witnesses, the executor's replayed, its confirmation."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from llfsm_verify.analysis.explanation.explain import explained
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.checking.claims import Claim
from llfsm_verify.checking.goals.goal import Goal, lost_at
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.replay.confirm import Disagreement, Letter, ReplayedRun, Schedule
from llfsm_verify.checking.replay.replayer import Replayer
from llfsm_verify.checking.trace import Trace, letter_steps
from llfsm_verify.engines.explicit.product_search import Walk
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.limits import unlimited
from llfsm_verify.program.cone import Cone
from llfsm_verify.program.moves import Move


class Counterexamples:
    """Makes the traces of one search. The executor is compiled when the first one is asked for.

    What the executor or the evaluation does not confirm raises Disagreement. With `reduction` the explorer searched a
    cone of influence: the steps are extended to the whole program, which is the one performed.
    """

    def __init__(self, problem: Problem, explorer: Explorer, reduction: Cone | None = None) -> None:
        self._problem = problem
        self._explorer = explorer
        self._replayer = Replayer(problem)
        self._reduction = reduction

    def of_property(self, goal: Goal, assumed: Sequence[Claim], walk: Walk) -> tuple[Trace, tuple[str, ...]]:
        """The confirmed trace of a violation, and what is worth noting of it."""
        replayed = self.replayed(goal, assumed, walk)
        notes = () if walk.loop is None else _notes(goal, replayed)
        return explained(replayed, goal, self._problem), notes

    def replayed(self, goal: Goal, assumed: Sequence[Claim], walk: Walk, beside: Sequence[str] = ()) -> ReplayedRun:
        """The executor's replayed of a violation, confirmed; its trace also shows the atoms `beside`.

        Raises Unconfirmed when the evaluation meets a limit, or when the walk is one of a cone of influence, and what
        that leaves out does not recur soon.
        """
        what = f"property {goal.line.name}"
        pairs = zip(walk.nodes, walk.nodes[1:], walk.letters, strict=False)
        parts = [self._explorer.witness(source, target, letter) for source, target, letter in pairs]
        loop = None if walk.loop is None else sum(len(p) for p in parts[: walk.loop])
        moves = tuple(move for part in parts for move in part)
        shown = self._replayer.shown(goal, assumed, beside)
        replayed = self._perform(moves, loop, walk.nodes[0], what, shown)
        self._compare(walk, replayed, what)
        soon = self._reduction is None
        self._replayer.confirm(goal, assumed, replayed, what, prefix=walk.loop is None, recurs_soon=soon)
        return replayed

    def of_fault(self, number: int, path: Sequence[int]) -> Trace:
        """The confirmed trace of fault `number`, which happens in a step from the last configuration of `path`."""
        moves: list[Move] = []
        for source, target in pairwise(path):
            moves += self._explorer.witness(source, target, None)
        moves += self._explorer.fault_witness(path[-1], number)
        site = self._explorer.program.faults[number]
        replayed = self._perform(tuple(moves), None, path[0], f"fault {site.code}", ())
        self._replayer.confirm_fault(site, replayed)
        return replayed.trace

    def _letter(self, mask: int) -> Letter:
        return frozenset(n for i, n in enumerate(self._explorer.observed) if mask >> i & 1)

    def _perform(
        self, moves: tuple[Move, ...], loop: int | None, root: int, what: str, shown: Sequence[str]
    ) -> ReplayedRun:
        first = self._letter(self._explorer.first_letters[root])
        if self._reduction is not None:
            moves = tuple(Move(m.process, self._reduction.extend(m.choices)) for m in moves)
        return self._replayer.perform(Schedule(self._explorer.free(root), moves, loop), first, what, shown)

    def _compare(self, walk: Walk, replayed: ReplayedRun, what: str) -> None:
        """The executor showed the letters that the search saw."""
        for i, mask in enumerate(walk.shown, 1):
            if i >= len(replayed.letters) or replayed.letters[i] != self._letter(mask):
                raise Disagreement(f"{what}: the executor shows another letter than the search after step {i}")


@unlimited()
def _notes(goal: Goal, replayed: ReplayedRun) -> tuple[str, ...]:
    """Where on a lasso the property is lost already, whatever comes after."""
    try:
        monitor = goal.monitor()
        number = None if monitor is None else lost_at(monitor, goal.atoms, replayed.letters)
    except AutomatonTooLarge:
        return ()
    if number is None:
        return ()
    step = letter_steps(replayed.trace)[number]
    return (f"after step {step} nothing can satisfy it any more; the rest shows that the assumptions can hold",)
