"""Random arrangements: what comes out in steps, by probes, against what the interpreter does on the plain program."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from unittest.mock import patch

import pytest
from hypothesis import HealthCheck, Phase, given, settings

from llfsm_verify.analysis.lint.local import ShortRuns, Situation, decide_locally
from llfsm_verify.analysis.lint.reach import Reach
from llfsm_verify.analysis.lint.run import lint
from llfsm_verify.analysis.lint.starvation import stuck
from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.reference import Interpreter
from llfsm_verify.backends.reference import Outcome as Step
from llfsm_verify.language.typed import Expression, Literal
from llfsm_verify.language.types import Value
from llfsm_verify.limits import Budget, Limits
from llfsm_verify.program.program import Choice, Program
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.semantics.probes import DEAD, Outcome, Probe
from llfsm_verify.testing.arrangements import Document, arrangements
from llfsm_verify.transforms.probing import Probed, probed
from tests.oracle import evaluation
from tests.oracle.direct import Direct
from tests.oracle.evaluation import Locals, World
from tests.quick import examples

MOST = 250
"""Configurations, and ways to go on from one, of the arrangements that are searched."""

SHORT = 4
"""Steps of the runs that a solver looks for."""

Values = tuple[tuple[str, object], ...]


class Brute:
    """All reachable configurations of the plain program, by the interpreter, with what happens in their steps."""

    def __init__(self, arrangement: Arrangement) -> None:
        self.arrangement = replace(arrangement, observe="ringlet")
        self.program = lower(self.arrangement)
        interpreter = Interpreter(self.program)
        outputs = {v.name: v.init for v in self.program.vars if v.output}
        values = {v.name: v.init for v in self.program.vars if not v.output}
        self.outcomes: set[Outcome] = set()
        self.complete = not any(v.free for v in self.program.vars)
        self.edges: dict[Values, set[Values]] = {}
        todo = [values]
        while todo and self.complete:
            before = todo.pop()
            key = tuple(before.items())
            if key in self.edges:
                continue
            self.edges[key] = set()
            for number, (process, step) in enumerate(interpreter.successors(before, outputs)):
                if number >= MOST or len(self.edges) > MOST or step.overflow:
                    self.complete = False
                    return
                self._note(before, process, step)
                if step.fault is None:
                    self.edges[key].add(tuple(step.values.items()))
                    todo.append(step.values)
                else:
                    self.edges[key].add(())

    def _note(self, before: Mapping[str, object], process: int | None, step: Step) -> None:
        for kind, machine, args in step.events:
            if machine >= len(self.arrangement.machines):
                continue  # the model of the surroundings has no turns
            if kind == "faulted":
                name = self.program.machines[machine].name
                site = self.program.faults[args[0]]
                self.outcomes.add(Outcome(Probe("fault", name, site.span, number=args[0]), 1))
            if kind in ("guard", "internal", "entry", "exit"):
                self.outcomes.add(self._outcome("spent", machine, args[0], -1, 1))
            if kind == "guard":
                self.outcomes.add(self._outcome("guard", machine, args[0], args[1], args[2]))
                if args[2]:
                    self.outcomes.add(self._outcome("fired", machine, args[0], args[1], 1))
        if step.fault is not None:
            assert process is not None
            acting = self.program.processes[process]
            turn = before[acting.turn]
            assert isinstance(turn, int)
            name = self.program.machines[self.program.slots[acting.slots[turn]].machine].name
            probe = Probe("fault", name, self.program.faults[step.fault].span, number=step.fault)
            self.outcomes.add(Outcome(probe, 1))

    def _outcome(self, kind: str, number: int, state: int, transition: int, value: int) -> Outcome:
        machine = self.arrangement.machines[number]
        if state == len(machine.states):
            span = machine.span
        else:
            place = machine.states[state]
            span = place.span if transition < 0 else place.transitions[transition].span
        assert kind in ("spent", "fired", "guard")
        return Outcome(Probe(kind, machine.name, span, state, transition), value)  # type: ignore[arg-type]


class Conditions:
    """What conditions are in all runs, by the oracle that knows no step programs."""

    def __init__(self, arrangement: Arrangement, program: Probed) -> None:
        wanted = {(o.probe.machine, o.probe.span) for o in program.outputs if o.probe.kind == "condition"}
        self.found: set[Outcome] = set()
        self.complete = False
        usual = evaluation.evaluate

        def evaluate(e: Expression, world: World, locals_: Locals) -> Value:
            value = usual(e, world, locals_)
            machine = getattr(world, "me", "")
            if isinstance(value, bool) and (machine, e.span) in wanted:
                self.found.add(Outcome(Probe("condition", machine, e.span), int(value)))
            return value

        direct = Direct(replace(arrangement, observe="ringlet"))
        with patch.object(evaluation, "evaluate", evaluate):
            todo = direct.initial()
            seen = set(todo)
            while todo:
                for _, _, step in direct.successors(todo.pop()):
                    if step.wide or len(seen) > MOST:
                        return
                    if step.after is not None and step.after not in seen:
                        seen.add(step.after)
                        todo.append(step.after)
        self.complete = True


COMPARED = ("spent", "fired", "guard", "fault")


def reached(program: Probed, reach: Reach) -> set[Outcome]:
    shown = {o for o in program.outputs if reach.has(o) and o.probe.kind in COMPARED}
    return {o for o in shown if o.probe.kind != "fault" or o.value}


def without_faulting(outcomes: set[Outcome]) -> set[Outcome]:
    """A step that faults before its first event tells the interpreter's observer nothing of its state."""
    faulting = {o.probe.machine for o in outcomes if o.probe.kind == "fault"}
    return {o for o in outcomes if o.probe.kind != "spent" or o.probe.machine not in faulting}


