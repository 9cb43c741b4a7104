"""The SMV models: evaluated by a small evaluator of our own, and by NuSMV where it is installed."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import event, given
from hypothesis import strategies as st

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.extensions.checkers.flat import Identifiers, comment, flatten
from llfsm_verify.extensions.checkers.formulas import NO, PROMELA, SMV, YES, weaken
from llfsm_verify.extensions.checkers.smv import smv
from llfsm_verify.kripke.export.specification import Specification
from llfsm_verify.kripke.structure import Structure
from llfsm_verify.logic import lasso
from llfsm_verify.logic.formula import Formula, atom
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.program.program import Int
from llfsm_verify.program.symbolic import scalars
from llfsm_verify.testing.formulas import Word, formulas, lassos
from tests.extensions.checkers.compare import Tally, nusmv_states, nusmv_verdicts
from tests.extensions.checkers.evaluator import Model, State, formula, literal_divisors, parsed, read
from tests.extensions.checkers.nusmv import needs_nusmv
from tests.extensions.checkers.problems import (
    ARITHMETIC,
    DIVISIONS,
    FAST,
    LARGEST,
    MODELS,
    NOTHING,
    SHIPPED,
    SLOW,
    Problem,
    counter,
    divisions,
    explored,
    model,
    problem,
    problems,
    specification,
    written,
)
from tests.quick import share

Row = tuple[int, ...]


def columns(found: Structure) -> list[tuple[str, int | None]]:
    """The scalars that the model declares."""
    return [
        key
        for v in found.program.vars
        if not v.output and isinstance(v.type, Int) and v.type.low < v.type.high
        for key, _ in scalars(v)
    ]


def rows(found: Structure) -> list[Row]:
    """Each configuration as the model's variables have it."""
    arrays = [found.column(name, index) for name, index in columns(found)]
    return [tuple(int(a[i]) for a in arrays) for i in range(len(found))]


def same_steps(arrangement, lines: PropertySet, keep_all_bits: bool = False) -> str:
    """Initial states, steps and letters of the model are those of the structure."""
    found = explored(arrangement, lines, keep_all_bits=keep_all_bits)
    text = written(smv, specification(arrangement, lines, keep_all_bits=keep_all_bits))
    if found is None or text is None:
        return "too large" if found is None else "refused"
    seen = read(text)
    choices = 1
    for values in seen.inputs.values():
        choices *= len(values)
    if choices * len(found) > 30_000:
        return "too many choices"
    states = seen.reachable(40 * LARGEST)
    if states is None:
        return "too many letters"
    compare(found, seen, states)
    return "compared"


def compare(found: Structure, seen: Model, states: dict[State, set[State]]) -> None:
    width = len(columns(found))
    faulty = seen.names[-1] == "fault"
    letters = len(seen.names) - width - faulty - ("zero" in seen.names)
    assert letters in (0, len(found.propositions))

    def split(state: State) -> tuple[Row, tuple[bool, ...]]:
        return tuple(map(int, state[:width])), tuple(map(bool, state[width : width + letters]))

    def fine(state: State) -> bool:
        return not faulty or state[-1] == 0

    known = rows(found)
    assert len(set(known)) == len(known)
    assert {split(s)[0] for s in states if fine(s)} == set(known)
    if not letters:
        assert sum(map(fine, states)) == len(found)
    assert {int(s[-1]) for s in states if not fine(s)} == ({f + 1 for f in fault_numbers(found)} if faulty else set())
    atoms = found.first.shape[1]
    initial = {
        (known[r], tuple(map(bool, row)) if letters else ()) for r, row in zip(found.roots, found.first, strict=True)
    }
    assert {(c, x[:atoms]) for c, x in map(split, seen.initial())} == initial
    edges = {
        (known[i], known[found.targets[e]], tuple(map(bool, found.alphabet[found.labels[e]])) if letters else ())
        for i in range(len(found))
        for e in range(found.indptr[i], found.indptr[i + 1])
    }
    shown = {(split(s)[0], *split(t)) for s, after in states.items() for t in after if fine(s) and fine(t)}
    assert shown == edges


def fault_numbers(found: Structure) -> set[int]:
    """The numbers of the faults that happen."""
    sites = found.program.faults
    named = {(f.code, f.message, f.place) for f in found.faults}
    return {i for i, s in enumerate(sites) if (s.code, s.message, "" if s.span is None else str(s.span)) in named}


@pytest.mark.slow
@pytest.mark.parametrize("path", MODELS)
def test_models_step_alike(path):
    assert same_steps(model(path)[0], NOTHING) == "compared"


@pytest.mark.slow
@pytest.mark.parametrize("path", MODELS)
def test_models_show_the_same_letters(path):
    assert same_steps(*model(path)) == "compared"


@pytest.mark.parametrize("document", ARITHMETIC)
def test_arithmetic(document):
    assert (
        same_steps(*problem(document, "G (x == x)") if "array" not in str(document) else problem(document))
        == "compared"
    )


