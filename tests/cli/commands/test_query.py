"""`llfsm query`: what it finds or refutes, its exit codes, and the runs it saves."""

from __future__ import annotations

import json

import jsonschema
import pytest

from llfsm_verify.report.schema import load
from llfsm_verify.verification.query import saved_query
from tests.cli.running import FAULTY, LIGHTS, llfsm
from tests.verification.test_portfolio import ENDLESS


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["explicit", "bmc"])
def test_a_shortest_run(engine):
    done = llfsm("query", LIGHTS, "ns@AMBER && car", "--engine", engine, "--format", "json")
    value = json.loads(done.stdout)
    jsonschema.Draft202012Validator(load("query")).validate(value)
    assert (done.returncode, value["answer"], value["formula"]) == (0, "reached", "ns@AMBER && car")
    assert len(value["trace"]["steps"]) == 35
    assert value["trace"]["because"] is None
    assert value["trace"]["steps"][-1]["atoms"] == {"car": True, "ns@AMBER": True}


def test_a_proof_that_there_is_none():
    done = llfsm("query", LIGHTS, "ns@GREEN && ew@GREEN")
    assert done.returncode == 1
    assert done.stdout.splitlines()[0] == "unreachable  ns@GREEN && ew@GREEN"


@pytest.mark.slow
def test_unknown():
    done = llfsm("query", LIGHTS, "ns@GREEN && ew@GREEN", "--engine", "explicit", "--max-states", "9")
    assert done.returncode == 4
    assert done.stdout.startswith("unknown  ns@GREEN && ew@GREEN\n         because the limit of 9")
    bounded = llfsm("query", LIGHTS, "ns@GREEN && ew@GREEN", "--engine", "bmc", "--depth", "3")
    assert bounded.returncode == 4
    assert "no run of up to 3 steps reaches it (--depth N looks further)" in bounded.stdout


def test_at_the_start():
    done = llfsm("query", LIGHTS, "ns@RED # a comment")
    assert done.returncode == 0
    assert done.stdout.splitlines()[0] == "reached  ns@RED  at the start"


@pytest.mark.slow
@pytest.mark.parametrize("formula", ["ns@GREEN && ew@GREEN", "ns@GREEN # first\n && ew@GREEN"])
def test_a_saved_run_is_run_again(tmp_path, formula):
    path = tmp_path / "both.trace.yaml"
    assert llfsm("query", FAULTY, formula, "--save", str(path)).returncode == 0
    again = llfsm("replay", str(path), "--quiet")
    assert (again.returncode, again.stderr, again.stdout) == (0, "", f"{path}: the run still reaches it\n")
    assert "fail" not in llfsm("replay", str(path)).stdout
    mended = llfsm("replay", str(path), "--quiet", "--arrangement", LIGHTS)
    assert (mended.returncode, mended.stdout) == (1, f"{path}: the run does not reach it any more\n")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("syntax", "formula"),
    [("spin", "ns@GREEN && ew@GREEN"), ("spot", '"ns@GREEN" & "ew@GREEN"'), ("nusmv", "ns@GREEN & ew@GREEN")],
)
def test_in_other_syntaxes(tmp_path, syntax, formula):
    path = tmp_path / "both.trace.yaml"
    done = llfsm("query", FAULTY, formula, "--syntax", syntax, "--save", str(path))
    assert done.returncode == 0, done.stderr
    assert llfsm("replay", str(path), "--quiet").returncode == 0


@pytest.mark.parametrize(
    ("formula", "place", "code"),
    [
        ("", "1:1", "E314"),
        ("ns@GREN", "1:4", "E112"),
        ("F ns@GREEN", "1:1", "E338"),
        ("ns@GREEN && X car", "1:1", "E338"),
        ("ns@GREEN &&", "1:10", "E320"),
    ],
)
def test_mistakes_point_into_the_command_line(formula, place, code):
    done = llfsm("query", LIGHTS, formula)
    assert done.returncode == 3
    assert done.stderr.startswith(f"<command line>:{place}: error[{code}]")


def test_wrong_usage():
    assert llfsm("query", LIGHTS, "car", "--engine", "explicit", "--depth", "5").returncode == 2
    assert llfsm("query", LIGHTS, "car", "--engine", "bmc", "--max-states", "5").returncode == 2
    assert llfsm("query", LIGHTS).returncode == 2


def test_nothing_to_save(tmp_path):
    path = tmp_path / "none.trace.yaml"
    done = llfsm("query", LIGHTS, "ns@GREEN && ew@GREEN", "--save", str(path))
    assert (done.returncode, path.exists()) == (1, False)
    assert "no run was found" in done.stderr


@pytest.mark.slow
def test_the_engine_that_decides_is_told(tmp_path):
    """Also that it is proved, and by what, where enumeration had no end."""
    path = tmp_path / "endless.yaml"
    path.write_text(ENDLESS)
    told = llfsm("query", str(path), "total < 0", "--max-states", "50").stdout
    assert "query: proved, since" in told and "not complete, and proofs for runs of every length" in told
    assert "  explicit decided nothing: the limit of 50 configurations" in told and "  pdr decided query" in told
    value = json.loads(llfsm("query", str(path), "total > 20", "--max-states", "5", "--format", "json").stdout)
    jsonschema.Draft202012Validator(load("query")).validate(value)
    assert (value["engine"], value["proofs"]) == ("pdr", [])
    assert [a["decided"] for a in value["attempts"]] == [[], ["query"]]
    proved = json.loads(llfsm("query", str(path), "total < 0", "--engine", "pdr", "--format", "json").stdout)
    jsonschema.Draft202012Validator(load("query")).validate(proved)
    assert (proved["engine"], proved["complete"], len(proved["proofs"])) == ("pdr", True, 1)


@pytest.mark.parametrize(
    ("name", "text", "asked"),
    [
        ("query", "G !(a)", "a"),
        ("query", "[] !((a) && (b))", "(a) && (b)"),
        ("query", "G !(a) -> F (b)", None),
        ("other", "G !(a)", None),
        ("query", "G a", None),
    ],
)
def test_what_a_saved_run_was_asked_for(name, text, asked):
    assert saved_query(name, "ltl", text) == asked
