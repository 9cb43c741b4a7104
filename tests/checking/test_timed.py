"""Bounds in time, steps and the past through the whole engine: by hand, against watching machines, at random."""

from __future__ import annotations

import re
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import HealthCheck, assume, event, given, settings
from hypothesis import strategies as st

from benchmarks.ring import ring
from llfsm_verify.arrangement.loader import build_arrangement, load_arrangement_text
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.goals.kinds import CHECKED
from llfsm_verify.checking.replay.confirm import Schedule
from llfsm_verify.checking.verdict import Options, Result, Verdict
from llfsm_verify.diagnostics import DiagnosticError, Disagreement, Source
from llfsm_verify.engines.explicit.options import Checkpointing, ExplicitOptions
from llfsm_verify.engines.unrolled.options import UnrolledOptions
from llfsm_verify.limits import Limits
from llfsm_verify.logic.bounds import Clock
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.program.moves import Move
from llfsm_verify.testing.arrangements import arrangements
from llfsm_verify.testing.properties import atoms
from llfsm_verify.verification.replay import replay
from llfsm_verify.verification.verify import verify
from tests.quick import examples, many


def lines(text: str) -> PropertySet:
    return parse_properties([Source("test.ltl", text)], features=CHECKED)


def checked(arrangement: str | Arrangement, properties: str, options: Options | None = None) -> Result:
    if isinstance(arrangement, str):
        arrangement = load_arrangement_text(arrangement, "test.yaml")
    return verify(arrangement, lines(properties), options, engine="explicit")


def verdicts(arrangement: str | Arrangement, properties: str, options: Options | None = None) -> dict[str, str]:
    return {p.name: p.verdict.value for p in checked(arrangement, properties, options).properties}


COUNTING = """
name: counting
cycle_ms: 100
whiteboard: {n: {type: 0..9, init: 0}}
machines:
  idle: {inline: {machine: I, states: [{name: A, transitions: [{when: n > 9, to: A}]}]}}
  m:
    inline:
      machine: M
      states:
        - name: A
          internal: "n = n == 9 ? 0 : n + 1;"
          transitions: [{when: n > 9, to: A}]
schedule: [idle, m]
"""
"""`n` counts cycles: c0 and the letters of the first cycle but its last have n = 0 and time 0, c2 has n = 1 and time 0,
c3 still n = 1 and 100 ms, c4 n = 2 and 100 ms."""


@pytest.mark.parametrize(
    ("formula", "holds"),
    [
        ("F[<=0ms] n == 1", True),
        ("F[<=99ms] n == 2", False),
        ("F[<=100ms] n == 2", True),
        ("F[<=199.5ms] n == 3", False),
        ("F[<=0.2s] n == 3", True),
        ("G[<=99ms] n <= 1", True),
        ("G[<=100ms] n <= 1", False),
        ("n < 5 U[<=399ms] n == 5", False),
        ("n < 5 U[<=400ms] n == 5", True),
        ("n < 4 U[<=400ms] n == 5", False),
        ("G (n == 9 -> F[<=0ms] n == 0)", False),
        ("G (n == 9 -> F[<=100ms] n == 0)", True),
        ("G (n == 0 -> G[<=800ms] n != 9)", False),
        ("G (n == 0 && m.ran -> G[<=800ms] n != 9)", True),
        ("G (n == 0 && m.ran -> G[<=900ms] n != 9)", False),
        ("F G[<=1s] n != 0", False),
        ("G F[<=1s] (n == 0 && F[<=400ms] n == 5)", True),
        ("G F[<=1s] (n == 0 && F[<=399ms] n == 5)", False),
        ("F[100ms:199ms] n == 2", True),
        ("F[101ms:200ms] n == 2", True),
        ("F[100ms:100ms] n == 1", True),
        ("F[200ms:300ms] n == 2", True),
        ("F[200ms:300ms] n == 1", False),
        ("F[300ms:400ms] n == 2", False),
        ("F[>=1s] n == 0", True),
        ("F[>=100ms] !(n == 0 || F n == 0)", False),
        ("G[100ms:200ms] n >= 1", True),
        ("G[100ms:200ms] n >= 2", False),
        ("G[>=100ms] n >= 1", False),
        ("G[100ms:299ms] n <= 3", True),
        ("G (n == 0 && m.ran -> F[900ms:1s] n == 9)", True),
        ("G (n == 0 && m.ran -> F[1s:2s] n == 9)", True),
        ("G (n == 0 && m.ran -> F[1100ms:1800ms] n == 9)", False),
        ("n < 3 U[200ms:300ms] n == 3", True),
        ("n < 3 U[300ms:400ms] n == 3", False),
        ("n < 3 U[400ms:500ms] n == 3", False),
        ("n < 2 U[200ms:300ms] n == 3", False),
        ("n < 5 U[>=300ms] n == 4", True),
        ("n == 3 R[100ms:1s] n != 9", True),
        ("n == 3 R[200ms:1s] n != 2", False),
        ("n == 3 R[200ms:1s] n <= 3", True),
        ("!(n == 9 R[<=1s] n <= 8)", True),
    ],
)
def test_the_time_of_a_letter_is_that_of_its_step(formula: str, holds: bool) -> None:
    assert verdicts(COUNTING, f"p: {formula}") == {"p": "holds" if holds else "violated"}


