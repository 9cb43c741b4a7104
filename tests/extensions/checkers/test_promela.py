"""SPIN's counts and verdicts on the Promela models, against our own."""

from __future__ import annotations

import subprocess

import pytest
from hypothesis import event, given

from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.checking.verdict import Options
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.extensions.checkers.promela.model import promela
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.verification.verify import verify
from tests.extensions.checkers.compare import Tally, spin_states, spin_verdicts
from tests.extensions.checkers.problems import (
    ARITHMETIC,
    DIVISIONS,
    FAST,
    MODELS,
    SLOW,
    Problem,
    counter,
    model,
    problem,
    problems,
    specification,
    written,
)
from tests.extensions.checkers.spin import needs_spin

ALIKE = Tally(["alike"])


def counted(tally: Tally) -> None:
    for what in tally:
        event(what)
    assert "different" not in tally


each_model = pytest.mark.parametrize(
    "path", [MODELS[0], *(pytest.param(path, marks=pytest.mark.slow) for path in MODELS[1:])]
)


@pytest.mark.slow
@needs_spin
@each_model
def test_models_have_as_many_states(path):
    arrangement, _ = model(path)
    assert spin_states(arrangement, None) == ALIKE


@pytest.mark.slow
@needs_spin
@each_model
def test_models_have_the_same_verdicts(path):
    assert set(spin_verdicts(*model(path), None)) <= {"alike", "hidden"}


@pytest.mark.slow
@needs_spin
@FAST
@given(problems())
def test_random_counts(drawn: Problem):
    counted(spin_states(drawn[0]))


@pytest.mark.slow
@needs_spin
@FAST
@given(problems())
def test_random_verdicts(drawn: Problem):
    counted(spin_verdicts(*drawn))


@needs_spin
@pytest.mark.long
@SLOW
@given(problems())
def test_random_counts_many(drawn: Problem):
    counted(spin_states(drawn[0], keep_all_bits=True))


@needs_spin
@pytest.mark.long
@SLOW
@given(problems())
def test_random_verdicts_many(drawn: Problem):
    counted(spin_verdicts(*drawn))


@needs_spin
@pytest.mark.parametrize("document", [*ARITHMETIC, *(pytest.param(d, marks=pytest.mark.slow) for d in DIVISIONS)])
def test_arithmetic(document):
    assert spin_states(problem(document)[0]) == ALIKE


@pytest.mark.slow
@needs_spin
def test_next_step_and_fairness(tmp_path):
    document = counter("0..3", "if (go) { x = (x + 1) % 4; }")
    lines = [
        "a: G (x == 1 -> X (x == 1 || x == 2))", "b: G (x == 1 -> X (x == 2))",
        "c: X X !(x == 3)", "d: X X X !(x == 3)", "e: G (x == 0 -> F (x == 1))",
        "assume f: G F go", "g: (x == 0) W (x == 1)", "h: (x == 1) M (x == 0)",
    ]  # fmt: skip
    arrangement, properties = problem(document, *lines)
    assert set(spin_verdicts(arrangement, properties)) == {"alike"}
    text = promela(specification(arrangement, properties))
    assert "never a {" in text and "ltl g {" in text


def test_mathematical_integers_are_refused():
    with pytest.raises(DiagnosticError) as raised:
        promela(specification(*problem(counter("int", "x++;"))))
    assert [d.code for d in raised.value.diagnostics] == ["E420"]
    assert "0..1000" in str(raised.value.diagnostics[0].hint)


@pytest.mark.parametrize("kind", ["uint32", "int32"])
def test_numbers_beyond_32_bits_are_refused(kind):
    with pytest.raises(DiagnosticError) as raised:
        promela(specification(*problem(counter(kind, "x = x + 1;"))))
    assert [d.code for d in raised.value.diagnostics] == ["E421"]


def test_hostile_names_and_texts_cannot_leave_their_comments():
    document = counter("0..3", "x = (x + 1) % 4;")
    document["name"] = "a */ int boom; /*\nb"
    text = promela(specification(*problem(document, "init: G !(x == 9)")))
    head = text[: text.index("/* The configuration")]
    assert head.count("*/") == 1 and "ltl init_2 " in text


@pytest.mark.slow
@needs_spin
def test_fairness_of_processes():
    document = counter("0..3", "x = (x + 1) % 4;")
    document["machines"]["other"] = {"inline": {"machine": "other", "states": [{"name": "A", "transitions": [
        {"to": "B", "when": "x == 0"}]}, {"name": "B", "transitions": [{"to": "A", "when": "x != 0"}]}]}}  # fmt: skip
    del document["schedule"]
    document["processes"] = {"one": ["m"], "two": ["other"]}
    lines = ["a: G F x == 1", "b: G F !(x == 1)", "c: F G x == 1", "d: F other@B", "e: G !(x == 3)"]
    arrangement, properties = problem(document, *lines)
    assert set(spin_verdicts(arrangement, properties)) == {"alike"}
    verdicts = {
        p.name: p.verdict.value for p in verify(arrangement, properties, Options(), engine="explicit").properties
    }
    assert verdicts == {"a": "holds", "b": "holds", "c": "violated", "d": "violated", "e": "violated"}


@pytest.mark.slow
@needs_spin
@pytest.mark.parametrize("lines", [(), ("G F (x == 0)",)])
def test_the_commands_in_the_model_give_no_warnings(tmp_path, lines):
    drawn = problem(counter("0..5", "x = (x + 1) % 6;"), *lines)
    text = written(promela, specification(*drawn))
    assert text is not None
    (tmp_path / "FILE").write_text(text)
    commands = [line.strip() for line in text.splitlines() if line.strip().startswith(("spin ", "gcc "))]
    assert len(commands) == 2
    for command in commands:
        done = subprocess.run(command.split(), cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0 and done.stderr == ""


def test_an_array_of_negative_numbers_is_stored_from_zero() -> None:
    """SPIN reads no negative numbers in the list of first values; the type has room for all values."""
    document = {
        "whiteboard": {"row": {"type": {"array": "-100..200", "size": 2}, "init": ["-100", "7"]}},
        "machines": {"m": {"inline": {"machine": "M", "states": [{"name": "A", "internal": "row[0] = row[1];"}]}}},
        "schedule": ["m"],
    }
    text = promela(specification(build_arrangement(document), PropertySet()))
    assert "short v_row[2] = { 0, 107 }" in text
