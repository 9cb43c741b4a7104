"""Check an arrangement against its properties with one of the engines."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.verdict import Engine, Options, Result
from llfsm_verify.engines.explicit.engine import ExplicitEngine
from llfsm_verify.logic.properties import PropertySet


def _bounded() -> Engine:
    from llfsm_verify.engines.bounded.engine import BoundedEngine

    return BoundedEngine()


def _induction() -> Engine:
    from llfsm_verify.engines.inductive.engine import induction

    return induction()


def _pdr() -> Engine:
    from llfsm_verify.engines.inductive.engine import pdr

    return pdr()


def _auto() -> Engine:
    from llfsm_verify.verification.portfolio import AutoEngine

    return AutoEngine(ENGINES)


def _together() -> Engine:
    from llfsm_verify.verification.differential import AllEngines

    return AllEngines()


ENGINES: Mapping[str, Callable[[], Engine]] = {
    "auto": _auto,
    "explicit": ExplicitEngine,
    "bmc": _bounded,
    "induction": _induction,
    "pdr": _pdr,
    "all": _together,
}
"""What makes an engine, by the name that ``--engine`` knows it by."""


def verify(
    arrangement: Arrangement, properties: PropertySet, options: Options | None = None, engine: str = "explicit"
) -> Result:
    """Verdicts for the faults of `arrangement` and for every property.

    Raises DiagnosticError when a property does not fit the arrangement, ValueError for an unknown engine (naming those
    there are), and Disagreement when a check of a result fails.
    """
    if engine not in ENGINES:
        raise ValueError(f"there is no engine `{engine}`; there are: {', '.join(ENGINES)}")
    return ENGINES[engine]().check(arrangement, bind(arrangement, properties), options or Options())
