"""Certificates forged in one place, and signed again: each is rejected, and the sentence says for what."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cache
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

from llfsm_verify.analysis.certificates.making import certificate
from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.certificate import NOT_CERTIFIED, PROVED, REJECTED, TRUSTED, checked
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.verification.verify import verify
from tests.analysis.certificates.changing import signed
from tests.analysis.certificates.test_changes import COUNTING, CYCLES, PROCESSES

FAULTY = COUNTING.replace("far < 3 ? far + 1 : 0", "far + 1")
PROBLEMS = {
    "counting": (COUNTING, "a: G far <= 3\nb: G F m@A\nc: G far < 2\nd: F far == 1"),
    "assumed": (COUNTING, "a: G (m@B -> F m@A)\nb: G F m@B\nc: F G m@A\nassume fair: G F !go\nassume too: G F go"),
    "cycles": (CYCLES, "a: (F b@T) || G F !go\nb: G !b@T\nc: F b@T"),
    "processes": (PROCESSES, "a: G (a@Y -> n == 2)\nb: G F b@Y\nc: F a@Y\nd: G n < 2"),
    "faulty": (FAULTY, "a: G far <= 3\nb: F m@B"),
}
SAID = {
    "counting": [
        "proved  holds  a  G far <= 3  (12 product states)",
        "proved  violated  b  G F m@A  (a run of 5 letters)",
        "proved  violated  c  G far < 2  (a run of 4 letters)",
        "proved  holds  d  F far == 1  (1 product states)",
        "proved  holds  faults  (every step)",
        "12 configurations, 24 steps; 0 of 2 inputs compared",
    ],
}
Document = Any


@cache
def made(name: str) -> str:
    """A certificate of one of the problems."""
    text, lines = PROBLEMS[name]
    arrangement, properties = load_arrangement_text(text), parse_properties([Source("p.ltl", lines)])
    with TemporaryDirectory() as folder:
        return certificate(arrangement, properties, verify(arrangement, properties), Path(folder)).text


def said(document: Document, folder: Path) -> tuple[list[str], int]:
    path = folder / "c.json"
    path.write_text(signed(document))
    return checked(path, folder)


@pytest.mark.slow
@pytest.mark.parametrize("name", PROBLEMS)
def test_what_is_made_is_proved(name: str, tmp_path: Path) -> None:
    document = json.loads(made(name))
    lines, code = said(document, tmp_path)
    assert (code, lines[-1]) == (PROVED, TRUSTED)
    if name in SAID:
        assert lines[:-1] == SAID[name]
    assumed = [f"assuming  {a['name']}  {a['text']}" for a in document["assumptions"]]
    assert lines[: len(assumed)] == assumed
    verdicts = [line.split()[:3] for line in lines[len(assumed) : -3]]
    free = [p["verdict"] == "holds" and name == "faulty" for p in document["properties"]]
    assert verdicts == [
        ["proved", p["verdict"], "on" if f else p["name"]] for p, f in zip(document["properties"], free, strict=True)
    ]
    inside = ", 8 of them inside cycles" if name == "cycles" else ""
    size = f"{len(document['configurations']):,} configurations{inside}, {document['steps']:,} steps"
    assert lines[-2].startswith(f"{size}; 0 of ")


Change = Callable[[Document], object]
CLOSED = "there are too few steps, an initial configuration is missing, or one is there twice"
ELSEWHERE = "a step leads to a configuration that is not there, or there are too many steps"
CAME = "a run does not come where it says, or reads other choices than it says"
RANKS = "a product state is missing, or the ranks do not prove what they should"
IDLE = "something is there twice or for nothing, or comes after a bad prefix"
LOOP = "the loop of a run does not come back, or shows nothing"
VIOLATES = "the run does not violate it"
HOLDS = "a property that holds has a run, or no automaton of its violations"


def run_of(document: Document, name: str) -> Document:
    return next(p for p in document["properties"] if p["name"] == name)["run"]


def proof_of(document: Document, name: str) -> Document:
    found = next(p for p in document["properties"] if p["name"] == name)
    return found["lasso"] or found["prefix"]


def set_in(*path: Any, value: object) -> Change:
    def change(document: Document) -> None:
        for step in path[:-1]:
            document = document[step]
        document[path[-1]] = value

    return change


def twice(document: Document) -> None:
    document["configurations"].append(document["configurations"][-1])


def one_less(document: Document) -> None:
    document["configurations"].pop()


def worse_rank(document: Document) -> None:
    """The first product states that are entered get a rank below those after them."""
    proof = proof_of(document, "b")
    ranks = proof["nodes"][2::3]
    proof["nodes"][2::3] = [max(ranks) - r for r in ranks]


def shorter(document: Document) -> None:
    del proof_of(document, "b")["nodes"][-3:]


def same_again(document: Document) -> None:
    nodes = proof_of(document, "b")["nodes"]
    nodes += nodes[:3]


def without_first(document: Document) -> None:
    proof = proof_of(document, "a")
    nodes = proof["nodes"]
    first = [i for i in range(0, len(nodes), 3) if nodes[i] == 0]
    for i in reversed(first):
        del nodes[i : i + 3]


def other_verdict(document: Document) -> None:
    document["properties"][1].update(verdict="holds")


def no_fault(document: Document) -> None:
    document["faults"].update(verdict="holds", runs=[])


def beyond_the_end(document: Document) -> None:
    document["faults"]["runs"][0][1]["steps"].append([0, [], [0, 0, 0, 0]])


FORGED: list[tuple[str, Change, str]] = [
    ("counting", set_in("format", value="llfsm-certificate 2"),
     "its format is not `llfsm-certificate 1`, the only one that this program reads"),
    ("counting", set_in("steps", value=25), CLOSED),
    ("counting", set_in("steps", value=23), ELSEWHERE),
    ("counting", twice, CLOSED),
    ("counting", one_less, ELSEWHERE),
    ("counting", set_in("properties", 1, "run", "initial", value=[0, 1, 1, 0]),
     "a run does not begin in an initial configuration"),
    ("counting", set_in("properties", 1, "run", "steps", 0, 0, value=1),
     "a run takes a step that is not possible there"),
    ("counting", set_in("properties", 1, "run", "steps", 0, 0, value=None),
     "a run takes a step that is not possible there"),
    ("counting", set_in("properties", 1, "run", "steps", 0, 0, value=False),
     "something else is in the place of a number"),
    ("counting", set_in("properties", 1, "run", "steps", 0, 1, value=[]), CAME),
    ("counting", set_in("properties", 1, "run", "steps", 0, 1, value=[[0, 0]]), CAME),
    ("counting", set_in("properties", 1, "run", "steps", 0, 1, value=[[0, 2]]), CAME),
    ("counting", set_in("properties", 1, "run", "steps", 0, 2, value=None), CAME),
    ("counting", set_in("properties", 1, "run", "loop", value=4), LOOP),
    ("counting", set_in("properties", 1, "run", "loop", value=0), LOOP),
    ("counting", set_in("properties", 1, "run", "loop", value=None), VIOLATES),
    ("counting", set_in("properties", 1, "trail", value=[[0], [0], [0], [0], [0]]), VIOLATES),
    ("counting", set_in("properties", 1, "trail", 0, value=[1]), "the automata do not go where they are said to"),
    ("counting", set_in("properties", 2, "verdict", value="holds"), HOLDS),
    ("counting", set_in("properties", 2, "formula", value=[["true", 0, 0]]), VIOLATES),
    ("counting", set_in("properties", 1, "formula", value=[["true", 0, 0]]), VIOLATES),
    ("counting", other_verdict, HOLDS),
    ("counting", set_in("faults", "verdict", value="violated"), "what it says of faults is not proved"),
    ("counting", without_first, "an initial product state is missing"),
    ("processes", worse_rank, RANKS),
    ("processes", shorter, RANKS),
    ("processes", same_again, IDLE),
    ("processes", set_in("properties", 1, "lasso", "sets", value=[0, 0, 0, 3, 0, 0]), IDLE),
    ("processes", set_in("properties", 1, "lasso", "joint", value=[[1], [0], [0]]), IDLE),
    ("faulty", no_fault, "what it says of faults is not proved"),
    ("faulty", set_in("faults", "verdict", value="holds"), "what it says of faults is not proved"),
    ("faulty", beyond_the_end, "a run takes a step that is not possible there"),
    ("faulty", set_in("faults", "runs", 0, 1, "loop", value=0), LOOP),
]  # fmt: skip


@pytest.mark.parametrize(("name", "change", "sentence"), FORGED, ids=map(str, range(len(FORGED))))
def test_a_forgery_is_rejected_for_what_it_is(name: str, change: Change, sentence: str, tmp_path: Path) -> None:
    document = json.loads(made(name))
    before = json.dumps(document)
    change(document)
    assert json.dumps(document) != before
    assert said(document, tmp_path) == ([f"rejected: {sentence}"], REJECTED)


def test_a_part_with_another_hash_is_rejected(tmp_path: Path) -> None:
    document = json.loads(made("counting"))
    document["digests"]["program"] = "0" * 64
    (tmp_path / "c.json").write_text(json.dumps(document, sort_keys=True, separators=(",", ":")) + "\n")
    sentence = "a part of it is not the one whose hash it has"
    assert checked(tmp_path / "c.json", tmp_path) == ([f"rejected: {sentence}"], REJECTED)


def test_what_is_not_certified_is_said_with_its_reason(tmp_path: Path) -> None:
    document = json.loads(made("counting"))
    document["properties"][1]["reason"] = "the time is up"
    document["faults"].update(reason="the memory ran out", verdict="unknown")
    lines, code = said(document, tmp_path)
    assert code == NOT_CERTIFIED
    assert lines[1] == "not certified  violated  b  G F m@A: the time is up"
    assert lines[4] == "not certified  unknown  faults: the memory ran out"


MALFORMED: list[tuple[str, Change]] = [
    ("counting", lambda d: proof_of(d, "a")["nodes"].append(0)),
    ("counting", lambda d: proof_of(d, "a")["joint"][0].append(0)),
    ("counting", lambda d: d["configurations"][1].append(0)),
    ("counting", lambda d: d["configurations"][1].pop()),
    ("counting", lambda d: d["properties"][1]["trail"].pop()),
    ("counting", lambda d: d["automata"][0]["edges"][0][0].append(0)),
]


@pytest.mark.parametrize(("name", "change"), MALFORMED, ids=map(str, range(len(MALFORMED))))
def test_what_is_too_long_or_too_short_is_not_well_formed(name: str, change: Change, tmp_path: Path) -> None:
    document = json.loads(made(name))
    change(document)
    (line,), code = said(document, tmp_path)
    assert code == REJECTED
    assert line.startswith("rejected: it cannot be read, is not well formed, or took too long (ValueError")


def test_an_automaton_says_what_it_does_with_every_letter(tmp_path: Path) -> None:
    document = json.loads(made("counting"))
    first = document["automata"][0]
    assert first["about"] == "bad prefixes of a" and first["complete"]
    first["edges"][0] = [edge for edge in first["edges"][0] if edge[0]][:0]
    sentence = "an automaton does not say what it does with a letter that occurs"
    assert said(document, tmp_path) == ([f"rejected: {sentence}"], REJECTED)


def test_no_product_state_is_a_bad_one(tmp_path: Path) -> None:
    document = json.loads(made("counting"))
    document["automata"][0]["bad"] = [0]
    assert said(document, tmp_path) == ([f"rejected: {IDLE}"], REJECTED)


@pytest.mark.parametrize("number", [0, 1])
def test_a_run_that_breaks_an_assumption_violates_nothing(number: int, tmp_path: Path) -> None:
    document = json.loads(made("assumed"))
    assert [a["name"] for a in document["assumptions"]] == ["fair", "too"]
    assert any(p["run"] is not None for p in document["properties"])
    document["assumptions"][number]["formula"] = [["true", 0, 0], ["not", 0, 0]]
    assert said(document, tmp_path) == ([f"rejected: {VIOLATES}"], REJECTED)


def test_only_the_one_form_is_read(tmp_path: Path) -> None:
    path, text = tmp_path / "c.json", made("counting")
    sentence = "it is not in the one form of a certificate: keys in order, once each, no spaces"
    for other in (
        text[:-1],
        text + "\n",
        text.replace('","', '", "', 1),
        text.replace('"format"', '"\\u0066ormat"', 1),
    ):
        assert other != text
        path.write_text(other)
        assert checked(path, tmp_path) == ([f"rejected: {sentence}"], REJECTED)


def test_inputs_are_compared_where_they_are(tmp_path: Path) -> None:
    document = json.loads(made("counting"))
    data = b"content"
    document["inputs"] = [["a.yaml", "arrangement", sha256(data).hexdigest()], ["b.ltl", "x", "0" * 64]]
    (tmp_path / "a.yaml").write_bytes(data)
    lines, code = said(document, tmp_path)
    assert code == PROVED and lines[-2].endswith("; 1 of 2 inputs compared")
    (tmp_path / "a.yaml").write_bytes(data + b"!")
    sentence = "an input file is not the one of which it was made, or is not a regular file"
    assert said(document, tmp_path) == ([f"rejected: {sentence}"], REJECTED)
    (tmp_path / "a.yaml").unlink()
    (tmp_path / "a.yaml").mkdir()
    assert said(document, tmp_path) == (["rejected: an input is not a regular file"], REJECTED)
