"""Compiled theories: those of the seeds, simple values, a linear size, and no deep recursion."""

from __future__ import annotations

import sys
from itertools import product
from pathlib import Path

import pytest

from llfsm_verify.diagnostics import Source
from llfsm_verify.knowledge.compiled import Compiled, compiled
from llfsm_verify.knowledge.explaining import explained
from llfsm_verify.knowledge.reading import read_theory
from llfsm_verify.knowledge.tables import MAX_INPUTS, Undecided, tables, undecided, valuation
from llfsm_verify.knowledge.theory import Literal, Theory
from llfsm_verify.language import typed
from tests import outside

COOK = Path("models/microwave/MicrowaveCook.d")
BALL = Path("models/ball_conditions/BallConditions.d")


def read(path: Path) -> Theory:
    return read_theory(Source(str(path), path.read_text(encoding="utf-8")))


def theory(text: str) -> Theory:
    return read_theory(Source("some.d", text))


def shown(part: Compiled) -> list[str]:
    """The definitions and the value, as text."""
    return [*(f"{local.key} := {text(value)}" for local, value in part.definitions), text(part.value)]


def text(e: typed.Expression) -> str:
    match e:
        case typed.Literal():
            return str(e.value)
        case typed.ReadLocal():
            return e.local.key
        case typed.Unary():
            return f"not {text(e.operand)}"
        case typed.Binary():
            return f"({text(e.left)} {e.op} {text(e.right)})"
    raise AssertionError(e)


def nodes(e: typed.Expression) -> int:
    return 1 + sum(nodes(part) for part in parts(e))


def parts(e: typed.Expression) -> tuple[typed.Expression, ...]:
    match e:
        case typed.Unary():
            return (e.operand,)
        case typed.Binary():
            return e.left, e.right
    return ()


def depth(e: typed.Expression) -> int:
    return 1 + max(map(depth, parts(e)), default=0)


def size(part: Compiled) -> int:
    return nodes(part.value) + sum(nodes(value) for _, value in part.definitions)


# ---------------------------------------------------------------- the seeds


def test_the_theories_of_the_slides_become_the_guards_written_by_hand() -> None:
    cook, ball = read(COOK), read(BALL)
    assert (cook.name, ball.name) == ("MicrowaveCook", "BALLCONDITIONS")
    assert [o.text for o in (*cook.outputs, *ball.outputs)] == ["cook", "is_it_a_ball"]
    part = compiled(cook, Literal("cook"))
    assert part.inputs == ("timeLeft", "doorOpen")
    assert shown(part) == ["(timeLeft and not doorOpen)"]
    part = compiled(ball, Literal("is_it_a_ball"))
    assert part.inputs == ("badProportionXY", "badProportionYX", "badDensityVsDensityTolerance")
    assert shown(part) == ["((not badProportionXY and not badProportionYX) and not badDensityVsDensityTolerance)"]


@outside.needs("shared")
def test_the_texts_of_the_slides_are_there_verbatim() -> None:
    slides = "".join((outside.SHARED / "seeds" / "clfsm-slides.txt").read_text(encoding="utf-8").split())
    ball = "".join(BALL.read_text(encoding="utf-8").split())
    assert ball in slides
    assert all("".join(line.split()) in slides for line in COOK.read_text(encoding="utf-8").split("\n"))


@pytest.mark.parametrize(("time_left", "door_open"), [*product((False, True), repeat=2)])
def test_who_wins_in_the_microwave(time_left: bool, door_open: bool) -> None:
    found = explained(read(COOK), Literal("cook"), {"timeLeft": time_left, "doorOpen": door_open})
    assert found.proved == (time_left and not door_open)
    (decision,) = found.decisions
    assert decision.proved != decision.refuted
    outcomes = {
        (False, False): ["wins", "idle", "idle"],
        (False, True): ["wins", "idle", "wins"],
        (True, False): ["beaten", "wins", "idle"],
        (True, True): ["wins", "beaten", "wins"],
    }
    assert [fate.outcome for fate in decision.fates] == outcomes[time_left, door_open]


