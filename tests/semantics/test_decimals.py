"""Decimals by hand, and every rule against Python's fractions on random numbers."""

from __future__ import annotations

import re
from decimal import Decimal
from fractions import Fraction
from functools import cache
from math import ceil, floor, isqrt, trunc
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import llfsm_verify as lv
from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.runtime.stepping.simulation import Simulation
from llfsm_verify.semantics.lowering import lower
from tests.quick import examples

RULES: dict[str, tuple[str, Any]] = {
    "sum": ("x + y", lambda x, y: x + y),
    "difference": ("x - y + 1", lambda x, y: x - y + 1),
    "product": ("x * y * -0.5", lambda x, y: x * y / -2),
    "quotient": ("y != 0 ? x / y : 0", lambda x, y: Fraction(trunc(x / y * 100), 100) if y else 0),
    "coarse": ("x != 0 ? y / x : 0", lambda x, y: Fraction(trunc(y / x * 10), 10) if x else 0),
    "fine": ("y != 0 ? x * 1.00 / y : 0", lambda x, y: Fraction(trunc(x / y * 10000), 10000) if y else 0),
    "whole": ("y != 0 ? 7 / y : 0", lambda _, y: trunc(7 / y) if y else 0),
    "third": ("x / 3", lambda x, _: Fraction(trunc(x / 3 * 100), 100)),
    "least": ("min(x, y)", min),
    "most": ("max(x, y)", max),
    "size": ("abs(x) - -y", lambda x, y: abs(x) + y),
    "choice": ("x < y ? x : y - 1", lambda x, y: x if x < y else y - 1),
    "down": ("floor(x)", lambda x, _: floor(x)),
    "up": ("ceil(x)", lambda x, _: ceil(x)),
    "near": ("round(x)", lambda x, _: floor(abs(x) + Fraction(1, 2)) * (1 if x >= 0 else -1)),
    "nearer": ("round(y * 1.5)", lambda _, y: floor(abs(y * 3 / 2) + Fraction(1, 2)) * (1 if y >= 0 else -1)),
    "root": ("sqrt(abs(x))", lambda x, _: Fraction(isqrt(int(abs(x) * 10000)), 100)),
    "roots": ("sqrt(abs(y) * 1.000)", lambda _, y: Fraction(isqrt(int(abs(y) * 100000000)), 10000)),
}
"""An expression of x, with two digits, and y, with one, and what it is."""
WIDE = {"decimal": "0.1", "range": "-999.0..999.0"}
TENTHS = {"type": {"decimal": "0.1", "range": "-1.0..1.0"}}


@cache
def calculator() -> Simulation:
    """All rules in one ringlet: the results with four digits, and stored with one."""
    actions = "".join(f"{name} = {text}; {name}_1 = {text};\n" for name, (text, _) in RULES.items())
    board: dict[str, object] = {
        "x": {"type": {"decimal": "0.01", "range": "-9.0..9.0"}, "role": "input"},
        "y": {"type": {"decimal": "0.1", "range": "-4.0..4.0"}, "role": "input"},
    }
    for name in RULES:
        board[name] = {"type": {"decimal": "0.0001", "range": "-9999.0..9999.0"}}
        board[f"{name}_1"] = {"type": WIDE}
    machine = {"inline": {"machine": "M", "states": [{"name": "S", "internal": actions, "stays": "true"}]}}
    return Simulation(lower(build_arrangement({"whiteboard": board, "machines": {"m": machine}, "schedule": ["m"]})))


@pytest.mark.slow
@settings(max_examples=examples(300), deadline=None)
@given(st.integers(-900, 900), st.integers(-40, 40))
def test_every_rule_against_fractions(hundredths: int, tenths: int) -> None:
    x, y = Fraction(hundredths, 100), Fraction(tenths, 10)
    run = calculator().anew()
    run.ringlet({"x": Decimal(hundredths) / 100, "y": Decimal(tenths) / 10})
    for name, (text, rule) in RULES.items():
        exact = Fraction(rule(x, y))
        assert Fraction(run.values[name]) == Fraction(trunc(exact * 10000), 10000), (text, x, y)  # type: ignore[arg-type]
        assert Fraction(run.values[f"{name}_1"]) == Fraction(trunc(exact * 10), 10), (text, x, y)  # type: ignore[arg-type]


TEXT = """
types:
  Share: {decimal: 0.01, range: -1.0..1.0}
whiteboard:
  want: {type: {decimal: 0.1, range: -0.1..0.1}, role: input}
  third: {type: Share, init: 0.25}
  steps: {type: {array: Share, size: 2}, init: [0.1, -0.1]}
machines:
  m:
    inline:
      machine: M
      variables: {own: {type: Share}}
      parameters: {gain: {constant: Share}}
      states:
        - name: A
          internal: |
            third = -1.00 / 3;
            own = want * gain;
            steps[1] += own;
          transitions: [{when: "steps[1] < -0.4 || steps[1] > 0.3", to: B}]
        - {name: B, on_entry: "steps[1] = -0.1;", transitions: [{when: "true", to: A}]}
    parameters: {gain: 0.5}
schedule: [m]
"""
PROPERTIES = """
third: G (third == 0.25 || third == -0.33)
never: G third > -0.33
range: G (steps[1] >= -0.45 && steps[1] <= 0.35)
own:   G (m.own >= -0.05 && m.own * 2 <= 0.100)
half:  G (third * third < 0.2 && floor(third) <= 0)
"""


