"""The examples on docs/plugs.md: short, installed as another distribution, looked at by the suites, and used."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Mapping
from pathlib import Path

import pytest

from llfsm_verify.testing import conformance
from llfsm_verify.testing.conformance.plugs import SAMPLES
from tests.cli.running import LIGHTS
from tests.distributions import ROOT, Site

PAGE = (ROOT / "docs" / "plugs.md").read_text(encoding="utf-8")
FILES = dict(re.findall(r"^```python\n# (\w+)\.py\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL))
POINTS: Mapping[str, Mapping[str, str]] = {
    "llfsm_verify.ports": {"clock": "clock:ENTRY"},
    "llfsm_verify.arrangements": {"json": "json_arrangement:READER"},
    "llfsm_verify.writers": {"json": "json_arrangement:WRITER"},
    "llfsm_verify.reports.result": {"brief": "brief:ENTRY"},
    "llfsm_verify.logs": {"jsonl": "jsonl:ENTRY"},
    "llfsm_verify.timelines": {"tabs": "tabs:ENTRY"},
    "llfsm_verify.drawings": {"plantuml": "plantuml:ENTRY"},
}
SUITES = """
import json, sys
from llfsm_verify.testing.conformance import *
document = json.load(open(sys.argv[1]))
rows = [{"car": "true", "n": "3"}, {"car": "false"}]
cases = [
    *port_cases("clock", "{every: 2, inputs: [go]}"), *reader_cases("json", json.dumps(document)),
    *writer_cases("json", "json"), *report_cases("brief", "result"), *log_cases("jsonl", sys.argv[2], rows),
    *timeline_cases("tabs"), *drawing_cases("plantuml"),
]
print(len(cases), *(f"{outcome.name}: {outcome.wrong}" for outcome in (case() for case in cases) if outcome.wrong))
"""


@pytest.fixture
def site(tmp_path: Path) -> Site:
    found = Site(tmp_path)
    found.install("theirs", POINTS, **FILES)
    return found


def test_the_page_has_an_example_of_each_plug() -> None:
    groups = set(re.findall(r"^\| [^|]+ \| `([\w.]+)` \|", PAGE, re.MULTILINE))
    assert {group.replace("KIND", "result") for group in groups} == {
        *POINTS, "llfsm_verify.automata", "llfsm_verify.codes", "llfsm_verify.engines", "llfsm_verify.commands",
        "llfsm_verify.debuggers", "llfsm_verify.models", "llfsm_verify.oracles", "llfsm_verify.panels",
        "llfsm_verify.plants", "llfsm_verify.readings", "llfsm_verify.schedulers", "llfsm_verify.structures",
        "llfsm_verify.sweeps",
        "llfsm_verify.syntaxes", "llfsm_verify.targets", "llfsm_verify.worlds",
    }  # fmt: skip
    assert {place.partition(":")[0] for found in POINTS.values() for place in found.values()} == set(FILES)
    lines = {name: sum(bool(line.strip()) for line in text.splitlines()) for name, text in FILES.items()}
    assert max(lines.values()) <= 25, lines
    assert {m for text in FILES.values() for m in re.findall(r"^from (llfsm_verify[\w.]*)", text, re.MULTILINE)} == {
        "llfsm_verify", "llfsm_verify.plug",
    }  # fmt: skip


def test_the_table_calls_each_suite_with_what_it_needs() -> None:
    calls = re.findall(r"\| `(\w+_cases)\((.*?)\)` \|$", PAGE, re.MULTILINE)
    needed = {
        name: sum(p.default is p.empty for p in inspect.signature(getattr(conformance, name)).parameters.values())
        for name in conformance.__all__
        if name.endswith("_cases") and name != "executor_cases"
    }
    assert {name: len(given.split(", ")) for name, given in calls} == needed


@pytest.mark.slow
def test_the_suites_pass_them(site: Site, tmp_path: Path) -> None:
    (tmp_path / "lamp.json").write_text(json.dumps(dict(SAMPLES["lamp"])))
    (tmp_path / "a.jsonl").write_text('{"car": true, "n": 3}\n{"car": false}\n')
    done = site.python("-c", SUITES, str(tmp_path / "lamp.json"), str(tmp_path / "a.jsonl"))
    assert re.fullmatch(r"\d+\n", done.stdout), done.stdout + done.stderr
    assert int(done.stdout) > 12


@pytest.mark.slow
def test_the_commands_know_them(site: Site, tmp_path: Path) -> None:
    lamp = tmp_path / "lamp.json"
    lamp.write_text(json.dumps(dict(SAMPLES["lamp"])))
    done = site.llfsm("verify", str(lamp), "-p", "a: G !(m@ON && m@OFF)", "-p", "b: G !lit", "--format", "brief")
    assert (done.returncode, done.stdout) == (1, "a holds, b violated, faults: holds\n"), done.stderr
    lamp.write_text(lamp.read_text().replace("button", "knob", 1))
    done = site.llfsm("verify", str(lamp), "--format", "brief")
    assert done.returncode == 3 and "machines.m.inline.states[0].transitions[0].when" in done.stderr
    assert done.stdout == "there is no variable `button` here\n"
    assert site.llfsm("simulate", LIGHTS, "--seed", "1", "--steps", "2", "--format", "tabs").stdout.startswith("step\t")
    assert site.llfsm("draw", LIGHTS, "--format", "plantuml").stdout.startswith("@startuml\n")
    (tmp_path / "ports.yaml").write_text("ports: {c: {kind: clock, every: 1, inputs: [car], on_failure: stale}}\n")
    done = site.llfsm("run", LIGHTS, "--ports", str(tmp_path / "ports.yaml"), "--rate", "0", "--for", "20s", "-q")
    assert done.returncode == 0, done.stderr
