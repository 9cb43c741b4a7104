"""Reasons in words and marks in the traces of whole checks."""

from __future__ import annotations

from pathlib import Path

import pytest

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.checking.trace import Trace, letter_steps
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.verification.verify import verify

LIGHTS = Path("models/traffic_lights")


def trace_of(line: str, model: str = "arrangement.yaml", assume: str = "") -> Trace:
    """The trace of one property of the traffic lights."""
    properties = parse_properties([Source(str(LIGHTS / "test.ltl"), f"{assume}\nx{line}" if assume else f"x{line}")])
    found = next(
        p.trace for p in verify(load_arrangement(str(LIGHTS / model)), properties, engine="explicit").properties
    )
    assert found is not None
    return found


def marks(trace: Trace) -> set[tuple[int, str]]:
    first = {(0, cause.atom) for cause in trace.initial_causes}
    return first | {(i, cause.atom) for i, step in enumerate(trace.steps, 1) for cause in step.causes}


CAR = "car && timer.ran"


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (": G !(ns@GREEN && ns_turn)", "`ns@GREEN` is true at step 2 while `ns_turn` is true"),
        (": G (ns@GREEN -> X ns@AMBER)", "`ns@GREEN` is true at step 2, and `ns@AMBER` is false at step 3"),
        (": G (car -> F ew@GREEN)", "`car` is true at step 5, and `ew@GREEN` is never true from step 5 on"),
        (": F ew@GREEN", "`ew@GREEN` is never true at any step"),
        (
            f": G ({CAR} -> F[<=3s] ew@GREEN)",
            f"`{CAR}` is true at step 1, and `ew@GREEN` is not true within 3 s of step 1",
        ),
        (": ns@RED W ew@GREEN", "`ns@RED` is false at step 2, before `ew@GREEN` has been true"),
        (": ew@GREEN R ns@RED", "`ns@RED` is false at step 2, and `ew@GREEN` has not been true before"),
        (": ns@RED -> X[2] ns@RED", "`ns@RED` is true in the initial configuration, and `ns@RED` is false at step 2"),
        (": X (F[0:2] ns@AMBER)", "`ns@AMBER` is not true from step 1 to step 3"),
        (
            ": G (ns@GREEN -> O ew@GREEN)",
            "`ns@GREEN` is true at step 2, and `ew@GREEN` has not been true up to step 2",
        ),
        (": G (ns@AMBER -> H !ns@GREEN)", "`ns@AMBER` is true at step 35, and `ns@GREEN` is true at step 34"),
        (": !ns@GREEN U ew@GREEN", "`ns@GREEN` is true at step 2, before `ew@GREEN` has been true"),
        (": ! G F ns@GREEN", "`ns@GREEN` is true at step 6, and again in every turn of the loop"),
        (
            ": F G car <-> G F ns@GREEN",
            "`G F ns@GREEN` holds in the initial configuration, and `F G car` does not",
        ),
        (": F G car xor G F ns@GREEN", "both `F G car` and `G F ns@GREEN` hold in the initial configuration"),
        (": F[0:2] ns@AMBER", "`ns@AMBER` is not true from the initial configuration to step 2"),
        (": F[<=100ms] ew@GREEN", "`ew@GREEN` is not true within 100 ms of the initial configuration"),
        (": F[100ms:2s] ew@GREEN", "`ew@GREEN` is not true from 100 ms to 2 s after the initial configuration"),
        (": !ew@GREEN U ew@GREEN", "`ew@GREEN` is never true at any step"),
        (": ew@GREEN M !ew@AMBER", "`ew@GREEN` is never true at any step"),
        (
            ": G !(ns_turn && ns@GREEN && ew@RED && !ew_turn)",
            "`ns@GREEN` is true at step 2 while `ew@RED` and `ns_turn` are true and `ew_turn` is false",
        ),
        (": G (ns@GREEN -> ns_turn && ew_turn && ew@RED)", "`ns@GREEN` is true at step 2 while `ew_turn` is false"),
        (
            ": G (ns@GREEN -> X X X (ew_turn | X ew_turn))",
            "`ns@GREEN` is true at step 2, and `ew_turn` is not true from step 5 to step 6",
        ),
        (
            ": G (ns@GREEN -> (ns@GREEN && ns_turn) U (ew_turn && X ew_turn))",
            "`ns@GREEN` is true at step 2, and `ew_turn && X ew_turn` is never true from step 2 on",
        ),
        (
            ": (G ns@RED) | (G ew@GREEN)",
            "`ns@RED` is false at step 2, and `ew@GREEN` is false in the initial configuration",
        ),
        (": G (ns@AMBER -> Y ns@RED)", "`ns@AMBER` is true at step 35, and `Y ns@RED` is false at step 35"),
        (": ! (ns@RED U ns@GREEN)", "`ns@GREEN` is true at step 2, and `ns@RED` has not been false before"),
        (": !(F[<=3s] ns@GREEN)", "`ns@GREEN` is true at step 2"),
        (": G (ns@GREEN -> G[0:3] ns@GREEN)", "`ns@GREEN` is true at step 32, and `ns@GREEN` is false at step 35"),
        (": !F G !ns@GREEN && F G car", "`car` is false at step 6, and again in every turn of the loop"),
    ],
)
def test_formulas_fail_for_a_reason_in_words(line: str, reason: str) -> None:
    assert trace_of(line).because == reason


