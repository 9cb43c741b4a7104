from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import jsonschema
import pytest
import yaml

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.report.saving import save_traces
from llfsm_verify.verification.tracefile import (
    DETAILED_STEPS,
    SavedProperty,
    profile_words,
    read_trace_file,
    trace_document,
)
from llfsm_verify.verification.tracefile_fields import schema
from tests.report.results import ALL, BAD, FAULT, LASSO, PATH, SITE, result, step

LIGHTS = load_arrangement("models/traffic_lights/arrangement.yaml")
WHAT = SavedProperty("bad", "ltl", "G !(x == 3)")
FAIR = (("fair", "G F (timer.ran && car)"),)


def saved(tmp_path: Path, trace=PATH, what=WHAT, assumptions=FAIR) -> Path:
    path = tmp_path / "x.trace.yaml"
    path.write_text(trace_document(trace, LIGHTS, what, assumptions, tmp_path), encoding="utf-8")
    return path


@pytest.mark.parametrize("trace", [PATH, LASSO, FAULT], ids=["path", "lasso", "fault"])
def test_what_is_written_is_read_again(tmp_path, trace):
    what = SITE if trace is FAULT else WHAT
    file = read_trace_file(saved(tmp_path, trace, what))
    assert Path(file.arrangement_path).resolve() == Path(LIGHTS.path).resolve() and not file.from_stdin
    assert (file.digest, file.profile, file.assumptions) == (LIGHTS.digest, profile_words(LIGHTS.profile), FAIR)
    assert (file.goal, file.fault) == ((None, (SITE.code, SITE.message)) if trace is FAULT else (WHAT, None))
    assert (file.loop, file.expect, file.free) == (trace.loop, "violated", trace.initial_free)
    assert [s.process for s in file.steps] == [s.process for s in trace.steps]
    assert [s.choices for s in file.steps] == [tuple((c.choice, c.text) for c in s.choices) for s in trace.steps]


@pytest.mark.parametrize("trace", [PATH, LASSO, FAULT], ids=["path", "lasso", "fault"])
def test_the_published_schema_fits(tmp_path, trace):
    value = yaml.safe_load(saved(tmp_path, trace, SITE if trace is FAULT else WHAT).read_text())
    validator = jsonschema.Draft202012Validator(schema("trace"))
    validator.validate(value)
    value["surprise"] = 1
    assert not validator.is_valid(value)


def test_the_path_of_the_arrangement_is_relative_to_the_file(tmp_path):
    text = trace_document(PATH, replace(LIGHTS, path="models/a.yaml"), WHAT, (), Path("out/traces"))
    assert "arrangement: ../../models/a.yaml\n" in text
    text = trace_document(PATH, replace(LIGHTS, path="<stdin>"), WHAT, (), tmp_path)
    (tmp_path / "s.trace.yaml").write_text(text)
    assert read_trace_file(tmp_path / "s.trace.yaml").from_stdin


def test_awkward_texts_survive(tmp_path):
    what = SavedProperty("odd", "ltl", "G !(x == 3) # {a: [b]} 'c' \"d\" & *e % @ ` é — true")
    assert read_trace_file(saved(tmp_path, what=what, assumptions=(("ON", "G F [no]"),))).goal == what


@pytest.mark.slow
def test_a_very_long_trace_leaves_out_what_is_only_for_the_reader(tmp_path):
    trace = replace(PATH, steps=tuple(step() for _ in range(DETAILED_STEPS + 1)))
    path = saved(tmp_path, trace)
    assert "machine" not in path.read_text() and len(read_trace_file(path).steps) == DETAILED_STEPS + 1


def test_a_result_is_saved_in_one_file_a_trace(tmp_path):
    assumed = parse_properties([Source("fair.ltl", "assume fair: G F (timer.ran && car)")])
    paths = save_traces(ALL, LIGHTS, assumed, tmp_path / "new" / "traces")
    assert [p.name for p in paths] == ["bad.trace.yaml", "looping.trace.yaml", "fault-1-F001.trace.yaml"]
    assert [read_trace_file(p).loop for p in paths] == [None, 1, None]
    assert all(read_trace_file(p).assumptions == FAIR for p in paths)
    assert not save_traces(result(), LIGHTS, assumed, tmp_path / "never") and not (tmp_path / "never").exists()


def test_a_place_that_cannot_be_written_is_a_diagnostic(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(DiagnosticError) as caught:
        save_traces(result(BAD), LIGHTS, PropertySet(), tmp_path / "file")
    assert caught.value.diagnostics[0].code == "E405"


GOOD_FILE = """trace: 1
arrangement: a.yaml
digest: 00
property: {name: p, kind: ltl, text: G a}
expect: violated
loop: 1
steps:
  - {process: main, choices: {car: true}}
"""


@pytest.mark.parametrize(
    ("change", "code", "line"),
    [
        (("trace: 1", "trace: 7"), "E401", 1),
        (("loop: 1", "loop: soon"), "E402", 6),
        (("loop: 1", "loop: 2"), "E403", 6),
        (("loop: 1", "loop: 0"), "E403", 6),
        (("property: {name: p, kind: ltl, text: G a}\n", ""), "E404", 1),
        (("loop: 1", "fault: {code: F001, message: x}"), "E404", 1),
        (("expect: violated", "expect: perhaps"), "E035", 5),
        (("digest: 00\n", ""), "E034", 1),
        (("process: main, ", ""), "E034", 8),
        (("process: main", "proces: main"), "E033", 8),
        (("kind: ltl", "kind: ctl"), "E035", 4),
        (("{car: true}", "[car]"), "E030", 8),
        (("steps:\n  - ", "steps: "), "E031", 7),
        (("G a}", "!!python/object/apply:os.system [true]}"), "E016", 4),
        (("loop: 1", "loop: 1\nloop: 1"), "E017", 7),
        (("{car: true}", "*nothing"), "E015", 8),
    ],
)
def test_wrong_files_are_diagnosed(tmp_path, change, code, line):
    path = tmp_path / "t.trace.yaml"
    path.write_text(GOOD_FILE)
    assert read_trace_file(path).loop == 0
    path.write_text(GOOD_FILE.replace(*change))
    with pytest.raises(DiagnosticError) as caught:
        read_trace_file(path)
    assert (code, line) in [(d.code, d.span.line if d.span else 0) for d in caught.value.diagnostics]
