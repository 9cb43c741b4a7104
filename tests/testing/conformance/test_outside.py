"""The engine of `examples/engine`, registered by an entry point from outside the package, and broken ones beside it."""

from __future__ import annotations

import subprocess
import tomllib
from pathlib import Path

import pytest

from tests.distributions import Site

ROOT = Path(__file__).parents[3]
EXAMPLE = ROOT / "examples" / "engine"
GROUP = "llfsm_verify.engines"
LIGHTS = "models/traffic_lights/arrangement.yaml"
ASK = f"""
from llfsm_verify.arrangement.loader import load_arrangement
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.verification.verify import verify
import sys
lines = parse_properties([Source("asked.ltl", "a: G !(ns@GREEN && ew@GREEN)\\nb: G F ew@GREEN")])
result = verify(load_arrangement({LIGHTS!r}), lines, engine=sys.argv[1])
print(result.engine, *(f"{{p.name}}:{{p.verdict.value}}" for p in result.properties), result.faults.verdict.value)
"""


@pytest.fixture
def site(tmp_path: Path) -> Site:
    """With the example installed."""
    project = tomllib.loads((EXAMPLE / "pyproject.toml").read_text(encoding="utf-8"))
    found = Site(tmp_path)
    (module,) = project["tool"]["setuptools"]["py-modules"]
    text = (EXAMPLE / f"{module}.py").read_text(encoding="utf-8")
    found.install(project["project"]["name"], project["project"]["entry-points"], **{module: text})
    return found


def entry(decides: str = "()", more: str = "") -> str:
    """A module with an engine that claims to decide this."""
    return (
        "from llfsm_verify.verification.engines import EngineEntry, Turn\n"
        f"ENTRY = EngineEntry('mine', 'mine:Mine', decides=frozenset({decides}){more})\n"
    )


@pytest.mark.slow
def test_an_engine_of_another_package_is_found_by_its_name(site: Site) -> None:
    done = site.python("-c", ASK, "plain")
    assert (done.stdout, done.stderr) == ("plain a:holds b:violated holds\n", "")


@pytest.mark.slow
def test_it_is_never_asked_by_auto(site: Site) -> None:
    code = "from llfsm_verify.verification.engines import ENGINES; ENGINES.entry('plain')\n"
    done = site.python("-c", f"{code}print(*ENGINES)\nprint(*(e.name for e in ENGINES.values() if e.turns))")
    assert done.stdout.splitlines() == ["auto explicit bmc induction pdr all plain", "explicit bmc induction pdr"]


@pytest.mark.slow
def test_broken_ones_are_a_note_for_those_who_ask_for_them(site: Site) -> None:
    site.install("broken", {GROUP: {"missing": "nowhere:ENTRY", "text": "broken:TEXT"}}, broken="TEXT = 'no entry'\n")
    site.install("greedy", {GROUP: {"greedy": "greedy:ENTRY"}}, greedy=entry(more=", turns=(Turn(1),)"))
    site.install("taken", {GROUP: {"explicit": "taken:ENTRY"}}, taken=entry().replace("'mine',", "'explicit',"))
    assert site.python("-c", ASK, "plain").stdout.startswith("plain ")
    assert site.python("-c", ASK, "explicit").stdout.startswith("explicit ")
    said = site.python("-c", ASK, "missing").stderr.splitlines()[-1]
    assert "there is no engine `missing`; there are: auto, explicit, bmc, induction, pdr, all, plain" in said
    assert "`missing` of broken cannot be used (ModuleNotFoundError: No module named 'nowhere')" in said
    assert "`text` of broken cannot be used (TypeError: broken:TEXT is not an EngineEntry)" in said
    assert "`greedy` of greedy cannot be used (ValueError: only our own engines take turns" in said
    assert "`explicit` of taken cannot be used (ValueError: there are two of the name `explicit`" in said


@pytest.mark.long
def test_the_suite_passes_it(site: Site) -> None:
    done = site.python("-m", "llfsm_verify.testing.conformance", "plain")
    *cases, last = done.stdout.splitlines()
    assert (done.returncode, done.stderr) == (0, ""), [c for c in cases if not c.startswith("passed")]
    assert all(case.startswith("passed") for case in cases) and last == f"{len(cases)} of {len(cases)} passed"


@pytest.mark.slow
def test_the_command_fails_an_engine_that_is_wrong(site: Site) -> None:
    lazy = (
        "from llfsm_verify.checking.engine import Session, Unknown\n"
        "class Mine(Session):\n"
        "    def __init__(self, given): pass\n"
        "    def search(self): pass\n"
        "    def answers(self, goal): return [Unknown('it did not try')]\n"
        "    def fault_runs(self): return []\n"
        "    def faults(self): return Unknown('it did not try')\n"
    )
    site.install("mine", {GROUP: {"mine": "mine:ENTRY"}}, mine=lazy + entry("['violations']"))
    done = site.python("-m", "llfsm_verify.testing.conformance", "mine", "--drawn", "0")
    assert done.returncode == 1
    assert "FAILED" in done.stdout and "which the engine claims to decide: it did not try" in done.stdout
    failed = [line for line in done.stdout.splitlines() if line.startswith("FAILED")]
    passed = [line for line in done.stdout.splitlines() if line.startswith("passed")]
    assert done.stdout.splitlines()[-1] == f"{len(passed)} of {len(passed) + len(failed)} passed"


@pytest.mark.slow
def test_the_command_says_what_there_is(site: Site) -> None:
    done = site.python("-m", "llfsm_verify.testing.conformance", "oracle")
    assert (done.returncode, done.stdout) == (3, "")
    assert done.stderr == "there is no engine `oracle`; there are: auto, explicit, bmc, induction, pdr, all, plain\n"


# -------------------------------------------------- at the command line


def verify(site: Site, *arguments: str) -> subprocess.CompletedProcess[str]:
    return site.python("-m", "llfsm_verify", "verify", *arguments)


@pytest.mark.slow
def test_the_command_line_asks_it(site: Site) -> None:
    done = verify(site, LIGHTS, "--engine", "plain", "-p", "both: G !(ns@GREEN && ew@GREEN)")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("holds  both") and "engine plain" in done.stdout
    done = verify(site, "models/traffic_lights/faulty.yaml", "--engine", "plain", "-p", "G !(ns@GREEN && ew@GREEN)")
    assert done.returncode == 1 and "Violated after step 65, however the run goes on." in done.stdout


@pytest.mark.slow
def test_it_takes_the_options_that_its_entry_names_and_no_others(site: Site) -> None:
    asked = (LIGHTS, "--engine", "plain", "-p", "G !(ns@GREEN && ew@GREEN)")
    done = verify(site, *asked, "--max-states", "5")
    assert done.returncode == 4 and "because the limit of 5 configurations was reached" in done.stdout
    done = verify(site, *asked, "--depth", "3")
    assert (done.returncode, done.stdout) == (2, "") and "--depth is for --engine" in done.stderr


@pytest.mark.slow
def test_the_command_line_says_what_there_is_and_what_is_broken(site: Site) -> None:
    site.install("broken", {GROUP: {"missing": "nowhere:ENTRY"}})
    done = verify(site, LIGHTS, "--engine", "plane", "-p", "true")
    assert done.returncode == 2
    assert "there is no engine `plane`; there are: auto, explicit, bmc, induction, pdr, all, plain" in done.stderr
    assert "the engine `missing` of broken cannot be used (ModuleNotFoundError" in done.stderr
    for name in ("plain", "explicit", "auto"):
        done = verify(site, LIGHTS, "--engine", name, "-p", "true")
        assert (done.returncode, done.stderr) == (0, "")
