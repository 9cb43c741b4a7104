"""Registries: every entry is there, and what there is to choose from is derived from them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import pytest

from llfsm_verify.api.sweeping import SWEEPS
from llfsm_verify.arrangement.formats import ARRANGEMENTS, WRITERS
from llfsm_verify.arrangement.formats.reading import MACHINES, POLICIES
from llfsm_verify.automata.files import AUTOMATA
from llfsm_verify.checking.engine_option import COUNT, EngineOption, EngineOptions
from llfsm_verify.cli.commands import COMMANDS
from llfsm_verify.engines.bounded.engine import BoundedSession
from llfsm_verify.kripke.export.formats import MODELS, STRUCTURES
from llfsm_verify.logic.syntax_names import TABLES
from llfsm_verify.registry import Choices, Entry, Registry, Unregistered
from llfsm_verify.report.codes import OF_OTHERS
from llfsm_verify.report.drawing.formats import DRAWINGS, GRAPHS
from llfsm_verify.report.formats import REPORTS
from llfsm_verify.report.schema import SCHEMAS
from llfsm_verify.report.timeline.formats import TIMELINES
from llfsm_verify.runtime.deciding.logs import LOGS, ORACLES, READINGS
from llfsm_verify.runtime.launch import PANELS
from llfsm_verify.runtime.ports.port import PORTS
from llfsm_verify.verification.engines import ENGINES, FEATURES, GROUP, UNROLLED, EngineEntry, Engines, Turn, table
from llfsm_verify.verification.portfolio import stages_of
from tests.cli.running import LIGHTS, llfsm

ALL: dict[str, Registry[object]] = {
    "access": REPORTS.access, "arrangements": ARRANGEMENTS, "automata": AUTOMATA, "codes": OF_OTHERS,
    "commands": COMMANDS, "drawings": DRAWINGS, "engines": ENGINES, "graphs": GRAPHS, "lint": REPORTS.lint,
    "logs": LOGS, "machines": MACHINES, "models": MODELS, "monitors": REPORTS.monitor,
    "simulations": REPORTS.simulation, "oracles": ORACLES, "panels": PANELS, "policies": POLICIES, "ports": PORTS,
    "queries": REPORTS.query, "readings": READINGS, "results": REPORTS.result, "schemas": SCHEMAS,
    "structures": STRUCTURES, "sweeps": SWEEPS, "syntaxes": TABLES, "timelines": TIMELINES, "writers": WRITERS,
}  # fmt: skip


@pytest.fixture(autouse=True)
def _only_ours(monkeypatch: pytest.MonkeyPatch) -> None:
    """Entry points of packages that happen to be installed are hidden, also where an earlier test has found them."""
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: ())
    for registry in ALL.values():
        monkeypatch.setattr(registry, "_broken", None if registry.group else [])
        monkeypatch.setattr(registry, "_entries", {name: registry[name] for name in registry.ours})


@pytest.mark.parametrize(("registry", "name"), [(r, name) for r in ALL for name in ALL[r].ours])
def test_every_entry_is_there_and_says_what_it_is(registry: str, name: str) -> None:
    assert ALL[registry].load(name) is not None
    assert ALL[registry][name].about and ALL[registry][name].name == name


@pytest.mark.parametrize("registry", ALL)
def test_who_asks_for_another_is_told_what_there_is(registry: str) -> None:
    found = ALL[registry]
    with pytest.raises(Unregistered) as told:
        found.load("nothing")
    assert str(told.value) == f"there is no {found.kind} `nothing`; there are: {', '.join(found)}"


@pytest.mark.parametrize(
    ("command", "option", "names"),
    [
        ("verify", "--engine", ENGINES), ("verify", "--format", REPORTS.result), ("lint", "--format", REPORTS.lint),
        ("query", "--format", REPORTS.query), ("query", "--engine", ENGINES), ("monitor", "--as", REPORTS.monitor),
        ("simulate", "--format", [*REPORTS.simulation, *TIMELINES]), ("trace", "--to", [*TIMELINES, "trace"]),
        ("draw", "--format", DRAWINGS),
        ("kripke", "--format", [*STRUCTURES, *MODELS]), ("verify", "--syntax", ["llfsm", *TABLES]),
    ],
)  # fmt: skip
def test_the_command_line_offers_what_there_is(command: str, option: str, names: list[str]) -> None:
    done = llfsm(command, LIGHTS, *(["true"] if command == "query" else []), option, "nothing")
    assert done.returncode == 2
    assert ", ".join(names) in done.stderr.replace("'", "")


def test_names_and_endings_stand_for_one_entry() -> None:
    found: Registry[object] = Registry("fruit", [Entry("apple", "os:name", suffixes=(".apl",))])
    assert found.named_by("a/b/C.APL") == "apple" and found.named_by("apl") is None
    with pytest.raises(ValueError, match=r"two of the name `apple`: fruit"):
        found.add(Entry("apple", "os:sep"))
    with pytest.raises(ValueError, match=r"`\.apl` already stands for another fruit"):
        found.add(Entry("pear", "os:sep", suffixes=(".prs", ".apl")))
    assert list(found) == ["apple"]
    found.add(Entry("pear", "os:sep", suffixes=(".prs",)))
    assert (found.named_by("x.prs"), len(found), found.load("pear")) == ("pear", 2, __import__("os").sep)


def test_an_ending_that_is_not_ours_is_looked_for_in_other_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    points = [Found("plum", Entry("plum", "os:sep", suffixes=(".plm",))), Found("broken", ImportError("no fruit"))]
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: points if group == "fruit" else [])
    found: Registry[object] = Registry("fruit", [Entry("apple", "os:name", suffixes=(".apl",))], "fruit")
    both = Choices(found, ("stone",))
    assert found.named_by("a.apl") == "apple" and found.named_by("-") is None and list(found) == ["apple"]
    assert found.named_by("a.plm") == "plum" and found.named_by("a.xyz") is None
    assert (list(found), found.ours, list(both), len(both)) == (
        ["apple", "plum"], ("apple",), ["apple", "plum", "stone"], 3,
    )  # fmt: skip
    assert both.find_others() == ["the fruit `broken` cannot be used (ImportError: no fruit)"]
    assert "stone" in both and "plum" in both and "pear" not in both


def test_the_page_of_the_command_line_has_the_table_of_engines() -> None:
    assert table() in Path("docs/command-line.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("engine", "asked", "wrong"),
    [
        ("explicit", ["depth"], "depth"),
        ("bmc", ["vacuity"], "vacuity"),
        ("pdr", ["depth", "vacuity", "cone"], "cone"),
        ("all", ["depth", "checkpoint"], "checkpoint"),
        ("auto", [each.name for each in (*ENGINES.options(), *FEATURES)], None),
    ],
)
def test_an_option_that_an_engine_does_not_take_is_found(engine: str, asked: list[str], wrong: str | None) -> None:
    found = ENGINES.misplaced(engine, dict.fromkeys(asked, 7))
    assert (None if found is None else found.name) == wrong


def test_the_engines_that_take_an_option_are_told() -> None:
    assert ENGINES.takers("depth") == "bmc, induction and pdr"
    assert ENGINES.takers("cone") == "explicit"


class Found:
    """An entry point as `importlib.metadata` gives it."""

    dist = None

    def __init__(self, name: str, what: object) -> None:
        self.name, self.value, self._what = name, f"somewhere:{name}", what

    def load(self) -> object:
        if isinstance(self._what, Exception):
            raise self._what
        return self._what


def test_engines_of_others_are_looked_for_when_a_name_is_not_ours(monkeypatch: pytest.MonkeyPatch) -> None:
    good = EngineEntry("mine", "llfsm_verify.engines.bounded.engine:BoundedSession", "a copy of bmc")
    points = [
        Found("mine", good), Found("broken", ImportError("no module named x")), Found("number", 3),
        Found("explicit", EngineEntry("explicit", "os:sep")),
        Found("turning", EngineEntry("t", "os:sep", turns=(Turn(0),))),
    ]  # fmt: skip
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: points if group == GROUP else [])
    engines = Engines("engine", [EngineEntry("explicit", "os:name")])
    assert engines.entry("explicit").place == "os:name"
    assert list(engines) == ["explicit"]  # nobody has asked for another
    with pytest.raises(Unregistered) as told:
        engines.entry("nothing")
    assert str(told.value) == (
        "there is no engine `nothing`; there are: explicit, mine; "
        "the engine `broken` cannot be used (ImportError: no module named x); "
        "the engine `explicit` cannot be used (ValueError: there are two of the name `explicit`: engine); "
        "the engine `number` cannot be used (TypeError: somewhere:number is not an EngineEntry); "
        "the engine `turning` cannot be used (ValueError: only our own engines take turns in `auto` and ask others)"
    )
    assert engines.load("mine") is BoundedSession
    assert all(stage.engine != "mine" for stage in stages_of(engines))


@dataclass(frozen=True, slots=True)
class Doubled(EngineOptions):
    """Has an option of the name that one of ours has."""

    OPTIONS: ClassVar[tuple[EngineOption, ...]] = (EngineOption("depth", "--their-depth", kind=COUNT, help=""),)
    depth: int = 1


@dataclass(frozen=True, slots=True)
class Featured(EngineOptions):
    """Has the flag of something that the harness gives engines."""

    OPTIONS: ClassVar[tuple[EngineOption, ...]] = (EngineOption("most", "--max-states", kind=COUNT, help=""),)
    most: int = 1


@dataclass(frozen=True, slots=True)
class Needy(EngineOptions):
    """Cannot be made without its option."""

    OPTIONS: ClassVar[tuple[EngineOption, ...]] = (EngineOption("needed", "--needed", kind=COUNT, help=""),)
    needed: int


@pytest.mark.parametrize(
    ("own", "why"),
    [
        (f"{__name__}:Doubled", "ValueError: there already is an option `depth`"),
        (f"{__name__}:Featured", "ValueError: there already is an option `most`"),
        (f"{__name__}:Needy", "TypeError: .*needed"),
        ("nowhere:Options", "ModuleNotFoundError: No module named 'nowhere'"),
        ("llfsm_verify.engines.unrolled.options:Missing", "AttributeError: "),
    ],
)
def test_an_engine_whose_options_cannot_be_ours_too_is_not_used(
    own: str, why: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its own classes are made and looked at when it is found, so that nothing else is disturbed later."""
    points = [Found("theirs", EngineEntry("theirs", "os:sep", own=(own,)))]
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: points)
    engines = Engines("engine", ENGINES.values())  # type: ignore[arg-type]
    with pytest.raises(Unregistered, match=rf"the engine `theirs` cannot be used \({why}"):
        engines.entry("theirs")
    assert engines.options() == ENGINES.options(ENGINES.ours)


def test_an_engine_may_have_the_options_of_one_of_ours(monkeypatch: pytest.MonkeyPatch) -> None:
    points = [Found("theirs", EngineEntry("theirs", "os:sep", own=(UNROLLED,)))]
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: points)
    engines = Engines("engine", ENGINES.values())  # type: ignore[arg-type]
    assert engines.entry("theirs").takes("depth") and engines.takers("depth") == "bmc, induction, pdr and theirs"