@pytest.mark.parametrize(
    ("formula", "holds"),
    [
        ("F[<=0ms] n == 1", True),
        ("F[<=99ms] n == 2", False),
        ("F[<=100ms] n == 2", True),
        ("G[<=100ms] n <= 1", False),
        ("F[100ms:100ms] n == 1", False),
        ("F[100ms:200ms] n == 3", True),
        ("G[100ms:200ms] n > 1", True),
    ],
)
def test_with_one_letter_a_cycle(formula: str, holds: bool) -> None:
    text = COUNTING.replace("cycle_ms", "observe: cycle\ncycle_ms")
    assert verdicts(text, f"p: {formula}") == {"p": "holds" if holds else "violated"}


SERVED = """
name: served
cycle_ms: 100
whiteboard: {ask: {type: bool, role: input}}
machines:
  m:
    inline:
      machine: M
      states:
        - {name: IDLE, transitions: [{when: ask, to: WAIT}]}
        - {name: WAIT, transitions: [{when: after_ms(400), to: DONE}]}
        - {name: DONE, transitions: [{when: "true", to: IDLE}]}
schedule: [m]
"""


def test_a_deadline_is_a_safety_property_with_the_shortest_trace() -> None:
    result = checked(SERVED, "late: G (m@WAIT -> F[<=500ms] m@DONE)\nfine: G (m@WAIT -> F[<=600ms] m@DONE)")
    late, fine = result.properties
    assert (late.verdict, fine.verdict) == (Verdict.VIOLATED, Verdict.HOLDS)
    assert late.trace is not None
    # WAIT is reached at time 0, and at the end of the cycle that begins at 500 ms the time is over.
    assert late.trace.loop is None
    assert len(late.trace.steps) == 6
    assert all(not name.startswith("\0") for step in late.trace.steps for name, _ in step.atoms)


@pytest.mark.slow
def test_too_early_is_as_bad_as_too_late() -> None:
    text = (
        "early: G (m@WAIT && Y m@IDLE -> F[700ms:900ms] m@DONE)\nfine: G (m@WAIT && Y m@IDLE -> F[500ms:600ms] m@DONE)"
    )
    early, fine = checked(SERVED, text).properties
    assert (early.verdict, fine.verdict) == (Verdict.VIOLATED, Verdict.HOLDS)
    assert early.trace is not None
    # DONE at 600 ms does not help: at the end of the cycle that begins at 900 ms the time is over.
    assert early.trace.loop is None
    assert len(early.trace.steps) == 10


