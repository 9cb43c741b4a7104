"""Two thousand changed certificates: none proves anything that the one it was made of does not."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import pytest

from llfsm_verify.analysis.certificates.making import canonical, certificate, differences
from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.certificate import NOT_CERTIFIED, PROVED, REJECTED, checked
from llfsm_verify.checking.verdict import Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.verification.verify import verify
from tests.analysis.certificates.changing import changes, signed
from tests.quick import FRESH

COUNTING = """
name: counting
whiteboard:
  go: {type: bool, role: input}
  far: {type: 0..3, init: 0}
machines:
  m:
    inline:
      machine: M
      states:
        - {name: A, on_entry: "far = far < 3 ? far + 1 : 0;", transitions: [{when: go, to: B}]}
        - {name: B, transitions: [{when: not go, to: A}]}
schedule: [m]
"""
PROCESSES = """
name: two
whiteboard: {n: {type: 0..2, init: 0}, up: {type: bool, role: input}}
machines:
  a: {inline: {machine: A, states: [{name: X, internal: if (up) n++;, transitions: [{when: n == 2, to: Y}]}, {name: Y}]}}
  b: {inline: {machine: B, states: [{name: X, transitions: [{when: "true", to: Y}]}, {name: Y, transitions: [{when: "true", to: X}]}]}}
processes: {left: [a], right: [b]}
"""  # noqa: E501
CYCLES = """
name: cycles
observe: cycle
cycle_ms: 10
whiteboard: {go: {type: bool, role: input}, last: {type: {array: bool, size: 2}}, i: {type: 0..1, init: 0}}
machines:
  a: {inline: {machine: A, states: [{name: S, internal: "last[i] = go; i = 1 - i;", transitions: [{when: "false", to: S}]}]}}
  b: {inline: {machine: B, states: [{name: S, transitions: [{when: "last[0]", to: T}]}, {name: T}]}}
schedule: [a, b]
"""  # noqa: E501
NUMBERS = """
name: numbers
tables: {curve: [0.0, 0.25, 1.0]}
whiteboard:
  i: {type: 0..2, role: input}
  x: {type: {decimal: 0.1, range: -0.5..1.5}}
  u: {type: uint64, init: 18446744073709551615}
  flags: {type: uint8}
machines:
  m:
    inline:
      machine: M
      states:
        - {name: A, stays: true, internal: "x = curve[i] / 3 - 0.1; u = u * u / 5 % 3 + i; flags = flags << 1 | 5;"}
schedule: [m]
"""
POOL = """
name: pool
operators: {unload: [a]}
access: {levels: [low, high], machines: {a: high}, write: {n: high}, users: {carol: high}, on_violation: refuse}
whiteboard: {n: {type: 0..3}, go: {type: bool, role: input}}
machines:
  a: {inline: {machine: A, states: [{name: X, runs: [inner], transitions: [{when: go, to: Y}]}, {name: Y, on_entry: load(b);, transitions: [{when: "done(inner)", to: X}]}]}}
  inner: {inline: {machine: I, states: [{name: S, internal: n = 1 - n;, transitions: [{when: "n == 1", to: T}]}, {name: T}]}}
  b: {inline: {machine: B, states: [{name: S, internal: n = 3 / n;, transitions: [{when: go, to: T}]}, {name: T}]}, on_fault: unload}
schedule: [a, inner]
pool: [b]
"""  # noqa: E501
PROBLEMS = {
    "counting": (COUNTING, "a: G far <= 3\nb: G F m@A\nc: G (m@B -> F m@A)\nassume fair: G F !go\nassume too: G F go"),
    "processes": (PROCESSES, "a: G (a@Y -> n == 2)\nb: G F b@Y\nc: F a@Y\nd: G n < 2"),
    "cycles": (CYCLES, "forbid a: [b@T] [b@S]\nb: G (b@T -> F[<=20ms] !go)\nc: (F b@T) || G F !go\nd: G (b@T -> O go)"),
}
ACTING = {
    "numbers": (NUMBERS, "a: G x <= 0.3\nb: G (u < 5 || u == 18446744073709551615)\nc: F flags == 255\nd: G F i == 1"),
    "pool": (POOL, "a: G (faulted(b) -> !b.loaded)\nb: G !refused(b)\nc: G (a.loaded || n < 2)\nd: G F a@X"),
}
"""What acts, and types that are held as something else."""
BELIEVED = ("name", "kind", "text", "formula", "violations", "early", "safe")
HARMLESS = {
    ("lasso", "nodes"): "another rank, by which the ranks still never rise and each has its set missing",
    ("lasso", "sets"): "another acceptance set that is missing inside of the rank, too",
    ("prefix", "nodes"): "the same: of bad prefixes only closedness is asked, beside what any rank proves",
    ("prefix", "sets"): "the same",
    ("run", "steps"): "another run, which violates the property also",
    ("trail",): "another run of the automaton on the same letters",
    ("run", "loop"): "another loop of the same run, which begins where the configuration is the same",
}
"""Changes that the verifier may accept: what it believes and what it proves are the same, by another proof. So is the
one that gives two configurations each other's numbers, where all that is said of these holds for both."""


def made(name: str, folder: Path) -> dict:
    text, lines = (PROBLEMS | ACTING)[name]
    (folder / "a.yaml").write_text(text)
    arrangement = load_arrangement_text(text)
    properties = parse_properties([Source("p.ltl", lines)], "llfsm", frozenset({"regular", "past", "time"}))
    result = verify(arrangement, properties, engine="explicit")
    assert Verdict.UNKNOWN not in {p.verdict for p in result.properties}
    document = json.loads(certificate(arrangement, properties, result, folder).text)
    assert code_of(signed(document), folder) == PROVED
    return document


