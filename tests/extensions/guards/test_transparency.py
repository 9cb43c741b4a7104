"""What a guard changes before its alarm: nothing, or the difference is performed."""

from __future__ import annotations

import random
from collections import Counter
from dataclasses import replace

import pytest
from hypothesis import reject, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.extensions.guards.reactions import KINDS
from llfsm_verify.extensions.guards.transparency import Different, Transparent, Unproved, transparency
from llfsm_verify.language.types import scalar_text
from llfsm_verify.limits import Budget, Limits
from llfsm_verify.semantics.lowering import lower
from tests.extensions.guards.helpers import draft_of, guarded
from tests.extensions.guards.test_random_guards import NOT_GUARDABLE, SLOW, drawn
from tests.quick import each, many, spread

LIMITER = """\
name: limiter
cycle_ms: 100
whiteboard:
  pedal: {type: 0..9, role: input}
  speed: {type: 0..9, role: output}
  level: {type: 0..9, init: 3, role: output}
machines:
  driver: {inline: {machine: Driver, states: [{name: DRIVES, internal: "speed = pedal;", stays: true}]}}
  keeper:
    inline:
      machine: Keeper
      states:
        - {name: LOW, internal: "if (speed > 4) level++;", transitions: [{when: level > 6, to: HIGH}]}
        - {name: HIGH, on_entry: level = speed;, transitions: [{when: after_ms(300), to: LOW}]}
schedule: [driver, keeper]
"""
LIMITS = Limits(max_states=3_000, max_steps=100_000)


def asked(original, made, limits=LIMITS):
    return transparency(original, made.arrangement, made.names, Budget(limits))


def test_a_guard_changes_nothing_before_its_alarm():
    made, _ = guarded(LIMITER, ["slow: G speed < 6"], {"speed": "min(speed, 5)"})
    assert isinstance(asked(made.original, made), Transparent)
    twice, _ = guarded(LIMITER, ["slow: G speed < 6", "few: G level < 8"], {"speed": "5", "level": "0"})
    assert isinstance(asked(twice.original, twice), Transparent)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new", "differs"),
    [
        ("level++;", "level--;", {"level"}),
        ("speed = pedal;", "speed = max(pedal, 1);", {"speed"}),
        ("init: 3", "init: 4", {"level"}),
    ],
)
def test_what_another_arrangement_does_is_performed(old, new, differs):
    made, _ = guarded(LIMITER, ["slow: G speed < 6"], {"speed": "min(speed, 5)"})
    assert old in LIMITER
    answer = asked(resolve(draft_of(LIMITER.replace(old, new))), made)
    assert isinstance(answer, Different)
    assert {name for name, _, _ in answer.found} >= differs
    assert answer.steps


def test_what_is_not_alike_is_not_proved():
    made, _ = guarded(LIMITER, ["slow: G speed < 6"], {"speed": "min(speed, 5)"})
    other = resolve(draft_of(LIMITER.replace("pedal: {type: 0..9", "pedal: {type: 0..12")))
    assert asked(other, made) == Unproved("`pedal` does not have the same values")


@pytest.mark.slow
def test_operators_and_models_write_the_same_to_both():
    """What they choose has the name of the slot in one of them."""
    text = LIMITER.replace('speed = pedal;", stays: true}]}}', 'speed = choose(0..9);", stays: true}]}, model: true}')
    text += "operators: {write: [speed]}\n"
    made, _ = guarded(text, ["slow: G speed < 6"], {"speed": "min(speed, 5)"})
    assert isinstance(asked(made.original, made), Transparent)
    other = resolve(draft_of(text.replace("level++", "level--")))
    assert isinstance(asked(other, made), Different)


TALLY = Counter()


def together(original, made, alarm, seed):
    """Whether a random run of both, with the same samples, is the same until the alarm."""
    before, after = (
        NativeProgram(lower(replace(a, observe="cycle"), (), keep_all_bits=True)) for a in (original, made)
    )
    ranges = {c.name: (c.type.low, c.type.high) for n in (before, after) for c in n.program.choices}
    names = [info.name for info in before.program.machines]
    compared = [
        v.name for v in before.program.vars
        if not v.output and (v.origin.kind in ("whiteboard", "machine") or v.name.endswith(".$state"))
    ]  # fmt: skip
    one, two, draw = before.layout.first(), after.layout.first(), random.Random(seed)
    values = after.layout.decode(two)
    free = {v.name: values[v.name] for v in before.program.vars if v.free}
    one = before.layout.encode_record({**before.layout.decode_record(one), **free})
    ran, cycle = after.layout.reader(after.program.ran), after.layout.reader(after.program.cycle)
    for _ in range(400):
        given = {name: draw.randint(*bounds) for name, bounds in ranges.items()}
        result = after.step(two, 0, {n: v for n, v in given.items() if n in {c.name for c in after.program.choices}})
        if result.status:
            return True
        two = result.record
        machine = after.program.machines[after.program.slots[ran(two) - 1].machine].name
        if machine in names and before.enabled(one):
            taken = before.step(
                one, 0, {n: v for n, v in given.items() if n in {c.name for c in before.program.choices}}
            )
            if taken.status:
                return True
            one = taken.record
        if cycle(two):
            old, new = before.layout.decode(one), after.layout.decode(two)
            if new[alarm]:
                TALLY["alarm"] += 1
                return True
            if any(old[name] != new[name] for name in compared):
                return False
    return True


def changes_nothing(data, seed):
    text, output = drawn(data)
    original = resolve(draft_of(text))
    start = scalar_text(output.init, output.type)
    machine = data.draw(st.sampled_from(original.machines)).name
    reactions = data.draw(st.sampled_from([[], *([f"{kind} {machine}"] for kind in KINDS)]))
    try:
        made, _ = guarded(text, [f"p: G {output.name} == {start}"], {output.name: start}, reactions=reactions)
    except DiagnosticError as error:
        if {d.code for d in error.diagnostics} <= NOT_GUARDABLE:
            reject()
        raise
    answer = asked(original, made)
    TALLY[type(answer).__name__] += 1
    TALLY["with reactions"] += bool(reactions) and isinstance(answer, Transparent)
    same = together(original, made.arrangement, made.names.alarm, seed)
    assert same or not isinstance(answer, Transparent)
    TALLY["same"] += same


@pytest.mark.long
def test_no_random_run_of_a_transparent_guard_differs_before_its_alarm():
    TALLY.clear()
    amount = settings(max_examples=many(200), suppress_health_check=SLOW)
    spread(
        changes_nothing,
        amount,
        st.data(),
        st.integers(1, 1000),
        until=each(TALLY, ["Transparent", "with reactions", "alarm"]),
    )


@pytest.mark.slow
def test_an_input_with_many_values_that_both_read_is_taken_value_by_value():
    wide = LIMITER.replace("pedal: {type: 0..9", "pedal: {type: 0..999").replace(
        "speed = pedal;", "speed = pedal % 10;"
    )
    made, _ = guarded(wide, ["slow: G speed < 6"], {"speed": "min(speed, 5)"})
    limits = Limits(max_states=3_000, max_steps=3_000_000)
    assert isinstance(asked(made.original, made, limits), Transparent)
