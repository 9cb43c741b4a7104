"""The check before loading against another way to the same answer: the executor alone, and monitors step by step.

From where a run stands all its continuations are performed, with every value of every choice; from each end of a cycle
all those with the change. What never comes is a loop in which a monitor waits.
"""

from __future__ import annotations

import copy
from collections import Counter, deque
from collections.abc import Collection, Iterable, Iterator
from random import Random

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.native.executor import StepResult
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.monitoring.states import Monitor, MonitorVerdict
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Int
from llfsm_verify.runtime.live import control
from llfsm_verify.runtime.live.plan import monitored
from llfsm_verify.testing.arrangements import Document, arrangements
from llfsm_verify.verification.changes.state_transfer import Accepted, Untransferable, transferred, update_point
from tests.quick import AtLeast, many, spread
from tests.runtime.swapping.test_hot_swap import POLICY, changed
from tests.runtime.swapping.test_update_check import asked, code_of, loop_of, properties_of

MOST_PLACES, MOST_STEPS, MOST_VALUES = 700, 12_000, 40
Place = tuple[bytes, tuple[int, ...], int | None]
"""A configuration, the states of the monitors, and the process that is in the middle of its cycle."""
FORMS = (
    "G !(A && B)",
    "G (A -> X X B)",
    "F A",
    "F (A && B)",
    "G (A -> B U C)",
    "G (A -> X B || C)",
    "G !(rose(A) && B)",
)


class TooLarge(Exception):
    """This example would take too long."""


class Performed:
    """An arrangement, as the executor performs it."""

    def __init__(self, arrangement: Arrangement, properties: PropertySet) -> None:
        self.program, monitors, _ = monitored(arrangement, properties)
        self.monitors = dict(monitors)
        self.execution = Execution(self.program)
        self.layout = self.execution.layout
        self._outputs = self.layout.encode_outputs(self.layout.initial_outputs())
        self._atoms = {atom.name: atom.output for atom in self.program.atoms}
        self._steps = 0

    def record(self, configuration: bytes) -> bytes:
        return configuration + self._outputs

    def reached(self, starts: Iterable[tuple[bytes, tuple[int, ...]]]) -> tuple[dict[Place, list[Place]], bool]:
        """What comes after each place that is reached, and whether some run ends in a fault."""
        after: dict[Place, list[Place]] = {}
        queue = deque[Place]((configuration, states, None) for configuration, states in dict.fromkeys(starts))
        seen, faults = set(queue), False
        while queue:
            place = queue.popleft()
            after[place] = found = []
            for process, result in self._moves(place):
                faults |= bool(result.status)
                if not result.status:
                    found.append(self._place(place[1], process, result))
            for other in found:
                if other not in seen:
                    seen.add(other)
                    queue.append(other)
            if len(seen) > MOST_PLACES:
                raise TooLarge
        return after, faults

    def _moves(self, place: Place) -> Iterator[tuple[int | None, StepResult]]:
        record = self.record(place[0])
        for process in self.execution.enabled(record) or [None]:
            if place[2] in (None, process):  # a run takes whole cycles
                yield from ((process, result) for result in self._results(record, process))

    def _results(self, record: bytes, process: int | None) -> Iterator[StepResult]:
        """With every value of every choice that the step makes."""
        waiting: list[dict[str, int]] = [{}]
        while waiting:
            given = waiting.pop()
            result = self.execution.step(record, Move(process, given))
            self._steps += 1
            made = (self.program.choices[number] for number, _ in result.samples)
            choice = next((choice for choice in made if choice.name not in given), None)
            if choice is None:
                yield result
                continue
            low, high = (choice.type.low, choice.type.high) if isinstance(choice.type, Int) else (0, 1)
            if high - low > MOST_VALUES or self._steps > MOST_STEPS:
                raise TooLarge
            waiting += [{**given, choice.name: value} for value in range(low, high + 1)]

    def _place(self, states: tuple[int, ...], process: int | None, result: StepResult) -> Place:
        outputs = self.layout.decode_outputs(result.record)
        complete = process is None or bool(outputs[self.program.cycle])
        if complete or self.program.observe == "ringlet":
            true = {name for name, output in self._atoms.items() if outputs[output]}
            pairs = zip(self.monitors.values(), states, strict=True)
            states = tuple(monitor.step(state, monitor.letter(true)) for monitor, state in pairs)
        return self.execution.configuration(result.record), states, None if complete else process

    def violated(self, states: tuple[int, ...]) -> set[str]:
        pairs = zip(self.monitors.items(), states, strict=True)
        return {name for (name, monitor), state in pairs if monitor.verdicts[state] is MonitorVerdict.FALSE}


def waiting_states(monitor: Monitor, formula: str) -> set[int]:
    """Who stays in these forever violates a formula of `FORMS`, though no finite part of the run does."""
    open_states = {q for q, verdict in enumerate(monitor.verdicts) if verdict is MonitorVerdict.NOT_YET}
    if " U " in formula:  # after an A; without B and C it is violated
        return {q for q in open_states if monitor.verdicts[monitor.step(q, 0)] is MonitorVerdict.FALSE}
    return open_states if formula.startswith("F ") else set()


