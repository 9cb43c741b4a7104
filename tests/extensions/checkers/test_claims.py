"""Never claims accept the words that their automata accept, and the header of a model says how it is checked."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import product

import networkx as nx
import pytest

from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.automata.automaton import Automaton
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.extensions.checkers.formulas import PROMELA, fair, never_claim, readable
from llfsm_verify.extensions.checkers.promela.model import promela
from llfsm_verify.logic.formula import Formula
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.parsing.formulas import parse_formula
from llfsm_verify.logic.properties import PropertySet, parse_properties
from tests.extensions.checkers.problems import specification

LETTERS = [frozenset(), frozenset("p"), frozenset("q"), frozenset("pq")]
WORDS = [
    (stem, loop)
    for m, n in product((0, 1), (1, 2))
    for stem in product(LETTERS, repeat=m)
    for loop in product(LETTERS, repeat=n)
]
Claim = dict[str, list[tuple[list[str], str]]]


def parsed(text: str) -> Formula:
    return parse_formula(Fragment.whole(Source("t", text))).formula


def read(text: str) -> tuple[str, Claim]:
    """The first label of a claim, and for each label the conjuncts and the label after of each option."""
    lines = text.splitlines()
    inner = [line for line in lines if line.startswith("  ") and "::" not in line]
    assert inner == ["  if", "  fi;"] * (len(inner) // 2 - 1) + ["  if", "  fi"]
    lines = [line for line in lines if line not in inner]
    assert re.fullmatch(r"never name \{( /\* no word \*/)?", lines[0]) and lines[-1] == "}"
    claim: Claim = {}
    for line in lines[1:-1]:
        if line.endswith(":"):
            options = claim.setdefault(line[:-1], [])
            continue
        found = re.fullmatch(r"  :: \(?(.*?)\)? -> goto (\w+)", line)
        assert found is not None, line
        options.append((found[1].split(" && "), found[2]))
    return next(iter(claim)), claim


def accepts(text: str, stem: Sequence[frozenset[str]], loop: Sequence[frozenset[str]]) -> bool:
    """Whether a claim reads a word whose letters are shown with `tick`, and again without it, forever."""
    first, claim = read(text)
    shown = [side for letter in (*stem, *loop) for side in (letter | {"tick"}, letter)]
    graph = nx.DiGraph()
    for i, here in enumerate(shown):
        after = i + 1 if i + 1 < len(shown) else 2 * len(stem)
        for label, options in claim.items():
            for conjuncts, target in options:
                if all((c[1:] not in here) if c.startswith("!") else c in here for c in conjuncts):
                    graph.add_edge((i, label), (after, target))
    if (0, first) not in graph:
        return False
    reached = graph.subgraph({(0, first)} | nx.descendants(graph, (0, first)))
    return any(
        any(label.startswith("accept") for _, label in part)
        for part in nx.strongly_connected_components(reached)
        if len(part) > 1 or any(reached.has_edge(node, node) for node in part)
    )


@pytest.mark.parametrize(
    "text",
    ["p", "X p", "G p", "F p", "p U q", "G F p", "F G p", "G F p && G F q", "G (p -> F q)", "false",
     "F (p && X (q U p))", "(G F p) && F q", "G (p -> X q)", "G F p && G F q && G F !p"],
)  # fmt: skip
def test_a_claim_accepts_what_its_automaton_does(text: str) -> None:
    f = parsed(text)
    claim = never_claim("name", translate(f, ("p", "q")), lambda key: key)
    for stem, loop in WORDS:
        assert accepts(claim, stem, loop) == evaluate(f, stem, loop), (stem, loop)


def test_an_automaton_without_states_accepts_nothing() -> None:
    assert never_claim("name", Automaton(("p",), (), 1), lambda key: key) == (
        "never name { /* no word */\nT0:\n  if\n  :: false -> goto T0\n  fi\n}"
    )


def test_fairness_as_a_formula() -> None:
    assert str(fair(None, "g")) == "G F g"
    assert str(fair("p", "g")) == "G F p -> G F g"


@pytest.mark.parametrize(
    ("text", "is_readable"),
    [("G (p -> F q)", True), ("G X p", False), ("(p U q) && (q U p)", True), ("G F p && G F q && G p", True),
     ("(p U q) && (q U p) && (p R q)", False), (" && ".join(f"p{i}" for i in range(59)), True),
     (" && ".join(f"p{i}" for i in range(60)), False)],
)  # fmt: skip
def test_what_spin_is_asked_to_translate(text: str, is_readable: bool) -> None:
    assert readable(parsed(text)) is is_readable
    assert PROMELA.text(parsed("p U q"), lambda key: f"_{key}") == "(_p U _q)"


def header(body: str, lines: str = "", size: int = 2, **keys: object) -> list[str]:
    """The comment of a model with one machine, without its end."""
    states = [{"name": "A", "internal": body, "transitions": [{"when": "go", "to": "A"}]}]
    document = {
        "name": "lights",
        "whiteboard": {
            "go": {"type": "bool", "role": "input"},
            "n": {"type": "0..3"},
            "a": {"type": {"array": "0..70000", "size": size}},
        },
        "machines": {"m": {"inline": {"machine": "M", "states": states}}},
        "schedule": ["m"],
        **keys,
    }
    asked = parse_properties([Source("t", lines)]) if lines else PropertySet(())
    text = promela(specification(build_arrangement(document), asked, keep_all_bits=True))
    assert text.startswith("/* ")
    above, _, below = text.partition(" */")
    assert below.startswith("\n")
    return above.splitlines()


FIRST = "/* The arrangement lights, written by llfsm kripke."


def test_the_commands_that_count_states() -> None:
    counting = ["     spin -o2 -a FILE", "     gcc -w -O2 -DSAFETY -DNOREDUCE -o pan pan.c"]
    stores = "   SPIN stores one state per configuration; a {} is one atomic sequence:"
    assert header("n = 1;") == [FIRST, stores.format("ringlet"), *counting, "     ./pan -m1000000"]
    assert header("n = 1;", cycle_ms=10, observe="cycle")[1] == stores.format("cycle")
    assert header("n++;")[4:] == [
        "     ./pan -m1000000    stops at the first fault: an assertion",
        "     ./pan -m1000000 -A -E    counts; a fault leads to the initial configuration",
    ]


def test_the_commands_that_check() -> None:
    found = header("n = 1;", "assume fair: G F go\nassume other: G F !go\na: G n <= 1")
    assert found == [
        FIRST,
        "   A letter is held until the next step is complete, so that formulas without X keep their meaning.",
        "   The others, and long ones, are never claims of ours, which read a letter where `tick` holds.",
        "     spin -o2 -a FILE",
        "     gcc -w -O2 -DNOREDUCE -o pan pan.c",
        "     ./pan -m1000000 -a -N NAME    for each ltl block and never claim",
        "   Assumed: fair, other.",
    ]
    assert header("n = 1;", "a: G n <= 1") == found[:-1]


@pytest.mark.parametrize(("size", "option"), [(200, ""), (300, "4096"), (600, "8192")])
def test_room_for_many_variables(size: int, option: str) -> None:
    """SPIN takes 1024 bytes for enough; an `int` takes four of them, and twice what the variables take is asked for."""
    (line,) = (line for line in header("n = 1;", size=size) if "gcc" in line)
    assert re.findall(r"-DVECTORSZ=(\d+)", line) == ([option] if option else [])
