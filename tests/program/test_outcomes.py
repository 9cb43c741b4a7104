"""The terms that the outcome of a step depends on, word by word, and the values that variables can have."""

from __future__ import annotations

import pytest

from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.program import outcomes
from llfsm_verify.program.outcomes import Place, TermTooLarge, outcome, places, possible_values, sampled_in
from llfsm_verify.program.program import Const, Expr, Get, Ite, Local, Op, Program
from llfsm_verify.semantics.lowering import lower

SIGNS = {
    "add": "+", "sub": "-", "mul": "*", "div": "/", "mod": "%", "eq": "==", "ne": "!=", "lt": "<", "le": "<=",
    "gt": ">", "ge": ">=", "and": "&&", "or": "||", "xor": "^",
}  # fmt: skip


def text(e: Expr) -> str:
    match e:
        case Const(value, _):
            return str(value)
        case Local(name, _):
            return name
        case Get(name, None, _):
            return name
        case Get(name, index, _):
            assert index is not None
            return f"{name}[{text(index)}]"
        case Ite(condition, then, otherwise, _):
            return f"({text(condition)} ? {text(then)} : {text(otherwise)})"
        case Op(name, (a, b), _) if name in SIGNS:
            return f"({text(a)} {SIGNS[name]} {text(b)})"
        case Op(name, args, _):
            return f"{name}({', '.join(map(text, args))})"
    raise AssertionError(e)


def program(guard: str = "false", internal: str = "", properties: str = "", **keys: object) -> Program:
    """A machine with two inputs that stays in its state unless `guard` is true."""
    board = {
        "x": {"type": "uint8", "init": 0, "role": "input"},
        "y": {"type": "uint8", "init": 0, "role": "input"},
        "z": {"type": "bool", "init": False, "role": "input"},
        "n": {"type": "0..99", "init": 7},
        "m": {"type": "0..9", "init": 0},
        "f": {"type": "bool", "init": False},
        "k": {"type": "int", "init": 0},
        "a": {"type": {"array": "0..9", "size": 2}, "init": [1, 2]},
    }
    states = [
        {"name": "A", "internal": internal, "transitions": [{"when": guard, "to": "B"}]},
        {"name": "B", "transitions": [{"when": "true", "to": "A"}]},
    ]
    machines = {"w": {"inline": {"machine": "W", "states": states}}}
    arrangement = build_arrangement({"whiteboard": board, "machines": machines, "schedule": ["w"], **keys})
    bound = bind(arrangement, parse_properties([Source("p", properties)]))
    return lower(arrangement, bound.atoms)


FIRST = Place(0, 0)


def told(lowered: Program, place: Place = FIRST) -> list[str]:
    """The terms, each with the variable that it goes into."""
    return sorted({text(t.term) + (f" into {t.into}" if t.into else "") for t in outcome(lowered, place)})


@pytest.mark.parametrize(
    ("guard", "asked"),
    [
        ("n > 3", []),
        ("x > 3", ["(?x > 3)"]),
        ("x > n", ["(?x > n)"]),
        ("x + y > 3", ["((?x + ?y) > 3)"]),
        ("x == 3 && y == 4", ["(?x == 3)", "(?y == 4)"]),
        ("(x > 3) == (y > 3)", ["(?x > 3)", "(?y > 3)"]),
        ("!(x > 3) || z", ["?z", "not((?x > 3))"]),
        ("z == f", ["?z"]),
        ("(x > 3 ? n : m) > 5", ["(?x > 3)"]),
        ("(x > 3 ? x : y) > n", ["(?x > 3)", "(?x > n)", "(?y > n)"]),
        ("(z ? x : 2) > (f ? y : 2)", ["(2 > ?y)", "(?x > 2)", "(?x > ?y)", "?z"]),
        ("(x > 3 ? 5 : 6) % 2 == 1", ["((((?x > 3) ? 5 : 6) % 2) == 1)"]),
        ("(x % 2) * n > 3", ["(((?x % 2) * n) > 3)"]),
        ("x / n == 3", ["(((n == 0) ? 0 : (?x / n)) == 3)"]),
        ("x / y > 3", ["(((?y == 0) ? 0 : (?x / ?y)) > 3)", "(?y == 0)"]),
        ("min(x, y) > n", ["(min(?x, ?y) > n)"]),
        ("a[x % 2] > 3", ["((?x % 2) == 0)"]),
    ],
)
def test_what_a_guard_asks(guard: str, asked: list[str]) -> None:
    assert [term for term in told(program(guard)) if " into " not in term] == asked