@pytest.fixture(scope="module")
def model(tmp_path_factory: pytest.TempPathFactory) -> lv.Model:
    path = tmp_path_factory.mktemp("decimals") / "a.yaml"
    path.write_text(TEXT)
    return lv.load(path)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["explicit", "auto", "bmc"])
def test_every_engine_has_the_same_numbers(engine: str, model: lv.Model) -> None:
    result = model.check(PROPERTIES, engine=engine, **({"depth": 6} if engine == "bmc" else {}))
    assert result["never"].verdict == "violated"
    trace = result["never"].trace
    assert trace is not None
    assert trace.values(-1)["third"] == Decimal("-0.33") and trace.values(0)["third"] == Decimal("0.25")
    if engine != "bmc":
        assert [result[name].verdict for name in ("third", "range", "own", "half")] == ["holds"] * 4


def test_a_trace_has_decimals_everywhere_and_replays(model: lv.Model, tmp_path: Path) -> None:
    trace = model.check("low: G steps[1] >= -0.1")["low"].trace
    assert trace is not None
    assert trace.inputs(1) == {"want": Decimal("-0.1")}
    assert trace.values(1)["steps[1]"] == Decimal("-0.15")
    assert "want = -0.1" in trace.table() and "-0.10 → -0.15" in trace.table()
    (sampled,) = trace.to_dict()["steps"][0]["sampled"]  # type: ignore[index,call-overload]
    assert sampled["value"] == -0.1 and sampled["text"] == "-0.1"  # type: ignore[index,call-overload]
    path = tmp_path / "low.trace"
    trace.save(path)
    assert lv.replay(path, model).happens


def test_the_place_of_a_decimal_that_leaves_its_range() -> None:
    document = arrangement("x = x + 0.75;", x=TENTHS)
    result = lv.build("d", **document).check("a: G true")
    (finding,) = result.faults
    assert "value outside its range: x is declared -1.0..1.0" in str(finding)


def test_the_root_of_a_negative_number_is_a_fault() -> None:
    result = lv.build("d", **arrangement("x = sqrt(x - 0.5);", x=TENTHS)).check("a: G true")
    (finding,) = result.faults
    assert finding.code == "F004"
    assert "square root of a negative number: x - 0.5 is below 0" in str(finding)


def test_a_store_truncates_towards_zero() -> None:
    document = arrangement("x = x * 0.9; y += 0.19; y -= 0.27;", x={**TENTHS, "init": "-0.5"}, y=TENTHS)
    run = lv.build("d", **document).simulate(steps=1, seed=1)
    assert run.values(1)["x"] == Decimal("-0.4") and run.values(1)["y"] == Decimal("-0.1")


@pytest.mark.parametrize("value", [Decimal("0.00000050"), 5e-7, "0.0000005", Decimal("5E-7")])
def test_decimals_from_python(value: object) -> None:
    """A float means what it is printed as; numbers are written without an exponent."""
    kind = {"decimal": 1e-7, "range": "0.0..1.0"}
    model = lv.build("d", **arrangement("x = y;", x={"type": kind, "init": value}, y={"type": kind, "role": "input"}))
    run = model.simulate(steps=1, inputs={"y": value})  # type: ignore[dict-item]
    assert run.values(0)["x"] == run.inputs(1)["y"] == Decimal("0.0000005")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("0.50", Decimal("0.5")),
        ("-0.10000", Decimal("-0.1")),
        ("1.", None),
        (".5", None),
        ("0.05", None),
        ("1.10", None),
    ],
)
def test_values_as_texts(text: str, value: Decimal | None) -> None:
    """Zeros at the end change nothing, as in the language; a point has digits on both sides."""
    model = lv.build("d", **arrangement("x = y;", x=TENTHS, y={**TENTHS, "role": "input"}))
    if value is not None:
        assert model.simulate(steps=1, inputs={"y": text}).inputs(1)["y"] == value
        return
    hint = "; write a digit on both sides of the point" if text in ("1.", ".5") else ""
    message = f"y: `{text}` is not a multiple of 0.1 from -1.0 to 1.0{hint}"
    with pytest.raises(ValueError, match=re.escape(message) + "$"):
        model.simulate(steps=1, inputs={"y": text})


def test_an_integer_takes_no_decimal_text() -> None:
    model = lv.build("d", **arrangement("x = n;", x=TENTHS, n={"type": "0..1", "role": "input"}))
    with pytest.raises(ValueError, match=re.escape("n: `1.0` is not a number from 0 to 1")):
        model.simulate(steps=1, inputs={"n": "1.0"})


def arrangement(action: str, **whiteboard: object) -> dict[str, Any]:
    machine = {"inline": {"machine": "M", "states": [{"name": "S", "internal": action, "stays": "true"}]}}
    return {"whiteboard": whiteboard, "machines": {"m": machine}, "schedule": ["m"]}
