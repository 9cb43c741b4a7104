"""Cases of a conformance suite, and what comes of one: passed, or what was wrong in a sentence; and what a result may
say where the answers are known, or computed by the reference.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib.util import find_spec

from llfsm_verify.checking.verdict import NO_RUN, OPEN, Result, Verdict
from llfsm_verify.testing.conformance.known import Known
from llfsm_verify.testing.conformance.stopping import Overdue, within

PATIENCE = 120.0
"""Seconds of processor time after which a case is ended."""


class Wrong(Exception):
    """What a case found to be wrong, in a sentence without its full stop."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of one case."""

    name: str
    passed: bool
    wrong: str = ""
    """What was wrong, in a sentence without its full stop."""
    seconds: float = 0.0
    """Processor time that it took."""


@dataclass(frozen=True, slots=True)
class Case:
    """One thing that is looked at. Calling it gives its outcome."""

    name: str
    about: str
    """What it looks at, in a sentence without its full stop."""
    look: Callable[[], None]
    """Raises Wrong."""
    patience: float = PATIENCE
    """Seconds of processor time after which it is ended, as far as Python code runs in the main thread."""

    def __str__(self) -> str:
        return self.name

    def __call__(self) -> Outcome:
        started = time.process_time()
        wrong = self._wrong()
        return Outcome(self.name, not wrong, wrong, time.process_time() - started)

    def _wrong(self) -> str:
        try:
            with within(self.patience):
                self.look()
        except Wrong as wrong:
            return str(wrong)
        except Overdue:
            return f"it did not end within {self.patience:g} s of processor time"
        except (Exception, SystemExit) as error:  # noqa: BLE001 - whatever an engine of others raises is what is reported
            return f"{type(error).__name__}: {error}".replace("\n", " ").rstrip(".")
        return ""


def outcomes_of(cases: Iterable[Case]) -> list[Outcome]:
    """The outcomes, in the order of the cases."""
    return [case() for case in cases]


def demand_hypothesis() -> None:
    """Raises ModuleNotFoundError where there is no Hypothesis, which draws the random cases."""
    if find_spec("hypothesis") is None:
        install = "pip install 'llfsm-verify[testing]', or ask for none of them (drawn=0)"
        raise ModuleNotFoundError(f"random cases need Hypothesis, which is not installed: {install}", name="hypothesis")


@dataclass(frozen=True, slots=True)
class Answers:
    """What is true.

    `holds`: of the properties, by name; one that is missing is not judged. `faults`: the codes of those in which runs
    end; None: not judged.
    """

    holds: Mapping[str, bool]
    faults: frozenset[str] | None
    contradictory: bool | None = False
    """No run satisfies the assumptions. None: not judged."""

    @staticmethod
    def of(known: Known) -> Answers:
        return Answers(known.holds, known.faults, known.contradictory)


def judge(result: Result, answers: Answers, demanded: frozenset[str] = frozenset()) -> None:
    """Raises Wrong for the first thing that a result says and is not true, or that is unknown and `demanded`.

    `demanded` are names of properties, and `faults`.
    """
    for wrong in (*_properties(result, answers, demanded), *_faults(result, answers, demanded)):
        raise Wrong(wrong)


def _properties(result: Result, answers: Answers, demanded: frozenset[str]) -> Iterator[str]:
    for found in result.properties:
        holds = answers.holds.get(found.name)
        match found.verdict:
            case Verdict.HOLDS if holds is False:
                yield f"`{found.name}` is said to hold and is violated: {found.text}"
            case Verdict.VIOLATED if holds is True:
                yield f"`{found.name}` is said to be violated and holds: {found.text}"
            case Verdict.HOLDS if answers.contradictory and OPEN.isdisjoint(found.notes):
                yield f"`{found.name}` is said to hold, without a note that no run satisfies the assumptions"
            case Verdict.HOLDS if answers.contradictory is False and NO_RUN in found.notes:
                yield f"of `{found.name}` it is said that no run satisfies the assumptions, and some do"
            case Verdict.UNKNOWN if found.name in demanded:
                yield f"`{found.name}` is unknown, which the engine claims to decide: {found.reason}"


def _faults(result: Result, answers: Answers, demanded: frozenset[str]) -> Iterator[str]:
    if answers.faults is None:
        return
    faults = result.faults
    codes = {finding.site.code for finding in faults.findings}
    if not codes <= answers.faults:
        yield f"faults are found that do not happen: {', '.join(sorted(codes - answers.faults))}"
    if faults.verdict is Verdict.HOLDS and answers.faults:
        yield f"no fault is said to happen, and there are: {', '.join(sorted(answers.faults))}"
    if "faults" in demanded and faults.verdict is Verdict.UNKNOWN:
        yield f"whether faults happen is unknown, which the engine claims to decide: {faults.reason}"
