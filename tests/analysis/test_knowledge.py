"""Comparisons of conditions agree with truth tables by the definition, and with Python's operators on all values."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import pairwise, product
from pathlib import Path
from random import Random
from unittest import mock

import pytest

from llfsm_verify.analysis import knowledge
from llfsm_verify.analysis.knowledge import Comparison, Known, compare, compare_in
from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.diagnostics import Disagreement, Fragment, Source
from llfsm_verify.knowledge.reading import read_theory
from llfsm_verify.knowledge.tables import valuation
from llfsm_verify.limits import Budget, Limits
from tests.knowledge.theories import DEFEATER, Plain, random_theory, tags
from tests.quick import examples

PYTHON = {"&&": " and ", "||": " or ", "!": " not ", "true": "True", "false": "False"}
VARIABLES: dict[str, list[object]] = {
    "p": [False, True], "q": [False, True], "n": [*range(6)], "m": [*range(-3, 3)], "u": [*range(16)],
}  # fmt: skip
ARRANGEMENT = """\
name: values
cycle_ms: 1
types: {Shade: [DARK, LIGHT, PALE]}
whiteboard:
  p: {type: bool, role: input}
  q: {type: bool}
  n: {type: 0..5, init: 4, role: input}
  m: {type: -3..2}
  u: {type: 0..15}
  whole: {type: int}
  shade: {type: Shade}
  mood: {type: Shade, role: input}
  price: {type: Price, init: 0.5}
  ball: {type: {record: {near: bool, hits: {array: 0..3, size: 2}}}}
  row: {type: {array: 0..3, size: 2}}
machines: {a: {inline: {machine: A, variables: {own: {type: 0..3}}, states: [{name: S}]}}}
schedule: [a]
"""
PRICED = ARRANGEMENT.replace("{Shade:", "{Price: {decimal: 0.1, range: 0.0..2.0}, Shade:")


def fragment(text: str) -> Fragment:
    return Fragment.whole(Source("<command line>", text))


def truths(text: str, rows: Sequence[Mapping[str, object]]) -> list[bool]:
    """By Python's operators."""
    translated = re.sub(r"&&|\|\||!(?!=)|\btrue\b|\bfalse\b", lambda m: PYTHON[m[0]], text)
    code = compile(translated.strip(), text, "eval")
    return [bool(eval(code, {}, dict(row))) for row in rows]


def condition(random: Random, names: list[str], depth: int = 3) -> str:
    """One over truth values."""
    if depth == 0 or random.random() < 0.2:
        return random.choice([*names, "true", "false"]) if random.random() < 0.1 else random.choice(names)
    if random.random() < 0.25:
        return f"!({condition(random, names, depth - 1)})"
    sides = (condition(random, names, depth - 1) for _ in range(2))
    return f"({random.choice([' && ', ' || ', ' == ', ' != ']).join(f'({side})' for side in sides)})"


def number(random: Random, depth: int = 2) -> str:
    if depth == 0 or random.random() < 0.3:
        return random.choice(["n", "m", "u", str(random.randint(0, 9))])
    return f"({number(random, depth - 1)} {random.choice('+-*')} {number(random, depth - 1)})"


def numeric(random: Random) -> str:
    """One over numbers and truth values, of which comparisons are parts."""
    names = [f"{number(random)} {random.choice(['<', '<=', '==', '!=', '>'])} {number(random)}" for _ in range(2)]
    return condition(random, [*(f"({name})" for name in names), "p", "q"], 2)


def is_right(found: Comparison, left: list[bool], right: list[bool], rows: list[Mapping[str, object]]) -> None:
    """The answer is that of the two columns over all rows; what tells them apart is one of the rows."""
    assert found.answer == ("equal" if left == right else "different")
    if found.answer == "different":
        assert found.truths == next(
            (one, other)
            for one, other, row in zip(left, right, rows, strict=True)
            if found.values.items() <= row.items()
        )
        assert found.truths[0] != found.truths[1] and tuple(found.values) == found.reads


def literal_of(plain: Plain, random: Random) -> str:
    """Any that a rule can prove."""
    return random.choice([rule.head for rule in plain.rules if rule.arrow != DEFEATER])


def known(plain: Plain, literal: str) -> Known:
    """The theory with this literal as an output: for a negation, an atom that is proved where it is."""
    text = plain.text()
    atom = literal.removeprefix("~")
    if literal != atom:
        text += f"negated: {literal} -> not_{atom}.\n"
        atom = f"not_{atom}"
    return Known(read_theory(Source("random.d", f"{text}output {{b {atom}}}.\n")), atom)


