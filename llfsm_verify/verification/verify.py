"""Check an arrangement against its properties with one of the engines."""

from __future__ import annotations

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.verdict import Options, Result
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.verification.engines import DEFAULT_ENGINE, ENGINES


def verify(
    arrangement: Arrangement, properties: PropertySet, options: Options | None = None, engine: str = DEFAULT_ENGINE
) -> Result:
    """Verdicts for the faults of `arrangement` and for every property.

    Raises DiagnosticError when a property does not fit the arrangement, ValueError for an unknown engine (naming those
    there are), and Disagreement when a check of a result fails.
    """
    return ENGINES.load(engine)().check(bind(arrangement, properties), options or Options())
