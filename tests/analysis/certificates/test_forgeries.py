"""Each thing that the verifier checks, in a certificate in which just this is wrong, and the sentence that says so."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from llfsm_verify.certificate import (
    PROVED,
    REJECTED,
    Automaton,
    Certificate,
    Expression,
    Faulted,
    Product,
    Rejected,
    Statements,
    checked,
    expression_of,
    true_on,
)
from tests.analysis.certificates.changing import signed
from tests.analysis.certificates.test_changes import PROBLEMS, code_of, made

Document = dict[str, Any]

POSSIBLE = "is not one of the possible numbers from"
ELSEWHERE = "a step leads to a configuration that is not there, or there are too many steps"
MISSING = "there are too few steps, an initial configuration is missing, or one is there twice"
NOT_POSSIBLE = "a run takes a step that is not possible there"
NOT_THERE = "a run does not come where it says, or reads other choices than it says"
LOOP = "the loop of a run does not come back, or shows nothing"
TWICE = "something is there twice or for nothing, or comes after a bad prefix"
RANKS = "a product state is missing, or the ranks do not prove what they should"
NO_VIOLATION = "the run does not violate it"
FAULTS = "what it says of faults is not proved"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("forged")


@pytest.fixture(scope="module")
def text(folder: Path) -> str:
    """Of two processes: `a` holds by its bad prefixes, `b` by lassos, `c` fails by a lasso, `d` by a bad prefix."""
    return json.dumps(made("processes", folder))


def set_in(*path: int | str, to: object) -> Callable[[Document], None]:
    def change(document: Document) -> None:
        part: Any = document
        for key in path[:-1]:
            part = part[key]
        part[path[-1]] = to

    return change


def add_to(*path: int | str, more: object) -> Callable[[Document], None]:
    def change(document: Document) -> None:
        part: Any = document
        for key in path:
            part = part[key]
        part.append(part[0] if more is None else more)

    return change


def violated_by_a_run_that(change: Callable[[Document], None]) -> Callable[[Document], None]:
    """The property that is violated by a bad prefix, with another run."""
    return lambda document: change(document["properties"][3])


def another_way(document: Document) -> None:
    document["properties"][3]["run"]["steps"][0][0] = 1 - document["properties"][3]["run"]["steps"][0][0]


def lower_first_rank(document: Document) -> None:
    nodes = document["properties"][1]["lasso"]["nodes"]
    nodes[2] = min(nodes[2::3])


FORGED: dict[str, tuple[Callable[[Document], None], str]] = {
    "another format": (set_in("format", to="llfsm-certificate 2"), "its format is not `llfsm-certificate 1`"),
    "one section more": (set_in("more", to=0), "there is no object with the keys"),
    "a flag for a number": (set_in("steps", to=True), "something else is in the place of a number"),
    "a number of 130 bits": (set_in("program", "cells", 0, 1, to=-(1 << 129)), POSSIBLE),
    "an initial value outside": (set_in("program", "cells", 0, 3, to=77), POSSIBLE),
    "a new kind of observing": (set_in("program", "observe", to="never"), "neither ringlets nor cycles are observed"),
    "an unknown operator": (add_to("program", "terms", more=["pow", 0, 0]), "an expression has no such operator"),
    "an operand too many": (add_to("program", "terms", more=["add", 0, 0, 0]), "an expression has no such operator"),
    "a term of later ones": (add_to("program", "terms", more=["neg", 9_999]), POSSIBLE),
    "an unknown statement": (add_to("program", "blocks", more=[["goto", 0]]), "there is no such statement"),
    "a block of later ones": (add_to("program", "blocks", more=[["do", 9_999]]), POSSIBLE),
    "a configuration less": (lambda d: d["configurations"].pop(), ELSEWHERE),
    "a configuration twice": (add_to("configurations", more=None), MISSING),
    "a step more": (lambda d: d.update(steps=d["steps"] + 1), MISSING),
    "a step less": (lambda d: d.update(steps=d["steps"] - 1), ELSEWHERE),
    "more initial configurations": (set_in("program", "cells", 2, 4, to=True), MISSING),
    "faults without a run": (set_in("faults", "verdict", to="violated"), FAULTS),
    "a verdict on faults that is none": (set_in("faults", "verdict", to="unknown"), FAULTS),
    "a fault that a run does not end in": (
        lambda d: d["faults"]["runs"].append([0, d["properties"][3]["run"]]), FAULTS),
    "premises of nothing": (add_to("premises", more=0), "fairness has more premises than automata, or fewer"),
    "no such verdict": (set_in("properties", 0, "verdict", to="true"), "a verdict is neither `holds` nor `violated`"),
    "an automaton that is not there": (set_in("properties", 0, "early", to=99), POSSIBLE),
    "no automaton": (set_in("properties", 0, "early", to=None), "a property that holds has a run, or no automaton"),
    "a run where it holds": (set_in("properties", 0, "run", to={}), "a property that holds has a run, or no automaton"),
    "a trail where it holds": (set_in("properties", 0, "trail", to=[]), "a property that holds has a run"),
    "no proof": (set_in("properties", 0, "prefix", to=None), "something else is in the place of an object"),
    "a proof too many": (
        lambda d: d["properties"][0].update(lasso=d["properties"][0]["prefix"]), "there is a proof about lassos"),
    "a proof of the wrong kind": (
        lambda d: d["properties"][1].update(prefix=d["properties"][1]["lasso"]), "there is a proof about bad prefixes"),
    "a product state twice": (
        lambda d: d["properties"][0]["prefix"]["nodes"].extend(d["properties"][0]["prefix"]["nodes"][:3]), TWICE),
    "a rank for nothing": (add_to("properties", 0, "prefix", "sets", more=0), TWICE),
    "a joint state for nothing": (add_to("properties", 0, "prefix", "joint", more=[0]), TWICE),
    "a bad state that is reached": (set_in("automata", 0, "bad", to=[0]), TWICE),
    "configurations that are not there": (set_in("configurations", to=None), FAULTS),
    "no initial product state": (
        lambda d: d["properties"][0]["prefix"].update(nodes=d["properties"][0]["prefix"]["nodes"][3:]),
        "an initial product state is missing"),
    "no last product state": (
        lambda d: d["properties"][0]["prefix"].update(nodes=d["properties"][0]["prefix"]["nodes"][:-3]), RANKS),
    "a rank that rises": (lower_first_rank, RANKS),
    "another set that is missing": (set_in("properties", 1, "lasso", "sets", 3, to=0), RANKS),
    "a run from elsewhere": (
        violated_by_a_run_that(lambda p: p["run"].update(initial=p["run"]["steps"][0][2])),
        "a run does not begin in an initial configuration"),
    "a process that is not there": (set_in("properties", 3, "run", "steps", 0, 0, to=2), NOT_POSSIBLE),
    "a stuttering step before the end": (set_in("properties", 3, "run", "steps", 0, 0, to=None), NOT_POSSIBLE),
    "another process": (another_way, NOT_THERE),
    "a choice that is not read": (lambda d: d["properties"][3]["run"]["steps"][0].__setitem__(1, []), NOT_THERE),
    "a value that a choice does not have": (set_in("properties", 3, "run", "steps", 0, 1, 0, 1, to=2), NOT_THERE),
    "a value outside its range": (set_in("properties", 3, "run", "steps", 0, 2, 0, to=3), POSSIBLE),
    "a loop that does not come back": (set_in("properties", 2, "run", "loop", to=2), LOOP),
    "a loop without a step": (lambda d: d["properties"][2]["run"].update(loop=9), LOOP),
    "a violation with a proof": (set_in("properties", 2, "prefix", to={}), NO_VIOLATION),
    "a lasso without its loop": (set_in("properties", 2, "run", "loop", to=None), NO_VIOLATION),
    "a lasso without its automaton": (set_in("properties", 2, "violations", to=None), NO_VIOLATION),
    "a bad prefix without its automaton": (set_in("properties", 3, "early", to=None), NO_VIOLATION),
    "a prefix that is not bad": (set_in("automata", 3, "bad", to=[]), NO_VIOLATION),
    "a bad prefix of a formula that is true": (set_in("properties", 3, "formula", to=[["true", 0, 0]]), NO_VIOLATION),
    "a lasso of a formula that is true": (set_in("properties", 2, "formula", to=[["true", 0, 0]]), NO_VIOLATION),
    "an unknown operator of formulas": (
        set_in("properties", 2, "formula", to=[["true", 0, 0], ["F", 0, 0]]), "a formula has no such operator"),
    "another trail": (
        set_in("properties", 3, "trail", 0, to=[1]), "the automata do not go where they are said to"),
    "acceptance sets that are not shown": (set_in("automata", 2, "sets", to=1), NO_VIOLATION),
}  # fmt: skip


@pytest.mark.parametrize(("change", "sentence"), FORGED.values(), ids=FORGED)
def test_what_is_wrong_is_said(change: Callable[[Document], None], sentence: str, text: str, folder: Path) -> None:
    document = json.loads(text)
    change(document)
    path = folder / "c.json"
    path.write_text(signed(document))
    (line,), code = checked(path, folder)
    assert code == REJECTED
    assert line.startswith("rejected: ") and sentence in line


def test_a_hash_of_something_else_is_noticed(text: str) -> None:
    document = json.loads(text)
    Certificate(json.loads(text))
    document["steps"] += 1
    with pytest.raises(Rejected, match="a part of it is not the one whose hash it has"):
        Certificate(document)


def test_a_violation_under_assumptions_that_are_false_is_none(tmp_path: Path) -> None:
    """The run is one of the arrangement and violates the property, but an assumption is false on it."""
    document = made("processes", tmp_path)
    violations = document["properties"][2]["violations"]
    false = {"name": "x", "text": "false", "automaton": violations, "formula": [["true", 0, 0], ["not", 0, 0]]}
    document["properties"] = document["properties"][2:3]
    (violated,) = document["properties"]
    violated["trail"] = [[state, state] for (state,) in violated["trail"]]
    document["assumptions"] = [false | {"formula": None}]
    assert code_of(signed(document), tmp_path) == PROVED
    document["assumptions"] = [false]
    assert code_of(signed(document), tmp_path) == REJECTED


COUNTS_TOO_FAR = """
name: far
whiteboard: {n: {type: 0..2, init: 0}}
machines:
  a: {inline: {machine: A, states: [{name: X, internal: n++;, transitions: [{when: "false", to: X}]}]}}