def code_of(text: str, folder: Path) -> int:
    path = folder / "c.json"
    path.write_text(text)
    return checked(path, folder)[1]


def claims(document: dict) -> str:
    believed = [[p[key] for key in (*BELIEVED, "verdict")] for p in document["properties"]]
    others = ("program", "automata", "assumptions", "premises", "inputs", "format")
    return canonical([believed, document["faults"]["verdict"], *(document[key] for key in others)])


def judged(name: str, folder: Path, few: int, every: int = 1) -> Counter:
    """How many changes (one of `every`) were rejected by what; fails for one that is not."""
    document, found = made(name, folder), Counter[str]()
    original = signed(document)
    for path, how, changed in islice(changes(document, few), 0, None, every):
        assert changed != document or json.dumps(changed) != json.dumps(document), (path, how)
        unsigned = changed | {"digests": document["digests"]} if isinstance(changed, dict) else changed
        assert code_of(canonical(unsigned) + "\n", folder) == REJECTED, (path, how, "without new hashes")
        if not isinstance(changed, dict):
            continue
        forged = signed(changed)
        if code_of(forged, folder) != PROVED:
            found["rejected by the verifier"] += 1
        elif claims(changed) != claims(document):
            assert any(differences(forged, original)), (path, how)
            found["rejected by the comparison"] += 1
        else:
            where = tuple(step for step in path[2:4] if isinstance(step, str))
            renumbered = (*path, how) == ("configurations", "swap")
            assert renumbered or (path[0] == "properties" and where in HARMLESS), (path, how)
            found["harmless"] += 1
    return found


def report(found: Counter) -> Iterator[str]:
    return (f"{number} {what}" for what, number in found.items())


@pytest.mark.slow
def test_changed_certificates_are_rejected(tmp_path: Path) -> None:
    found = judged("counting", tmp_path, 2, 9)
    assert found["rejected by the verifier"] > 50, [*report(found)]


@pytest.mark.long
@pytest.mark.parametrize(("problems", "every"), [(PROBLEMS, 3), (ACTING, 2)], ids=("control", "acting"))
def test_two_thousand_changed_certificates_are_rejected(
    problems: dict[str, tuple[str, str]], every: int, tmp_path: Path
) -> None:
    found = Counter[str]()
    for name in problems:
        found += judged(name, tmp_path, 5, 1 if FRESH else every)
    assert found.total() >= 2_000, [*report(found)]
    assert found["harmless"] < found.total() / 20, [*report(found)]


def test_a_text_in_it_cannot_add_lines_to_what_the_verifier_says(tmp_path: Path) -> None:
    document = made("counting", tmp_path)
    document["properties"][0]["name"] = "a\nproved  holds  z\x1b[2J\ud800"
    path = tmp_path / "c.json"
    path.write_text(signed({k: v for k, v in document.items() if k != "digests"}))
    said, code = checked(path, tmp_path)
    assert code == PROVED
    assert all(line.isprintable() for line in said)


@pytest.mark.slow
def test_what_one_side_lacks_hides_no_forgery(tmp_path: Path) -> None:
    """One property is said not to be certified; another is violated, and claimed to hold by an automaton of nothing."""
    text, _ = PROBLEMS["counting"]
    (tmp_path / "a.yaml").write_text(text)
    arrangement = load_arrangement_text(text)
    for assumed in ("", "\nassume fair: G F !go"):
        properties = parse_properties([Source("p.ltl", f"a: G far < 2\nb: G F m@A{assumed}\nc: G far <= 3")])
        result = verify(arrangement, properties, engine="explicit")
        original = certificate(arrangement, properties, result, tmp_path).text
        document = json.loads(original)
        a, b, _ = document["properties"]
        b.update(reason="the memory ran out", violations=None, early=None, safe=False, prefix=None, lasso=None)
        b.update(run=None, trail=None)
        assert code_of(signed(document), tmp_path) == NOT_CERTIFIED
        found, unlike = differences(signed(document), original)
        assert not found and unlike == ["not compared: b, because it is not certified there: the memory ran out"]
        b["reason"] = "x\nproved  holds  a"
        assert "\n" not in "".join(differences(signed(document), original)[1])
        document["automata"].append(
            {"about": "nothing", "atoms": [], "sets": 1, "complete": False, "bad": [], "edges": [[]]}
        )
        a.update(verdict="holds", run=None, trail=None, safe=False, early=None, prefix=None)
        a.update(violations=len(document["automata"]) - 1, lasso={"joint": [], "nodes": [], "sets": []})
        assert code_of(signed(document), tmp_path) == NOT_CERTIFIED
        assert differences(signed(document), original)[0]
        # An automaton that is another one, for the same verdict.
        document = json.loads(original)
        _, b, c = document["properties"]
        b.update(reason="the memory ran out", violations=None, early=None, safe=False, prefix=None, lasso=None)
        b.update(run=None, trail=None)
        document["automata"].append(
            {"about": "nothing", "atoms": [], "sets": 1, "complete": False, "bad": [], "edges": [[]]}
        )
        c.update(safe=False, early=None, prefix=None, violations=len(document["automata"]) - 1)
        c.update(lasso={"joint": [], "nodes": [], "sets": []})
        assert code_of(signed(document), tmp_path) == NOT_CERTIFIED
        found, unlike = differences(signed(document), original)
        assert found == ([] if assumed else ["its automata are not those of the properties"])
        assert (unlike[1:] != []) == bool(assumed)
