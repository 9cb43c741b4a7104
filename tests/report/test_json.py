from __future__ import annotations

import copy
import json
from dataclasses import replace
from fractions import Fraction

import jsonschema
import pytest

from llfsm_verify.checking.trace import Trace
from llfsm_verify.diagnostics import Diagnostic, Source, Span
from llfsm_verify.report.json import failure_json, result_json, trace_object
from llfsm_verify.report.schema import SCHEMAS, load
from tests.report.results import ALL, EVERY, step

VALIDATOR = jsonschema.Draft202012Validator(load("result"))


@pytest.mark.parametrize("name", SCHEMAS)
def test_schemas_are_schemas(name):
    jsonschema.Draft202012Validator.check_schema(SCHEMAS.load(name)(name))


@pytest.mark.parametrize("name", EVERY)
def test_results_are_valid(name):
    VALIDATOR.validate(json.loads(result_json(EVERY[name])))


def test_the_fields_that_programs_read():
    value = json.loads(result_json(ALL))
    assert (value["states"], value["transitions"], value["complete"], value["exit_code"]) == (1234, 5678, True, 1)
    assert [p["verdict"] for p in value["properties"]] == ["holds", "violated", "violated", "unknown"]
    assert value["properties"][0]["words"] == "holds on fault-free runs"
    assert value["properties"][1]["trace"]["loop"] is None and value["properties"][2]["trace"]["loop"] == 1
    assert value["properties"][1]["span"] == {
        "file": "props.ltl",
        "line": 2,
        "column": 1,
        "end_line": 2,
        "end_column": 4,
    }
    assert value["faults"]["list"][0]["trace"]["fault"]["code"] == "F001"
    trace = value["properties"][1]["trace"]
    assert trace["free"] == {"mode": 2} and trace["values"] == {"x": 0, "m": "A"}
    assert [step["step"] for step in trace["steps"]] == list(range(1, 10)) and trace["steps"][8]["time_ms"] is None
    assert trace["steps"][7]["changes"][1] == {"variable": "x", "before": "0", "after": "3", "value": 3}


def test_times_and_values_of_all_types():
    values = (("a", "true"), ("b", "-0.50"), ("c", "-7"), ("d", "RED"))
    cycle = (replace(step(), cycle=True),)
    trace = trace_object(Trace(values, (), (), (*cycle * 2, step()), None, period=Fraction(25, 2)), before=cycle)
    assert trace["values"] == {"a": True, "b": -0.5, "c": -7, "d": "RED"}
    assert [(s["step"], s["time_ms"]) for s in trace["steps"]] == [(2, 12.5), (3, 25), (4, 37.5)]


PLACED = Diagnostic("E110", "no `x`", Span(Source("a.yaml", "a: x\n"), 3, 4), ("a note",), "a hint")
FAILURE = [PLACED, Diagnostic("E001", "there is no such file", file="b.yaml"), Diagnostic("E999", "of no file")]


def test_what_is_wrong_with_the_files_is_one_object():
    value = json.loads(failure_json(FAILURE, 3))
    VALIDATOR.validate(value)
    assert value["exit_code"] == 3 and value["error"]["diagnostics"][:2] == [
        {
            "code": "E110",
            "message": "no `x`",
            "file": "a.yaml",
            "line": 1,
            "column": 4,
            "notes": ["a note"],
            "hint": "a hint",
        },
        {
            "code": "E001",
            "message": "there is no such file",
            "file": "b.yaml",
            "line": None,
            "column": None,
            "notes": [],
            "hint": None,
        },
    ]


def objects(value, path=()):
    """The path of every object that is not a free mapping of names to values."""
    if isinstance(value, dict):
        if path and path[-1] in ("initial", "values", "free", "atoms"):
            return
        yield path
        for key, inner in value.items():
            yield from objects(inner, (*path, key))
    elif isinstance(value, list):
        for i, inner in enumerate(value):
            yield from objects(inner, (*path, i))


@pytest.mark.slow
def test_the_schema_allows_nothing_else_and_lacks_nothing():
    value = json.loads(result_json(ALL))
    places = list(objects(value))
    assert len(places) > 30
    allows_nothing_else(value, places)
    failure = json.loads(failure_json(FAILURE, 3))
    allows_nothing_else(failure, list(objects(failure)))


def allows_nothing_else(value, places):
    for place in places:
        wrong = copy.deepcopy(value)
        target = wrong
        for key in place:
            target = target[key]
        target["surprise"] = 1
        assert not VALIDATOR.is_valid(wrong), place
        del target["surprise"]
        target.pop(next(iter(target)))
        assert not VALIDATOR.is_valid(wrong), place
