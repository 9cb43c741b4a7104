"""Numbers of 64 bits, calculated with 128 on the way, against Python's integers."""

from __future__ import annotations

from random import Random

import pytest

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.backends.reference import Interpreter
from llfsm_verify.checking.verdict import Options, Verdict
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.engines.explicit.options import ExplicitOptions
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.program.program import Program
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.verification.verify import verify

KINDS = {"a": ("uint64", 0, 1 << 64), "b": ("uint64", 0, 1 << 64), "c": ("int64", -(1 << 63), 1 << 63)}
"""Variables: type, lowest value, one beyond the highest."""
CORNERS = (0, 1, 2, 3, 7, (1 << 31) - 1, 1 << 32, (1 << 63) - 1, 1 << 63, (1 << 64) - 1, -1, -2, -(1 << 63))


def truncated(a: int, b: int) -> int:
    return abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)


EXPRESSIONS = {
    "a + b": lambda a, b, c: a + b,
    "a - b": lambda a, b, c: a - b,
    "a * b": lambda a, b, c: a * b,
    "a * b / (b / 2 + 1)": lambda a, b, c: a * b // (b // 2 + 1),
    "a * b % 1000000007": lambda a, b, c: a * b % 1000000007,
    "a * c": lambda a, b, c: a * c,
    "a * c / 3": lambda a, b, c: truncated(a * c, 3),
    "a * c % -1000": lambda a, b, c: a * c - -1000 * truncated(a * c, -1000),
    "c * c": lambda a, b, c: c * c,
    "-c": lambda a, b, c: -c,
    "abs(c)": lambda a, b, c: abs(c),
    "c / -1": lambda a, b, c: -c,
    "min(a, c)": lambda a, b, c: min(a, c),
    "max(b, c) - 1": lambda a, b, c: max(b, c) - 1,
    "a < c ? 1 : 0": lambda a, b, c: int(a < c),
    "a * b > c ? a : c": lambda a, b, c: a if a * b > c else c,
    "c >= a * b ? 7 : 8": lambda a, b, c: 7 if c >= a * b else 8,
    "a & b": lambda a, b, c: a & b,
    "~a ^ b": lambda a, b, c: ~a ^ b,
    "c >> 17": lambda a, b, c: c >> 17,
    "c << 17": lambda a, b, c: c << 17,
    "a << 63": lambda a, b, c: a << 63,
    "sqrt(a)": lambda a, b, c: __import__("math").isqrt(a),
    "340282366920938463463374607431768211455 - a * b": lambda a, b, c: (1 << 128) - 1 - a * b,
    "c + -0x7fffffffffffffff0000000000000000": lambda a, b, c: c - ((1 << 127) - (1 << 64)),
    "min(a, 36893488147419103232) % 1000": lambda a, b, c: a % 1000,
    "c * c == 85070591730234615847396907784232501249 ? 1 : 2": lambda a, b, c: 1 if abs(c) == (1 << 63) - 1 else 2,
    "c < -85070591730234615847396907784232501249 ? 1 : 0": lambda a, b, c: 0,
    "340282366920938463463374607431768211455 / (a / 2 + 1)": lambda a, b, c: ((1 << 128) - 1) // (a // 2 + 1),
    "a * 1.5 >= 27670116110564327422.5 ? 3 : 4": lambda a, b, c: 3 if a == (1 << 64) - 1 else 4,
}


def wrapped(value: int, kind: str) -> int:
    _, low, end = KINDS[kind]
    return (value - low) % (end - low) + low


def calculating(text: str, stored: str, **values: int) -> Program:
    """A machine whose ringlet stores the expression in `into`."""
    board = {name: {"type": kind, "init": str(values.get(name, 0))} for name, (kind, _, _) in KINDS.items()}
    board["into"] = {"type": KINDS[stored][0]}
    state = {"name": "S", "on_entry": f"into = {text};", "transitions": [{"to": "S", "when": "true"}]}
    machine = {"machine": "m", "states": [state]}
    document = {"name": "wide", "cycle_ms": 1, "whiteboard": board, "machines": {"m": {"inline": machine}}}
    return lower(build_arrangement({**document, "schedule": ["m"]}), ())


@pytest.mark.parametrize("text", EXPRESSIONS)
def test_what_is_calculated_is_what_python_calculates(text: str) -> None:
    random = Random(text)
    for stored in ("a", "c"):
        program = calculating(text, stored)
        native, interpreter = NativeProgram(program), Interpreter(program)
        layout = native.layout
        start = layout.decode(layout.first())
        for _ in range(60):
            values = {}
            for name, (_, low, end) in KINDS.items():
                corners = [x for x in CORNERS if low <= x < end]
                values[name] = random.choice(corners) if random.random() < 0.6 else random.randrange(low, end)
            wanted = wrapped(EXPRESSIONS[text](**values), stored)
            outputs = layout.initial_outputs()
            record = layout.encode({**start, **values}) + layout.encode_outputs(outputs)
            step = native.step(record, 0, {})
            assert step.status == 0
            assert layout.get(step.record, "into") == wanted, (text, values)
            told = interpreter.step({**start, **values}, outputs, 0, lambda choice: choice.type.low)
            assert told.values["into"] == wanted


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("a * b * a", "a * b * a"),
        ("c + (a * b - 1) * 2", "a * b - 1"),
        ("a * b / c", "a * b / c"),
        ("min(a * b, c)", "min(a * b, c)"),
        ("a == 0 ? c : a * b", "a == 0 ? c : a * b"),
    ],
)
def test_what_may_leave_128_bits_is_an_error(text: str, part: str) -> None:
    with pytest.raises(DiagnosticError) as found:
        calculating(text, "a")
    (diagnostic,) = found.value.diagnostics
    assert diagnostic.code == "E193"
    assert diagnostic.span is not None
    assert diagnostic.span.text == part


