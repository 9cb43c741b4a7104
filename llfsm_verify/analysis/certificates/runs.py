"""Runs as certificates write them: performed again by the executor, and followed by the automata that accept them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from llfsm_verify.analysis.certificates.configurations import Nodes
from llfsm_verify.automata.omega.emptiness import find_accepting_lasso
from llfsm_verify.checking.goals.goal import Unconfirmed
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.checking.trace import Trace
from llfsm_verify.diagnostics import Disagreement
from llfsm_verify.jsonvalue import Json
from llfsm_verify.kripke.observing import Observer
from llfsm_verify.kripke.product_search import Product, States
from llfsm_verify.limits import tick
from llfsm_verify.program.moves import Move

MOST_STEPS = 100_000
"""Steps after which a loop whose configuration does not recur, or that the automata need, is given up."""


@dataclass(frozen=True, slots=True)
class Step:
    """`choices` by number, as they were read; `node` None: the step faults. `shown`: letters shown up to here."""

    process: int | None
    choices: tuple[tuple[int, int], ...]
    node: tuple[int, ...] | None
    shown: int


@dataclass(frozen=True, slots=True)
class Run:
    """Steps from `initial`, with the letters they show, c0 first; from step `loop` on they repeat."""

    initial: tuple[int, ...]
    steps: tuple[Step, ...]
    letters: tuple[int, ...]
    loop: int | None

    def back(self) -> int | None:
        """The number of the first letter that is repeated."""
        return None if self.loop is None else self.steps[self.loop - 1].shown if self.loop else 1

    def json(self) -> Json:
        steps: list[Json] = []
        for s in self.steps:
            choices: list[Json] = [[k, x] for k, x in s.choices]
            steps.append([s.process, choices, None if s.node is None else list(s.node)])
        return {"initial": list(self.initial), "steps": steps, "loop": self.loop}


class RunRecorder:
    """Performs the traces of one arrangement with `execution`, whose program is the one in the certificate."""

    def __init__(self, execution: Execution) -> None:
        self._execution = execution
        self._program = execution.program
        self._nodes = Nodes(self._program, execution.layout)
        self._observer = Observer(self._program, execution.layout)
        self._processes: dict[str | None, int | None] = {p.name: i for i, p in enumerate(self._program.processes)}

    def run_of(self, trace: Trace) -> Run:
        """The steps of `trace`; its loop is repeated until a node recurs. Unconfirmed: it does not fit, or for long."""
        execution = self._execution
        record = execution.start(trace.initial_free)
        initial = tuple(self._nodes(record, in_cycle=False))
        letters = [self._observer.first_letter(record)]
        steps: list[Step] = []
        seen: dict[tuple[int, ...] | None, int] = {}
        moves = [
            Move(self._processes[s.process] if s.process is not None else None, {c.choice: c.value for c in s.choices})
            for s in trace.steps
        ]
        stem = moves if trace.loop is None else moves[: trace.loop]
        turn = stem
        while True:
            for move in turn:
                tick()
                result = execution.step(record, move)
                record = result.record
                if any(self._program.choices[k].name not in move.choices for k, _ in result.samples):
                    raise Unconfirmed("its trace gives no value for a choice that a step reads")
                if result.status < 0 or (result.status and len(steps) + 1 < len(moves)):
                    raise Disagreement("the executor ends a trace before its end")
                in_cycle = self._program.observe == "cycle" and move.process is not None
                in_cycle = in_cycle and not self._observer.ends_cycle(record)
                if not in_cycle and not result.status:
                    letters.append(self._observer.letter(record))
                node = None if result.status else tuple(self._nodes(record, in_cycle=in_cycle))
                steps.append(Step(move.process, result.samples, node, len(letters)))
            here = steps[-1].node if steps else initial
            if trace.loop is None:
                return Run(initial, tuple(steps), tuple(letters), None)
            if here in seen:
                return Run(initial, tuple(steps), tuple(letters), seen[here])
            if len(steps) > MOST_STEPS + len(moves):
                raise Unconfirmed("the configurations of its trace do not recur for long")
            seen[here] = len(steps)
            turn = moves[trace.loop :]


def follow(run: Run, product: Product, what: str) -> tuple[Run, Json]:
    """A run with the states of the automata after each letter, its loop repeated until these recur as well.

    Without a loop: any states that the letters lead to. Disagreement: the automata do not accept it.
    """
    begin: States = (0,) * product.parts
    if run.loop is None:
        trail = _any(run.letters, product, begin)
        if trail is None:
            raise Disagreement(f"{what}: the automata do not follow its trace")
        return run, [list(states) for states in trail]
    size, back = len(run.letters), run.back()
    assert back is not None

    def successors(node: tuple[int, int]) -> Iterator[tuple[None, int, tuple[int, int]]]:
        at, state = node
        for target, acceptance in product.step(state, run.letters[at]):
            yield None, acceptance, (at + 1 if at + 1 < size else back, target)

    lasso = None
    if not product.is_empty:
        lasso = find_accepting_lasso([(0, product.number(begin))], successors, product.sets)
    if lasso is None:
        raise Disagreement(f"{what}: the automata do not accept its trace")
    stem, loop = [state for _, (_, state) in lasso.stem], [state for _, (_, state) in lasso.loop]
    # Once more around: then both ends of the loop lie after the beginning of the run's own loop.
    states = [*stem, *loop, *loop]
    repeated = _unrolled(run, len(stem) + len(loop), len(states))
    return repeated, [list(product.states(state)) for state in states]


def _any(letters: Sequence[int], product: Product, begin: States) -> list[States] | None:
    """States that the letters lead through; of a deterministic automaton the only ones."""
    trail, state = list[States](), product.number(begin)
    for letter in letters:
        moves = () if product.is_empty else product.step(state, letter)
        if not moves:
            return None
        state = moves[0][0]
        trail.append(product.states(state))
    return trail


def _unrolled(run: Run, start: int, end: int) -> Run:
    """The same run, whose loop begins after `start` letters and ends after `end`, all after its own first ones."""
    back = run.back()
    assert run.loop is not None
    assert back is not None
    steps, letters = list(run.steps), list(run.letters)
    turn, words = run.steps[run.loop :], run.letters[back:]
    if end > MOST_STEPS:
        raise Unconfirmed("the automata do not recur on its trace for long")
    while steps[-1].shown < end + 1:
        later = len(letters) - back
        steps += [Step(s.process, s.choices, s.node, s.shown + later) for s in turn]
        letters += words
    first = next(i for i, s in enumerate(steps, 1) if s.shown == start)
    last = next(i for i, s in enumerate(steps, 1) if s.shown == end)
    return Run(run.initial, tuple(steps[:last]), tuple(letters[:end]), first)