def test_the_seeds_are_decided_everywhere() -> None:
    for path in (COOK, BALL):
        for output in read(path).outputs:
            assert undecided(read(path), Literal(output.atom)) == Undecided(None, None, looked=True)


# ---------------------------------------------------------------- values


@pytest.mark.parametrize(
    ("rules", "expected"),
    [
        ("{} -> q.", ["True"]),
        ("{} => q.", ["True"]),
        ("{} => q. {} => ~q.", ["False"]),
        ("{} => q. a ~> ~q.", ["not a"]),
        ("R: {} => q. S: a ~> ~q. R > S.", ["True"]),
        ("a, b, a => q.", ["(a and b)"]),
        ("a, ~a => q.", ["False"]),
        ("a => q. ~a => q.", ["True"]),
        ("a => q. a => q. b => q.", ["(a or b)"]),
        ("a -> q. b -> ~q.", ["a"]),
        ("a -> q. b => ~q. c => q.", ["(a or (c and not b))"]),
        ("a -> q. a => q. b => ~q.", ["a"]),
        ("R: a => q. S: b => ~q. R > S.", ["a"]),
        ("a -> q. ~a => q.", ["True"]),
        ("{} => p. p, a => q.", ["a"]),
        ("a, b => q. R: c => ~q.", ["rule 0 := (a and b)", "(rule 0 and not c)"]),
        (
            "a, b => p. p => q. p, c => ~q.",
            ["rule 0 := (a and b)", "rule 2 := (rule 0 and c)", "(rule 0 and not rule 2)"],
        ),
    ],
)
def test_values_are_simple(rules: str, expected: list[str]) -> None:
    made = theory(f"input {{a, b, c}}. {rules} output {{b q}}.")
    assert shown(compiled(made, Literal("q"))) == expected


def test_inputs_are_named_in_the_order_of_the_file_and_only_those_that_matter() -> None:
    made = theory("input {c, b, a}. a, c => p. b => q. p => r. output {b r}.")
    assert compiled(made, Literal("r")).inputs == ("c", "a")
    assert shown(compiled(made, Literal("r", False))) == ["False"]
    assert shown(compiled(made, Literal("b", False))) == ["not b"]


def test_places_are_those_of_rules() -> None:
    made = read(COOK)
    places = {made.rules[1].span, made.rules[2].span}
    part = compiled(made, Literal("cook"))
    stack = [part.value]
    while stack:
        e = stack.pop()
        assert e.span in places
        stack += parts(e)
    assert {(span.line, span.text) for span in places} == {(9, "C1: timeLeft => cook"), (10, "C2: doorOpen => ~cook")}


# ---------------------------------------------------------------- size


def chain(n: int) -> Theory:
    """Each literal twice in the rules for the next one, and against it; nothing folds."""
    levels = [
        f"r{i}: p{i}, a{i % 19} => p{i + 1}. s{i}: p{i}, b => ~p{i + 1}. t{i}: ~p{i} => ~p{i + 1}. "
        f"u{i}: c, p{i} ~> ~p{i + 1}. v{i}: p{i}, ~a{i % 7} => p{i + 1}. r{i} > s{i}. v{i} > u{i}. v{i} > t{i}."
        for i in range(n)
    ]
    inputs = ", ".join(f"a{i}" for i in range(19))
    return theory(f"input {{b, c, {inputs}}}.\nb => p0. c => ~p0.\n{chr(10).join(levels)}\noutput {{b p{n}}}.\n")


