"""Bit operations against Python's, which are those of two's complement without end."""

from __future__ import annotations

from functools import cache
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
    "both": ("x & y", lambda x, y, _: x & y),
    "either": ("x | y", lambda x, y, _: x | y),
    "one": ("x ^ y", lambda x, y, _: x ^ y),
    "none": ("~x", lambda x, _, __: ~x),
    "left": ("x << k", lambda x, _, k: x << k),
    "right": ("x >> k", lambda x, _, k: x >> k),
    "mask": ("x & 0x2C", lambda x, _, __: x & 0x2C),
    "set": ("x | 0x41 | y", lambda x, y, _: x | 0x41 | y),
    "flip": ("0x55 ^ x", lambda x, _, __: x ^ 0x55),
    "two": ("x << 3 >> 2", None),
    "loose": ("x & y | ~x ^ 7 & y", lambda x, y, _: (x & y) | (~x ^ (7 & y))),
}


def within(value: int, kind: str) -> int:
    bits = int(kind.removeprefix("u").removeprefix("int"))
    value %= 1 << bits
    return value - (1 << bits) if kind[0] == "i" and value >= 1 << (bits - 1) else value


def expected(name: str, x: int, y: int, k: int, kind: str) -> int:
    if name == "two":
        return within(within(x << 3, kind) >> 2, kind)
    return within(RULES[name][1](x, y, k), kind)


@cache
def calculator(kind: str) -> Simulation:
    board: dict[str, object] = {n: {"type": kind, "role": "input"} for n in ("x", "y")}
    board["k"] = {"type": "0..7", "role": "input"}
    board |= {name: {"type": kind} for name in RULES} | {f"{name}_2": {"type": kind} for name in ("both", "left")}
    actions = "".join(f"{name} = {text};\n" for name, (text, _) in RULES.items())
    actions += "both_2 = x; both_2 &= y; left_2 = x; left_2 <<= k;"
    machine = {"inline": {"machine": "M", "states": [{"name": "S", "internal": actions, "stays": "true"}]}}
    return Simulation(lower(build_arrangement({"whiteboard": board, "machines": {"m": machine}, "schedule": ["m"]})))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["uint8", "int8", "uint16", "int16", "uint32", "int32"])
def test_every_operation_against_python(kind: str) -> None:
    low, high = (
        within(1 << (int(kind.lstrip("uint")) - 1), kind) if kind[0] == "i" else 0,
        within(-1, "u" + kind.lstrip("u")),
    )
    high = high >> 1 if kind[0] == "i" else high

    @settings(max_examples=examples(60), deadline=None)
    @given(st.integers(low, high), st.integers(low, high), st.integers(0, 7))
    def check(x: int, y: int, k: int) -> None:
        run = calculator(kind).anew()
        run.ringlet({"x": x, "y": y, "k": k})
        for name in RULES:
            assert run.values[name] == expected(name, x, y, k, kind), (name, x, y, k)
        assert run.values["both_2"] == x & y and run.values["left_2"] == within(x << k, kind)

    check()


def model(action: str, **board: object) -> lv.Model:
    machine = {"inline": {"machine": "M", "states": [{"name": "S", "internal": action, "stays": "true"}]}}
    return lv.build("b", whiteboard=board, machines={"m": machine}, schedule=["m"])


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["explicit", "pdr", "bmc"])
def test_every_engine_has_the_same_bits(engine: str) -> None:
    subject = model(
        "s = s >> 1 | (low ? 0x40 : 0); n = s & 0x3;", s={"type": "int8", "init": "-128"}, n={"type": "0..3"},
        low={"type": "bool", "role": "input"},
    )  # fmt: skip
    result = subject.check("sign: G s < 0\nodd: G n != 3", engine=engine)
    assert result["odd"].verdict == "violated"
    assert result["sign"].verdict == ("holds" if engine != "bmc" else "unknown")


def test_a_shift_by_too_much_is_a_fault() -> None:
    result = model("u = u << k;", u={"type": "uint8"}, k={"type": "0..8", "role": "input"}).check("a: G true")
    (finding,) = result.faults
    assert finding.code == "F005" and "shift by too much: k is not in 0..7" in str(finding)


def test_brackets_in_brackets_are_each_read_once() -> None:
    nested = "x"
    for number in range(24):
        nested = f"({nested} ^ {number})" if number % 2 else f"({number} | {nested})"
    result = model(f"v = {nested};", v={"type": "uint8"}, x={"type": "uint8"})
    assert result.check(f"a: F G v == {eval(nested, {'x': 0})}")["a"].verdict == "holds"


ADOPTED = {
    "u = u | 1 << n;": ("u", 0x0D),
    "u |= 1 << n;": ("u", 0x0D),
    "u |= K << 1;": ("u", 0x0D),
    "u |= n > 2 ? 1 << n : 0;": ("u", 0x0D),
    "u = n > 2 ? 1 << n : 0;": ("u", 0x08),
    "u = ~1;": ("u", 0xFE),
    "w = ~1;": ("w", 0xFFFE),
    "w = 1 << n + 6;": ("w", 0x200),
    "r = u & ~1;": ("r", 0x04),
    "r = ~1 & u;": ("r", 0x04),
    "r = (n > 2 ? u : 3) & 7;": ("r", 0x05),
    "r = (n > 2 ? 3 : u) & 7;": ("r", 0x03),
    "r = (n > 2 ? 1 << n : n) & (u | 8);": ("r", 0x08),
    "b = (u | 8) == (5 | 1 << n);": ("b", True),
    "b = 1 << n == (w & 8);": ("b", False),
    "r = u | w;": ("r", 0x1F5),
    "r = w | u;": ("r", 0x1F5),
    "r = (n > 2 ? 300 : u) & w;": ("r", 0x120),
    "r = w & (n > 2 ? 300 : u);": ("r", 0x120),
    "r = (n > 2 ? w : u) & 0x1FF;": ("r", 0x1F0),
}
"""What a number that is written down is beside u = 5, w = 0x1F0, n = 3 and K = 4."""


@pytest.mark.parametrize("action", ADOPTED)
def test_numbers_take_the_width_of_their_place(action: str) -> None:
    board = {
        "u": {"type": "uint8", "init": 5},
        "w": {"type": "uint16", "init": 0x1F0},
        "n": {"type": "0..9", "init": 3},
    }
    state = {"name": "S", "internal": action, "stays": "true"}
    machine = {"machine": "M", "parameters": {"K": {"constant": "0..7"}}, "states": [state]}
    board |= {"r": {"type": "int"}, "b": {"type": "bool"}}
    machines = {"m": {"inline": machine, "parameters": {"K": 4}}}
    run = lv.build("b", whiteboard=board, machines=machines, schedule=["m"]).simulate(steps=1)
    name, value = ADOPTED[action]
    assert run.values(1)[name] == value
