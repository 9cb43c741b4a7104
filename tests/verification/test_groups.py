"""Groups of properties, each with a search of its own, whose results look like that of one search."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.checking.engine import Given, Session
from llfsm_verify.checking.groups import Group, groups_of
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.checking.verdict import FAULTS, EarlyVerdict, Options, Progress, Result, Verdict
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.engines.explicit.engine import ExplicitSession
from llfsm_verify.engines.explicit.options import Checkpointing, ExplicitOptions
from llfsm_verify.limits import Limits, reached
from llfsm_verify.verification import groups, harness
from llfsm_verify.verification.merging import MergingGroups
from llfsm_verify.verification.verify import verify
from tests.checking.replaying import lines_of
from tests.quick import FRESH
from tests.verification.grouping import KINDS, Case, compare, run

HOLDS, VIOLATED, UNKNOWN = Verdict.HOLDS, Verdict.VIOLATED, Verdict.UNKNOWN


def chain(inputs: int, count: int = 0) -> str:
    """A machine that trips on any of some inputs; `count`: beside it, a number up to that."""
    lines = ["name: chain", "cycle_ms: 20", "whiteboard:"]
    lines += [f"  s{i}: {{type: bool, role: input}}" for i in range(inputs)]
    lines += ["  run: {type: bool, init: false}", f"  n: {{type: 0..{count}}}", "machines:", "  m:", "    inline:"]
    lines += ["      machine: M", "      states:", "        - name: OK", "          on_entry: run = true;"]
    lines += [f"          internal: n = min(n + 1, {count});", "          transitions:"]
    lines += [f"            - {{when: s{i}, to: T{i}}}" for i in range(inputs)]
    for i in range(inputs):
        lines += [f"        - name: T{i}", "          on_entry: run = false;", "          transitions:"]
        lines += [f"            - {{when: 'after(2) && not s{i}', to: OK}}"]
    return "\n".join([*lines, "schedule: [m]", ""])


def lines(inputs: int) -> str:
    """Three properties of each input: one that holds, one that does not, one about a sample."""
    each = ("h{0}: G (m@T{0} -> F (m@OK || s{0}))", "v{0}: G (m@T{0} -> s{0})", "r{0}: G (sampled(s{0}) -> !m@T{1})")
    return "\n".join(text.format(i, (i + 1) % inputs) for i in range(inputs) for text in each)


def problem(inputs: int, text: str = "", count: int = 0) -> Problem:
    return bind(load_arrangement_text(chain(inputs, count), "chain.yaml"), lines_of(text or lines(inputs)))


def check(given: Problem, options: Options | None = None) -> Result:
    return groups.check("explicit", ExplicitSession, given, options or Options())


@pytest.mark.long
def test_groups_decide_what_one_search_decides() -> None:
    run(8)


@pytest.mark.long
def test_groups_decide_what_one_search_decides_on_many() -> None:
    run(500 if FRESH else 60, kinds=("several groups", *KINDS))


@pytest.mark.slow
def test_results_look_as_those_of_one_search() -> None:
    given = problem(4)
    told: list[EarlyVerdict] = []
    parts = check(given, Options(decided=told.append))
    whole = harness.check("explicit", ExplicitSession, given, Options())
    assert len(groups_of(given)) == 3
    assert [p.name for p in parts.properties] == [p.name for p in given.properties]
    for one, other in zip(whole.properties, parts.properties, strict=True):
        assert replace(one, trace=None, notes=()) == replace(other, trace=None, notes=())
        assert (one.trace is None) == (other.trace is None)
    assert (parts.faults, parts.complete, parts.engine, parts.attempts) == (whole.faults, True, "explicit", ())
    assert parts.exploration.states < whole.exploration.states
    assert {e.name for e in told} == {p.name for p in given.properties} | {FAULTS}


# ---- Mistakes that the comparison has to find


def other_letters(made: Sequence[Group]) -> list[Group]:
    """The first group's own atoms tell what an atom of the last group says."""
    first, last = made[0].problem, made[-1].problem
    foreign = next(a.expression for a in last.atoms if a not in first.atoms)
    atoms = tuple(a if a in last.atoms else replace(a, expression=foreign) for a in first.atoms)
    return [replace(made[0], problem=replace(first, atoms=atoms)), *made[1:]]


def unassumed(made: Sequence[Group]) -> list[Group]:
    """The groups are searched without the assumptions."""
    return [replace(group, problem=replace(group.problem, assumptions=())) for group in made]


CASE = Case(
    load_arrangement_text(chain(4), "chain.yaml"), ("assume a: G !s3", "u: G !m@T3", *lines(4).splitlines()), most=3
)


@pytest.mark.slow
@pytest.mark.parametrize("change", [other_letters, unassumed])
def test_groups_that_are_made_wrongly_are_noticed(change: Callable[..., list[Group]]) -> None:
    compare(CASE)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(groups, "groups_of", lambda problem, most=3: change(groups_of(problem, most)))
        with pytest.raises(AssertionError):
            compare(CASE)


@pytest.mark.slow
def test_verdicts_that_go_to_properties_of_another_group_are_noticed() -> None:
    add = MergingGroups.add
    last: list[Result] = []

    def exchanged(merging: MergingGroups, engine: str, result: Result) -> None:
        """The first verdict of each group is one of the group before."""
        first = result.properties[0]
        before = next((p for p in last[-1].properties if p.verdict is not first.verdict), first) if last else first
        last.append(result)
        wrong = replace(before, name=first.name, text=first.text, span=first.span)
        add(merging, engine, replace(result, properties=(wrong, *result.properties[1:])))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(MergingGroups, "add", exchanged)
        with pytest.raises(AssertionError):
            compare(CASE)


