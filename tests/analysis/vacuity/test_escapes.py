"""Assumptions that the arrangement escapes: cases by hand, and random arrangements beside a search in plain Python."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import settings
from hypothesis import strategies as st

from llfsm_verify.api.results import CheckResult
from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.verdict import Options, Result, Verdict
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.engines.explicit.explored import ExploredGraph
from llfsm_verify.engines.explicit.options import ExplicitOptions
from llfsm_verify.engines.explicit.search import Search
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.language import typed
from llfsm_verify.language.atoms import PropertyScope, check_atom
from llfsm_verify.limits import Budget, LimitReached, Limits
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.report.saving import trace_documents
from llfsm_verify.testing.conformance.stopping import StoppingBudget
from llfsm_verify.testing.properties import state_formulas
from llfsm_verify.verification import harness
from llfsm_verify.verification.verify import verify
from tests.checking.replaying import again, lines_of
from tests.oracle import judging
from tests.oracle.direct import nodes
from tests.oracle.escapes import nearest_escape
from tests.oracle.formulas import Tree, text
from tests.oracle.graph import TooLargeError, explore
from tests.quick import each, examples, many, spread

ALL = Options(Limits(max_states=10_000), vacuity="all")
REDUCED = replace(ALL, own=(ExplicitOptions(cone="on", compression="on"),))


def works(*, stop: str = "stop", changes: str = "step", more: str = "") -> Arrangement:
    """`t` shows the sensor until it is told to stop, and is then finished; `u` goes on."""
    states = [
        {"name": "WORK", "internal": "out = car;", "transitions": [{"when": stop, "to": "END"}]},
        {"name": "END", "on_entry": f"out = false; {more}"},
    ]
    car = {"type": "bool", "role": "input", "changes": changes}
    return build_arrangement(
        {
            "name": "works",
            "cycle_ms": 100,
            "whiteboard": {
                "car": car if changes == "never" else {**car, "init": False},
                "stop": {"type": "bool", "init": False, "role": "input"},
                "out": {"type": "bool", "role": "output"},
                "bad": {"type": "bool", "role": "output"},
            },
            "machines": {
                "t": {"inline": {"machine": "T", "states": states}},
                "u": {"inline": {"machine": "U", "states": [{"name": "A", "stays": True}]}},
            },
            "schedule": ["t", "u"],
        }
    )


WORKS = works()


def checked(arrangement: Arrangement, assumptions: str, options: Options = ALL, engine: str = "explicit") -> Result:
    return verify(arrangement, lines(f"G (car || !car); {assumptions}"), options, engine=engine)


def lines(texts: str) -> PropertySet:
    """A property and assumptions, separated by semicolons."""
    goal, *assumptions = texts.split("; ")
    return lines_of("\n".join([f"p: {goal}", *(f"assume a{i}: {text}" for i, text in enumerate(assumptions))]))


def steps_of(result: Result) -> int | None:
    """The steps of the run that escapes, which the property says, too."""
    (found,) = result.properties
    said = [finding for finding in found.vacuity.findings if finding.kind == "escape"]
    assert len(said) == (result.escape is not None), found.vacuity
    if result.escape is None:
        return None
    assert result.escape.escape and result.escape.loop is None
    return len(result.escape.steps)


@pytest.mark.parametrize(
    ("assumptions", "steps"),
    [
        ("G F (t.ran && car)", 1),
        ("G F t.ran", 1),
        ("G F t@WORK", 1),
        ("G (car -> F t.read(car))", 2),  # the first turn in END is the last one of t, and car may come with it
        ("G F car", None),
        ("G !(car && stop)", None),
        ("G !stop", None),
        ("G F rose(car)", None),
        ("F car; G (car -> X !car)", None),
        ("G F sampled(car)", 1),
        ("G F u.ran", None),
        ("G !t@END", None),  # what is seen at once is what the assumption leaves out
        ("G !t.entered(END)", 1),
        ("G !t.entered(END); G !stop", None),
        ("G F (t.ran && car); G !stop", None),
        ("G F (t.ran && car); G (stop -> F car)", 1),
        ("G F[<=300ms] t.ran", 1),
        ("G (car -> F[<=300ms] t.ran)", 4),
        ("F (t.ran && car)", 3),
        ("G F t.ran || G F u.ran", None),
    ],
)
def test_a_machine_that_finishes(assumptions: str, steps: int | None) -> None:
    for options in (ALL, REDUCED):
        assert steps_of(checked(WORKS, assumptions, options)) == steps


def test_the_run_is_performed_again() -> None:
    result = checked(WORKS, "G F (t.ran && car)")
    assert result.escape is not None
    (step,) = result.escape.steps
    assert step.fired == "WORK -> END when stop" and step.atoms == (("car", False), ("t.ran", True))
    assert again(WORKS, lines("G (car || !car); G F (t.ran && car)"), result.escape).outcome == "passes"


def test_two_assumptions_that_only_together_cannot_be_met() -> None:
    """Whichever the machine does, one of the two can be met."""
    both = "F G t@WORK; F stop"
    assert steps_of(checked(WORKS, both)) == 1
    # Here the inputs decide, and the words themselves contradict each other then.
    assert steps_of(checked(WORKS, "G (car -> G F bad); G (car -> G !bad)")) is None


def test_an_input_that_never_changes_is_chosen_by_the_surroundings() -> None:
    still = works(changes="never", stop="false")
    assert steps_of(checked(still, "G F (t.ran && car)")) is None
    assert steps_of(checked(works(changes="never"), "G F (t.ran && car)")) == 1


def test_what_a_plant_writes_is_no_input_that_may_come_again() -> None:
    states = [
        {"name": "THERE", "internal": "car = choose(bool);", "transitions": [{"when": "away", "to": "GONE"}]},
        {"name": "GONE", "on_entry": "car = false;"},
    ]
    machine = {"machine": "T", "states": [{"name": "S", "stays": True, "internal": "away = stop;"}]}
    arrangement = build_arrangement(
        {
            "whiteboard": {
                "car": {"type": "bool", "role": "input"},
                "stop": {"type": "bool", "role": "input"},
                "away": {"type": "bool", "role": "output"},
            },
            "environment": {"inline": {"machine": "P", "states": states}},
            "machines": {"t": {"inline": machine}},
            "schedule": ["t"],
        }
    )
    assert steps_of(checked(arrangement, "G F car")) == 1
    assert steps_of(checked(arrangement, "G F stop")) is None


def test_no_run_at_all_is_said_otherwise() -> None:
    result = checked(WORKS, "G F bad")
    assert result.escape is None
    assert [f.kind for f in result.properties[0].vacuity.findings] == ["assumptions"]


def test_an_output_that_an_assumption_leaves_out() -> None:
    late = works(more="bad = true;")
    assert steps_of(checked(late, "G !bad")) == 1  # in END already, and `bad` not yet true
    assert steps_of(checked(late, "G !(bad && car)")) is None
    assert steps_of(checked(works(stop="true", more="bad = true;"), "G !bad")) is None  # no run at all


def test_runs_that_end_in_a_fault_are_no_escape() -> None:
    faulty = works(more="out = 1 / (out ? 1 : 0) == 0;")
    result = checked(faulty, "G F t.ran")
    assert result.escape is None and result.faults.findings


@pytest.mark.slow
def test_without_fairness_a_process_may_stop_anywhere() -> None:
    states = [{"name": "A", "stays": True}]
    machines = {name: {"inline": {"machine": f"K{name}", "states": states}} for name in ("a", "b")}
    document = {
        "name": "two",
        "whiteboard": {"car": {"type": "bool", "init": False, "role": "input"}},
        "machines": machines,
        "processes": {"p": ["a"], "q": ["b"]},
    }
    for fairness in ("processes", "none"):
        arrangement = build_arrangement({**document, "fairness": fairness})
        assert steps_of(checked(arrangement, "G F a.ran")) is None
        assert steps_of(checked(arrangement, "F G !a.ran; F a.ran")) is None
    # A run that leaves `a` out is not fair, so nothing meets the second assumption after the surroundings have decided.
    fair = build_arrangement(document)
    assert steps_of(checked(fair, "G (car -> F G !a.ran)")) == 1
    unfair = build_arrangement({**document, "fairness": "none"})
    assert steps_of(checked(unfair, "G (car -> F G !a.ran)")) is None


# ---------------------------------------------------------------- strictness and limits


@pytest.mark.slow
@pytest.mark.parametrize(("accepted", "code"), [(frozenset[str](), 1), (frozenset({"p"}), 0)])
def test_strict_is_no_pass(accepted: frozenset[str], code: int) -> None:
    asked = lines("G (out -> O car); G F (t.ran && car)")
    strict = replace(ALL, strict=True, accepted=accepted)
    assert verify(WORKS, asked, strict, engine="explicit").exit_code == code
    assert verify(WORKS, asked, strict, engine="auto").exit_code == code
    assert verify(WORKS, asked, replace(strict, strict=False), engine="explicit").exit_code == 0


def test_without_an_option_it_is_a_note(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(harness, "ESCAPE_LEAST", 600.0)  # nothing is to depend on the clock
    assert steps_of(checked(WORKS, "G F t.ran", Options(Limits(max_states=10_000)))) == 1


@pytest.mark.slow
def test_engines_that_prove_say_that_they_did_not_look() -> None:
    strict = replace(ALL, strict=True)
    asked = lines("G (out -> O car); G F (t.ran && car)")
    found = verify(WORKS, asked, strict, engine="pdr")
    (item,) = found.properties
    assert found.exit_code == 4 and item.vacuity.looked != "all" and "escapes" in (item.vacuity.reason or "")
    inputs = verify(WORKS, lines("G (out -> O car); G F car"), strict, engine="pdr")
    assert inputs.exit_code == 0, inputs.properties[0].vacuity


@pytest.mark.parametrize(
    ("stop", "code"),
    [(KeyboardInterrupt(), 130), (LimitReached("so much"), 4), (MemoryError(), 4), (AutomatonTooLarge("states", 1), 4)],
)
def test_what_ends_the_look_is_never_a_pass(stop: BaseException, code: int, monkeypatch: pytest.MonkeyPatch) -> None:
    def ends(_: object) -> None:
        raise stop

    monkeypatch.setattr(ExploredGraph, "escape", ends)
    asked = lines("G (out -> O car); G F (t.ran && car)")
    for strict, expected in ((True, code), (False, 130 if code == 130 else 0)):
        result = verify(WORKS, asked, replace(ALL, strict=strict), engine="explicit")
        (item,) = result.properties
        assert (result.exit_code, item.verdict, result.escape) == (expected, Verdict.HOLDS, None)
        assert item.vacuity.looked != "all" and not item.vacuity.findings
        if code == 4:
            assert "whether the arrangement escapes the assumptions" in (item.vacuity.reason or "")


@pytest.mark.slow
def test_it_may_be_stopped_at_any_tick() -> None:
    """What has been begun can be begun again, and says the same."""
    problem = bind(WORKS, lines("G (out -> O car); G (car -> F t.read(car)); G F (t.ran || stop)"))
    search = Search(Explorer(problem.program(), Budget(Limits())), problem, ())
    search.run()
    whole = search.escape()
    assert whole is not None
    at = 1
    while True:
        budget = StoppingBudget(Limits(), at, LimitReached("so much"))
        with budget:
            try:
                found = search.escape()
            except LimitReached:
                at += 1
                continue
        assert found == whole and at > 5 and search.escape() == whole
        return


def test_the_front_door_gives_the_run_and_saves_it(tmp_path: Path) -> None:
    asked = lines("G (out -> O car); G F (t.ran && car)")
    result = verify(WORKS, asked, ALL, engine="explicit")
    ((name, _, document),) = trace_documents(result, WORKS, asked, tmp_path)
    assert name == "p.escape" and "expect: holds" in document
    shown = CheckResult(result, WORKS, asked).escape
    assert shown is not None and "The last chance is lost in step 1" in str(shown)
    assert CheckResult(replace(result, escape=None), WORKS, asked).escape is None


# ---------------------------------------------------------------- beside plain Python


@st.composite
def _problems(draw: st.DrawFn) -> tuple[Arrangement, list[Tree], list[str]]:
    arrangement = build_arrangement(draw(judging.compound_arrangements()))
    names = draw(st.lists(st.sampled_from(state_formulas(arrangement)), min_size=2, max_size=4, unique=True))
    one = judging.state_trees(names)
    two = st.tuples(one, one)
    shapes = st.one_of(
        one.map(lambda f: ("G", ("F", f))),
        two.map(lambda fs: ("G", ("->", fs[0], ("F", fs[1])))),
        two.map(lambda fs: ("G", ("->", fs[0], ("X", ("X", fs[1]))))),
        two.map(lambda fs: ("G", ("->", fs[0], ("G", ("F", fs[1]))))),
        two.map(lambda fs: ("->", ("F", fs[0]), ("F", ("G", fs[1])))),
        judging.formulas(names),
    )
    return arrangement, draw(st.lists(shapes, min_size=1, max_size=2)), names


def _inputs(arrangement: Arrangement, names: list[str], *, fixed: bool) -> set[str]:
    """The texts that name nothing but inputs; `fixed`: those that never change."""
    inputs = {w.variable.name for w in arrangement.whiteboard if w.role == "input" and not w.driven}
    wanted = {w.variable.name for w in arrangement.whiteboard if w.role == "input" and w.changes == "never"}
    known = {v for e in arrangement.enumerations for v in e.values} | {"rose", "fell", "changed", "true", "false"}
    found = set()
    for name in names:
        words = set(re.findall(r"(?<![.\w])[A-Za-z_]\w*", name)) - known - {"abs", "min", "max"}
        if "@" not in name and not re.search(r"\b(sampled|read)\(", name) and words <= (wanted if fixed else inputs):
            found.add(name)
    return found


class _Compared:
    def __init__(self) -> None:
        self.seen: Counter[str] = Counter()

    def __call__(self, problem: tuple[Arrangement, list[Tree], list[str]]) -> None:
        arrangement, assumptions, names = problem
        if arrangement.timing == "untimed" and any(nodes(arrangement.texts, typed.After)):
            return
        scope = PropertyScope.of(arrangement)
        expressions = {n: check_atom(Fragment.whole(Source("<atom>", n)), scope) for n in names}
        try:
            graph = explore(arrangement, expressions, judging.CONFIGURATIONS, judging.STEPS)
        except TooLargeError:
            return
        if graph.wide:
            return
        inputs, fixed = (_inputs(arrangement, names, fixed=f) for f in (False, True))
        expected = nearest_escape(assumptions, graph, inputs, fixed, fair=arrangement.fairness == "processes")
        asked = lines_of("\n".join(["p: true", *(f"assume a{i}: {text(f)}" for i, f in enumerate(assumptions))]))
        for options in (ALL, REDUCED):
            options = replace(options, allow_contradiction=True)  # as if some run satisfied them
            result = verify(arrangement, asked, options, engine="explicit")
            (found,) = result.properties
            assert found.vacuity.looked == "all", found.vacuity.reason
            letters = None if result.escape is None else sum(step.observed for step in result.escape.steps)
            assert letters == expected, (expected, letters, asked)
            assert (letters is not None) == any(f.kind == "escape" for f in found.vacuity.findings)
        self.seen["escapes" if expected is not None else "none"] += 1
        self.seen["after a step"] += bool(expected)
        self.seen["two assumptions"] += len(assumptions) == 2
        if found.notes:
            self.seen["no run"] += 1


def _run(count: int, *kinds: str) -> None:
    """Compare that many, and more until each kind has come."""
    compared = _Compared()
    met = each(compared.seen, kinds)
    spread(compared, settings(judging.QUIET, max_examples=count), _problems(), size=5, until=met)


@pytest.mark.slow
def test_as_plain_python_says() -> None:
    _run(examples(8), "none")


@pytest.mark.long
def test_as_plain_python_says_of_many() -> None:
    _run(many(4_000), "escapes", "none", "after a step", "two assumptions", "no run")
