"""The suite for engines: it passes ours, and fails each of those that are wrong on purpose in a case that is named."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import pytest

from llfsm_verify.checking.engine_option import COUNT, FLAG, EngineOption, EngineOptions
from llfsm_verify.registry import Unregistered
from llfsm_verify.testing.conformance import Outcome, check_engine, engine_cases
from llfsm_verify.verification.engines import ENGINES, EXPLICIT, UNROLLED, EngineEntry
from tests.quick import many
from tests.testing.conformance import wrong

CLAIMS = frozenset({"violations", "proofs", "faults"})
WRONG = {
    "AlwaysUnknown": ("safety", "`both` is unknown, which the engine claims to decide: who knows"),
    "AlwaysHolds": ("safety", "`stays` is said to hold and is violated"),
    "HoldsAtLimit": ("1 configurations: last step", "`end` is said to hold and is violated"),
    "NeverTheSame": ("again: safety", "`both` has another answer when it is asked for again"),
    "Crashes": ("safety", "RuntimeError: an engine of others"),
    "DropsTheLastStep": ("last step", "Disagreement: property end: the run shown could still go on"),
    "GivesNoChoices": ("safety", "reads `go`, which the run does not give"),
    "LoopsBackToTheStart": ("loop", "Disagreement: property back: the trace satisfies the property"),
    "ShowsWrongLetters": ("safety", "the executor shows another letter than the search"),
    "ForgetsFreeValues": ("free values", "Disagreement: property zero"),
    "IgnoresAssumptions": ("assumption for liveness", "the trace does not satisfy an assumption"),
    "IgnoresFairness": ("fair processes", "the loop of the trace is not fair"),
    "AssumesFairness": ("unfair processes", "`b` is said to hold and is violated"),
    "ObservesRinglets": ("observed cycles", "Disagreement: property inside"),
    "TellsTimeWrongly": ("logical time", "Disagreement: property"),
    "SeesInitialInputs": ("safety", "`stays` is said to hold and is violated"),
    "StopsAtTheEnd": ("the end", "`late` is said to hold and is violated"),
    "KnowsOnlySafety": ("liveness", "`again` is said to hold and is violated"),
    "IgnoresBounds": ("bounds in time", "`late` is said to hold and is violated"),
    "ForbidsInitially": ("regular", "`on` is said to hold and is violated"),
    "SeesNoFaults": ("a range that is left", "no fault is said to happen, and there are: F001"),
    "NumbersFaultsWrongly": ("three kinds of faults", "the executor does not fault on its trace"),
    "LeavesFaultsOpen": ("safety", "whether faults happen is unknown, which the engine claims to decide"),
    "SaysRunsArePossible": ("contradictory assumptions", "`x` is said to hold, without a note"),
    "SaysNoRunIsPossible": ("assumption for liveness", "it is said that no run satisfies the assumptions, and some do"),
    "SwallowsCtrlC": ("Ctrl-C", "the harness was not told of Ctrl-C"),
    "IsInterruptedLater": ("Ctrl-C at a tick: last step", "and here it was afterwards"),
    "Exits": ("safety", "SystemExit: enough"),
    "ClaimsAllWhenInterrupted": ("Ctrl-C at a tick: last step", "`end` is said to hold and is violated"),
    "IgnoresLimits": ("1 configurations: last step", "after 1 of 13 configurations"),
    "GoesOnAfterTheLimit": ("no time", "it did not end within 2 s of processor time"),
}
"""Of each wrong engine the case that catches it, and something of what is said then."""
NO_CLAIMS = ("NeverTheSame",)
"""Those that claim to decide nothing, so that nothing else catches them."""


def entry(name: str) -> EngineEntry:
    decides = frozenset() if name in NO_CLAIMS else CLAIMS
    return EngineEntry(
        name, f"tests.testing.conformance.wrong:{name}", decides=decides, options=frozenset({"max_states"})
    )


SLOW = frozenset({"Ctrl-C", "no time"})
"""Cases that take more than a second of processor time, where an engine fails them."""


def outcome(engine: EngineEntry, case: str, patience: float = 60) -> Outcome:
    (found,) = [c for c in engine_cases(engine, patience=patience) if c.name == case]
    return found()


def marked(name: str, case: str) -> object:
    return pytest.param(name, marks=pytest.mark.slow if case in SLOW else ())


@pytest.mark.parametrize("name", [marked(name, case) for name, (case, _) in WRONG.items()])
def test_a_wrong_engine_fails(name: str) -> None:
    case, says = WRONG[name]
    found = outcome(entry(name), case, patience=2 if name == "GoesOnAfterTheLimit" else 60)
    assert not found.passed and says in found.wrong, found.wrong


@pytest.mark.parametrize("case", [marked(case, case) for case in sorted({case for case, _ in WRONG.values()})])
def test_the_same_case_passes_the_engine_that_is_changed(case: str) -> None:
    found = outcome(entry("Explicit"), case)
    assert found.passed, found.wrong


def test_each_wrong_engine_is_tried() -> None:
    bases = {"Delegate", "Explicit", "Retold", "OtherGoals", "ChangesFairness"}
    classes = {n for n, c in vars(wrong).items() if isinstance(c, type) and issubclass(c, wrong.Delegate)}
    assert len(WRONG) > 12
    assert classes - bases == set(WRONG)


def test_cases_have_names_of_their_own() -> None:
    names = [case.name for case in engine_cases("explicit")]
    assert len(names) == len(set(names))


@dataclass(frozen=True, slots=True)
class Torn(EngineOptions):
    """Says two things about one default."""

    OPTIONS: ClassVar[tuple[EngineOption, ...]] = (EngineOption("w", "--w", kind=COUNT, default=7, help=""),)
    w: int = 8


@dataclass(frozen=True, slots=True)
class Doubled(EngineOptions):
    """Has one flag for two options."""

    OPTIONS: ClassVar[tuple[EngineOption, ...]] = (
        EngineOption("a", "--a", kind=COUNT, help=""), EngineOption("b", "--a", kind=FLAG, help=""),
    )  # fmt: skip
    a: int = 8
    b: bool = False


@pytest.mark.parametrize(
    ("own", "says"), [("Torn", "the default of `w` is 7, and 8"), ("Doubled", "conflicting option")]
)
def test_options_that_cannot_be_arguments_fail(own: str, says: str) -> None:
    found = outcome(replace(entry("Explicit"), own=(f"{__name__}:{own}",)), "own options")
    assert not found.passed and says in found.wrong, found.wrong
    assert outcome(EngineEntry("any", "os:name", own=(EXPLICIT, UNROLLED)), "own options").passed


def test_an_engine_that_nobody_registered_is_named() -> None:
    with pytest.raises(Unregistered, match="there is no engine `oracle`; there are: auto, explicit"):
        check_engine("oracle")


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in ENGINES if name != "all"])
def test_our_engines_pass(name: str) -> None:
    assert [o for o in check_engine(name, drawn=many(120)) if not o.passed] == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["AlwaysHolds", "IgnoresAssumptions", "SeesNoFaults", "DropsTheLastStep"])
def test_random_arrangements_catch_it_as_well(name: str) -> None:
    cases = [case for case in engine_cases(entry(name)) if case.name.startswith("random ")]
    assert any(not case().passed for case in cases)
