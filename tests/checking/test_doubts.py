"""Comparisons with numbers that are never reached: those that all values of the declared types answer alike."""

import pytest

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.checking.doubts import doubts
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties

BOARD = """
name: numbers
timing: untimed
types:
  Pair: {record: {a: 0..5, b: bool}}
  Warm: {decimal: 0.1, range: -1.5..30.0}
  Row: {array: 0..5, size: 3}
whiteboard:
  level: {type: 0..20, role: input}
  byte: {type: uint8, role: input}
  any: {type: int}
  warm: {type: Warm, role: input}
  pair: {type: Pair}
  row: {type: Row}
machines: {m: {inline: {machine: M, states: [{name: A, internal: any = 1;, stays: true}]}}}
schedule: [m]
"""


def said(*texts):
    properties = parse_properties([Source("p.ltl", "\n".join(texts))])
    return [(d.code, d.message, d.span.text) for d in doubts(ARRANGEMENT, properties)]


ARRANGEMENT = load_arrangement_text(BOARD)


@pytest.mark.parametrize(
    ("atom", "why"),
    [
        ("level == 3.5", "`level` is a whole number, so it is never 3.5"),
        ("any != 0.5", "`any` is a whole number, so it is never 0.5"),
        ("300 == level", "`level` is 0 to 20, so it is never 300"),
        ("byte == 256", "`byte` is 0 to 255, so it is never 256"),
        ("byte == -1", "`byte` is 0 to 255, so it is never -1"),
        ("level > 300", "`level` is 0 to 20, so it is never 300"),
        ("level + 1 == 0", "`level + 1` is 1 to 21, so it is never 0"),
        ("warm == 20.25", "`warm` has 1 digit after the point, so it is never 20.25"),
        ("warm < -2.5", "`warm` is -1.5 to 30.0, so it is never -2.5"),
        ("pair.a == 6", "`pair.a` is 0 to 5, so it is never 6"),
        ("row[1] == 6", "`row[1]` is 0 to 5, so it is never 6"),
        ("sampled(level) == 21", "`sampled(level)` is 0 to 20, so it is never 21"),
    ],
)
def test_a_number_that_is_never_reached_is_said(atom, why):
    assert said(f"x: G !({atom})", f"y: F ({atom})") == [("W303", why, atom)]
    assert said(f"x: G !rose({atom})") == [("W303", why, atom)]


@pytest.mark.parametrize(
    "atom",
    ["level == 20", "level < 21", "level > -1", "level < 3.5", "any == 300", "warm == 20.5", "level == byte",
     "1 == 1", "warm < 30.1", "pair.b", "level / 2 == 3"],
)  # fmt: skip
def test_what_may_be_is_not(atom):
    assert said(f"x: G ({atom})") == []


@pytest.mark.parametrize(
    ("line", "meant"),
    [
        ("p: G (on -> O[<=1500ms] on)", "O[<=1s]"),
        ("p: G (on -> F[<=500ms] on)", "F[<=0ms]"),
        ("p: G (on S[1500ms:3s] on)", "S[2s:3s]"),
        ("p: G H[>=2.5s] on", "H[>=3s]"),
        ("p: on responds to on within 1500ms", "1s"),
        ("p: G F[<=2s] on", None),
        ("p: G O[1s:2s] on", None),
    ],
)
def test_a_bound_between_two_cycles_is_said(line: str, meant: str | None) -> None:
    text = "name: x\ncycle_ms: 1000\nwhiteboard: {on: {type: bool, role: input}}\n"
    text += "machines: {m: {inline: {machine: M, states: [{name: A}]}}}\nschedule: [m]\n"
    arrangement, lines = load_arrangement_text(text), parse_properties([Source("p", line)])
    found = doubts(arrangement, lines)
    assert [(d.code, d.hint) for d in found] == (
        [("W304", f"write `{meant}`, or times that are multiples of the cycle")] if meant else []
    )
    assert doubts(arrangement, lines, stamped=True) == () == doubts(None, lines)


def test_atoms_that_do_not_fit_are_left_to_others():
    assert said("x: G (level == 300 && nowhere == 3)") == [
        ("W303", "`level` is 0 to 20, so it is never 300", "level == 300")
    ]
