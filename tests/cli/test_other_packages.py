"""What another distribution adds by entry points: found by its name and its ending, and listed beside ours."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.running import LIGHTS
from tests.distributions import Site

THEIRS = """
from dataclasses import dataclass
from typing import ClassVar
from llfsm_verify.plug import COUNT, FLAG, EngineEntry, EngineOption, EngineOptions, Session, Unknown
from llfsm_verify.plug import Entry, ReportEntry, Row

def brief(result, arrangement, style):
    return " ".join(f"{p.name}={p.verdict.value}" for p in result.properties)
def wrong_files(diagnostics, code):
    return f"{len(diagnostics)} wrong, {code}"
BRIEF = ReportEntry("brief", "theirs:brief", "a word each", failure="theirs:wrong_files")

def write_dots(timeline, file):
    file.write("".join(f"{row.step}." for row in timeline.rows).encode())
DOTS = Entry("dots", "theirs:write_dots", "steps and dots", (".dots",))

def read_bars(path, wanted):
    for number, line in enumerate(open(path), 1):
        yield Row(f"line {number}", dict(zip(("car", "ns"), line.strip().split("|"))))
BARS = Entry("bars", "theirs:read_bars", "cells between bars", (".bars",))

def titles(graph):
    return "".join(f"{node.title}\\n" for node in graph.nodes)
TITLES = Entry("titles", "theirs:titles", "the titles of nodes", (".titles",))

@dataclass(frozen=True, slots=True)
class WideOptions(EngineOptions):
    OPTIONS: ClassVar = (
        EngineOption("breadth", "--breadth", kind=COUNT, default=7, help="how wide"),
        EngineOption("loud", "--loud", kind=FLAG, default=False, help="say so"),
        EngineOption("polite", "--polite", kind=FLAG, default=True, help="say please"),
    )
    breadth: int = 7
    loud: bool = False
    polite: bool = True
class Wide(Session):
    def __init__(self, given):
        own = given.options.of(WideOptions)
        self.why = f"breadth {own.breadth}{', loud' if own.loud else ''}{'' if own.polite else ', rude'}"
    def search(self): pass
    def answers(self, goal): return [Unknown(self.why)]
    def fault_runs(self): return []
    def faults(self): return Unknown(self.why)
WIDE = EngineEntry("wide", "theirs:Wide", "as wide as asked", own=("theirs:WideOptions",))
"""
CLASHES = """
from dataclasses import dataclass
from typing import ClassVar
from llfsm_verify.plug import COUNT, FLAG, EngineEntry, EngineOption, EngineOptions
@dataclass(frozen=True, slots=True)
class Strict(EngineOptions):
    OPTIONS: ClassVar = (EngineOption("strict", "--strict", kind=FLAG, help="clashes with an option of the command"),)
    strict: bool = False
@dataclass(frozen=True, slots=True)
class Deep(EngineOptions):
    OPTIONS: ClassVar = (EngineOption("depth", "--my-depth", kind=COUNT, help="clashes with one of our engines"),)
    depth: int = 1
@dataclass(frozen=True, slots=True)
class Needy(EngineOptions):
    OPTIONS: ClassVar = (EngineOption("needed", "--needed", kind=COUNT, help="cannot be left out"),)
    needed: int
