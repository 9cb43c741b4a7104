"""Bounds of a thousand steps: nothing recurses as deep as they are, and limits end what takes long."""

from __future__ import annotations

import pytest

from llfsm_verify.automata.automaton import Automaton
from llfsm_verify.automata.ltl.answers import Answers, classify_any
from llfsm_verify.automata.ltl.translation import automaton_of
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.limits import LimitReached, ticking
from llfsm_verify.logic.bounds import without_steps
from llfsm_verify.logic.formula import Formula, depth
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.rewriting.simplify import simplify_any
from llfsm_verify.logic.syntaxes import parse_in


def read(text: str) -> Formula:
    return parse_in("llfsm", Fragment.whole(Source("t", text))).formula


class Counted:
    """A limit in calls, in the place of one in seconds."""

    def __init__(self, most: int) -> None:
        self.left = most

    def __call__(self) -> None:
        self.left -= 1
        if self.left < 0:
            raise LimitReached("so many calls")


@pytest.mark.parametrize(
    ("text", "same"),
    [
        ("F[1:2] F[3:5] p", "F[4:7] p"),
        ("G[0:2] G[1:1] p", "G[1:3] p"),
        ("X[2] X[3] p", "X[5] p"),
        ("X[2] F[0:3] p", "F[2:5] p"),
        ("G[1:3] X[2] p", "G[3:5] p"),
        ("F[0:1] X[1] F[0:1] X[1] p", "F[2:4] p"),
    ],
)
def test_bounds_inside_each_other_are_one_bound(text: str, same: str) -> None:
    assert without_steps(read(text)) is without_steps(read(same))


@pytest.mark.parametrize(
    "text", ["F[0:2] G[0:2] p", "G[1:2] F[0:1] p", "F[1:2] (q || F[0:2] p)", "X G[0:1] X[2] F[0:2] p"]
)
def test_other_bounds_mean_what_they_did(text: str) -> None:
    formula = read(text)
    written = without_steps(formula)
    for number in range(1 << 7):
        word = [frozenset({"p"} if number >> i & 1 else {"q"} if i % 3 == 0 else ()) for i in range(7)]
        assert evaluate(formula, word[:4], word[4:]) == evaluate(written, word[:4], word[4:]), number


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("F[0:1000] F[0:1000] p", marks=pytest.mark.slow),
        pytest.param("G[0:1000] G[0:1000] p", marks=pytest.mark.slow),
        "X[1000] X[1000] p",
        "F[0:1000] p",
        "X[1000] p",
    ],
)
def test_a_chain_of_a_thousand_steps_takes_linear_work(text: str) -> None:
    """A state a step, and a few calls of the limit for each. Partitions were refined a thousand times before."""
    formula = read(text)
    with ticking(Counted(150_000)):
        automaton = automaton_of(formula)
    assert isinstance(automaton, Automaton) and depth(without_steps(formula)) >= 1_000
    assert len(automaton.edges) in range(1_000, 2_003)


@pytest.mark.parametrize(
    "text", ["F[0:300] G[0:300] p", "F[0:900] (q && F[0:900] p)", "G F F[0:1000] p", "F[0:300] (q || F[0:300] p)"]
)
@pytest.mark.parametrize("most", [100, pytest.param(5_000, marks=pytest.mark.slow)])
def test_a_limit_ends_every_question(text: str, most: int) -> None:
    """No recursion error on the way, whatever is asked first."""
    formula: Formula = read(text)
    for ask in (
        lambda: classify_any(formula),
        lambda: simplify_any(formula),
        lambda: automaton_of(formula),
        lambda: Answers().word(formula),
        lambda: Answers().difference(formula, read("p")),
        lambda: Answers().automaton(formula, buchi=True),
    ):
        limit = Counted(most)
        try:
            with ticking(limit):
                ask()
        except LimitReached:
            assert limit.left < 0
