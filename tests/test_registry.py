"""Registries: every entry is there, and what there is to choose from is derived from them."""

from __future__ import annotations

import pytest

from llfsm_verify.arrangement.formats import ARRANGEMENTS, MACHINES
from llfsm_verify.exports.formats import MODELS
from llfsm_verify.kripke.export.formats import STRUCTURES
from llfsm_verify.logic.syntax_names import TABLES
from llfsm_verify.registry import Entry, Registry, Unregistered
from llfsm_verify.report.drawing.formats import DRAWINGS
from llfsm_verify.report.formats import LINT, QUERIES, RESULTS
from llfsm_verify.report.schemas import SCHEMAS
from llfsm_verify.verification.engines import ENGINES
from tests.cli.running import LIGHTS, llfsm

ALL: dict[str, Registry[object]] = {
    "arrangements": ARRANGEMENTS, "drawings": DRAWINGS, "engines": ENGINES, "lint": LINT, "machines": MACHINES,
    "models": MODELS, "queries": QUERIES, "results": RESULTS, "schemas": SCHEMAS, "structures": STRUCTURES,
    "syntaxes": TABLES,
}  # fmt: skip


@pytest.mark.parametrize(("registry", "name"), [(r, name) for r in ALL for name in ALL[r]])
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
        ("verify", "--engine", ENGINES), ("verify", "--format", RESULTS), ("lint", "--format", LINT),
        ("query", "--format", QUERIES), ("query", "--engine", ENGINES), ("draw", "--format", DRAWINGS),
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