def has_loop(after: dict[Place, list[Place]], inside: Collection[Place]) -> bool:
    """Whether a run can stay inside forever."""
    left = set(inside)
    while gone := {place for place in left if not left.intersection(after[place])}:
        left -= gone
    return bool(left)


def another(document: Document, machine: str, random: Random) -> Document:
    """The arrangement with another machine in one place."""
    other = copy.deepcopy(document)
    machines = other["machines"]
    assert isinstance(machines, dict)
    text = machines[machine]["inline"] = copy.deepcopy(machines[machine]["inline"])
    for _ in range(random.randint(1, 2)):
        state, donor = random.choice(text["states"]), random.choice(text["states"])
        match random.randrange(6):
            case 0:
                state.pop("internal", None)
            case 1:
                state.pop("transitions", None)
            case 2:
                text["initial"] = donor["name"]
            case 3:
                state["internal"] = donor.get("internal", "")
            case 4:
                state["on_entry"] = donor.get("internal", "")
            case 5:
                text["states"].reverse()
    return other


def lines_about(document: Document, running: Arrangement, random: Random) -> dict[str, str]:
    """Three properties, by name."""
    atoms = [f"{m.name}@{state.name}" for m in running.machines for state in m.states if not m.nested]
    whiteboard = document["whiteboard"]
    assert isinstance(whiteboard, dict)
    atoms += [name for name, entry in whiteboard.items() if entry.get("type") == "bool"]
    chosen = random.sample(FORMS, 3)
    found = {}
    for number, form in enumerate(chosen):
        first = random.choice(atoms)
        others = random.sample([atom for atom in (*atoms, "true", "false") if atom != first], 2)
        names = dict(zip("ABC", (first, *others), strict=True))
        found[f"p{number}"] = "".join(f"({names[c]})" if c in names else c for c in form)
    return found


def check_one(document: Document, seed: int, tally: Counter[str]) -> None:
    random = Random(seed)
    running = build_arrangement(document)
    alone = [m.name for m in running.machines if not m.nested and not any(state.runs for state in m.states)]
    if not alone:
        return
    machine = random.choice(alone)
    replaced = None if not random.randrange(8) else machine
    lines = lines_about(document, running, random)
    try:
        text = changed(document, machine, POLICY) if replaced is None else another(document, machine, random)
        following = build_arrangement(text)
        properties = properties_of(*(f"{name}: {formula}" for name, formula in lines.items()))
        code, next_code = code_of(running, properties), code_of(following, properties)
    except DiagnosticError:
        return  # another machine asks for what is gone
    loop = loop_of(code, seed)
    if loop.go(1 + seed % 6) != control.DONE:
        return
    outcome = asked(running, following, replaced, properties, loop)
    before, after = Performed(running, properties), Performed(following, properties)
    states = tuple(table.states[state] for table, state in zip(code.tables, loop.states, strict=True))
    lost = before.violated(states)
    places: dict[bytes, tuple[bytes, tuple[int, ...]]] = {}
    try:
        for configuration, now, within in before.reached([(before.execution.configuration(loop.record), states)])[0]:
            record = before.record(configuration)
            if within is not None or not before.violated(now) <= lost or not before.execution.enabled(record):
                continue
            try:
                root = transferred(code, record, next_code, next_code.layout.first(), replaced)
            except Untransferable:
                continue
            numbers = [table.numbers[state] for table, state in zip(code.tables, now, strict=True)]
            places[update_point(code, record, numbers)] = after.execution.configuration(root), now
        graph, faults = after.reached(places.values())
    except TooLarge:
        tally["too large"] += 1
        return
    alone_running = len(running.processes) == 1
    violated = {name for place in graph for name in after.violated(place[1])} - lost
    if alone_running or not isinstance(outcome, Accepted):  # several processes: a run is not as unfair as a loop may be
        for number, (name, monitor) in enumerate(after.monitors.items()):
            waits = waiting_states(monitor, lines[name])
            if name not in lost and has_loop(graph, {place for place in graph if place[1][number] in waits}):
                violated.add(name)
    if isinstance(outcome, Accepted):
        tally["accepted"] += 1
        assert not faults and not violated, (violated, lines)
        assert places.keys() <= outcome.points if not alone_running else places.keys() == outcome.points
    elif outcome.counterexample is not None and alone_running:
        tally["refused"] += 1
        tally["endless"] += outcome.counterexample.endless
        if outcome.broken is None:
            assert faults
        elif outcome.broken in after.monitors and outcome.broken not in lost:
            assert outcome.broken in violated, (outcome.broken, lines)


@pytest.mark.long
def test_the_answer_is_that_of_the_executor_alone() -> None:
    tally: Counter[str] = Counter()
    count = many(80)
    least = {"accepted": count // 10, "refused": count // 4, "endless": count // 10}
    spread(
        lambda document, seed: check_one(document, seed, tally),
        settings(max_examples=count, deadline=None, suppress_health_check=list(HealthCheck)),
        arrangements(),
        st.integers(1, 1 << 40),
        size=10,
        until=AtLeast(tally, least),
    )