STRICT = EngineEntry("strict", "theirs:Wide", own=("clashes:Strict",))
DEEP = EngineEntry("deep", "theirs:Wide", own=("clashes:Deep",))
NEEDY = EngineEntry("needy", "theirs:Wide", own=("clashes:Needy",))
"""
MAPPING = "columns: {car: car, ns: ns}\n"


@pytest.fixture
def site(tmp_path: Path) -> Site:
    folder = tmp_path / "site"
    folder.mkdir()
    found = Site(folder)
    found.install("theirs", {
        "llfsm_verify.reports.result": {"brief": "theirs:BRIEF", "gone": "nowhere:GONE"},
        "llfsm_verify.timelines": {"dots": "theirs:DOTS", "gone": "nowhere:GONE"},
        "llfsm_verify.logs": {"bars": "theirs:BARS"},
        "llfsm_verify.drawings": {"titles": "theirs:TITLES"},
        "llfsm_verify.engines": {"wide": "theirs:WIDE"},
    }, theirs=THEIRS)  # fmt: skip
    return found


@pytest.mark.slow
def test_a_report_is_found_by_its_name_also_where_files_are_wrong(site: Site, tmp_path: Path) -> None:
    done = site.llfsm("verify", LIGHTS, "-p", "a: true", "-p", "b: F ns@GREEN", "--format", "brief", "--engine", "wide")
    assert (done.returncode, done.stdout) == (4, "a=unknown b=unknown\n"), done.stderr
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text("machines: []\n")
    done = site.llfsm("verify", str(wrong), "--format", "brief")
    assert (done.returncode, done.stdout) == (3, f"{done.stderr.count('error[')} wrong, 3\n")
    done = site.llfsm("verify", LIGHTS, "--format", "breef")
    assert done.returncode == 2 and "did you mean `brief`?; the report format `gone` of theirs cannot be" in done.stderr
    done = site.llfsm("lint", LIGHTS, "--format", "brief")
    assert done.returncode == 2 and "there is no `brief`; did you mean `sarif`?\n" in done.stderr


@pytest.mark.slow
def test_a_timeline_is_found_by_its_name_and_by_its_ending(site: Site, tmp_path: Path) -> None:
    run = ("simulate", LIGHTS, "--seed", "1", "--steps", "3")
    assert site.llfsm(*run, "--format", "dots").stdout == "0.1.2.3."
    for output in ("run.dots", "run.DOTS"):
        assert site.llfsm(*run, "-o", str(tmp_path / output)).returncode == 0
        assert (tmp_path / output).read_text() == "0.1.2.3."
    done = site.llfsm(*run, "--format", "dits")
    assert "there is no `dits`; did you mean `dots`?; the format of timelines `gone` of theirs" in done.stderr
    faulty = "models/traffic_lights/faulty.yaml"
    asked = ("verify", faulty, "-p", "a: G !(ns@GREEN && ew@GREEN)", "--save-traces", str(tmp_path))
    assert site.llfsm(*asked, "--save-as", "dots").returncode == 1
    assert (tmp_path / "a.dots").exists()
    trace = ("trace", str(tmp_path / "a.trace.yaml"))
    assert site.llfsm(*trace, "--to", "dots").stdout == (tmp_path / "a.dots").read_text()
    assert "say which format: --to csv, mcap, vcd, svg, itf, dots, trace," in site.llfsm(*trace, "-o", "x.y").stderr


@pytest.mark.slow
def test_a_log_is_found_by_its_name_and_by_its_ending(site: Site, tmp_path: Path) -> None:
    mapping, log, other = tmp_path / "mapping.yaml", tmp_path / "a.bars", tmp_path / "a.txt"
    mapping.write_text(MAPPING)
    for path in (log, other):
        path.write_text("true|RED\ntrue|GREEN\n")
    asked = ("--mapping", str(mapping), "--arrangement", LIGHTS, "-p", "G !ns@GREEN")
    for given in ((str(log),), (str(other), "--from", "bars")):
        done = site.llfsm("check-recording", *given, *asked)
        assert (done.returncode, "violated" in done.stdout) == (1, True), done.stderr
    done = site.llfsm("check-recording", str(other), *asked)
    assert "say which format the log has: --from mcap, rosbag, csv, parquet, bars" in done.stderr


@pytest.mark.slow
def test_a_drawing_is_found_by_its_name_and_by_its_ending(site: Site, tmp_path: Path) -> None:
    shown = site.llfsm("draw", LIGHTS, "--format", "titles").stdout
    assert "2. ns" in shown.splitlines()
    assert site.llfsm("draw", LIGHTS, "-o", str(tmp_path / "a.titles")).returncode == 0
    assert (tmp_path / "a.titles").read_text() == shown


# -------------------------------------------------- options of engines


@pytest.mark.slow
@pytest.mark.parametrize("named", [["--engine", "wide"], ["--engine=wide"], ["--eng", "wide"]])
def test_an_option_of_an_engine_is_one_of_the_command_that_asks_it(site: Site, named: list[str]) -> None:
    for command in (["verify", LIGHTS, "-p", "true"], ["query", LIGHTS, "ns@GREEN"]):
        done = site.llfsm(*command, "--breadth", "3", *named, "--loud")
        assert done.returncode == 4 and "breadth 3, loud" in done.stdout, done.stderr
    done = site.llfsm("verify", LIGHTS, "-p", "true", *named)
    assert "breadth 7\n" in done.stdout
    assert "breadth 7, rude\n" in site.llfsm("verify", LIGHTS, "-p", "true", "--no-polite", *named).stdout


@pytest.mark.slow
def test_it_is_in_the_help_and_wrong_values_are_said(site: Site) -> None:
    shown = " ".join(site.llfsm("verify", "--engine", "wide", "--help").stdout.split())
    assert "--breadth N how wide (default: 7)" in shown and "--no-polite say please (default: on)" in shown
    assert "--breadth" not in site.llfsm("verify", "--help").stdout
    done = site.llfsm("verify", LIGHTS, "--engine", "wide", "--breadth", "0")
    assert (done.returncode, done.stderr) == (2, "error: --breadth: '0' is not a whole number from 1\n")
    done = site.llfsm("verify", LIGHTS, "--engine", "bmc", "--breadth", "3")
    assert (done.returncode, done.stdout) == (2, "") and "unrecognized arguments: --breadth 3" in done.stderr
    done = site.llfsm("verify", LIGHTS, "--engine", "wide", "--depth", "3")
    assert (done.returncode, done.stdout) == (2, "") and "--depth is for --engine bmc, induction and pdr" in done.stderr


PYTHON = f"""
import llfsm_verify as lv
model = lv.load({LIGHTS!r})
print(next(iter(model.check("true", engine="wide", breadth=3, loud=True))).reason)
print(model.query("ns@GREEN", engine="wide", breadth=4).reason)
print(model.query("ns@GREEN", engine="wide", polite=False).reason)
for given in ({{"breadth": 0}}, {{"depth": 3}}, {{"width": 3}}):
    try:
        model.check("true", engine="wide", **given)
    except (TypeError, ValueError) as error:
        print(type(error).__name__, error)