def agrees(document: Document) -> None:
    arrangement = build_arrangement(document)
    brute = Brute(arrangement)
    wide = probed(arrangement, wide=True)
    locally = decide_locally(arrangement, wide, Budget(Limits()))
    witnesses_do_what_they_say(wide, locally.possible)
    if not brute.complete:
        return
    conditions = Conditions(arrangement, wide)
    for program in (wide, probed(arrangement, wide=False)):
        reach = Reach(program, Budget(Limits()))
        try:
            if not reach.complete:
                continue  # guards alone left 64 bits, or were too many
            found = reached(program, reach)
            assert without_faulting(found) == without_faulting(brute.outcomes)
            assert not found & locally.impossible
            compare_stuck(brute, reach)
            if program is wide:
                compare_short_runs(wide, reach)
            if conditions.complete:
                shown = {o for o in program.outputs if o.probe.kind == "condition" and reach.has(o)}
                assert shown == conditions.found
        finally:
            reach.close()
    compare_findings(arrangement, brute)


def witnesses_do_what_they_say(program: Probed, possible: Mapping[Outcome, Situation]) -> None:
    """The configurations that Z3 gives have the outcomes, by the interpreter."""
    interpreter = Interpreter(program.program)
    outputs = {v.name: v.init for v in program.program.vars if v.output}
    owner = {program.program.machines[s.machine].name: s for s in program.program.slots}
    for outcome, situation in possible.items():
        slot = owner[outcome.probe.machine]
        process = program.program.processes[slot.process]
        values = dict(situation.values) | {process.turn: process.slots.index(program.program.slots.index(slot))}

        def choose(choice: Choice, samples: Mapping[str, int] = situation.samples) -> int:
            return samples.get(choice.name, choice.type.low)

        step = interpreter.step(values, outputs, slot.process, choose)
        assert step.overflow or step.outputs[program.outputs[outcome]] == 1, outcome


def compare_short_runs(program: Probed, reach: Reach) -> None:
    """A solver finds the outcomes of short runs, and no others; its runs are as short as those of the exploration."""
    short = ShortRuns(program, program.outputs, Budget(Limits()), depth=SHORT)
    for outcome in program.outputs:
        length = len(reach.run_to(outcome).ringlets) if reach.has(outcome) else SHORT + 1
        assert short.has(outcome) == (length <= SHORT)
        if short.has(outcome):
            assert len(short.run_to(outcome).ringlets) == length


