"""Test vectors: performed again they cover what they say, and damaged files are refused with a place."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

from llfsm_verify.analysis.coverage.measure import coverage
from llfsm_verify.analysis.coverage.search import find_vectors
from llfsm_verify.analysis.coverage.vectorfile import program_hash, read_vectors, vectors_text
from llfsm_verify.analysis.coverage.vectors import Sequence, Vectors
from llfsm_verify.arrangement import build_arrangement, load_arrangement
from llfsm_verify.backends.reference import Interpreter
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.runtime.live.plan import runnable, starting_values
from llfsm_verify.semantics.lowering import lower
from tests.analysis.coverage.test_measure import COUPLED, write
from tests.analysis.coverage.test_random import decisive
from tests.cli.running import llfsm
from tests.quick import examples


def interpreted(program, vectors: Vectors, run: Sequence) -> tuple[list[tuple[int, ...]], int]:
    """The records and the fault of a sequence, by the interpreter."""
    interpreter, records = Interpreter(program), []
    values = {v.name: v.init for v in program.vars if not v.output}
    outputs = {v.name: v.init for v in program.vars if v.output}
    for row in run.inputs:
        held = dict(zip(vectors.inputs, row, strict=True))
        while True:
            done = interpreter.step(values, outputs, 0, lambda choice, held=held: held[choice.name])
            if done.fault is not None or done.overflow:
                return records, -2 if done.overflow else done.fault + 1
            values, outputs = done.values, done.outputs
            if vectors.unit == "ringlet" or outputs[program.cycle]:
                break
        flat = [(values | outputs)[v.name] for v in program.vars]
        records.append(tuple(n for value in flat for n in (value if isinstance(value, tuple) else (value,))))
    return records, 0


def check(arrangement, unit: str) -> Vectors:
    """Vectors cover all that is reachable, and the interpreter makes the same records of them."""
    image = runnable(arrangement, simulated=False)
    program = lower(image, keep_all_bits=True)
    found = find_vectors(arrangement, image, starting_values(program), unit)
    for run in found.vectors.sequences:
        assert interpreted(program, found.vectors, run) == (list(run.records), run.fault)
    judged = coverage(arrangement, found.seen)
    if unit == "ringlet":
        assert not list(judged.of("reachable"))
    else:  # what needs inputs that change within a cycle is not reached
        assert set(judged.of("covered"))
    return found.vectors


@pytest.mark.slow
@pytest.mark.parametrize("unit", ["ringlet", "cycle"])
def test_vectors_cover_all_that_is_reachable(unit):
    faults = 0
    for number in range(examples(30)):
        faults += sum(run.fault != 0 for run in check(build_arrangement(decisive(Random(number))), unit).sequences)
    assert faults > 0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["lift", "level_crossing", "traffic_lights"])
def test_what_a_plant_wrote_is_an_input_of_the_image(name):
    arrangement = load_arrangement(f"models/{name}/arrangement.yaml")
    vectors = check(arrangement, "ringlet")
    assert len(vectors.sequences) < 4


@pytest.mark.slow
def test_wide_inputs_that_are_held_have_a_value_of_each_class():
    arrangement = load_arrangement("models/distance_sensor/arrangement.yaml")
    vectors = check(arrangement, "cycle")
    image = runnable(arrangement, simulated=False)
    program = lower(image, keep_all_bits=True)
    again = find_vectors(arrangement, image, starting_values(program), "cycle")
    assert again.vectors == vectors
    assert not list(coverage(arrangement, again.seen).of("reachable"))


def test_no_sequence_adds_nothing():
    vectors = check(build_arrangement(COUPLED), "ringlet")
    assert len(vectors.sequences) == len(set(vectors.sequences)) <= 2


SMALL = Vectors("ab", "cycle", ("x",), ("n", "m.$state"), (Sequence(((1,), (2,)), ((0, 1),), 1), Sequence((), ())))


def test_a_file_has_what_was_written(tmp_path):
    file = tmp_path / "a.json"
    file.write_text(vectors_text(SMALL))
    assert read_vectors(file) == SMALL


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"vectors": 1', '"vectors": 2', "of format 2"),
        ('"vectors": 1', '"vectors": 1, "vectors": 1', "given twice"),
        ('"cycle"', '"turn"', "`unit` must be"),
        ('["x"]', '["x", "x"]', "each once"),
        ('["x"]', "[]", "row 0 of `inputs` of `sequences[0]` must be 0 whole numbers"),
        ("[1]", "[true]", "1 whole numbers"),
        ("[1]", "[1.5]", "1.5 is not a whole number"),
        ("[[1]", "[1", "row 0 of `inputs` of `sequences[0]` must be a list"),
        ('"fault": 1', '"fault": 0', "`records` of `sequences[0]` must be 2 rows"),
        ('"fault": 1', '"fault": -1', "`fault` of `sequences[0]`"),
        ('"fault": 1, ', "", "`sequences[0]` must be an object"),
        ("[0, 1]", "[0, 1", ".json:9:20: error[E522]: this is not JSON"),
        ("[0, 1]", "[" * 100_000, "not a file of test vectors"),
    ],
)
def test_a_damaged_file_is_refused(tmp_path, old, new, said):
    file = tmp_path / "a.json"
    file.write_text(vectors_text(SMALL).replace(old, new, 1))
    with pytest.raises(DiagnosticError) as refused:
        read_vectors(file)
    assert refused.value.diagnostics[0].code == "E522"
    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("name", "said"), [("no.json", "No such file"), (".", "a directory"), ("a\0b", "not the path")]
)
def test_what_is_no_file_is_refused(name, said):
    with pytest.raises(DiagnosticError, match=said):
        read_vectors(name)


def test_the_hash_is_of_what_a_program_does():
    program = lower(build_arrangement(COUPLED), keep_all_bits=True)
    assert program_hash(program) == program_hash(lower(build_arrangement(COUPLED), keep_all_bits=True))
    assert program_hash(program) != program_hash(replace(program, letter=program.slots[0].epilogue))


@pytest.mark.slow
def test_vectors_count_as_runs_and_changed_ones_do_not(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write("a.yaml", COUPLED)
    assert llfsm("coverage", "a.yaml", "--vectors", "a.json").returncode == 0
    assert llfsm("coverage", "a.yaml", "a.json").returncode == 0
    assert llfsm("coverage", "a.yaml", "--unit", "cycle").returncode == 2
    document = json.loads(Path("a.json").read_text())
    document["sequences"][0]["records"][0][0] += 1
    Path("b.json").write_text(json.dumps(document))
    done = llfsm("coverage", "a.yaml", "b.json")
    assert (done.returncode, "E521" in done.stderr) == (3, True)
    document["sequences"][0]["inputs"][0][0] = 99
    Path("b.json").write_text(json.dumps(document))
    assert "outside its range" in llfsm("coverage", "a.yaml", "b.json").stderr


@pytest.mark.parametrize("text", ["notes: mine\n", '{"name": "a"}', "{}", ""])
def test_a_file_of_another_kind_is_not_replaced(tmp_path, monkeypatch, text):
    monkeypatch.chdir(tmp_path)
    write("a.yaml", COUPLED)
    Path("mine.json").write_text(text)
    done = llfsm("coverage", "a.yaml", "--vectors", "mine.json")
    assert (done.returncode, done.stdout, Path("mine.json").read_text()) == (3, "", text)
    assert "mine.json: error[E523]: this file is not one of test vectors" in done.stderr
    Path("mine.json").write_text(vectors_text(SMALL))
    assert llfsm("coverage", "a.yaml", "--vectors", "mine.json").returncode == 0
    assert read_vectors("mine.json") != SMALL