@pytest.mark.slow
@pytest.mark.parametrize(
    ("engine", "formula", "verdict"),
    [
        ("bmc", "G (m@WAIT && Y m@IDLE -> F[700ms:900ms] m@DONE)", Verdict.VIOLATED),
        ("bmc", "G (m@WAIT && Y m@IDLE -> G[>=300ms] m@WAIT)", Verdict.VIOLATED),
        ("bmc", "G (m@WAIT && Y m@IDLE -> F[500ms:600ms] m@DONE)", Verdict.UNKNOWN),
        ("induction", "G (m@DONE -> G[100ms:100ms] m@IDLE)", Verdict.HOLDS),
        ("pdr", "G (m@DONE -> G[100ms:100ms] m@IDLE)", Verdict.HOLDS),
    ],
)
def test_solvers_agree(engine: str, formula: str, verdict: Verdict) -> None:
    options = Options(own=(UnrolledOptions(depth=10),))
    (found,) = verify(load_arrangement_text(SERVED), lines(f"p: {formula}"), options, engine).properties
    assert found.verdict is verdict
    known = {"p": "violated" if verdict is Verdict.VIOLATED else "holds"}
    assert verdicts(SERVED, f"p: {formula}") == known


def test_assumptions_with_time() -> None:
    # As long as somebody asks now and then, WAIT comes again.
    found = verdicts(
        SERVED,
        "assume asked: G F[<=300ms] ask\nsoon: G F[<=500ms] m@WAIT\nsooner: G F[<=400ms] m@WAIT\nlive: G F m@DONE",
    )
    assert found == {"soon": "holds", "sooner": "violated", "live": "holds"}
    assert verdicts(SERVED, "live: G F m@DONE") == {"live": "violated"}


ENDING = """
name: ending
cycle_ms: 100
whiteboard: {late: {type: bool, role: input}}
machines:
  m: {inline: {machine: T, states: [{name: A, transitions: [{when: "true", to: B}]}, {name: B}]}}
schedule: [m]
"""


@pytest.mark.slow
def test_time_goes_on_after_the_end() -> None:
    """Each letter that repeats the last configuration is a cycle later than the one before."""
    found = verdicts(
        ENDING,
        "a: G[<=1s] !late\nb: F (m@B && G[<=1s] m@B)\nc: G F[<=1s] m@B\nd: G (late -> F[<=300ms] !late)\n"
        "e: F (m@B && H[500ms:1s] m@B)\nf: G (m@B -> O[<=1s] m@A)\n"
        "assume x: G (late -> X[2] !late)",
    )
    assert found == {"a": "violated", "b": "holds", "c": "holds", "d": "holds", "e": "holds", "f": "violated"}
    assert verdicts(ENDING, "d: G (late -> F[<=300ms] !late)") == {"d": "violated"}
    trace = checked(ENDING, "d: F[<=300ms] late").properties[0].trace
    assert trace is not None and trace.loop is None
    assert len(trace.steps) == 4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("formula", "holds"),
    [
        ("G (m@WAIT -> O ask)", True),
        ("G (m@DONE -> Y m@WAIT)", True),
        ("G (m@DONE -> Y Y m@IDLE)", False),
        ("G (m@WAIT -> (m@WAIT S ask))", True),
        ("G (m@DONE -> H !m@DONE)", False),
        ("G (m@DONE -> Z H !m@DONE)", False),
        ("G F Y m@IDLE", True),
        ("G (ask && Y m@IDLE && m.ran -> X[6] m@DONE)", True),
        ("G (m@DONE -> (O m@WAIT) && F[0:1] m@IDLE)", True),
        ("G (m@WAIT && Y m@IDLE -> F[0:6] m@DONE)", True),
        ("G (m@WAIT && Y m@IDLE -> F[0:5] m@DONE)", False),
        ("G (m@WAIT && Y m@IDLE -> G[0:3] m@WAIT)", True),
        ("G (m@DONE -> O (ask && F[<=600ms] m@DONE))", True),
        ("F O m@DONE", False),
        ("G (Y m@DONE -> m@IDLE T !m@WAIT)", True),
        ("G (m@DONE -> O[<=600ms] ask && O[0:6] ask)", True),
        ("G (m@DONE -> O[<=400ms] ask)", False),
        ("G (m@DONE -> O[0:4] ask)", False),
        ("G (m@DONE -> m@WAIT S[0:1] m@WAIT || H[1:4] m@WAIT)", True),
        ("G (m@WAIT && H[<=400ms] m@WAIT -> F[<=200ms] m@DONE)", True),
        ("G (m@DONE -> H[100ms:300ms] m@WAIT)", True),
        ("G (m@DONE -> H[<=300ms] m@WAIT)", False),
        ("G (m@WAIT -> (m@WAIT S[<=600ms] ask))", True),
    ],
)
def test_the_past_and_bounds_in_steps(formula: str, holds: bool) -> None:
    for options in (Options(), Options(own=(ExplicitOptions(cone="on", compression="on"),))):
        assert verdicts(SERVED, f"p: {formula}", options) == {"p": "holds" if holds else "violated"}


