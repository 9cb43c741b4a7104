"""What proves verdicts: all configurations, ranked product states for what holds, and performed runs for what does
not.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass

from llfsm_verify.automata.omega.components import components
from llfsm_verify.automata.omega.emptiness import find_accepting_lasso
from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.checking.goals.goal import Unconfirmed
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.checking.trace import Trace
from llfsm_verify.diagnostics import Disagreement
from llfsm_verify.jsonvalue import Json
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.kripke.observing import Observer
from llfsm_verify.kripke.product_search import Product, States
from llfsm_verify.limits import LimitReached, tick
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Program

MOST_STATES = 1_000_000
"""Product states (and configurations) up to which a certificate is made."""
MOST_STEPS = 20_000_000
"""Steps from them, with all values of inputs, that a certificate is made for: its checker is plain Python."""


class Nodes:
    """Turns records into the lists of values that certificates write.

    A node is the values of a configuration; with ``observe: cycle``, in the middle of a cycle, also of the outputs.
    """

    def __init__(self, program: Program, layout: Layout) -> None:
        def readers(*, output: bool) -> list[Callable[[bytes], int]]:
            chosen = [v for v in program.vars if v.output is output]
            return [layout.reader(v.name, i) for v in chosen for i in ([None] if v.length is None else range(v.length))]

        self._configuration, self._outputs = readers(output=False), readers(output=True)

    def __call__(self, record: bytes, *, in_cycle: bool) -> list[int]:
        values = [read(record) for read in self._configuration]
        return values + [read(record) for read in self._outputs] if in_cycle else values


class TooLarge(LimitReached):
    """There are more states than a certificate is made for."""


def explore(explorer: Explorer) -> None:
    """Explore everything. LimitReached with the reason when that cannot be."""
    graph = explorer.graph
    explorer.explore(MOST_STATES + 1, MOST_STEPS)
    if len(graph) > MOST_STATES:
        raise TooLarge(f"there are more than {MOST_STATES:,} configurations")
    if graph.unfinished is not None:
        raise LimitReached(graph.unfinished)


MOST_RUN_STEPS = 100_000
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
    """Performs the traces of one arrangement with `execution`, whose program is the one in the certificate.

    `moved`: the choices that it draws later in a cycle than traces do."""

    def __init__(self, execution: Execution, moved: Collection[str] = ()) -> None:
        self._execution = execution
        self._moved = moved
        self._program = execution.program
        self._nodes = Nodes(self._program, execution.layout)
        self._observer = Observer(self._program, execution.layout)
        self._processes: dict[str | None, int | None] = {p.name: i for i, p in enumerate(self._program.processes)}

    def run_of(self, trace: Trace) -> Run:
        """The steps of `trace`; its loop is repeated until a node recurs. What is sampled for other properties alone
        has any value. Unconfirmed: no node recurs for long."""
        execution = self._execution
        free = {v.name for v in self._program.vars if v.free}
        record = execution.start([(name, value) for name, value in trace.initial_free if name in free])
        initial = tuple(self._nodes(record, in_cycle=False))
        letters = [self._observer.first_letter(record)]
        steps: list[Step] = []
        seen: dict[tuple[int, ...] | None, int] = {}
        moves = [
            Move(self._processes[s.process] if s.process is not None else None, {c.choice: c.value for c in s.choices})
            for s in trace.steps
        ]
        drawn: dict[tuple[int | None, str], int] = {}
        """By process, what the cycle that is under way has drawn of `moved`."""
        stem = moves if trace.loop is None else moves[: trace.loop]
        turn = stem
        while True:
            for move in turn:
                tick()
                drawn |= {(move.process, n): x for n, x in move.choices.items() if n in self._moved}
                given = move.choices | {n: x for (process, n), x in drawn.items() if process == move.process}
                result = execution.step(record, Move(move.process, given))
                record = result.record
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
            if len(steps) > MOST_RUN_STEPS + len(moves):
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
    if end > MOST_RUN_STEPS:
        raise Unconfirmed("the automata do not recur on its trace for long")
    while steps[-1].shown < end + 1:
        later = len(letters) - back
        steps += [Step(s.process, s.choices, s.node, s.shown + later) for s in turn]
        letters += words
    first = next(i for i, s in enumerate(steps, 1) if s.shown == start)
    last = next(i for i, s in enumerate(steps, 1) if s.shown == end)
    return Run(run.initial, tuple(steps[:last]), tuple(letters[:end]), first)


Edges = Sequence[Sequence[tuple[int, int | None]]]


def edges_of(graph: Graph) -> list[list[tuple[int, int | None]]]:
    """The (successor, letter) pairs of every node of a complete graph."""
    found = []
    for node in range(len(graph)):
        tick()
        found.append(list(graph.edges(node)))
    return found


def proof_of(product: Product, edges: Edges, first: Sequence[int], what: str) -> Json:
    """The product states with ranks: `joint` lists the states of the automata, `nodes` has for each product state its
    configuration, the index in `joint` and the rank, `sets` an acceptance set of each rank.

    `first` are the letters of the roots. TooLarge: there are more than MOST_STATES states. Disagreement: a run is
    accepted.
    """
    own = product.sets - len(product.fair_bits)
    numbers: dict[tuple[int, int], int] = {}
    order: list[tuple[int, int]] = []
    targets: list[list[int]] = []
    acceptance: list[list[int]] = []

    def number(node: tuple[int, int]) -> int:
        found = numbers.setdefault(node, len(order))
        if found == len(order):
            if found >= MOST_STATES:
                raise TooLarge(f"its product has more than {MOST_STATES:,} states")
            order.append(node)
        return found

    for node, states in product.initial(first):
        number((node, product.number(states)))
    for here in order:  # it grows
        tick()
        to, masks = list[int](), list[int]()
        for target, letter in edges[here[0]]:
            for state, mask in ((here[1], 0),) if letter is None else product.step(here[1], letter):
                to.append(number((target, state)))
                low = mask & (1 << own) - 1
                masks.append(0 if letter is None else low | 1 << own | mask >> own << own + 1)
        targets.append(to)
        acceptance.append(masks)
    ranks, sets = ranked(targets, acceptance, product.sets + 1, what)
    joint = {state: i for i, state in enumerate(dict.fromkeys(state for _, state in order))}
    flat: list[Json] = []
    for (node, state), rank in zip(order, ranks, strict=True):
        flat += [node, joint[state], rank]
    return {"joint": [list(product.states(state)) for state in joint], "nodes": flat, "sets": list(sets)}


# ---- Ranks of product states: they never rise, and inside of each some acceptance set does not occur


def ranked(
    targets: Sequence[Sequence[int]], acceptance: Sequence[Sequence[int]], sets: int, what: str
) -> tuple[list[int], list[int]]:
    """The rank of each node, and of each rank the acceptance set that no edge inside it has.

    Node i has edges to ``targets[i]`` in the sets of the masks ``acceptance[i]``; there are `sets` sets, at least one.
    One rank where a set occurs nowhere, else as few as taking the components one by one, successors first, gives.
    Source: ranks of the complements of Büchi automata (Kupferman and Vardi, Weak alternating automata are not that
    weak, TOCL 2 (2001)), here of a product without accepting runs. Raises Disagreement when there is an accepting
    component: `what` does not hold.
    """
    shown = 0
    for masks in acceptance:
        for mask in masks:
            shown |= mask
    nowhere = [k for k in range(sets) if not shown >> k & 1]
    if nowhere:
        return [0] * len(targets), nowhere[: min(1, len(targets))]
    component = components(targets)
    members: list[list[int]] = [[] for _ in range(max(component, default=-1) + 1)]
    for node, number in enumerate(component):
        members[number].append(node)
    rank, named = [0] * len(component), list[int]()
    for number, nodes in enumerate(members):
        inside = below = 0
        least = -1
        for node in nodes:
            for target, mask in zip(targets[node], acceptance[node], strict=True):
                if component[target] == number:
                    inside |= mask
                elif rank[target] > least:
                    least, below = rank[target], mask
                elif rank[target] == least:
                    below |= mask
        level = max(least, 0)
        if least >= 0 and (inside | below) >> named[least] & 1:
            level = least + 1
        while level < len(named) and inside >> named[level] & 1:
            level += 1
        if level == len(named):
            missing = [k for k in range(sets) if not inside >> k & 1]
            if not missing:
                raise Disagreement(f"{what}: the product has an accepting component, although the search found none")
            named.append(missing[0])
        for node in nodes:
            rank[node] = level
    return rank, named
