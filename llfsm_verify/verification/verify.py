"""Check an arrangement against its properties with one of the engines."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import cast

from llfsm_verify.arrangement.ending import ending_notes
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.engine import Start
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.checking.verdict import Options, Result
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.verification import harness
from llfsm_verify.verification.engines import DEFAULT_ENGINE, ENGINES

Check = Callable[[Problem, Options], Result]


def checker(name: str) -> Check:
    """The engine of a name, in the harness. Unregistered: there is none."""
    entry, found = ENGINES.entry(name), ENGINES.load(name)
    return cast(Check, found) if entry.asks_others else partial(harness.check, name, cast(Start, found))


def verify(
    arrangement: Arrangement, properties: PropertySet, options: Options | None = None, engine: str = DEFAULT_ENGINE
) -> Result:
    """Verdicts for the faults of `arrangement` and for every property.

    Raises DiagnosticError when a property does not fit the arrangement, ValueError for an unknown engine (naming those
    there are), and Disagreement when a check of a result fails.
    """
    result = checker(engine)(bind(arrangement, properties), options or Options())
    return replace(result, notes=ending_notes(arrangement))
