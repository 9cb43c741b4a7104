"""Numbers that leave 64 bits: one rule for the executor, the interpreter of the tests, and the solvers."""

from __future__ import annotations

import pytest

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.native.code import OVERFLOW
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.backends.reference import Interpreter
from llfsm_verify.backends.smt.relation import MAX_BITS, NumberTooLarge, Terms
from llfsm_verify.backends.smt.unrolling import Unrolling
from llfsm_verify.checking.goals.kinds import CHECKED
from llfsm_verify.checking.verdict import Options, Result, Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.engines.unrolled.options import UnrolledOptions
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.verification.verify import verify

TEXT = """
name: squares
cycle_ms: 10
whiteboard:
  n: {{type: 0..9}}
  x: {{type: int, init: 3}}
machines:
  m:
    inline:
      machine: M
      states:
        - name: S
          internal: "{action}"
          transitions: [{{when: "false", to: S}}]
schedule: [m]
"""
LEFT = "a value of type int left the 64 bits in which the executor holds it"
TOO_LARGE = f"a value of type int may have more than {MAX_BITS:,} bits, and no solver is asked about it"


def squared(times: int) -> Arrangement:
    """3 squared so often in one ringlet, and compared with 5: the comparison is true in any number of bits."""
    return load_arrangement_text(TEXT.format(action=f"int y = 3; {'y = y * y; ' * times} n = y > 5 ? 1 : 0;"))


GROWING = load_arrangement_text(TEXT.format(action="x = x * x; n = x > 5 ? 1 : 0;"))


def checked(arrangement: Arrangement, engine: str, line: str, depth: int | None = 4) -> Result:
    properties = parse_properties([Source("p.ltl", line)], features=CHECKED)
    return verify(arrangement, properties, Options(own=(UnrolledOptions(depth=depth),)), engine=engine)


@pytest.mark.parametrize(("times", "leaves"), [(5, False), (6, True), (8, True), (24, True), (200, True)])
def test_executor_and_interpreter_leave_64_bits_at_the_same_value(times: int, leaves: bool) -> None:
    program = lower(squared(times), ())
    layout = Layout.of(program)
    native = NativeProgram(program)
    (record,) = layout.initial()
    outcome = Interpreter(program).step(layout.decode(record), layout.decode_outputs(record), 0, lambda _: 0)
    assert outcome.overflow is leaves and outcome.fault is None
    assert native.step(record, 0, {}).status == (OVERFLOW if leaves else 0)


@pytest.mark.slow
@pytest.mark.parametrize("times", [5, 8])
def test_a_value_that_leaves_64_bits_is_unknown_to_the_executor_and_exact_to_solvers(times: int) -> None:
    arrangement = squared(times)
    (explicit,) = checked(arrangement, "explicit", "G n <= 1").properties
    if times == 5:
        assert explicit.verdict is Verdict.HOLDS
    else:
        place = "`y` at <text>:13, in step 1 of the run m@S"
        assert (explicit.verdict, explicit.reason) == (Verdict.UNKNOWN, f"{LEFT}: {place}")
    assert checked(arrangement, "bmc", "G n <= 1").properties[0].verdict is Verdict.UNKNOWN
    for prover in ("pdr", "induction"):
        assert checked(arrangement, prover, "G n <= 1", None).properties[0].verdict is Verdict.HOLDS


@pytest.mark.parametrize("times", [24, 200])
@pytest.mark.parametrize("engine", ["bmc", "pdr", "induction"])
def test_solvers_are_not_asked_about_numbers_that_they_could_not_write_down(times: int, engine: str) -> None:
    result = checked(squared(times), engine, "G n <= 1")
    for found in (*result.properties, result.faults):
        assert (found.verdict, found.reason) == (Verdict.UNKNOWN, TOO_LARGE)


@pytest.mark.slow
def test_a_number_that_grows_from_step_to_step_ends_the_look_at_longer_runs_only() -> None:
    """After 12 squarings of 3 there are 2 * 2**12 bits, and one more is too many."""
    run = Unrolling(Terms(lower(GROWING, ())))
    for _ in range(12):
        run.extend()
    with pytest.raises(NumberTooLarge):
        run.extend()
    assert len(run) == 12
    assert checked(GROWING, "bmc", "G n <= 1", 20).properties[0].reason == TOO_LARGE
    assert checked(GROWING, "induction", "G n <= 1", None).properties[0].verdict is Verdict.HOLDS


@pytest.mark.slow
def test_a_violation_in_numbers_beyond_64_bits_is_not_shown() -> None:
    """No engine shows a run that the executor cannot perform, and none says that there is no such run."""
    for engine in ("explicit", "bmc", "pdr", "induction"):
        (found,) = checked(squared(6), engine, "G n == 0").properties
        assert found.verdict is Verdict.UNKNOWN and found.trace is None


RECKLESS = load_arrangement_text(
    """
timing: untimed
whiteboard: {n: {type: int, init: 2}, k: {type: 1..40, role: input}, s: {type: 0..9}}
machines:
  m:
    inline:
      machine: M
      variables: {big: {type: int, init: 1}}
      states:
        - {name: A, transitions: [{when: k > 30, to: B}]}
        - name: B
          on_entry: |
            big = big * 4000000000;
            s = 1;
            n = big * big;
          transitions: [{when: n > 5, to: C}]
        - {name: C, on_entry: s = n;}
schedule: [m]
""".replace("big << k", "big * 3000000000")
)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["explicit", "pdr", "bmc", "induction"])
def test_what_leaves_64_bits_is_said_with_its_line_its_variable_and_the_run(engine: str) -> None:
    reason = checked(RECKLESS, engine, "G s <= 1").faults.reason or ""
    assert "`n` at <text>:15 (`n = big * big`), in step 2 of the run m@A (k = " in reason
    assert reason.partition("k = ")[2].endswith("), m@B")