def compare_stuck(brute: Brute, reach: Reach) -> None:
    """EF AG by repeated passes over a dictionary."""
    expected = set()
    program: Program = brute.program
    for machine in brute.arrangement.machines:
        name = f"{machine.name}.$state"
        state = {key: dict(key).get(name) for key in brute.edges}
        can = {key for key, after in brute.edges.items() if any(not a or dict(a)[name] != state[key] for a in after)}
        while True:
            more = {key for key, after in brute.edges.items() if key not in can and after & can}
            if not more:
                break
            can |= more
        process = next(
            p
            for p in program.processes
            if any(program.machines[program.slots[s].machine].name == machine.name for s in p.slots)
        )
        for key in brute.edges:
            values = dict(key)
            gone = values.get(f"{machine.name}.$finished") or (process.ended is not None and values[process.ended])
            gone = gone or not values.get(f"{machine.name}.$loaded", 1)
            number = values[name]
            assert isinstance(number, int)
            leads = machine.states[number].transitions if number < len(machine.states) else ()
            meant = any(t.target != number and not (isinstance(t.guard, Literal) and not t.guard.value) for t in leads)
            if key not in can and not gone and meant:
                expected.add((machine.name, number))
    found = list(stuck(brute.arrangement, reach))
    suspended = {(f.machine, f.state) for f in found if f.suspended}
    assert {(f.machine, f.state) for f in found} - suspended == expected - suspended


def compare_findings(arrangement: Arrangement, brute: Brute) -> None:
    """Lint reports what never happens, and only that; every fault that happens, and only those."""
    result = lint(arrangement)
    if not result.complete:
        return
    assert not result.open
    said = {(f.code, f.span.start, m) for f in result.findings for m in f.machines}
    faulting = {o.probe.machine for o in brute.outcomes if o.probe.kind == "fault"}
    for machine in arrangement.machines:
        if ("L002", machine.span.start, machine.name) in said:
            assert not machine.loaded
            spent = {o.probe.machine for o in brute.outcomes if o.probe.kind == "spent" and o.value}
            assert machine.name not in spent
            continue
        for number, state in enumerate(machine.states):
            entered = Outcome(Probe("spent", machine.name, state.span, number), 1) in brute.outcomes
            if machine.name not in faulting:
                assert (("L002", state.span.start, machine.name) in said) == (not entered)
            for i, t in enumerate(state.transitions):
                fires = Outcome(Probe("fired", machine.name, t.span, number, i), 1) in brute.outcomes
                meant = isinstance(t.guard, Literal) and not t.guard.value
                dead = ("L001", t.span.start, machine.name) in said
                assert not (dead and fires)
                if entered and not meant:
                    assert dead == (not fires)
    runs = {o.probe.span for o in brute.outcomes if o.probe.kind == "fault" and o.probe.span is not None}
    assert {f.span for f in result.findings if f.code in ("L006", "L007", "L008", "L009")} == runs
    for finding in result.findings:
        assert finding.proof != "ranges"
        assert finding.proof != "run" or (finding.witness is not None and finding.witness.trace is not None)


def run(count: int) -> None:
    quiet = [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.large_base_example]
    phases = (Phase.explicit, Phase.reuse, Phase.generate, Phase.shrink)

    @settings(max_examples=count, deadline=None, suppress_health_check=quiet, phases=phases)
    @given(arrangements(max_machines=2, max_states=3))
    def checked(document: Document) -> None:
        agrees(document)

    checked()


@pytest.mark.slow
def test_outcomes_are_those_of_the_interpreter() -> None:
    run(examples(4))


@pytest.mark.long
def test_outcomes_of_many_arrangements() -> None:
    run(40)


def test_a_fault_ends_what_is_probed() -> None:
    """After a step that would fault nothing happens any more, and what came before it in the step is shown."""
    arrangement = build_arrangement(
        {
            "whiteboard": {"n": {"type": "0..2"}},
            "machines": {
                "m": {
                    "inline": {
                        "machine": "M",
                        "states": [
                            {
                                "name": "A",
                                "internal": "if (n > 0) n += 1; n += 1;",
                                "transitions": [{"when": "n > 5", "to": "A"}],
                            }
                        ],
                    }
                }
            },
            "schedule": ["m"],
        }
    )
    program = probed(arrangement, wide=False)
    assert program.has_faults
    reach = Reach(program, Budget(Limits()))
    checks = {(o.probe.number, o.value) for o in program.outputs if o.probe.kind == "fault" and reach.has(o)}
    reach.close()
    assert checks == {(0, 0), (1, 0), (1, 1)}  # 0: from 0 to 1; 1, then 2 + 1 in the second store
    assert any(v.name == DEAD for v in program.program.vars)