@pytest.mark.slow
def test_the_size_is_linear_and_no_expression_is_deep() -> None:
    sizes = [size(compiled(chain(n), Literal(f"p{n}"))) for n in (100, 200, 400)]
    assert sizes[1] - sizes[0] == pytest.approx((sizes[2] - sizes[1]) / 2, rel=0.05)
    assert sizes[2] < 60 * 400
    many = theory(
        f"input {{a, b}}. {' '.join(f'a, b => q. p{i} => q. a => p{i}.' for i in range(2000))} output {{b q}}."
    )
    part = compiled(many, Literal("q"))
    assert max(depth(value) for value in (part.value, *(value for _, value in part.definitions))) < 20


@pytest.mark.slow
def test_a_chain_of_thousands_of_literals_needs_no_recursion() -> None:
    n = 3000
    links = "\n".join(
        f"a{i}, p{i} => p{i + 1}. b => ~p{i + 1}. c{i}: p{i} -> ~q{i}. p{i} => q{i}." for i in range(n // 2)
    )
    inputs = ", ".join(f"a{i}" for i in range(n // 2))
    made = theory(f"input {{b, {inputs}}}.\n{{}} => p0.\n{links}\noutput {{b p{n // 2}}}.\n")
    wanted = Literal(f"p{n // 2}")
    limit = sys.getrecursionlimit()
    assert n // 2 > limit
    part = compiled(made, wanted)
    assert len(part.inputs) == n // 2 + 1
    assert explained(made, wanted, dict.fromkeys(part.inputs[1:], True)).proved
    assert not explained(made, wanted, dict.fromkeys(part.inputs, True)).proved
    assert undecided(made, wanted) == Undecided(None, None, looked=False)
    with pytest.raises(Exception, match=r"depends on itself: p0 ← p1500 ← .* ← … ← p1 ← p0") as caught:
        theory(made.source.text.replace("{} => p0.", f"p{n // 2} => p0."))
    assert len(str(caught.value)) < 2000


# ---------------------------------------------------------------- tables


def test_tables_come_in_blocks() -> None:
    """Of 16 inputs there are four; each row is that of a direct evaluation."""
    names = [f"i{k}" for k in range(16)]
    rules = " ".join(
        f"{a}, ~{b} => {'~' if n % 3 else ''}q." for n, (a, b) in enumerate(zip(names, names[5:], strict=False))
    )
    made = theory(f"input {{{', '.join(names)}}}. R: {{}} => q. {rules} output {{b q}}.")
    part = compiled(made, Literal("q"))
    blocks = list(tables([part], names))
    assert [(first, rows) for first, rows, _ in blocks] == [(k << 14, 1 << 14) for k in range(4)]
    for row in range(0, 1 << 16, 97):
        _, _, (column,) = blocks[row >> 14]
        values = valuation(names, row)
        assert values == {name: bool(row & 0x8000 >> k) for k, name in enumerate(names)}
        assert bool(column >> (row & 0x3FFF) & 1) == explained(made, Literal("q"), values).proved


def test_the_first_valuation_that_is_undecided_is_found_in_whatever_block_it_is() -> None:
    names = [f"i{k}" for k in range(MAX_INPUTS)]
    made = theory(f"input {{{', '.join(names)}}}. R: {', '.join(names)} => q. S: {{}} => ~q. output {{b q}}.")
    assert undecided(made, Literal("q")) == Undecided(dict.fromkeys(names, True), None, looked=True)
    two_blocks = theory(f"input {{{', '.join(names[:15])}}}. {', '.join(names[:15])} => q. output {{b q}}.")
    assert undecided(two_blocks, Literal("q")) == Undecided(dict.fromkeys(names[:15], False), None, looked=True)
    both = theory("input {b, a}. a -> q. b, a -> ~q. ~a => ~q. output {b q}.")
    assert undecided(both, Literal("q")) == Undecided(None, {"b": True, "a": True}, looked=True)
    many = theory(f"input {{z, {', '.join(names)}}}. z, {', '.join(names)} => q. output {{b q}}.")
    assert undecided(many, Literal("q")) == Undecided(None, None, looked=False)
