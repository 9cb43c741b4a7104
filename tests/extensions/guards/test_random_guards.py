"""Random arrangements with guards: no run of what is proved leaves the property, and renaming keeps what texts mean."""

from __future__ import annotations

from collections import Counter
from contextlib import suppress
from dataclasses import fields, is_dataclass

import pytest
from hypothesis import HealthCheck, reject, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.backends.broken import BrokenProgramError
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.verdict import Verdict
from llfsm_verify.diagnostics import DiagnosticError, Span
from llfsm_verify.language.typed import Choose, Command, Read
from llfsm_verify.language.types import ArrayType, BoolType, RecordType, scalar_text
from llfsm_verify.limits import Limits
from llfsm_verify.monitoring.properties import monitor_properties
from llfsm_verify.monitoring.states import MonitorVerdict
from llfsm_verify.runtime.stepping.monitored import MonitoredSimulation
from llfsm_verify.runtime.stepping.simulation import SimulationFault, SimulationOverflow
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.testing.arrangements import arrangements
from tests.extensions.guards.helpers import draft_of, guarded, proved, text_of
from tests.quick import each, examples, many, spread

NOT_GUARDABLE = {"E438", "E085"}
SLOW = [HealthCheck.too_slow, HealthCheck.filter_too_much]


def routable(arrangement):
    """The outputs that machines write and a switch can route."""
    written = {name for machine in arrangement.machines for name, _ in machine.writes()}
    return [
        w.variable
        for w in arrangement.whiteboard
        if w.role == "output" and w.variable.name in written and not isinstance(w.variable.type, ArrayType | RecordType)
    ]


def drawn(data):
    """A random arrangement as a text, with one of its outputs."""
    document = data.draw(arrangements())
    text = text_of({**document, "name": "random", **({"observe": "cycle"} if "schedule" in document else {})})
    outputs = routable(resolve(draft_of(text)))
    if not outputs:
        reject()
    return text, data.draw(st.sampled_from(outputs))


def condition(data, arrangement):
    """Of an input: when the output must be as it was in the beginning."""
    inputs = [w.variable for w in arrangement.whiteboard if w.role == "input" and isinstance(w.variable.type, BoolType)]
    return data.draw(st.sampled_from(["true", *(variable.name for variable in inputs)]))


def violated(arrangement, lines, seed):
    """Whether a random run violates one of the properties."""
    program = lower(arrangement, bind(arrangement, lines).atoms)
    monitors = {line.name: monitor_properties(line).monitor for line in lines.goals}
    run = MonitoredSimulation(program, monitors, seed)
    with suppress(SimulationFault, SimulationOverflow):  # a run that ends is a run
        run.run(300)
    return any(monitors[name].verdicts[state] is MonitorVerdict.FALSE for name, state in run.monitor_states.items())


TALLY = Counter()


def no_run_leaves_it(data, seed):
    text, output = drawn(data)
    before = resolve(draft_of(text))
    start = scalar_text(output.init, output.type)
    properties = [f"p: G ({condition(data, before)} -> {output.name} == {start})"]
    try:
        made, lines = guarded(text, properties, {output.name: start})
    except DiagnosticError as error:
        if {d.code for d in error.diagnostics} <= NOT_GUARDABLE:
            reject()
        raise
    proof = proved(made, lines, "explicit", Limits(3_000, max_steps=100_000))
    if proof.result is None or proof.result.properties[0].verdict is Verdict.UNKNOWN:
        TALLY["unknown"] += 1
    else:
        assert proof.result.properties[0].verdict is Verdict.HOLDS
        TALLY["proved"] += 1
    try:
        assert not violated(made.arrangement, lines, seed)
        TALLY["unguarded"] += violated(before, lines, seed)
    except BrokenProgramError:
        reject()


@pytest.mark.long
def test_no_random_run_of_a_guarded_arrangement_leaves_the_property():
    """The executor runs what was written, with the machines themselves; without the guard some runs leave it."""
    TALLY.clear()
    amount = settings(max_examples=many(200), suppress_health_check=SLOW)
    spread(no_run_leaves_it, amount, st.data(), st.integers(1, 1000), until=each(TALLY, ["proved", "unguarded"]))


def same(left, right, requests, machines):
    """Whether two typed trees differ only in places, in the names of routed outputs, and in commands to others than
    `machines`, which `suspend_all()` gives to monitors and switch, too."""
    if isinstance(left, Span):
        return isinstance(right, Span)
    if isinstance(left, Read) and left.variable.scope == "whiteboard":
        name = requests.get(left.variable.name, left.variable.name)
        return (
            isinstance(right, Read) and right.variable.name == name and same(left.path, right.path, requests, machines)
        )
    if isinstance(left, tuple):
        right = tuple(each for each in right if not isinstance(each, Command) or each.machine in machines)
        return len(left) == len(right) and all(same(x, y, requests, machines) for x, y in zip(left, right, strict=True))
    if is_dataclass(left):
        words = ("text", "variable", *(("target",) if isinstance(left, Choose) else ()))
        parts = [f.name for f in fields(left) if f.name not in words]
        return type(left) is type(right) and all(
            same(getattr(left, p), getattr(right, p), requests, machines) for p in parts
        )
    return left == right


def renamed(data):
    text, output = drawn(data)
    before = resolve(draft_of(text))
    start = scalar_text(output.init, output.type)
    try:
        made, _ = guarded(text, [f"p: G {output.name} == {start}"], {output.name: start})
    except DiagnosticError as error:
        if {d.code for d in error.diagnostics} <= NOT_GUARDABLE:
            reject()
        raise
    names = {machine.name for machine in before.machines}
    for machine in before.machines:
        assert same(machine.states, made.arrangement.machine(machine.name).states, made.names.requests, names)


@pytest.mark.slow
def test_texts_mean_the_same_with_the_slot_for_the_output():
    """The types tell: no name was found by its characters."""
    spread(renamed, settings(max_examples=examples(8), suppress_health_check=SLOW), st.data())