@pytest.mark.parametrize(
    ("internal", "terms"),
    [
        ("n = x % 10;", ["(?x % 10) into n"]),
        ("n = (x / 2) / 3;", ["((?x / 2) / 3) into n"]),
        ("n = x / (y % 4 + 1);",
         ["((?x / ((?y % 4) + 1)) < 0)", "((?x / ((?y % 4) + 1)) > 99)", "(?x / ((?y % 4) + 1)) into n"]),
        ("n = n + (z ? 1 : 0);", ["((n + (?z ? 1 : 0)) < 0)", "((n + (?z ? 1 : 0)) > 99)", "?z into n"]),
        ("if (x > 3) n = 1; else n = 2;", ["(?x > 3) into n"]),
        ("f = z;", ["?z into f"]),
        ("f = x > n;", ["(?x > n) into f"]),
        ("k = x * y;", ["(?x * ?y) into k"]),
        ("k = k + x;", ["?x", "?x into k"]),
        ("a[x % 2] = 3;", ["((?x % 2) == 0) into a", "((?x % 2) == 1) into a"]),
        ("a[0] = y % 10;", ["(?y % 10) into a"]),
        ("n = 3;", []),
    ],
)  # fmt: skip
def test_what_is_stored(internal: str, terms: list[str]) -> None:
    assert told(program(internal=internal)) == terms


@pytest.mark.parametrize(
    ("line", "terms"),
    [
        ("G (x > 3)", ["(?x > 3)"]),
        ("G (x > n && z)", ["(?x > n)", "?z"]),
        ("G (x + y > 3)", ["((?x + ?y) > 3)"]),
        ("G changed(x)", ["(?x != $before.0)", "?x into $before.0"]),
        ("G (sampled(x) > 3)", []),
    ],
)
def test_what_a_letter_asks(line: str, terms: list[str]) -> None:
    assert told(program(properties=line), Place(None, 0)) == terms
    later = [term.replace("?x", "?x#letter").replace("?y", "?y#letter").replace("?z", "?z#letter") for term in terms]
    if "+" not in line:  # a sum asks for what was sampled, where something was
        assert told(program(properties=line, observe="cycle"), Place(None, 1)) == later


def test_a_comparison_with_many_sides_is_one_term(monkeypatch: pytest.MonkeyPatch) -> None:
    lowered = program("(z ? x : 2) > (f ? y : 2)")
    whole = "((?z ? ?x : 2) > (f ? ?y : 2))"
    for most, asked in ((1, [whole]), (3, [whole]), (4, ["(2 > ?y)", "(?x > 2)", "(?x > ?y)", "?z"])):
        monkeypatch.setattr(outcomes, "MOST_SIDES", most)
        assert [term for term in told(lowered) if " into " not in term] == asked


def test_a_term_may_have_so_many_nodes(monkeypatch: pytest.MonkeyPatch) -> None:
    lowered = program(internal="k = x * y;")
    monkeypatch.setattr(outcomes, "MOST_NODES", 3)
    assert told(lowered) == ["(?x * ?y) into k"]
    monkeypatch.setattr(outcomes, "MOST_NODES", 2)
    with pytest.raises(TermTooLarge):
        told(program("x * y > n"))


def test_where_choices_are_sampled() -> None:
    found = program("y > 3 && x > 3", properties="G z")
    assert [(place, sampled_in(block)) for place, block in places(found)] == [
        (FIRST, ("y", "x")), (Place(0, 1), ()), (Place(None, 0), ("z",))
    ]  # fmt: skip
    cycles = program("x > 3", properties="G z", observe="cycle")
    assert [place for place, _ in places(cycles)] == [FIRST, Place(0, 1), Place(None, 0), Place(None, 1)]


def test_values_that_variables_can_have() -> None:
    lowered = program(internal="n = z ? 12 : (f ? 30 : 7); m = m + 1; a[m] = 5; k = x;")
    found = possible_values(lowered, 10)
    own = {name: found[name] for name in ("n", "m", "f", "a") if name in found}
    assert own == {"n": (7, 12, 30), "m": tuple(range(10)), "f": (0,), "a": (1, 2, 5)}
    assert "k" not in found
    fewer = possible_values(lowered, 9)
    assert "m" not in fewer and fewer["n"] == (7, 12, 30)
    assert "n" not in possible_values(lowered, 2)