# ---- Limits and Ctrl-C


@pytest.mark.slow
def test_a_limit_of_the_user_is_for_each_group() -> None:
    given = problem(4)
    result = check(given, Options(Limits(max_states=10)))
    assert {p.reason for p in result.properties if p.verdict is UNKNOWN} == {reached(10, "configurations")}
    assert (result.faults.verdict, result.complete) == (UNKNOWN, False)
    assert {p.verdict for p in result.properties} == {VIOLATED, UNKNOWN}


@pytest.mark.slow
def test_steps_that_a_turn_may_take_are_shared_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(groups, "STEPS", 20)
    given, asked = problem(4, count=500), list[Limits]()

    def start(one: Given) -> Session:
        asked.append(one.options.limits)
        return ExplicitSession(one)

    result = groups.check("explicit", start, given, Options(Limits(max_steps=900, max_work=9)))
    again = len(asked) - 3
    assert [limits.max_steps for limits in asked] == [20] * 3 + [900 // again] * again
    assert {limits.max_work for limits in asked} == {9}
    assert {p.reason for p in result.properties if p.verdict is UNKNOWN} == {reached(900, "steps")}


@pytest.mark.slow
def test_what_the_first_round_leaves_open_is_searched_again_by_needs_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(groups, "STATES", 300)
    given, searched = problem(4, count=20), list[str]()

    def start(one: Given) -> Session:
        searched.append(" ".join(p.name for p in one.problem.properties))
        return ExplicitSession(one)

    result = groups.check("explicit", start, given, Options())
    assert searched[:3] == ["h3 v3 r3", "h0 v0 r0 h1 v1", "r1 h2 v2 r2"]
    assert len(searched) > 5 and result.complete and result.exploration.states > 300
    assert {p.name: p.verdict for p in result.properties} == {
        p.name: p.verdict for p in harness.check("explicit", ExplicitSession, given, Options()).properties
    }


@pytest.mark.slow
def test_faults_of_the_search_that_came_farthest_are_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(groups, "STATES", 300)
    text = chain(4, 20).replace("n = min(n + 1, 20)", "n = n + 1").replace("run = false;", "run = false; n = n - 1;", 1)
    given = bind(load_arrangement_text(text, "chain.yaml"), lines_of(lines(4)))
    whole = harness.check("explicit", ExplicitSession, given, Options())
    assert len(whole.faults.findings) == 2
    assert [f.site for f in check(given).faults.findings] == [f.site for f in whole.faults.findings]


@pytest.mark.slow
def test_ctrl_c_in_one_group_keeps_what_others_have_said() -> None:
    given = problem(4)

    def start(one: Given) -> Session:
        if any(p.name == "h0" for p in one.problem.properties):
            raise KeyboardInterrupt
        return ExplicitSession(one)

    result = groups.check("explicit", start, given, Options())
    said = {p.name: p.reason for p in result.properties}
    assert result.interrupted and result.exit_code == 130 and not result.complete
    assert said["h3"] is None and said["h0"] == said["h2"] == harness.INTERRUPTED
    assert result.faults.verdict is HOLDS


@pytest.mark.slow
def test_after_the_time_limit_no_group_is_begun(monkeypatch: pytest.MonkeyPatch) -> None:
    given, begun = problem(4), list[Given]()

    def start(one: Given) -> Session:
        begun.append(one)
        monkeypatch.setattr(groups._Rounds, "_seconds", 5.0)
        return ExplicitSession(one)

    result = groups.check("explicit", start, given, Options(Limits(timeout=5.0)))
    assert len(begun) == 1
    said = {p.name: p.reason for p in result.properties}
    assert said["h3"] is None and said["h0"] == said["h2"] == "the time limit of 5 s was reached"


@pytest.mark.slow
def test_progress_names_the_group() -> None:
    shown: list[Progress] = []
    check(problem(4), Options(progress=shown.append))
    assert {p.doing.split(":")[0] for p in shown} == {f"group {i} of 3" for i in (1, 2, 3)}
    assert [p.seconds for p in shown] == sorted(p.seconds for p in shown)


@pytest.mark.slow
def test_a_checkpoint_is_of_one_search(tmp_path: Path) -> None:
    path = tmp_path / "c"
    options = Options(Limits(max_states=50), own=(ExplicitOptions(checkpoint=Checkpointing(path)),))
    result = check(problem(4), options)
    assert path.exists() and {p.reason for p in result.properties} >= {reached(50, "configurations")}
    assert check(problem(4), replace(options, limits=Limits())).complete


def test_what_is_wrong_with_properties_is_said_of_all_groups_at_once() -> None:
    text = "\n".join([*(f"p{i}: G s{i}" for i in range(5)), "forbid a: s0*", "forbid b: s4*"])
    with pytest.raises(DiagnosticError) as caught:
        check(problem(5, text))
    assert len(caught.value.diagnostics) == 2


@pytest.mark.slow
def test_auto_and_all_have_groups_as_well() -> None:
    given = problem(6)
    result = verify(given.arrangement, lines_of(lines(6)), engine="auto")
    assert result.engine == "explicit" and result.complete
    assert {p.verdict for p in result.properties} == {HOLDS, VIOLATED}
    assert result.exploration.states < 3_000
