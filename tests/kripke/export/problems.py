"""What the tests of the exports share: specifications of the models and of random arrangements."""

from __future__ import annotations

from pathlib import Path

from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement import build_arrangement, load_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.binding import bind
from llfsm_verify.checking.limits import Budget
from llfsm_verify.checking.verdict import Limits
from llfsm_verify.diagnostics import Source
from llfsm_verify.kripke.export.flat import Specification
from llfsm_verify.kripke.structure import Structure, structure
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.logic.reading import read_source
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.testing.arrangements import arrangements
from llfsm_verify.testing.properties import properties

MODELS = sorted(
    str(path) for path in Path("models").glob("*/*.yaml") if not path.name.endswith((".machine.yaml", ".trace.yaml"))
)
LARGEST = 300
"""Configurations: larger random arrangements are left out."""

CHECKS = [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large, HealthCheck.large_base_example]
FAST = settings(max_examples=4, deadline=None, suppress_health_check=CHECKS, phases=[Phase.generate])
SLOW = settings(FAST, max_examples=60)

Problem = tuple[Arrangement, PropertySet]


def model(path: str) -> Problem:
    """A model with its property file."""
    return load_arrangement(path), parse_properties([read_source(f"properties/{Path(path).parent.name}.ltl")])


def problem(document: dict[str, object], *lines: str) -> Problem:
    return build_arrangement(document), parse_properties([Source("test.ltl", "\n".join(lines))])


@st.composite
def problems(draw: st.DrawFn) -> Problem:
    """A random arrangement with properties and sometimes an assumption."""
    arrangement = build_arrangement(draw(arrangements(max_machines=2, max_states=3)))
    texts = draw(st.lists(properties(arrangement), min_size=1, max_size=2))
    lines = [f"p{i}: {text}" for i, text in enumerate(texts)]
    if draw(st.integers(0, 3)) == 3:
        lines.append(f"assume a: {draw(properties(arrangement, 2))}")
    return arrangement, parse_properties([Source("random.ltl", "\n".join(lines))])


def specification(arrangement: Arrangement, lines: PropertySet, *, keep_all_bits: bool = False) -> Specification:
    bound = bind(arrangement, lines)
    program = lower(arrangement, bound.atoms, keep_all_bits=keep_all_bits)
    goals = tuple((p.name, p.formula) for p in bound.properties if p.formula is not None)
    assumptions = tuple((p.name, p.formula) for p in bound.assumptions if p.formula is not None)
    return Specification(program, goals, assumptions)


def explored(arrangement: Arrangement, lines: PropertySet, *, keep_all_bits: bool = False) -> Structure | None:
    """The structure; None when it is too large for these tests, or leaves 64 bits."""
    budget = Budget(Limits(max_states=LARGEST))
    found = structure(arrangement, bind(arrangement, lines), keep_all_bits=keep_all_bits, allowance=budget)
    return found if found.complete else None


NOTHING = PropertySet(())
