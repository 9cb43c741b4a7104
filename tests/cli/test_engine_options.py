"""Defaults of engine options of every kind: on the command line, in Python, in help and in the table of engines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import pytest

from llfsm_verify.checking.engine_option import (
    COUNT,
    FILE,
    FLAG,
    SECONDS,
    SWITCH,
    WHEN,
    EngineOption,
    EngineOptions,
    Kind,
)
from llfsm_verify.cli import engine_options as module
from llfsm_verify.cli.engine_options import engine_options, given_options, refuse_misplaced
from llfsm_verify.cli.parser import Parser, UsageError
from llfsm_verify.verification import engines as registered
from llfsm_verify.verification.engines import UNROLLED, EngineEntry, Engines


@dataclass(frozen=True, slots=True)
class Planted(EngineOptions):
    """An option of each kind with a default, two of flags, and one that is a part of another."""

    OPTIONS: ClassVar[tuple[EngineOption, ...]] = (
        EngineOption("breadth", "--breadth", kind=COUNT, default=7, help="how wide"),
        EngineOption("soft", "--soft", kind=FLAG, default=False, help="softly"),
        EngineOption("loud", "--loud", kind=FLAG, default=True, help="loudly"),
        EngineOption("pause", "--pause", kind=SECONDS, default=60.0, help="how long"),
        EngineOption("log", "--log", kind=FILE, default="50%.txt", help="where to"),
        EngineOption("split", "--split", kind=SWITCH, default=False, help="90 % in parts"),
        EngineOption("fold", "--fold", kind=WHEN, default="on", help="smaller"),
        EngineOption("margin", "--margin", kind=COUNT, part_of="breadth", alone="is about {}", help="beside it"),
    )
    breadth: int = 7
    soft: bool = False
    loud: bool = True
    pause: float = 60.0
    log: str = "50%.txt"
    split: bool = False
    fold: str = "on"
    margin: int | None = None


@dataclass(frozen=True, slots=True)
class Torn(EngineOptions):
    """Says two things about one default."""

    OPTIONS: ClassVar[tuple[EngineOption, ...]] = (EngineOption("w", "--w", kind=COUNT, default=7, help=""),)
    w: int = 8


@pytest.fixture
def engines(monkeypatch: pytest.MonkeyPatch) -> Engines:
    """Two engines, of which the first has the planted options."""
    found = Engines(
        "engine",
        [
            EngineEntry("wide", "os:name", "as wide as asked", own=(f"{__name__}:Planted",)),
            EngineEntry("deep", "os:name", "as deep as asked", own=(UNROLLED,)),
        ],
    )
    monkeypatch.setattr(module, "ENGINES", found)
    monkeypatch.setattr(registered, "ENGINES", found)
    return found


def parser_of(engines: Engines) -> Parser:
    parser = Parser("llfsm verify")
    parser.add_argument("--engine", default="wide")
    parser.add_argument("--max-states")
    engine_options(parser, parser, engines.options())
    return parser


@pytest.mark.parametrize(
    ("words", "made"),
    [
        ([], Planted()),
        (["--breadth", "9"], Planted(9)),
        (["--soft", "--no-loud"], Planted(soft=True, loud=False)),
        (["--loud"], Planted()),
        (["--pause", "2.5", "--log", "a.txt"], Planted(pause=2.5, log="a.txt")),
        (["--split", "on", "--fold", "off"], Planted(split=True, fold="off")),
        (["--margin", "3"], Planted(margin=3)),
    ],
)
def test_a_default_of_every_kind_is_what_the_engine_is_told(engines: Engines, words: list[str], made: Planted) -> None:
    options = parser_of(engines).parse_args(words)
    refuse_misplaced(options)
    own = engines.own(given_options(options))
    assert (own[0] if own else Planted()) == made
    assert engines.own({}) == ()  # as Python's keywords, of which none is given


def test_a_default_is_no_question_to_an_engine_that_does_not_take_it(engines: Engines) -> None:
    refuse_misplaced(parser_of(engines).parse_args(["--engine", "deep", "--depth", "3"]))
    with pytest.raises(UsageError, match=r"^--breadth is for --engine wide$"):
        refuse_misplaced(parser_of(engines).parse_args(["--engine", "deep", "--breadth", "8"]))
    assert engines.partial({"margin": 3}) is None  # that of which it is a part has a default
    wrong = engines.misplaced("deep", {"breadth": 7, "loud": False})
    assert wrong is not None and wrong.name == "loud"


def test_help_and_the_table_of_engines_show_them(engines: Engines) -> None:
    shown = " ".join(parser_of(engines).format_help().split())
    for said in (
        "how wide (default: 7)", "softly --", "--loud, --no-loud loudly (default: on)", "how long (default: 60)",
        "where to (default: 50%.txt)", "90 % in parts (default: off)", "smaller (default: on)",
    ):  # fmt: skip
        assert said in shown
    assert "| `--breadth` `--soft` `--loud` `--pause` `--log` `--split` `--fold` |\n" in registered.table()


@pytest.mark.parametrize(("kind", "default"), [(COUNT, 0), (FLAG, "yes"), (WHEN, "never"), (SWITCH, "on"), (FILE, "")])
def test_a_default_that_its_kind_does_not_take_is_refused(kind: Kind, default: object) -> None:
    with pytest.raises(ValueError, match=rf"^the default of the option `x` is {default!r}, not "):
        EngineOption("x", "--x", kind=kind, default=default, help="")


def test_a_flag_without_dashes_is_refused() -> None:
    with pytest.raises(ValueError, match=r"^the flag `x` of the option `x` does not begin with `--`$"):
        EngineOption("x", "x", kind=COUNT, help="")


def test_the_defaults_of_ours_are_those_of_their_classes() -> None:
    for each in registered.ENGINES.classes(registered.ENGINES.ours):
        each.demand_defaults()
    with pytest.raises(ValueError, match=r"^the default of `w` is 7, and 8 in its class$"):
        Torn.demand_defaults()
