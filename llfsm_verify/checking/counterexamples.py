"""From a walk of the search to a counterexample: witnesses, the executor's performance, its confirmation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from itertools import pairwise

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.checking.binding import Bound
from llfsm_verify.checking.claims import Claim
from llfsm_verify.checking.confirm import (
    Disagreement,
    Letter,
    Misfit,
    Performance,
    Script,
    confirm_lasso,
    perform,
)
from llfsm_verify.checking.execution import Execution
from llfsm_verify.checking.explaining.explain import explained
from llfsm_verify.checking.goals import Goal, Unconfirmed, lost_at
from llfsm_verify.checking.search import Walk
from llfsm_verify.checking.trace import Trace, letter_steps
from llfsm_verify.kripke.explore import Explorer, Move
from llfsm_verify.logic.bounds import HIDDEN
from llfsm_verify.logic.expressions import ExpressionTooLarge
from llfsm_verify.semantics.cone import Cone
from llfsm_verify.semantics.lowering import lower


class Counterexamples:
    """Makes the traces of one search. The executor is compiled when the first one is asked for.

    `tick` is called for every ringlet performed, and may raise to stop. What the executor or the evaluation does not
    confirm raises Disagreement. With `reduction` the explorer searched a cone of influence: the steps are extended to
    the whole program, which is the one performed.
    """

    def __init__(
        self,
        arrangement: Arrangement,
        bound: Bound,
        explorer: Explorer,
        tick: Callable[[], None],
        reduction: Cone | None = None,
    ) -> None:
        self._arrangement = arrangement
        self._bound = bound
        self._explorer = explorer
        self._tick = tick
        self._reduction = reduction

    @cached_property
    def _execution(self) -> Execution:
        return Execution(lower(self._arrangement, self._bound.atoms, keep_all_bits=True))

    def of_property(self, goal: Goal, assumed: Sequence[Claim], walk: Walk) -> tuple[Trace, tuple[str, ...]]:
        """The confirmed trace of a violation, and what is worth noting of it."""
        performance = self.performance(goal, assumed, walk)
        notes = () if walk.loop is None else _notes(goal, performance)
        return explained(performance, goal, self._bound), notes

    def performance(self, goal: Goal, assumed: Sequence[Claim], walk: Walk, beside: Sequence[str] = ()) -> Performance:
        """The executor's performance of a violation, confirmed; its trace also shows the atoms `beside`.

        Raises Unconfirmed when the evaluation meets a limit, or when the walk is one of a cone of influence, and what
        that leaves out does not recur soon.
        """
        what = f"property {goal.line.name}"
        pairs = zip(walk.nodes, walk.nodes[1:], walk.letters, strict=False)
        parts = [self._explorer.witness(source, target, letter) for source, target, letter in pairs]
        loop = None if walk.loop is None else sum(len(p) for p in parts[: walk.loop])
        moves = tuple(move for part in parts for move in part)
        read = {*goal.atoms, *beside, *(name for f in assumed for name in f.atoms)}
        shown = sorted(name for name in read if not name.startswith(HIDDEN))  # those we made are no atoms of users
        performance = self._perform(moves, loop, walk.nodes[0], what, shown)
        self._compare(walk, performance, what)
        try:
            if walk.loop is None:
                goal.confirm_prefix(performance, what)
                return performance
            self._confirm_run(goal, assumed, performance, what)
        except ExpressionTooLarge as limit:
            raise Unconfirmed(str(limit)) from None
        return performance

    def _confirm_run(self, goal: Goal, assumed: Sequence[Claim], performance: Performance, what: str) -> None:
        if self._reduction is not None and not performance.recurs:
            raise Unconfirmed(
                "variables that the property does not depend on do not recur for long; --cone off searches with them"
            )
        confirm_lasso(performance, assumed, self._execution.program.fairness, what)
        start = performance.loop_letter
        if not goal.violated_by(performance.letters[:start], performance.letters[start:]):
            raise Disagreement(f"{what}: the trace satisfies the property")

    def of_fault(self, number: int, path: Sequence[int]) -> Trace:
        """The confirmed trace of fault `number`, which happens in a step from the last configuration of `path`."""
        moves: list[Move] = []
        for source, target in pairwise(path):
            moves += self._explorer.witness(source, target, None)
        moves += self._explorer.fault_witness(path[-1], number)
        site = self._explorer.program.faults[number]
        performance = self._perform(tuple(moves), None, path[0], f"fault {site.code}", ())
        if performance.trace.fault != site:
            raise Disagreement(f"fault {site.code} ({site.message}): the executor does not fault on its trace")
        return performance.trace

    def _letter(self, mask: int) -> Letter:
        return frozenset(n for i, n in enumerate(self._explorer.observed) if mask >> i & 1)

    def _perform(
        self, moves: tuple[Move, ...], loop: int | None, root: int, what: str, shown: Sequence[str]
    ) -> Performance:
        first = self._letter(self._explorer.first_letters[root])
        if self._reduction is not None:
            moves = tuple(Move(m.process, self._reduction.extend(m.choices)) for m in moves)
        script = Script(self._explorer.free(root), moves, loop)
        try:
            return perform(self._execution, script, first, shown, self._tick)
        except Misfit as misfit:
            raise Disagreement(f"{what}: the executor cannot follow the search: {misfit}") from misfit

    def _compare(self, walk: Walk, performance: Performance, what: str) -> None:
        """The executor showed the letters that the search saw."""
        for i, mask in enumerate(walk.shown, 1):
            if i >= len(performance.letters) or performance.letters[i] != self._letter(mask):
                raise Disagreement(f"{what}: the executor shows another letter than the search after step {i}")


def _notes(goal: Goal, performance: Performance) -> tuple[str, ...]:
    """Where on a lasso the property is lost already, whatever comes after."""
    try:
        monitor = goal.monitor()
        number = None if monitor is None else lost_at(monitor, goal.atoms, performance.letters)
    except AutomatonTooLarge:
        return ()
    if number is None:
        return ()
    step = letter_steps(performance.trace)[number]
    return (f"after step {step} nothing can satisfy it any more; the rest shows that the assumptions can hold",)