# ---------------------------------------------------------------- what has no time


def refused(text: str, properties: str) -> list[tuple[str, int, int, str, str]]:
    with pytest.raises(DiagnosticError) as raised:
        checked(text, properties)
    return [(d.code, d.span.line, d.span.column, d.message, d.hint or "") for d in raised.value.diagnostics if d.span]


def test_an_untimed_arrangement_has_no_time() -> None:
    text = SERVED.replace("cycle_ms: 100", "timing: untimed")
    (first, second) = refused(text, "a: G m@IDLE\nb: G (m@WAIT ->\n  F [<= 2s] (m@DONE && G[<=5ms] !ask))")
    assert first[:3] == ("E336", 3, 3) and second[:3] == ("E336", 3, 24)
    assert "`F [<= 2s]` asks for time, and this arrangement is untimed" in first[3]
    assert "F[0:5] p" in first[4] and "cycle_ms" in first[4]
    assert verdicts(text, "a: G (m@WAIT -> F[0:0] m@WAIT)") == {"a": "holds"}
    for asked, meant in (("G O[<=2s] m@A", "O[0:5] p"), ("m@A S[<=2s] m@A", "p S[0:5] q")):
        assert f"(`{meant}`)" in refused(text, f"a: {asked.replace('m@A', 'm@DONE')}")[0][4]
    assert "(`F[0:5] p`)" in refused(text, "a: m@DONE responds to m@WAIT within 300ms")[0][4]


def test_the_period_must_be_known() -> None:
    text = ENDING.replace("cycle_ms: 100", "timing: timed")
    ((code, _, _, message, hint),) = refused(text, "assume b: F[<=2s] m@B")
    assert code == "E336" and "how long a cycle takes" in message and "cycle_ms: …" in hint


def test_several_processes_have_no_common_time() -> None:
    text = COUNTING.replace("schedule: [idle, m]", "processes: {a: [idle], b: [m]}")
    ((code, _, column, message, hint),) = refused(text, "b: m@A U[<=2s] n == 3")
    assert (code, column) == ("E336", 8) and "each of the 2 processes" in message and "after" in hint
    ((code, _, column, message, _),) = refused(text, "b: G O[<=2s] m@A")
    assert (code, column) == ("E336", 6) and "`O[<=2s]` asks for one time" in message
    assert verdicts(text, "b: G (n == 3 -> H[0:0] m@A)") == {"b": "holds"}


def test_a_bound_of_too_many_cycles() -> None:
    ((code, _, column, message, _),) = refused(COUNTING, "b: F[<=104857700ms] n == 3 && F[<=104857699ms] n == 3")
    assert (code, column) == ("E337", 4)
    assert message == "104857700 ms are 1,048,577 cycles of 100 ms, more than 1,048,576"


def test_a_bound_in_which_no_cycle_begins() -> None:
    ((code, _, column, message, hint),) = refused(COUNTING, "b: F[110ms:190ms] n == 3 || F[110ms:200ms] n == 3")
    assert (code, column) == ("E339", 4)
    assert message == "no cycle begins in the time from 110 to 190 ms: there is one every 100 ms"
    assert hint == "write times between which a multiple of 100 ms lies"