schedule: [a]
"""


def test_a_run_ends_in_its_fault(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(PROBLEMS, "far", (COUNTS_TOO_FAR, "a: G n < 3"))
    text = json.dumps(made("far", tmp_path))
    path = tmp_path / "c.json"

    def said(change: Callable[[Document], None]) -> str:
        document = json.loads(text)
        change(document)
        path.write_text(signed(document))
        return checked(path, tmp_path)[0][0]

    def go_on(document: Document) -> None:
        ((_, run),) = document["faults"]["runs"]
        run["steps"].append(run["steps"][-1])

    def stop_before(document: Document) -> None:
        ((_, run),) = document["faults"]["runs"]
        run["steps"].pop()

    assert said(lambda _: None) == "proved  holds on fault-free runs  a  G n < 3  (3 product states)"
    assert said(go_on) == f"rejected: {NOT_POSSIBLE}"
    assert said(stop_before) == f"rejected: {FAULTS}"
    assert said(lambda d: d["faults"].update(verdict="holds", runs=[])) == f"rejected: {FAULTS}"


def test_another_text_of_the_same_certificate_is_rejected(text: str, folder: Path) -> None:
    path = folder / "c.json"
    path.write_text(json.dumps(json.loads(signed(json.loads(text)))) + "\n")
    (line,), _ = checked(path, folder)
    assert line == "rejected: it is not in the one form of a certificate: keys in order, once each, no spaces"


LETTERS = {
    "about": "",
    "atoms": [0],
    "sets": 1,
    "complete": True,
    "bad": [],
    "edges": [[[1, 0, 0, 1], [0, 1, None, 0]], [[1, 0, 0, 0]]],
}


def test_a_letter_that_a_complete_automaton_does_not_know_is_no_end_of_a_run() -> None:
    automaton = Automaton(LETTERS)
    assert [edge.target for edge in automaton.moves(0, 1)] == [0]
    assert automaton.moves(0, 0) == []
    with pytest.raises(Rejected, match="does not say what it does with a letter that occurs"):
        automaton.moves(1, 0)
    assert Automaton(LETTERS | {"complete": False}).moves(1, 0) == []


def test_a_certificate_whose_automaton_does_not_know_a_letter_is_rejected(text: str, folder: Path) -> None:
    document = json.loads(text)
    document["automata"][0]["edges"][0].pop()
    path = folder / "c.json"
    path.write_text(signed(document))
    (line,), _ = checked(path, folder)
    assert line == "rejected: an automaton does not say what it does with a letter that occurs"


def test_acceptance_sets_stand_side_by_side() -> None:
    """Those of each automaton in order, the one of every letter, those of the goals."""
    one = LETTERS | {"sets": 2, "edges": [[[0, 0, 0, 0b10]]], "complete": False}
    product = Product([one, one], [5])
    ((target, acceptance),) = product.first_moves(1 << 5)
    assert (target, acceptance) == ((0, 0), 0b111010)
    assert product.every_set == 0b111111
    assert product.first_moves(0)[0].acceptance == 0b011010
    assert product.moves((0, 0), None) == [((0, 0), 0)]
    assert Product([one, one | {"edges": []}], []).first_moves(0) == []


@pytest.mark.parametrize(
    ("term", "value"),
    [
        (["const", -3], -3), (["get", 1], -2), (["element", 0, 2, 2], -2), (["neg", 0], -7), (["not", 2], 0),
        (["abs", 1], 2), (["add", 0, 1], 5), (["sub", 0, 1], 9), (["mul", 0, 1], -14), (["div", 0, 1], -3),
        (["mod", 1, 0], -2), (["mod", 0, 1], 1), (["div", 1, 1], 1), (["min", 0, 1], -2), (["max", 0, 1], 7),
        (["eq", 0, 1], 0), (["ne", 0, 1], 1), (["lt", 0, 1], 0), (["le", 0, 0], 1), (["gt", 0, 0], 0),
        (["ge", 0, 0], 1), (["lt", 0, 0], 0), (["le", 0, 1], 0), (["and", 0, 2], 1), (["or", 0, 1], -1),
        (["xor", 0, 2], 6), (["ite", 2, 0, 1], 7), (["ite", 3, 0, 1], -2), (["wrap", 0, 3, 1], 2),
        (["wrap", -2, 1, 0], -1),
    ],
)  # fmt: skip
def test_expressions(term: list[object], value: int) -> None:
    """Over 7, -2, 1 and 0."""
    values = [7, -2, 1, 0]
    terms: list[Expression] = []
    for cell in range(4):
        terms.append(expression_of(["get", cell], terms, values))
    assert expression_of(term, terms, values)(values) == value


@pytest.mark.parametrize(("cell", "fine"), [(-1, False), (0, True), (1, True), (2, False)])
def test_an_index_stays_in_its_array_and_a_value_in_its_range(cell: int, fine: bool) -> None:
    code = Statements([(0, 4), (0, 4), (-5, 6)], [], ["F"])
    for term in (["const", cell], ["const", 3], ["const", 4], ["element", 0, 2, 0]):
        code.add_term(term)
    code.add_block([["put", 0, 2, 0, 1]])
    code.add_block([["put", 0, 2, 0, 2]])
    code.add_block([["fault", 0, 1]])
    cells = [1, 1, 0]
    if fine:
        code.blocks[0](cells, None)  # type: ignore[arg-type]
        assert cells[cell] == 3 and code.terms[3](cells) == 3
    else:
        with pytest.raises(Rejected):
            code.blocks[0](cells, None)  # type: ignore[arg-type]
        with pytest.raises(Rejected):
            code.terms[3](cells)
    with pytest.raises(Rejected):
        code.blocks[1](cells, None)  # type: ignore[arg-type]
    with pytest.raises(Faulted):
        code.blocks[2](cells, None)  # type: ignore[arg-type]


def test_until_goes_round_the_loop() -> None:
    """Of p U q, where q is true only in the part of the loop that comes before."""
    formula = [["atom", 0, 0], ["atom", 1, 0], ["U", 0, 1], ["X", 2, 2], ["X", 3, 3]]
    letters = [1, 2, 1, 1]
    assert true_on(formula, letters, 1)
    assert not true_on(formula, letters, 2)


@pytest.mark.slow
def test_expressions_may_be_deep(tmp_path: Path) -> None:
    """Twenty thousand operators, one inside the other; how deep calls may be elsewhere stays as it was."""
    document = made("counting", tmp_path)
    program, before = document["program"], sys.getrecursionlimit()
    (statement,) = program["blocks"][4]
    assert statement[0] == "set"
    for _ in range(20_000):
        program["terms"].append(["neg", statement[2]])
        statement[2] = len(program["terms"]) - 1
    assert code_of(signed(document), tmp_path) == PROVED
    assert sys.getrecursionlimit() == before