def test_an_int_beside_64_bits_ends_the_run_where_these_do_not_fit() -> None:
    board = {"u": {"type": "uint64", "init": str(1 << 63)}, "n": {"type": "int", "init": "-1"}}
    state = {"name": "S", "on_entry": "n = n + u;", "transitions": [{"to": "S", "when": "true"}]}
    machines = {"m": {"inline": {"machine": "m", "states": [state]}}}
    program = lower(
        build_arrangement({"name": "x", "cycle_ms": 1, "whiteboard": board, "machines": machines, "schedule": ["m"]}),
        (),
    )
    native = NativeProgram(program)
    record = native.layout.first()
    assert native.step(record, 0, {}).status == -1
    values = native.layout.decode(record), native.layout.initial_outputs()
    assert Interpreter(program).step(*values, 0, lambda choice: choice.type.low).overflow


@pytest.mark.parametrize("number", [(1 << 128) - 1, 1 << 127, (1 << 64) - 1, -(1 << 127)])
def test_a_number_of_128_bits_beside_an_int_ends_the_run(number: int) -> None:
    """Also one whose lowest 64 bits look like a small number."""
    board = {"n": {"type": "int", "init": "0"}, "big": {"type": "bool", "init": "false"}}
    state = {"name": "S", "on_entry": f"big = (n == 0 ? {number} : n) > 4;"}
    document = {"name": "x", "cycle_ms": 1, "whiteboard": board, "schedule": ["m"]}
    program = lower(
        build_arrangement({**document, "machines": {"m": {"inline": {"machine": "m", "states": [state]}}}}), ()
    )
    native = NativeProgram(program)
    record = native.layout.first()
    assert native.step(record, 0, {}).status == -1
    values = native.layout.decode(record), native.layout.initial_outputs()
    assert Interpreter(program).step(*values, 0, lambda choice: choice.type.low).overflow


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["bmc", "induction", "pdr", "auto"])
@pytest.mark.parametrize("factor", [(1 << 63) - 1, 1 << 63])
def test_a_property_that_leaves_64_bits_at_first_is_unknown(engine: str, factor: int) -> None:
    """Solvers calculate with mathematical integers, and the executor cannot perform what they find."""
    board = {"n": {"type": "int", "init": 5}, "b": {"type": "bool"}}
    state = {"name": "A", "internal": "n = 5;", "stays": True}
    machines = {"m": {"inline": {"machine": "M", "states": [state]}}}
    arrangement = build_arrangement({"name": "o", "whiteboard": board, "machines": machines, "schedule": ["m"]})
    lines = parse_properties([Source("p.ltl", f"p: G n * {factor} < 0\nq: G b\n")])
    found = verify(arrangement, lines, Options(), engine)
    assert {p.verdict for p in found.properties} == {Verdict.UNKNOWN}
    assert "a property leaves 64-bit arithmetic in the initial configuration" in (found.properties[0].reason or "")


WIDE_INPUT = {
    "name": "w",
    "cycle_ms": 10,
    "whiteboard": {
        "x": {"type": "uint64", "role": "input"},
        "y": {"type": "uint64", "init": 0},
        "big": {"type": "bool", "init": False},
    },
    "schedule": ["m"],
}


@pytest.mark.slow
@pytest.mark.parametrize("labels", [True, False], ids=["with labels", "without"])
@pytest.mark.parametrize("engine", ["explicit", "bmc", "induction", "pdr"])
def test_all_values_of_an_input_of_64_bits_count(engine: str, labels: bool) -> None:
    """What stores it has too many steps for `explicit`, which must not stop at the values that have no sign: it has
    violations among the first values, and does not know of the last one."""
    state = {"name": "S", "internal": "y = x; big = x > 1;", "transitions": [{"when": "false", "to": "S"}]}
    document = {**WIDE_INPUT, "machines": {"m": {"inline": {"machine": "M", "states": [state]}}}}
    lines = parse_properties([Source("p.ltl", "p: G y == 0\nq: G !big\nr: G y != 18446744073709551615\n")])
    own = (ExplicitOptions(labels=labels),) if engine == "explicit" else ()
    options = Options(Limits(max_steps=1_000_000), own=own)
    found = verify(build_arrangement(document), lines, options, engine)
    last = Verdict.UNKNOWN if engine == "explicit" else Verdict.VIOLATED
    assert [p.verdict for p in found.properties] == [Verdict.VIOLATED, Verdict.VIOLATED, last]


def test_classes_of_an_input_of_64_bits() -> None:
    state = {"name": "S", "internal": "big = x > 9223372036854775808;", "transitions": [{"when": "false", "to": "S"}]}
    document = {**WIDE_INPUT, "machines": {"m": {"inline": {"machine": "M", "states": [state]}}}}
    text = "p: G !big\nq: G x < 9223372036854775807\nr: G (m.read(x) && x > 9223372036854775808 -> big)\n"
    found = verify(build_arrangement(document), parse_properties([Source("p.ltl", text)]), Options(), "explicit")
    assert [p.verdict for p in found.properties] == [Verdict.VIOLATED, Verdict.VIOLATED, Verdict.HOLDS]