@pytest.mark.parametrize(("cycle", "said"), [("2.5", "2.5 ms"), ("0.5", "0.5 ms"), ("10000000", "10000000 ms")])
def test_the_length_of_a_cycle_is_said_as_it_is_written(cycle: str, said: str) -> None:
    text = COUNTING.replace("cycle_ms: 100", f"cycle_ms: {cycle}")
    ((code, _, _, message, _),) = refused(text, "b: F[0.1ms:0.2ms] n == 3")
    assert code == "E339" and message.endswith(f"there is one every {said}")


def test_a_bound_from_below_of_too_many_cycles() -> None:
    ((code, *_),) = refused(COUNTING, "b: F[>=104857700ms] n == 3")
    assert code == "E337"


def test_more_delays_than_fit_are_unknown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("llfsm_verify.automata.ltl.counting.MAX_BITS", 1_000)
    (found,) = checked(COUNTING, "b: G (n == 3 -> F[10s:20s] n == 4)").properties
    assert found.verdict is Verdict.UNKNOWN
    assert "bits of times that it remembers" in str(found.reason)


# ---------------------------------------------------------------- against machines that watch

WATCHED = """
name: watched
cycle_ms: 100
{observe}
whiteboard:
  p: {{type: bool, init: false}}
  q: {{type: bool, init: false}}
  a: {{type: bool, role: input}}
  b: {{type: bool, role: input}}
machines:
  env:
    inline:
      machine: Env
      variables: {{k: {{type: 0..{slow}, init: 0}}}}
      states:
        - name: S
          internal: |
            p = a && k == 0;
            if (p) {{ k = {slow}; }}
            q = b || k == 1;
            if (k > 0) {{ k--; }}
          transitions: [{{when: k > {slow}, to: S}}]
  watch:
    inline:
      machine: Watch
      variables: {{n: {{type: 0..{top}, init: 0}}}}
      states:
        - name: S
          internal: |
            {step}
          transitions: [{{when: n > {top}, to: S}}]
schedule: [env, watch]
"""


def watched(k: int, slow: int, observe: str, kind: str) -> str:
    """`n` is `top` as soon as the watcher, at the end of a cycle, has seen the bound of `k` cycles violated.

    It sees what the letters at the end of cycles show, and `p` and `q` change in no other letter.
    """
    top = k + 2
    if kind == "G":  # n: the cycles in which `q` may not hold, this one included
        step = (
            f"if (p && n < {top}) {{ n = {k + 1}; }}"
            f" if (n > 0 && n < {top} && q) {{ n = {top}; }} else if (n > 0 && n < {top}) {{ n--; }}"
        )
    else:  # n: the cycles that have passed since the oldest `p` that waits, and one
        lost = f"n > {k} || !p" if kind == "U" else f"n > {k}"
        step = (
            f"if (n == 0 && p) {{ n = 1; }}"
            f" if (n > 0 && n < {top}) {{ if (q) {{ n = 0; }} else if ({lost}) {{ n = {top}; }} else {{ n++; }} }}"
        )
    return WATCHED.format(observe=observe, slow=slow, top=top, step=step)


FORMULAS = {"F": "G (p -> F[<={}ms] q)", "G": "G (p -> G[<={}ms] !q)", "U": "G (p -> (p U[<={}ms] q))"}
ENDS = {  # with a letter for each ringlet only those at the end of a cycle are looked at
    "F": "G (cycle && p -> F[<={}ms] (cycle && q))",
    "G": "G (cycle && p -> G[<={}ms] (cycle -> !q))",
    "U": "G (cycle && p -> ((cycle -> p) U[<={}ms] (cycle && q)))",
}


@pytest.mark.parametrize("kind", "FGU")
@pytest.mark.parametrize("k", [0, 1, 3])
@pytest.mark.parametrize("slow", [1, 3, 4])
def test_a_watching_machine_sees_the_same(kind: str, k: int, slow: int) -> None:
    milliseconds = 100 * k + 50
    top = k + 2
    for observe, formulas in (("observe: cycle", FORMULAS), ("", ENDS)):
        result = checked(
            watched(k, slow, observe, kind),
            f"timed: {formulas[kind].format(milliseconds)}\nwatched: G watch.n != {top}",
        )
        timed, seen = result.properties
        assert timed.verdict is seen.verdict
        if timed.trace is not None and seen.trace is not None and observe:
            assert timed.trace.loop is None
            assert len(timed.trace.steps) == len(seen.trace.steps)


