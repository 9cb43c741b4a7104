"""Random arrangements that are all about numbers read from sensors, and properties that mention them."""

from __future__ import annotations

from dataclasses import dataclass

from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties

INPUTS = ("d", "e", "f")
COMPARED = ("<", "<=", ">", ">=", "==", "!=")


@dataclass(frozen=True)
class Width:
    """The sensors' largest value, and those that thresholds may have."""

    high: int
    thresholds: tuple[int, ...]

    @property
    def type(self) -> str:
        return f"0..{self.high}"


NARROW = Width(6, (0, 1, 2, 3, 5, 6))
WIDE = Width(65535, (0, 1, 100, 499, 2000, 40000, 65535))


@st.composite
def sensors(draw: st.DrawFn, width: Width = NARROW) -> tuple[Arrangement, Problem]:
    """One or two machines that read up to three sensors, and up to two properties."""

    def pick(*options: str) -> str:
        return draw(st.sampled_from(options))

    def threshold() -> str:
        return str(draw(st.sampled_from(width.thresholds)))

    def read() -> str:
        return pick("d", "d", "d", "d", "e", "f")

    def guard(depth: int = 0) -> str:
        kind = draw(st.integers(0, 13 if depth < 2 else 8))
        sign = pick(*COMPARED)
        if kind <= 3:
            return f"{read()} {sign} {threshold()}"
        if kind == 4:
            return f"{read()} {sign} {pick('limit', 'other', 'count')}"
        if kind == 5:
            return f"d {sign} {pick('e', threshold(), threshold())}"
        if kind == 6:
            return f"{read()} {pick('+', '-', '*')} {pick('count', '2', 'limit', '3')} {sign} {threshold()}"
        if kind == 7:
            return f"{read()} {pick('%', '/')} {pick('3', '2', 'count')} == {pick('0', '1', 'count')}"
        if kind == 8:
            return pick("true", "flag", "count > 1", "b")
        return f"({guard(depth + 1)} {pick('&&', '||')} {guard(depth + 1)})"

    def action() -> str:
        kind = draw(st.integers(0, 11))
        if kind == 0:
            return f"limit = {threshold()};"
        if kind == 1:
            return f"flag = {guard(1)};"
        if kind == 2:
            return f"if ({guard(1)}) {{ count = (count + 1) % 4; }} else {{ flag = {pick('true', 'false')}; }}"
        if kind == 3:
            return f"count = {read()} > {threshold()} ? 1 : {pick('0', 'count')};"
        if kind == 4:
            return f"small = {read()} % 3;"
        if kind == 5:
            return pick(f"other = {read()};", "other = limit;", f"limit = {read()} / 2;", "other = limit + 1;")
        if kind == 6:
            return f"table[{read()} % 2] = {pick('flag', 'true', 'false')};"
        if kind == 7:
            return pick("big = big + 1;", f"big = {read()} * big;", "big = 9000000000000000000;")
        return ""

    def state(name: str, names: list[str]) -> dict[str, object]:
        transitions = [{"when": guard(), "to": draw(st.sampled_from(names))} for _ in range(draw(st.integers(1, 3)))]
        return {
            "name": name, "on_entry": action(), "internal": action(), "on_exit": action(), "transitions": transitions
        }  # fmt: skip

    count = draw(st.integers(1, 2))
    machines = {}
    for i in range(count):
        names = [f"S{k}" for k in range(draw(st.integers(1, 3)))]
        machines[f"m{i}"] = {"inline": {"machine": f"M{i}", "states": [state(n, names) for n in names]}}
    changes = pick("step", "step", "step", "cycle")
    document: dict[str, object] = {
        "name": "sensors",
        "whiteboard": {
            "d": {"type": width.type, "init": "0", "role": "input"},
            "e": {"type": width.type, "init": "1", "role": "input", "changes": changes},
            "f": {"type": width.type, "init": "2", "role": "input"},
            "b": {"type": "bool", "init": "false", "role": "input"},
            "limit": {"type": width.type, "init": "3"},
            "other": {"type": width.type, "init": "0"},
            "count": {"type": "0..3", "init": "0"},
            "small": {"type": "0..2", "init": "0"},
            "flag": {"type": "bool", "init": "false"},
            "table": {"type": {"array": "bool", "size": "2"}},
            "big": {"type": pick("int", "int32", "int32"), "init": "0"},
        },
        "machines": machines,
        "schedule": list(machines),
        "profile": {"base": "llfsm", "snapshot": pick("ringlet", "ringlet", "none", "after_entry")},
    }
    if draw(st.integers(0, 4)) == 0:
        document["observe"] = "cycle"
    arrangement = build_arrangement(document)
    lines = [
        f"p{i}: G (({_atom(draw, width)}) -> {pick('X', 'F', '')} ({_atom(draw, width)}))"
        for i in range(draw(st.integers(0, 2)))
    ]
    return arrangement, bind(arrangement, parse_properties([Source("p.ltl", "\n".join(lines))]))


def _atom(draw: st.DrawFn, width: Width) -> str:
    sign = draw(st.sampled_from(COMPARED))
    threshold = draw(st.sampled_from(width.thresholds))
    return draw(
        st.sampled_from(
            (
                f"d {sign} {threshold}",
                f"d {sign} limit",
                f"d {sign} e",
                f"count {sign} 1",
                "flag",
                "m0@S0",
                f"f {sign} {threshold}",
                f"d + e {sign} {threshold}",
                "b",
                f"f {sign} count",
            )
        )
    )