try:
    model.check("true", engine="bmc", breadth=3)
except TypeError as error:
    print(str(error).partition(",")[0])
"""


@pytest.mark.slow
def test_it_is_a_keyword_of_python(site: Site) -> None:
    done = site.python("-c", PYTHON)
    first, second, third, zero, depth, width, bmc = done.stdout.splitlines()
    assert (first, second, third) == ("breadth 3, loud", "breadth 4", "breadth 7, rude")
    assert zero == "ValueError the option `breadth` needs a whole number from 1, not 0"
    assert depth == "ValueError the option `depth` is for bmc, induction and pdr, not for `wide`"
    assert width.startswith("TypeError check has no option `width`") and "breadth, loud, polite" in width
    assert bmc == "check has no option `breadth`"


@pytest.mark.slow
def test_options_that_clash_are_said_to_those_who_ask(site: Site) -> None:
    names = {name: f"clashes:{name.upper()}" for name in ("strict", "deep", "needy")}
    site.install("clashes", {"llfsm_verify.engines": names}, clashes=CLASHES)
    asked = ("verify", LIGHTS, "-p", "true", "--engine")
    assert "breadth 3" in site.llfsm(*asked, "wide", "--strict", "--breadth", "3").stdout
    done = site.llfsm(*asked, "strict")
    said = "the engine `strict` cannot be asked: `--strict` already is an option of `llfsm verify`"
    assert (done.returncode, done.stdout, done.stderr) == (2, "", f"error: {said}\n")
    code = f"import llfsm_verify as lv; lv.load({LIGHTS!r}).check('true', engine='strict')"
    said = "ValueError: the engine `strict` cannot be asked: `strict` already is an option of a check"
    assert said in site.python("-c", code).stderr
    assert "the engine `deep` of clashes cannot be used (ValueError: there already is an option `depth`)" in (
        site.llfsm(*asked, "deep").stderr
    )
    assert "the engine `needy` of clashes cannot be used (TypeError: " in site.llfsm(*asked, "needy").stderr


BROKEN = """
import json
from llfsm_verify.plug import EngineEntry, Entry, ReportEntry, draft_data
GONE = EngineEntry("gone", "broken:nothing", "a place with nothing")
HALF = ReportEntry("half", "theirs:brief", "a word each", failure="broken:nothing")
def read_json(given):
    return draft_data(json.load(open(given.path)))
JSON = Entry("json", "broken:read_json", "JSON", (".json",))
"""


@pytest.mark.slow
def test_what_is_wrong_in_another_package_is_not_said_to_be_our_mistake(site: Site, tmp_path: Path) -> None:
    points = {
        "llfsm_verify.engines": {"gone": "broken:GONE", "leaves": "leaves:ENTRY"},
        "llfsm_verify.reports.result": {"half": "broken:HALF"},
        "llfsm_verify.arrangements": {"json": "broken:JSON"},
    }
    site.install("broken", points, broken=BROKEN, leaves="raise SystemExit(9)\n")
    done = site.llfsm("verify", LIGHTS, "-p", "true", "--engine", "gone")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: the engine `gone` of another package cannot be used (AttributeError: ")
    done = site.llfsm("verify", LIGHTS, "-p", "true", "--engine", "gune")
    assert done.returncode == 2 and "the engine `leaves` of broken cannot be used (SystemExit: 9)" in done.stderr
    done = site.llfsm("verify", "missing.yaml", "--format", "half")
    assert done.returncode == 3 and "E001" in done.stderr and "the report has no text for this (Attr" in done.stderr
    wrong = tmp_path / "a.json"
    wrong.write_text("{}")
    done = site.llfsm("check", str(wrong))
    assert done.returncode == 3 and "E0" in done.stderr