@pytest.mark.slow
def test_regular_properties_say_what_could_have_followed() -> None:
    lines = "enforce x: (ns@RED ns@GREEN ns@AMBER)*", "forbid x: ns@GREEN ns@RED"
    for line, reason, last in zip(
        lines,
        (
            "the run shows `ns@RED` at step 35, and after `ns@GREEN` only `ns@AMBER` may follow",
            "the run shows `ns@GREEN`, then `ns@RED` at step 35, which is forbidden",
        ),
        ({(35, "ns@AMBER"), (35, "ns@GREEN"), (35, "ns@RED")}, {(35, "ns@GREEN"), (35, "ns@RED")}),
        strict=True,
    ):
        found = verify(
            load_arrangement(str(LIGHTS / "abrupt.yaml")), parse_properties([Source("x", line)]), engine="explicit"
        )
        trace = found.properties[0].trace
        assert trace is not None
        assert trace.because == reason
        assert marks(trace) <= last and marks(trace)


@pytest.mark.parametrize(
    ("rule", "reason"),
    [
        ("([car] [car])*", "after what it shows in the initial configuration nothing that could follow satisfies the"),
        ("([!car] [car] [!car])* [!car]", "the run shows `car` at step 1, and nothing may follow after `!car`"),
        ("([!car])*", "the run shows none of its letters at step 1, and after `!car` only `!car` may follow"),
    ],
)
def test_only_what_could_have_followed_is_said(rule: str, reason: str) -> None:
    """No word has equal neighbours, so that nothing goes on with some of what a match may begin with."""
    lines = parse_properties([Source("x", f"enforce x: {rule}")])
    trace = verify(load_arrangement(str(LIGHTS / "arrangement.yaml")), lines, engine="explicit").properties[0].trace
    assert trace is not None and trace.because is not None
    assert trace.because.startswith(reason)


def test_marks_name_the_variables_with_their_values_there() -> None:
    trace = trace_of(": G !(ns_light == GREEN && timer@CAR_WAITING && car)")
    (cause, *others) = trace.steps[-1].causes
    found = {c.atom: (c.value, dict(c.variables)) for c in (cause, *others)}
    assert found == {
        "car": (True, {"car": "true"}),
        "ns_light == GREEN": (True, {"ns_light": "GREEN"}),
        "timer@CAR_WAITING": (True, {"timer": "CAR_WAITING"}),
    }
    assert all(not step.causes for step in trace.steps[:-1])


def test_the_first_failure_is_explained_not_what_shows_that_assumptions_can_hold() -> None:
    trace = trace_of(": G !ns@GREEN", assume=f"assume fair: G F ({CAR})")
    assert trace.loop is not None
    assert trace.because == "`ns@GREEN` is true at step 2"
    assert marks(trace) == {(2, "ns@GREEN")}


def test_a_bad_prefix_that_no_operand_shows_is_explained_by_the_monitor() -> None:
    # Once the first light is green nothing can be right any more, and neither operand of && is false by itself.
    trace = trace_of(": G (ns@GREEN -> (X car && X !car))")
    assert letter_steps(trace)[-1] == 2
    assert trace.because == "after what it shows at step 2 nothing that could follow satisfies the property"
    assert marks(trace) == {(2, "ns@GREEN")}
