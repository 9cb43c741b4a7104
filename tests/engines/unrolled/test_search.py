"""What is asked of a property, and what is said where only a part of it could be."""

from __future__ import annotations

from typing import cast

from llfsm_verify.checking.engine import Unknown, Violated
from llfsm_verify.checking.goals.goal import Goal
from llfsm_verify.engines.unrolled.encoding import Encoding
from llfsm_verify.engines.unrolled.question import Question
from llfsm_verify.engines.unrolled.runs import Watched
from llfsm_verify.engines.unrolled.search import BoundedSearch, Task
from llfsm_verify.logic.formula import TRUE


def task(*, watched: bool = False, wrong: bool = False, limit: str | None = None) -> Task:
    made = Task(cast(Goal, None), Question(finite=True), cast(Watched, object()) if watched else None)
    made.wrong = Encoding(TRUE, "x") if wrong else None
    made.limit = limit
    return made


def said(given: Task | None, why: str | None) -> str:
    found = BoundedSearch.answer(cast(BoundedSearch, None), given, why)
    assert isinstance(found, Unknown)
    return found.reason


def test_either_kind_of_violation_makes_it_asked() -> None:
    asked = [task(watched=a, wrong=b).is_asked for a in (False, True) for b in (False, True)]
    assert asked == [False, True, True, True]


def test_a_part_that_is_too_large_is_said_beside_what_was_asked() -> None:
    limit = "it has more than 4 letters"
    assert said(task(wrong=True, limit=limit), "no run violates it") == f"{limit}; and no run violates it"
    assert said(task(watched=True, limit=limit), "no run violates it") == f"{limit}; and no run violates it"
    assert said(task(limit=limit), "no run violates it") == limit
    assert said(task(wrong=True), "no run violates it") == "no run violates it"
    assert said(task(), None) == said(None, None) == "it was not looked at"


def test_what_was_found_is_the_answer() -> None:
    given, run = task(limit="it is too large"), cast(Violated, object())
    given.found = run
    assert BoundedSearch.answer(cast(BoundedSearch, None), given, "why") is run


def test_what_a_property_reads_is_its_context_and_its_negation() -> None:
    given = task(wrong=True)
    context = Encoding(TRUE, "y")
    given.context.append(context)
    assert given.readings == [context, given.wrong]
    given.wrong = None
    assert given.readings == [context]