# ---------------------------------------------------------------- at random

TICKING = "(cycle || {ended})"
LIMITS = Limits(max_states=1_500)


@st.composite
def timed_problems(draw: st.DrawFn) -> tuple[Arrangement, str, str]:
    """An arrangement of one process with time, a formula with bounds in time, and one that writes them out."""
    document = draw(arrangements(max_machines=2, max_states=3))
    assume("schedule" in document and document.get("timing") != "untimed")
    document.setdefault("cycle_ms", "20")
    arrangement = build_arrangement(document)
    ran = " || ".join(f"{m.name}.ran" for m in arrangement.machines)
    # After the end no machine has run; nor has one in c0, behind which no time passes.
    passes = f"(cycle || (!({ran}) && Y true))"
    p, q = draw(atoms(arrangement)), draw(atoms(arrangement))
    first, ticks = draw(st.sampled_from([0, 0, 1, 2])), draw(st.integers(0, 3))
    period = arrangement.cycle_ms
    assert period is not None
    bound = f"[<={float(period * ticks + period / 2):g}ms]"
    if first:
        least, most = (
            float(period * n + period * part) for n, part in ((first, Fraction(-1, 2)), (first + ticks, Fraction(1, 2)))
        )
        bound = f"[{least:g}ms:{most:g}ms]"
    within = f"((!{passes} && ({{0}})) U ({{1}}))"
    written = within
    for _ in range(ticks):
        written = f"((!{passes} && ({{0}})) U (({{1}}) || ({passes} && ({{0}}) && X {written})))"
    for _ in range(first):
        written = f"((!{passes} && ({{0}})) U ({passes} && ({{0}}) && X {written}))"
    kind = draw(st.sampled_from("FGUR"))
    negated = draw(st.booleans())
    outside = draw(st.sampled_from(["{}", "G ({0} || {1})", "F ({0} && {1})", "G F ({0})", "F G ({0})", "X ({0})"]))
    if kind == "F":
        short, long = f"(F{bound} ({q}))", written.format("true", q)
    elif kind == "G":
        short, long = f"(G{bound} ({q}))", f"!{written.format('true', f'!({q})')}"
    elif kind == "R":
        short, long = f"(({p}) R{bound} ({q}))", f"!{written.format(f'!({p})', f'!({q})')}"
    else:
        short, long = f"(({p}) U{bound} ({q}))", written.format(p, q)
    r = draw(atoms(arrangement))
    sign = "!" if negated else ""
    return arrangement, outside.format(f"{sign}{short}", f"({r})"), outside.format(f"{sign}({long})", f"({r})")


def agree_at_random(problem: tuple[Arrangement, str, str]) -> None:
    arrangement, short, long = problem
    result = checked(arrangement, f"short: {short}\nlong: {long}", Options(LIMITS))
    timed, written = result.properties
    if not result.complete:
        event("too large")
    event(f"{timed.verdict.value} {written.verdict.value}")
    assert timed.verdict is written.verdict or Verdict.UNKNOWN in (timed.verdict, written.verdict)
    if timed.verdict is Verdict.HOLDS:
        chained = checked(
            arrangement, f"short: {short}", Options(LIMITS, own=(ExplicitOptions(cone="on", compression="on"),))
        )
        assert chained.properties[0].verdict is Verdict.HOLDS
    elif timed.trace is not None and written.trace is not None:
        if not re.search(
            "rose|fell|changed", short
        ):  # an edge that comes twice in a row is a bad prefix when it is seen
            assert (timed.trace.loop is None) == (written.trace.loop is None)
            if timed.trace.loop is None:
                assert len(timed.trace.steps) == len(written.trace.steps)
        chained = checked(
            arrangement, f"short: {short}", Options(LIMITS, own=(ExplicitOptions(cone="on", compression="on"),))
        )
        assert chained.properties[0].trace == timed.trace


