"""Tables: each number at its place, a fault beside it, in properties, and in Python."""

from __future__ import annotations

from fractions import Fraction
from random import Random

import pytest

import llfsm_verify as lv
from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.backends.reference import Interpreter
from llfsm_verify.semantics.lowering import lower


def looking_up(values: list[str], stored: object) -> dict[str, object]:
    """An arrangement that stores entry `i` of the table `t` in `x` and goes on to the next place."""
    state = {"name": "S", "internal": "x = t[i]; i = i + 1;", "stays": "true"}
    return {
        "name": "tables", "cycle_ms": 1, "tables": {"t": values},
        "whiteboard": {"x": {"type": stored}, "i": {"type": "0..2000"}},
        "machines": {"m": {"inline": {"machine": "m", "states": [state]}}}, "schedule": ["m"],
    }  # fmt: skip


@pytest.mark.parametrize("size", [1, 2, 3, 7, 100, 1024])
@pytest.mark.parametrize("digits", [0, 3])
def test_each_number_is_at_its_place_and_none_beside_it(size: int, digits: int) -> None:
    random = Random(size)
    values = [random.randint(-5000, 5000) for _ in range(size)]
    texts = [f"{Fraction(v, 10**digits).__float__():.{digits}f}" for v in values]
    stored = "int16" if digits == 0 else {"decimal": "0.001", "range": "-5.0..5.0"}
    program = lower(build_arrangement(looking_up(texts, stored)), ())
    native, interpreter = NativeProgram(program), Interpreter(program)
    record, layout = native.layout.first(), native.layout
    for wanted in values:
        told = interpreter.step(layout.decode(record), layout.initial_outputs(), 0, lambda c: c.type.low)
        record = native.step(record, 0, {}).record
        assert layout.get(record, "x") == told.values["x"] == wanted
    step = native.step(record, 0, {})
    site = program.faults[step.status - 1]
    assert (site.code, site.message) == ("F003", f"index outside the table `t`: i is not in 0..{size - 1}")
    assert interpreter.step(layout.decode(record), layout.initial_outputs(), 0, lambda c: c.type.low).fault is not None


def test_properties_and_python_see_tables() -> None:
    states = {"S": lv.StateDefinition(internal="x = curve[n]; n = (n + 1) % 3;", stays=True)}
    model = lv.build(
        "curves", {"m": lv.MachineDefinition("M", states)}, cycle_ms=10, tables={"curve": ["0.0", "0.5", 1]},
        whiteboard={"x": {"type": {"decimal": "0.1", "range": "0.0..1.0"}}, "n": {"type": "0..2"}},
    )  # fmt: skip
    found = model.check("a: G (x == curve[0] || x >= curve[1])\nb: G x <= curve[1]")
    assert [found[name].verdict for name in "ab"] == ["holds", "violated"]
