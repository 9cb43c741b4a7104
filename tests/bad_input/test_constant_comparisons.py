"""Comparisons that the types decide are warnings with their place; whatever could come out otherwise is none."""

from __future__ import annotations

import operator
from itertools import product

import pytest

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.diagnostics import Diagnostic
from tests.bad_input.cases import FRAMED
from tests.cli.running import llfsm

ALWAYS = {
    "n < 20": "true: it compares `n` (0..15) and 20",
    "n >= 0": "true",
    "n <= 15": "true",
    "n > -1": "true",
    "n != 16": "true",
    "20 > n": "true",
    "u <= 255": "true",
    "n + u >= 0": "true",
    "a[n % 4] < 4": "true",
    "n > 15": "false",
    "n < 0": "false",
    "n == 16": "false: it compares `n` (0..15) and 16",
    "u == -1": "false",
    "n - 16 >= 0": "false",
    "abs(ball.x) > 128": "false",
    "min(n, 3) > 3": "false",
}
SOMETIMES = (
    "n < 15",
    "n > 0",
    "n >= 1",
    "n == 15",
    "n != 0",
    "n <= u",
    "big < 20",
    "1 == 1",
    "limit < 20",
    "n < limit + 20",
    "car == true",
    "light == RED",
    "ball.x > 126",
    "a[n % 4] == 3",
    "after(n)",
)


def warnings(text: str) -> list[Diagnostic]:
    return [d for d in load_arrangement_text(text, "a.yaml").warnings if d.code == "W002"]


@pytest.mark.parametrize("guard", ALWAYS)
def test_what_the_types_decide(guard):
    text = FRAMED(guard=f"car && {guard}")
    (warning,) = warnings(text)
    assert warning.span is not None and warning.span.text == guard and not warning.is_error
    assert warning.message.startswith(f"this comparison is always {ALWAYS[guard]}") and warning.hint


@pytest.mark.parametrize("guard", SOMETIMES)
def test_what_they_do_not(guard):
    assert warnings(FRAMED(guard=guard)) == []


RANGES = [(0, 0), (0, 2), (1, 3), (2, 4), (3, 3), (4, 4)]
COMPARED = {
    "==": operator.eq, "!=": operator.ne, "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge,
}  # fmt: skip


@pytest.mark.parametrize("sign", COMPARED)
def test_a_warning_is_given_when_all_values_agree(sign):
    """Two variables, by the definition: each value of one with each of the other."""
    variables = [(side, low, high) for side in "ab" for low, high in RANGES]
    pairs = list(product(RANGES, RANGES))
    guards = [f"a_{low}_{high} {sign} b_{least}_{most}" for (low, high), (least, most) in pairs]
    lines = [f"  {side}_{low}_{high}: {{type: {low}..{high}}}" for side, low, high in variables]
    head = "cycle_ms: 1\nwhiteboard:\n" + "\n".join(lines)
    body = (
        "\nmachines:\n  m:\n    inline:\n      machine: M\n      states:\n        - name: A\n          transitions:\n"
    )
    moves = "\n".join(f"            - {{when: {guard}, to: A}}" for guard in guards)
    found = {d.span.text: d.message for d in warnings(f"{head}{body}{moves}\nschedule: [m]\n") if d.span}
    for guard, (left, right) in zip(guards, pairs, strict=True):
        values = {COMPARED[sign](a, b) for a in range(left[0], left[1] + 1) for b in range(right[0], right[1] + 1)}
        if len(values) == 2:
            assert guard not in found
            continue
        sides = [f"{low}..{high}" if low < high else str(low) for low, high in (left, right)]
        named = " and ".join(f"`{name}` ({values})" for name, values in zip(guard.split()[::2], sides, strict=True))
        always = "true" if values == {True} else "false"
        assert found[guard] == f"this comparison is always {always}: it compares {named}"


def test_actions_are_looked_through():
    text = FRAMED(action="if (n < 16) { n = u == 256 ? 1 : 2; } else { for (i in 0..3) { if (i > 3) a[i] = 0; } }")
    assert [d.span.text for d in warnings(text) if d.span] == ["n < 16", "u == 256", "i > 3"]


def test_two_instances_are_one_warning():
    text = FRAMED(guard="n < 20").replace("  other:", "  twin: {inline: *m}\n  other:")
    text = text.replace("    inline:\n      machine: M", "    inline: &m\n      machine: M").replace("[m,", "[m, twin,")
    text = text.replace("twin: {inline: *m}", "twin: {inline: *m, parameters: {limit: 4}}")
    assert len(warnings(text)) == 1


MODEL = (
    "cycle_ms: 1\nwhiteboard: {n: {type: 0..15}}\nmachines:\n  m:\n    inline:\n      machine: M\n      states:\n"
    "        - name: A\n          transitions: [{when: n < 20, to: A}]\nschedule: [m]\n"
)


@pytest.mark.parametrize("command", ["verify", "simulate"])
def test_they_are_printed_once_and_change_nothing(command):
    done = llfsm(command, "-", stdin=MODEL)
    assert done.returncode == 0 and done.stderr.count("<stdin>:9:32: warning[W002]") == 1
    assert done.stderr.count("warning") == 1 and "W002" not in done.stdout
