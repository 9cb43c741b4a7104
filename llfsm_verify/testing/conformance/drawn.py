"""Random problems with the reference's answers, and random step programs, drawn by Hypothesis from a seed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import count
from typing import TypeVar

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.program.program import Program
from llfsm_verify.testing.arrangements import Document, arrangements
from llfsm_verify.testing.conformance.outcome import Answers
from llfsm_verify.testing.conformance.reference import TooLarge, answers_to
from llfsm_verify.testing.programs import programs
from llfsm_verify.testing.properties import properties, regular_properties

T = TypeVar("T")

CONFIGURATIONS, STEPS = 120, 1_200
BATCH = 5
"""Drawn from one seed, since Hypothesis stays near where it began; some are too large for the reference, or void."""


@dataclass(frozen=True, slots=True)
class Drawn:
    """A random problem."""

    document: Document
    lines: str
    answers: Answers

    def problem(self) -> Problem:
        """A new one, with nothing lowered."""
        return _bound(self.document, self.lines)


def _bound(document: Document, lines: str) -> Problem:
    return bind(build_arrangement(document), parse_properties([Source("random.ltl", lines)]))


@cache
def problems(number: int, start: int) -> tuple[Drawn, ...]:
    """So many problems; the same for the same seed and release of Hypothesis."""
    found: list[Drawn] = []
    batches = (batch for i in count() for batch in _drawn(_texts(), BATCH, start + 1_000 * i))
    for document, lines in batches:
        drawn = _answered(document, lines)
        if drawn is not None:
            found.append(drawn)
        if len(found) == number:
            break
    return tuple(found)


@st.composite
def _texts(draw: st.DrawFn) -> tuple[Document, str]:
    """An arrangement with two formulas, two under an assumption, or two rules."""
    document = draw(arrangements(max_machines=2, max_states=3))
    arrangement = build_arrangement(document)
    if draw(st.integers(0, 2)) == 0:
        rules = [draw(regular_properties(arrangement)) for _ in range(2)]
        return document, "\n".join(f"{kind} p{i}: {text}" for i, (kind, text) in enumerate(rules))
    lines = [f"p{i}: {draw(properties(arrangement))}" for i in range(2)]
    if draw(st.booleans()):
        lines.append(f"assume a: {draw(properties(arrangement, max_leaves=2))}")
    return document, "\n".join(lines)


def _drawn(strategy: st.SearchStrategy[T], number: int, start: int) -> list[T]:
    found: list[T] = []

    @seed(start)
    @settings(
        max_examples=number, database=None, deadline=None, derandomize=False,
        phases=[Phase.generate], suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    @given(strategy)
    def keep(value: T) -> None:
        found.append(value)

    keep()
    return found


@cache
def step_programs(number: int, start: int) -> tuple[Program, ...]:
    """So many step programs; the same for the same seed and release of Hypothesis."""
    found: list[Program] = []
    for i in count():
        found += _drawn(programs(), BATCH, start + 1_000 * i)
        if len(found) >= number:
            break
    return tuple(found[:number])


def _answered(document: Document, lines: str) -> Drawn | None:
    try:
        problem = _bound(document, lines)
        goals_of(problem)
        answers = answers_to(problem, CONFIGURATIONS, STEPS)
    except (DiagnosticError, TooLarge, OverflowError):  # a rule that nothing can break, or too much
        return None
    return Drawn(document, lines, answers) if answers.holds else None
