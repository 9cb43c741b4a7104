"""Lint by classes of wide inputs: what it finds is what it finds value by value."""

from __future__ import annotations

from collections import Counter
from functools import partial
from unittest.mock import patch

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from llfsm_verify.analysis.lint import run as linting
from llfsm_verify.analysis.lint.finding import LintResult
from llfsm_verify.analysis.lint.reach import Reach, worthwhile_cone
from llfsm_verify.analysis.lint.run import lint
from llfsm_verify.arrangement import build_arrangement, load_arrangement_text
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.kripke.labels import sizes
from llfsm_verify.limits import Limits
from llfsm_verify.testing.arrangements import arrangements
from llfsm_verify.transforms.probing import probed
from tests.kripke.labels.sensors import sensors
from tests.quick import FRESH, many

CHECKS = [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large, HealthCheck.large_base_example]
ANY = arrangements(max_machines=2, max_states=3).map(build_arrangement)
SENSORS = sensors().map(lambda problem: problem[0])


def shape(result: LintResult) -> list[tuple[object, ...]]:
    """What findings have in common with those that other members of the classes show: with runs as long."""
    found: list[tuple[object, ...]] = []
    for f in result.findings:
        trace = None if f.witness is None else f.witness.trace
        length = None if trace is None else len(trace.steps)
        found.append((f.code, f.level, f.message, f.span, f.machines, f.proof, f.notes, f.suppressed, length))
    return found


def agreed(count: int, strategy: st.SearchStrategy[Arrangement]) -> Counter[str]:
    tally: Counter[str] = Counter()

    @settings(max_examples=count, deadline=None, suppress_health_check=CHECKS, phases=[Phase.generate, Phase.shrink])
    @given(strategy)
    def checked(arrangement: Arrangement) -> None:
        limits = Limits(max_states=400)
        by_class = lint(arrangement, limits)
        with (
            patch.object(linting, "Reach", partial(Reach, classes=False)),
            patch("llfsm_verify.analysis.lint.reach.worthwhile_cone", lambda _: None),
        ):
            by_value = lint(arrangement, limits)
        assert not by_value.inputs
        tally["split"] += any(n.classes is not None for n in by_class.inputs)
        tally["left out"] += bool(by_class.left_out)
        if not by_value.complete or not by_class.complete:
            tally["too large"] += 1
            return
        assert shape(by_class) == shape(by_value)
        assert by_class.open == by_value.open
        assert by_class.left_out or by_class.configurations == by_value.configurations
        tally["runs"] += any(f.witness is not None and f.witness.trace is not None for f in by_class.findings)
        tally["compared"] += 1

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(sizes, "WIDE", 2)
        patched.setattr("llfsm_verify.analysis.lint.reach.WIDE", 2)
        checked()
    return tally


@pytest.mark.long
def test_same_findings_of_many() -> None:
    tally = agreed(many(60), SENSORS)
    assert tally["compared"] > 0, tally
    assert not FRESH or min(tally["split"], tally["runs"]) > 0, tally


@pytest.mark.long
def test_same_findings_of_all_kinds() -> None:
    tally = agreed(many(200), ANY)
    assert tally["compared"] > 3, tally


ROVER = """
name: rover
whiteboard:
  left: {type: uint16, role: input}
  right: {type: uint16, role: input}
  last: {type: uint16}
machines:
  m:
    inline:
      machine: M
      states:
        - name: LOOK
          transitions:
            - {when: left > right, to: TURN}
        - name: TURN
          on_entry: last = left;
          transitions:
            - {when: left <= right && left > 400, to: LOOK}
            - {when: left + right > 50000 && left < 10 && right < 10, to: TURN}
schedule: [m]
"""

END = "schedule: [m]\n"


@pytest.mark.slow
def test_two_sensors_of_16_bits() -> None:
    """Value by value that is 2^32 steps from one configuration; what is stored for nobody is not explored."""
    result = lint(load_arrangement_text(ROVER))
    assert result.complete and not result.open
    assert [(f.code, f.proof) for f in result.shown] == [("L010", "text"), ("L001", "local")]
    assert result.left_out == ("last",)
    assert {n.inputs for n in result.inputs} == {("left", "right")}
    assert all(n.classes is not None and n.classes < 20 for n in result.inputs)


def test_what_is_asked_of_starving_machines_is_explored() -> None:
    """A machine in a state without transitions ends the arrangement, and is not stuck."""
    arrangement = load_arrangement_text(
        ROVER[: ROVER.index("          transitions:\n            - {when: left <=")] + END
    )
    reduced = worthwhile_cone(probed(arrangement, wide=False))
    assert reduced is not None
    assert {"m.$state", "m.$finished", "main.$ended"} <= {v.name for v in reduced.program.vars}
    assert [f.code for f in lint(arrangement).shown] == ["L010"]


@pytest.mark.slow
def test_values_that_are_stored_and_read_are_not_tried_for_ever() -> None:
    """Unless a time is given: then until that has passed."""
    text = ROVER.replace("left > right,", "left > right && last < 300,")
    with patch("llfsm_verify.analysis.lint.reach.MOST_STEPS", 5_000):
        result = lint(load_arrangement_text(text))
        assert not result.complete and "the limit of 5,000 steps" in (result.reason or "")
        assert ("left", "it is stored in `last`") in {(n.inputs[0], n.reason) for n in result.inputs}
        patient = lint(load_arrangement_text(text), Limits(max_states=100, timeout=1e6))
        assert "100 configurations" in (patient.reason or "")


def test_a_time_limit_that_ends_the_split() -> None:
    """The exploration is not begun value by value then."""
    result = lint(load_arrangement_text(ROVER), Limits(timeout=1e-6))
    assert not result.complete and "time limit" in (result.reason or "")
    assert "L012" in {q.code for q in result.open}