@pytest.mark.slow
@FAST
@given(problems(), st.booleans())
def test_random_steps(drawn: Problem, checked: bool):
    event(same_steps(drawn[0], drawn[1] if checked else NOTHING))


@pytest.mark.long
@SLOW
@given(problems(), st.booleans(), st.booleans())
def test_random_steps_many(drawn: Problem, checked: bool, keep_all_bits: bool):
    event(same_steps(drawn[0], drawn[1] if checked else NOTHING, keep_all_bits))


# ---------------------------------------------------------------- divisors


def divisors(arrangement, lines: PropertySet = NOTHING) -> list[frozenset[int | None]]:
    text = written(smv, specification(arrangement, lines))
    return [] if text is None else literal_divisors(text)


@pytest.mark.parametrize("document", DIVISIONS)
def test_no_branch_of_a_divisor_is_the_literal_0(document):
    found = divisors(problem(document)[0])
    assert found and not [d for d in found if 0 in d]
    assert same_steps(problem(document)[0], NOTHING) == "compared"


@pytest.mark.slow
@FAST
@given(problems())
def test_no_branch_of_a_random_divisor_is_the_literal_0(drawn: Problem):
    for found in (divisors(drawn[0]), divisors(*drawn)):
        event("divisions" if found else "no division")
        assert not [d for d in found if 0 in d]


def test_a_wide_divisor_takes_no_table():
    document = counter("uint16", "n = go ? 0 : n + 1; if (n > 0) { x = 65535 / n; }", n={"type": "uint16"})
    found = divisors(problem(document)[0])
    assert {None} in found and not [d for d in found if 0 in d]
    assert len(written(smv, specification(*problem(document)))) < 3_000


def test_what_nusmv_computes_on_literals():
    plain = "DEFINE\n  e0 := (v_c ? 0 : 3);\n  e1 := ((e0 = 0) ? 1 : e0);\n  e2 := (4 / e1);\n"
    assert literal_divisors(plain) == [{0, 1, 3}]
    assert literal_divisors(plain.replace("4 / e1", "4 / (e1 + (v_x - v_x))")) == [{None}]
    assert literal_divisors(plain.replace("4 / e1", "4 mod ((e0 - 3) * v_x)")) == [{0, None}]


# ---------------------------------------------------------------- formulas


@pytest.mark.slow
@given(formulas(), lassos())
def test_formulas_mean_the_same(f: Formula, word: tuple[Word, Word]):
    back = formula(parsed(SMV.text(f, lambda key: key)))
    assert lasso.evaluate(back, *word) == lasso.evaluate(f, *word)


SPIN_SIGNS = {"[]": "G", "<>": "F", "&&": "&", "||": "|", "true": "TRUE", "false": "FALSE", "W": "W"}


@pytest.mark.slow
@given(formulas(), lassos())
def test_promela_formulas_mean_the_same(f: Formula, word: tuple[Word, Word]):
    """Spelled in SMV's signs; `W`, which SMV lacks, by its meaning."""
    if any(node == "W" for node in str(f).split()):
        return
    text = " ".join(
        SPIN_SIGNS.get(w, w) for w in PROMELA.text(f, lambda key: key).replace("(", "( ").replace(")", " )").split()
    )
    assert lasso.evaluate(formula(parsed(text)), *word) == lasso.evaluate(f, *word)


@pytest.mark.slow
@given(formulas(), lassos())
def test_weakened_formulas_mean_the_same_where_nothing_is_cut_off(f: Formula, word: tuple[Word, Word]):
    assert weakly(f, word) == lasso.evaluate(f, *word)


@pytest.mark.slow
@given(formulas(), lassos())
def test_a_weakened_formula_holds_on_what_is_cut_off_before_a_model(f: Formula, word: tuple[Word, Word]):
    """A prefix of a word that satisfies the formula is never counted as bad."""
    stem, loop = word
    if lasso.evaluate(f, stem, loop):
        every = frozenset(mark + key for mark in (YES, NO) for key in ("p", "q", "r"))
        cut = [[*map(literals, stem)], [every]]
        assert lasso.evaluate(weaken(f), *cut)


def literals(letter: frozenset[str]) -> frozenset[str]:
    return frozenset(YES + key if key in letter else NO + key for key in ("p", "q", "r"))


def weakly(f: Formula, word: tuple[Word, Word]) -> bool:
    return lasso.evaluate(weaken(f), *([literals(letter) for letter in part] for part in word))


def test_a_bad_prefix_is_seen_behind_the_cut():
    p = atom("p")
    from llfsm_verify.logic.formula import apply

    every = frozenset((YES + "p", NO + "p"))
    assert not lasso.evaluate(weaken(apply("G", p)), [literals(frozenset("p")), literals(frozenset())], [every])
    assert lasso.evaluate(weaken(apply("F", p)), [literals(frozenset())], [every])


# ---------------------------------------------------------------- NuSMV itself