@pytest.mark.slow
@settings(
    max_examples=examples(40),
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much],
)
@given(timed_problems())
def test_bounds_in_time_mean_what_they_are_written_out_as(problem: tuple[Arrangement, str, str]) -> None:
    agree_at_random(problem)


@pytest.mark.long
@settings(
    max_examples=many(300),
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much],
)
@given(timed_problems())
def test_bounds_in_time_mean_what_they_are_written_out_as_at_length(problem: tuple[Arrangement, str, str]) -> None:
    agree_at_random(problem)


# ---------------------------------------------------------------- beside everything else


@pytest.mark.slow
def test_a_search_in_pieces(tmp_path: Path) -> None:
    properties = lines(
        "late: G (m0@ON && !m1@ON -> F[<=500ms] m1@ON)\nthen: G (m1@ON -> O m0@ON)\nsoon: G F[<=2s] (m0@ON || m0@OFF)"
    )
    arrangement = load_arrangement_text(ring(4, 3).replace("schedule:", "cycle_ms: 100\nschedule:"))
    whole = verify(arrangement, properties, Options(keep_all_bits=True), engine="explicit")
    assert [p.verdict.value for p in whole.properties] == ["violated", "violated", "holds"]
    most = 0
    while True:
        most += 1_500
        wanted = Checkpointing(tmp_path / "ring.checkpoint", 1e9, resume=True)
        result = verify(
            arrangement,
            properties,
            Options(Limits(max_states=most), True, own=(ExplicitOptions(checkpoint=wanted),)),
            engine="explicit",
        )
        if result.complete:
            break
    assert [(p.verdict, p.trace) for p in result.properties] == [(p.verdict, p.trace) for p in whole.properties]


@pytest.mark.slow
def test_traces_are_replayed() -> None:
    arrangement = load_arrangement_text(SERVED, "test.yaml")
    for text in (
        "G (m@WAIT -> F[<=500ms] m@DONE)",
        "G F[<=2s] m@DONE",
        "G F (ask && F[<=1s] m@DONE)",
        "G (m@IDLE -> H m@IDLE)",
    ):
        properties = lines(f"p: {text}")
        trace = verify(arrangement, properties, engine="explicit").properties[0].trace
        assert trace is not None
        moves = tuple(Move(0, {s.choice: s.value for s in step.choices}) for step in trace.steps)
        again = replay(arrangement, properties, Schedule((), moves, trace.loop))
        assert again.outcome == "fails", text
        assert again.trace is not None
        assert [step.changes for step in again.trace.steps] == [step.changes for step in trace.steps]
        mended = lines("p: G (m@WAIT -> F[<=600ms] m@DONE)")
        assert replay(arrangement, mended, Schedule((), moves, trace.loop)).outcome == "passes"


@pytest.mark.slow
def test_expressions_of_psl_beside_time() -> None:
    psl = (
        '# syntax: spot\np: G ({"m@WAIT"; "m@WAIT"[*]}[]-> ("m@WAIT" || X "m@IDLE"))\n'
        'q: G ({"m@WAIT"[+]; "m@DONE"}[]-> X "m@WAIT")\nr: F {"m@WAIT"[*6]; "m@DONE"}!'
    )
    arrangement = load_arrangement_text(SERVED)
    assert {p.name: p.verdict.value for p in verify(arrangement, lines(psl), engine="explicit").properties} == {
        "p": "holds", "q": "violated", "r": "violated",
    }  # fmt: skip
    sources = [Source("psl.ltl", psl), Source("time.ltl", "assume asked: G F[<=300ms] ask")]
    found = verify(arrangement, parse_properties(sources, features=CHECKED), engine="explicit").properties
    assert [p.verdict.value for p in found] == ["holds", "violated", "holds"]


def test_a_violation_of_an_unconfirmed_kind_is_no_surprise(monkeypatch: pytest.MonkeyPatch) -> None:
    """The evaluator is independent: a wrong period in it is noticed as a disagreement."""
    monkeypatch.setattr(Clock, "delays", lambda _self, letters: [Fraction(0) for _ in letters])
    with pytest.raises(Disagreement, match="property p"):
        checked(SERVED, "p: G (m@WAIT -> F[<=500ms] m@DONE)")
