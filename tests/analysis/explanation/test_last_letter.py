"""The marks of rules and automata: least sets of changes of the last letter, against the definition of the property."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from llfsm_verify.analysis.explanation.causes import changes
from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.automata.finite.monitor import EmptyWordForbidden, NoWord, RegularMonitor
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.formula import Formula, apply, atom, atoms, negation
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.logic.regular import RegularKind
from llfsm_verify.logic.regular_evaluate import is_bad
from llfsm_verify.testing.formulas import Word, letters
from llfsm_verify.verification.verify import verify
from tests.quick import examples

KEYS = ("p", "q", "r")
LETTER = st.sampled_from([atom(k) for k in KEYS] + [negation(atom("p")), apply("and", atom("p"), atom("q"))])
EXPRESSIONS = st.recursive(
    LETTER,
    lambda inner: st.one_of(
        st.tuples(st.sampled_from(["seq", "alt"]), inner, inner).map(lambda x: apply(x[0], x[1], x[2])),
        inner.map(lambda x: apply("repeat", x, bound="1:")),
    ),
    max_leaves=4,
)
KINDS = st.sampled_from(["enforce", "forbid", "forbid initially"])


def by_definition(kind: RegularKind, expression: Formula, word: Word) -> set[str]:
    """The atoms in the least sets whose change in the last letter makes the word no bad prefix."""
    keys = atoms(expression)
    sets = [frozenset(c) for size in range(1, len(keys) + 1) for c in combinations(keys, size)]
    good = [s for s in sets if not is_bad(kind, expression, [*word[:-1], word[-1] ^ s])]
    return {key for s in good if not any(t < s for t in good) for key in s}


def check(kind: RegularKind, expression: Formula, word: Word) -> None:
    try:
        monitor = RegularMonitor(kind, expression, KEYS)
    except (NoWord, EmptyWordForbidden):
        assume(False)
    bad = [is_bad(kind, expression, word[: i + 1]) for i in range(len(word))]
    assume(any(bad))
    word = word[: bad.index(True) + 1]
    assert changes(monitor, KEYS, word) == by_definition(kind, expression, word)


@settings(max_examples=examples(40), deadline=None)
@given(KINDS, EXPRESSIONS, st.lists(letters(KEYS), min_size=1, max_size=4))
def test_marks_of_rules_are_the_least_sets_of_changes(kind: RegularKind, expression: Formula, word: Word) -> None:
    check(kind, expression, word)


@pytest.mark.long
@settings(max_examples=1_000, deadline=None)
@given(KINDS, EXPRESSIONS, st.lists(letters(KEYS), min_size=1, max_size=5))
def test_marks_of_rules_at_length(kind: RegularKind, expression: Formula, word: Word) -> None:
    check(kind, expression, word)


HOA = """HOA: v1
States: 2
Start: 0
AP: 1 "{}"
acc-name: {}
Acceptance: {}
--BODY--
{}
--END--
"""


def trace_of(folder: Path, line: str, text: str):
    (folder / "a.hoa").write_text(text, encoding="utf-8")
    lines = parse_properties([Source(str(folder / "x.ltl"), line)])
    trace = (
        verify(load_arrangement("models/traffic_lights/arrangement.yaml"), lines, engine="explicit").properties[0].trace
    )
    assert trace is not None
    return trace, {(i, c.atom) for i, step in enumerate(trace.steps, 1) for c in step.causes}


def test_an_automaton_that_accepts_no_continuation(tmp_path: Path) -> None:
    allowed = HOA.format("ns@GREEN", "all", "0 t", "State: 0\n[!0] 0\nState: 1")
    trace, marks = trace_of(tmp_path, "automaton never_green: a.hoa", allowed)
    assert marks == {(2, "ns@GREEN")}
    assert trace.because == "after what it shows at step 2 the automaton accepts nothing that could follow"


def test_an_automaton_that_accepts_an_infinite_run(tmp_path: Path) -> None:
    # Accepted is what is not green from some point on.
    body = "State: 0\n[t] 0\n[!0] 1\nState: 1 {0}\n[!0] 1"
    trace, marks = trace_of(tmp_path, "automaton never quiet: a.hoa", HOA.format("ew@GREEN", "Buchi", "1 Inf(0)", body))
    assert trace.because == "the automaton accepts the run" and trace.loop is not None
    # Any step of the loop that showed it would mend the run.
    assert marks == {(i, "ew@GREEN") for i in range(trace.loop + 1, len(trace.steps) + 1)}