ALIKE = Tally(["alike"])
RANDOM_SECONDS = 10
"""Of processor time, for one random problem: most take less than 0.1 s, and a few have wide diagrams."""
NARROW = [d for d in ARITHMETIC if "uint16" not in str(d)]
"""Diagrams of 65,536 values and their quotients take NuSMV minutes; the others take it less than 0.1 s."""


@needs_nusmv
@pytest.mark.parametrize("document", [*NARROW, *DIVISIONS])
def test_nusmv_counts(document):
    assert nusmv_states(problem(document)[0]) == ALIKE


@needs_nusmv
@pytest.mark.parametrize("document", DIVISIONS)
def test_nusmv_divides_alike(document):
    word = "x" if document["whiteboard"]["x"] == {"type": "bool"} else "x == 0"
    found = nusmv_verdicts(*problem(document, f"a: G F ({word})", f"b: F G ({word})", f"c: G !({word})"))
    assert set(found) == {"alike"} and found["alike"] == 3


DECIDED = [path for path in SHIPPED if Path(path).parent.name in ("ball_conditions", "distance_sensor")]
"""NuSMV answers everything about them within 7 s of processor time; of the larger ones `compare models` tells."""
COUNTED = [*DECIDED, *(path for path in SHIPPED if Path(path).parent.name in ("fruit_picking", "microwave"))]
"""It counts their states within 3 s."""
WHOLE, FAULTY = ([p for p in COUNTED if (Path(p).stem == "arrangement") is whole] for whole in (True, False))
"""Of faulty versions, which have the same constructs, a quarter is tried."""
TRIED = [*WHOLE, *(path for number, path in enumerate(FAULTY) if share(number, 4))]


@needs_nusmv
@pytest.mark.parametrize("path", [*MODELS, *(pytest.param(p, marks=pytest.mark.slow) for p in TRIED)])
def test_nusmv_counts_the_models(path):
    assert nusmv_states(load_arrangement(path), None) == ALIKE


@needs_nusmv
@pytest.mark.parametrize("path", [*MODELS, *(pytest.param(p, marks=pytest.mark.long) for p in DECIDED if p in TRIED)])
def test_nusmv_answers_alike(path):
    assert set(nusmv_verdicts(*model(path), None)) <= {"alike", "hidden"}


def counted(tally: Tally) -> None:
    for what in tally:
        event(what)
    assert "different" not in tally


@pytest.mark.slow
@needs_nusmv
@FAST
@given(problems() | divisions())
def test_nusmv_counts_random_problems_alike(drawn: Problem):
    counted(nusmv_states(drawn[0], seconds=RANDOM_SECONDS))


@needs_nusmv
@pytest.mark.long
@SLOW
@given(problems() | divisions())
def test_nusmv_answers_random_problems_alike(drawn: Problem):
    counted(nusmv_states(drawn[0], seconds=RANDOM_SECONDS))
    counted(nusmv_verdicts(*drawn, seconds=RANDOM_SECONDS))


# ---------------------------------------------------------------- what is refused


def test_mathematical_integers_are_refused():
    with pytest.raises(DiagnosticError) as raised:
        smv(specification(*problem(counter("int", "x++;"))))
    assert [d.code for d in raised.value.diagnostics] == ["E420"]


def test_only_what_is_needed_is_left():
    """Without properties no output stays that the steps do not read."""
    arrangement, _ = model(MODELS[0])
    flat = flatten(specification(arrangement, NOTHING))
    assert not [v.name for v in flat.vars if v.output] and not flat.stutter


def test_without_goals_no_output_is_left() -> None:
    lights = "models/traffic_lights/arrangement.yaml"
    lines = parse_properties([Source("p", "G (ns@GREEN -> F ew@GREEN)")])
    whole = specification(load_arrangement(lights), lines)
    assert {a.output for a in whole.program.atoms} <= {v.name for v in flatten(whole).vars}
    nothing = flatten(Specification(whole.program))
    assert not [v.name for v in nothing.vars if v.output]


def test_identifiers_look_like_names_and_are_given_once() -> None:
    ids = Identifiers("v_a", "v_taken")
    names = ("a", "a", "b.c", "b c", "b__c", "é", "_x_", "taken", "taken", "x")
    assert [ids.new("v_", name) for name in names] == [
        "v_a_2", "v_a_3", "v_b_c", "v_b_c_2", "v_b_c_3", "v_", "v_x", "v_taken_2", "v_taken_3", "v_x_2",
    ]  # fmt: skip


def test_comments_stay_in_their_line_and_open() -> None:
    assert comment("a\n*/  b\t\x07c") == "a * / b c"


@pytest.mark.slow
def test_a_formula_too_long_to_be_read_is_refused() -> None:
    lights = load_arrangement("models/traffic_lights/arrangement.yaml")
    long = parse_properties([Source("p", "long: G[0:900] F[0:900] ns@GREEN")])
    with pytest.raises(DiagnosticError) as raised:
        smv(specification(lights, long))
    assert [d.code for d in raised.value.diagnostics] == ["E424"]
    assert "long" in raised.value.diagnostics[0].message
