"""The verifier by itself: plain, alone, never surprised, and of the same opinion as the oracles about each part."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, assume, given, settings

from llfsm_verify import certificate as verifier
from llfsm_verify.analysis.certificates.written import formula_json
from llfsm_verify.backends.reference import Interpreter
from llfsm_verify.certificate import REJECTED, Program, Rejected, checked, true_on
from llfsm_verify.logic.formula import Formula
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.program.json import program_json
from llfsm_verify.program.program import Program as StepProgram
from llfsm_verify.testing.formulas import ATOMS, formulas, lassos
from llfsm_verify.testing.programs import programs
from tests.quick import examples, many

FILE = Path(verifier.__file__)


def test_it_imports_the_standard_library_only_and_makes_no_code_of_text() -> None:
    tree = ast.parse(FILE.read_text())
    names = {
        name.split(".")[0]
        for node in ast.walk(tree)
        if isinstance(node, (ast.Import, ast.ImportFrom))
        for name in ([node.module or ""] if isinstance(node, ast.ImportFrom) else [a.name for a in node.names])
    }
    assert "json" in names
    assert names <= set(sys.stdlib_module_names)
    assert not {"exec", "eval", "compile"} & {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}


GENERATED = [HealthCheck.too_slow, HealthCheck.data_too_large]


@pytest.mark.slow
@settings(max_examples=examples(40), suppress_health_check=GENERATED)
@given(programs())
def test_it_steps_as_the_reference_interpreter_does(program: StepProgram) -> None:
    same_steps(program)


@pytest.mark.long
@settings(max_examples=many(1500), suppress_health_check=GENERATED)
@given(programs())
def test_it_steps_as_the_reference_interpreter_does_at_length(program: StepProgram) -> None:
    same_steps(program)


def same_steps(program: StepProgram) -> None:
    """Two steps deep from the first configuration: the same successors in the same order, letters and faults."""
    ours, theirs = Program(json.loads(json.dumps(program_json(program)))), Interpreter(program)

    def flat(values) -> tuple[int, ...]:
        return tuple(x for v in values.values() for x in (v if isinstance(v, tuple) else (v,)))

    start = {v.name: v.init for v in program.vars if not v.output}
    fresh = {v.name: v.init for v in program.vars if v.output} | {program.cycle: 1}
    shown = [a.output for a in program.atoms]
    for condition in program.fairness:
        shown += [name for name in (condition.premise, condition.goal) if name is not None]
    todo, taken = [(start, fresh, 0)], 0
    for values, outputs, depth in todo:
        in_cycle = program.observe == "cycle" and outputs[program.cycle] == 0 and depth > 0
        node = flat(values) + (flat(outputs) if in_cycle else ())
        found = ours.successors(node)
        for process, outcome in theirs.successors(values, outputs):
            assume(taken < 3_000)
            taken += 1
            if outcome.overflow:
                return  # no certificate is made of such a program
            got = next(found)
            if outcome.fault is not None:
                assert (got.node, got.letter, got.fault) == (None, None, outcome.fault)
                continue
            silent = process is not None and program.observe == "cycle" and not outcome.outputs[program.cycle]
            letter = None if silent else sum(1 << i for i, name in enumerate(shown) if outcome.outputs[name])
            target = flat(outcome.values) + (flat(outcome.outputs) if silent else ())
            assert (got.node, got.letter, got.fault) == (target, letter, None)
            if depth == 0:
                todo.append((outcome.values, fresh if not silent else outcome.outputs, depth + 1))
        assert next(found, None) is None


@settings(max_examples=examples(150))
@given(formulas(), lassos())
def test_it_evaluates_formulas_as_the_definition_does(
    formula: Formula, word: tuple[tuple[frozenset[str], ...], tuple[frozenset[str], ...]]
) -> None:
    stem, loop = word
    written = json.loads(json.dumps(formula_json(formula, {a: i for i, a in enumerate(ATOMS)})))
    masks = [sum(1 << i for i, a in enumerate(ATOMS) if a in letter) for letter in (*stem, *loop)]
    assert true_on(written, masks, len(stem)) == evaluate(formula, stem, loop)


MALFORMED = {
    "nothing": "",
    "no object": "[]\n",
    "a number": "7\n",
    "no JSON": "{\n",
    "not canonical": '{"format": 1}\n',
    "a key twice": '{"format":1,"format":1}\n',
    "no keys": "{}\n",
    "nested deeply": "[" * 100_000 + "]" * 100_000 + "\n",
    "a long number": "9" * 100_000 + "\n",
    "not a number": "NaN\n",
    "a surrogate": '"\\ud800"\n',
}


@pytest.mark.parametrize("text", MALFORMED.values(), ids=MALFORMED)
def test_what_is_no_certificate_is_rejected_in_a_sentence(text: str, tmp_path: Path) -> None:
    path = tmp_path / "c.json"
    path.write_text(text)
    (line,), code = checked(path, tmp_path)
    assert code == REJECTED
    assert line.startswith("rejected: ")


def test_what_is_no_text_or_not_there_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "c.json"
    path.write_bytes(b"\xff\xfe\x00")
    assert checked(path, tmp_path)[1] == REJECTED
    assert checked(tmp_path / "none.json", tmp_path)[1] == REJECTED
    assert checked(tmp_path, tmp_path)[1] == REJECTED


def test_numbers_of_the_program_do_not_grow_without_end() -> None:
    """A certificate that squares again and again is refused, not computed forever."""
    terms = [["const", 3], *(["mul", i, i] for i in range(60))]
    letter = {"first": [], "cells": [], "cycle": 0, "stutter": 0}
    program = Program(
        {
            "name": "squares", "observe": "ringlet", "sizes": [1, 1], "cells": [["x", 0, 1, 0, False]], "choices": [],
            "inputs": [], "terms": terms, "blocks": [[["set", 0, 60]]], "processes": [["p", None, 0]],
            "letter": letter, "fairness": [], "faults": [],
        }
    )  # fmt: skip
    with pytest.raises(Rejected):
        list(program.successors((0,)))


def test_it_runs_alone(tmp_path: Path) -> None:
    """Copied elsewhere, without site packages and without this package."""
    copy = tmp_path / "check.py"
    copy.write_text(FILE.read_text())
    (tmp_path / "c.json").write_text("{}\n")
    done = subprocess.run(
        [sys.executable, "-I", "-S", str(copy), "c.json"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (1, "")
    assert done.stdout.startswith("rejected: ")
    usage = subprocess.run([sys.executable, "-I", "-S", str(copy)], capture_output=True, text=True, check=False)
    assert usage.returncode == 2