def column(plain: Plain, literal: str, rows: list[Mapping[str, bool]]) -> list[bool]:
    return [literal in tags(plain, {name: row[name] for name in plain.inputs}).proved for row in rows]


@pytest.mark.slow
def test_random_theories_and_conditions() -> None:
    answers: dict[str, int] = {}
    for seed in range(examples(400)):
        random = Random(seed)
        plain = random_theory(random)
        rows = list(plain.valuations())
        literal = literal_of(plain, random)
        left = column(plain, literal, rows)
        text = condition(random, list(plain.inputs))
        if random.random() < 0.4:  # a condition that is the same: the rows in which it is true
            cubes = [
                [name if row[name] else f"!{name}" for name in plain.inputs]
                for row, v in zip(rows, left, strict=True)
                if v
            ]
            text = " || ".join(" && ".join(cube) for cube in cubes) or "false"
        found = compare(known(plain, literal), fragment(text), Budget(Limits()))
        is_right(found, left, truths(text, rows), rows)
        answers[found.answer] = answers.get(found.answer, 0) + 1
    assert min(answers["equal"], answers["different"]) * 10 > sum(answers.values())


@pytest.mark.slow
def test_random_theories() -> None:
    for seed in range(examples(300)):
        random = Random(f"two {seed}")
        one = random_theory(random)
        other = one if random.random() < 0.3 else random_theory(random)
        if random.random() < 0.5:  # fewer priorities
            other = Plain(one.inputs, one.rules, frozenset(random.sample(sorted(one.beats), len(one.beats) // 2)))
        inputs = list(dict.fromkeys((*one.inputs, *other.inputs)))
        rows = [valuation(inputs, row) for row in range(1 << len(inputs))]
        wanted = literal_of(one, random), literal_of(other, random)
        found = compare(known(one, wanted[0]), known(other, wanted[1]), Budget(Limits()))
        is_right(found, column(one, wanted[0], rows), column(other, wanted[1], rows), rows)
        alone = [tuple(n for n in a.inputs if n not in b.inputs) for a, b in ((one, other), (other, one))]
        assert found.alone == tuple(alone)


@pytest.fixture(scope="module")
def arrangement_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("values") / "values.yaml"
    path.write_text(PRICED)
    return path


@pytest.mark.slow
def test_random_conditions_of_an_arrangement(arrangement_path: Path) -> None:
    arrangement = load_arrangement(arrangement_path)
    rows = [dict(zip(VARIABLES, values, strict=True)) for values in product(*VARIABLES.values())]
    answers: dict[str, int] = {}
    for seed in range(examples(80)):
        random = Random(f"numbers {seed}")
        left = numeric(random)
        right = random.choice(
            [numeric(random), f"!(!({left}))", left.replace(" < ", " <= "), left.replace("n", "(n + 0)")]
        )
        found = compare_in(arrangement, fragment(left), fragment(right), Budget(Limits()))
        is_right(found, truths(left, rows), truths(right, rows), rows)
        answers[found.answer] = answers.get(found.answer, 0) + 1
    assert min(answers["equal"], answers["different"]) > 4


@pytest.mark.slow
def test_random_theories_in_an_arrangement(tmp_path: Path) -> None:
    """A theory whose inputs are conditions on numbers, and a second one that asks the first."""
    rows = [dict(zip(VARIABLES, values, strict=True)) for values in product(*VARIABLES.values())]
    answers: dict[str, int] = {}
    for seed in range(examples(80)):
        random = Random(f"known {seed}")
        columns: list[list[bool]] = []
        entries = []
        for number in range(2):
            plain = random_theory(random)
            side = known(plain, literal := literal_of(plain, random))
            (tmp_path / f"{number}.d").write_text(side.theory.source.text)
            asked = {name: numeric(random) for name in plain.inputs}
            inputs = {name: truths(text, rows) for name, text in asked.items()}
            if number:  # one of its inputs is the other theory
                asked["a"], inputs["a"] = (
                    "k0 || p",
                    [one or bool(row["p"]) for one, row in zip(columns[0], rows, strict=True)],
                )
            bound = ", ".join(f'{name}: "{text}"' for name, text in asked.items())
            entries.append(f"  k{number}: {{file: {number}.d, inputs: {{{bound}}}, output: {side.atom}}}\n")
            valuations = list(zip(*inputs.values(), strict=True))
            proved = {v: column(plain, literal, [dict(zip(inputs, v, strict=True))])[0] for v in set(valuations)}
            columns.append([proved[v] for v in valuations])
        path = tmp_path / f"{seed}.yaml"
        path.write_text(PRICED.replace("machines:", f"knowledge:\n{''.join(entries)}machines:"))
        other = random.choice(["k0", "k1 && true", f"!!k1 || ({numeric(random)} && k1)", numeric(random)])
        right = {"k0": columns[0], "k1 && true": columns[1]}.get(other) or (
            columns[1] if other.startswith("!!") else truths(other, rows)
        )
        found = compare_in(load_arrangement(path), fragment("k1"), fragment(other), Budget(Limits()))
        is_right(found, columns[1], right, rows)
        answers[found.answer] = answers.get(found.answer, 0) + 1
    assert min(answers["equal"], answers["different"]) > 2


@pytest.mark.parametrize(
    ("left", "right", "told"),
    [
        ("shade == DARK", "!(shade == LIGHT || shade == PALE)", None),
        ("shade == DARK", "shade != PALE", {"shade": "LIGHT"}),
        ("mood == DARK", "mood != PALE", {"mood": "LIGHT"}),
        ("row[0] + row[1] > 5", "row[0] == 3 && row[1] == 3", None),
        ("row[1] > 2", "row[1] > 1", {"row[1]": 2}),
        ("a.own > 2", "a.own == 3", None),
        ("price > 0.4", "price >= 0.5", None),
        ("whole * whole >= 0", "true", None),
        ("whole > 4", "whole > 3", {"whole": 4}),
        ("whole < 9223372036854775807", "whole != 9223372036854775807", None),
        ("n < 4", "n < 5", {"n": 4}),
        ("ball.hits[1] > 2", "ball.hits[1] > 1", {"ball.hits[1]": 2}),
        ("true", "false", {}),
    ],
)
def test_values_of_all_types(left: str, right: str, told: Mapping[str, object] | None, arrangement_path: Path) -> None:
    found = compare_in(load_arrangement(arrangement_path), fragment(left), fragment(right), Budget(Limits()))
    assert found.answer == ("equal" if told is None else "different") and found.arrangement == "values"
    assert found.values == (told or {})


def test_what_tells_them_apart_is_near_to_the_start(arrangement_path: Path) -> None:
    arrangement = load_arrangement(arrangement_path)
    found = compare_in(arrangement, fragment("n > 4 || m > 0 || q"), fragment("m > 0"), Budget(Limits()))
    assert found.values == {"q": False, "n": 5, "m": 0}
    assert found.reads == ("q", "n", "m")  # as on the whiteboard
    found = compare_in(arrangement, fragment("u > 1 && n < 5 && m < 1"), fragment("false"), Budget(Limits()))
    assert (found.values["n"], found.values["m"]) == (4, 0)


def test_a_model_that_does_not_tell_them_apart_is_a_disagreement() -> None:
    theory = read_theory(Source("a.d", "input {a, b}.\na => c.\noutput {b c}.\n"))
    with (
        mock.patch.object(knowledge, "_apart", return_value={("a", None): 1, ("b", None): 1}),
        pytest.raises(Disagreement, match="they are the same there"),
    ):
        compare(Known(theory, "c"), fragment("a && b || a"), Budget(Limits()))


def test_a_chain_of_theories_is_compared_in_linear_time() -> None:
    rules = "".join(
        f"p{i} => x{i}. ~p{i} => ~x{i}. p{i}, ~x{i} => p{j}. ~p{i}, x{i} => p{j}. a => ~p{j}.\n"
        for i, j in pairwise(range(301))
    )
    theory = read_theory(Source("chain.d", f"input {{a, b}}.\na => p0. ~a => ~p0. \n{rules}output {{b p300}}.\n"))
    assert compare(Known(theory, "p300"), fragment("a && !a"), Budget(Limits())).answer == "equal"


@pytest.mark.slow
def test_a_hard_question_is_unknown(tmp_path: Path) -> None:
    path = tmp_path / "hard.yaml"
    path.write_text(ARRANGEMENT.replace("price: {type: Price, init: 0.5}", "v: {type: uint32}\n  w: {type: uint32}"))
    factors = "v * w == 4611686014132420609 && v > 1 && v < w"  # the square of a prime
    found = compare_in(load_arrangement(path), fragment(factors), fragment("false"), Budget(Limits(timeout=0.3)))
    assert (found.answer, found.exit_code) == ("unknown", 4)
    assert found.reason == "the time limit of 0.3 s was reached"
