"""Invariants in the words of the files: formulas as text, and the variables behind words of properties."""

from __future__ import annotations

import pytest

from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.engines.inductive.invariant import Invariant, formula_text
from llfsm_verify.engines.inductive.observers import Faults
from llfsm_verify.engines.inductive.wording import _left, _Names
from llfsm_verify.engines.unrolled.runs import Table
from llfsm_verify.logic.parsing.formulas import parse_formula
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.program.program import BOOL, Const, Expr, Get, Int, Local, Op
from llfsm_verify.program.terms import FALSE, TRUE, const, get, ite, op

SMALL = Int(-9, 9)
A, B = get("a", SMALL), get("b", SMALL)
P, Q = get("p", BOOL), get("q", BOOL)
X, Y = get("x", Int(-900, 900, digits=2)), get("y", Int(-90, 90, digits=1))


@pytest.mark.parametrize(
    ("formula", "text"),
    [
        (TRUE, "true"),
        (FALSE, "false"),
        (P, "p"),
        (op("not", P), "!p"),
        (op("or", op("not", P), Q), "p -> q"),
        (op("or", op("not", Q), op("not", P)), "!(p && q)"),
        (op("or", Q, P), "p || q"),
        (op("and", op("or", P, Q), P), "((p || q) && p)"),
        (op("not", op("and", P, Q)), "!(p && q)"),
        (op("lt", A, const(3)), "a <= 2"),
        (op("gt", A, const(3)), "a >= 4"),
        (op("gt", const(3), A), "a <= 2"),
        (op("not", op("le", A, B)), "a > b"),
        (op("le", op("sub", A, B), const(2)), "a <= b + 2"),
        (op("le", op("add", A, B), const(-2)), "a + b <= -2"),
        (op("eq", op("sub", A, op("mul", const(3), B)), const(0)), "a == 3 * b"),
        (op("ge", op("neg", A), const(0)), "a <= 0"),
        (op("eq", P, Q), "(p <-> q)"),
        (op("ne", P, Q), "(p xor q)"),
        (op("eq", P, FALSE), "!p"),
        (op("ne", P, FALSE), "p"),
        (op("xor", P, Q), "(p xor q)"),
        (op("le", ite(P, A, B), const(0)), "(p ? a : b) <= 0"),
        (op("le", op("min", A, B), op("abs", A)), "min(a, b) <= abs(a)"),
        (op("le", op("mod", A, const(2)), op("div", B, const(3))), "(a % 2) <= (b / 3)"),
        (Op("eq", (const(2), const(2)), BOOL), "0 == 0"),
        (op("lt", X, const(251)), "x <= 2.50"),
        (op("le", op("mul", Y, const(10)), X), "y <= x"),
        (op("le", op("sub", op("mul", Y, const(10)), X), const(-25)), "y <= x - 0.25"),
        (op("le", op("mul", Y, const(2)), op("mul", A, const(10))), "2 * y <= a"),
    ],
)
def test_formulas_as_text(formula: Expr, text: str) -> None:
    def name(scalar: object) -> str:
        assert isinstance(scalar, Get)
        return scalar.var

    assert formula_text(formula, lambda scalar, holds: None, name) == text


def test_what_stands_behind_words_of_properties_has_words() -> None:
    board = {
        "b": {"type": "bool", "role": "input"},
        "d": {"type": "0..9", "role": "input", "init": 1},
        "n": {"type": {"array": "0..3", "size": 2}},
        "held0": {"type": "bool"},
    }
    state = {"name": "S", "internal": "held0 = b && d > 3;", "transitions": [{"when": "false", "to": "S"}]}
    machines = {"m": {"inline": {"machine": "M", "states": [state]}}}
    arrangement = build_arrangement({"whiteboard": board, "machines": machines, "schedule": ["m"]})
    text = "G (sampled(d) > 3 || sampled(d) > n[0] || m.sampled(d) == n[1] || changed(held0))"
    problem = bind(arrangement, parse_properties([Source("p", text)]))
    names = _Names(Invariant(Faults(), TRUE), problem.program(), None, problem)
    variables = problem.program().vars
    written = {v.name: names.name(Get(v.name, Const(1, SMALL) if v.length else None, v.type)) for v in variables}
    assert written["$held.0"] == "#held0"  # a variable has the name
    assert written["$any.$sampled.d"] == "sampled(d)"
    assert written["m.$sampled.d"] == "m.sampled(d)"
    assert written["$before.0"] == "before0"
    assert written["n"] == "n[1]"
    assert names.legend["before0"] == "what `held0` was in the letter before"
    assert names.legend["#held0"] == "`sampled(d) > 3`"
    copies = {name: names.name(Local(f"copy:{name}", SMALL)) for name in ("n[1]", "held0", "m.$state")}
    assert copies == {"n[1]": "then(n[1])", "held0": "then(held0)", "m.$state": "then(m.state)"}
    assert names.legend["then(…)"] == "what held in the configuration in which the loop begins"
    assert names.name(Local("saved", BOOL)) == "saved"
    assert names.legend["saved"] == "the configuration in which the loop begins has been passed"
    assert names.name(Local("rounds", SMALL)) == "rounds"
    assert names.legend["rounds"] == "how often all that a violation needs forever has happened so far"


def test_a_monitor_remembers_what_is_left_to_satisfy() -> None:
    formula = parse_formula(Fragment.whole(Source("test", "a -> X (b && X c)"))).formula
    table = Table(("a", "b", "c"), (), 1, 0)
    for word, rest in (((0b001,), "b && X c"), ((0b101, 0b010), "c"), ((0b110,), "true")):
        assert _left(formula, table, word) == f"from here on the run has to satisfy {rest}"
