"""Machines inside states by hand. Random ones: see the lockstep."""

from __future__ import annotations

import pytest

from llfsm_verify.analysis.lint.run import lint
from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.checking.verdict import Options
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.verification.verify import verify
from tests.oracle.direct import Direct
from tests.oracle.lockstep import Lockstep

Document = dict[str, object]

WORKER = {
    "machine": "Worker",
    "states": [
        {"name": "START", "on_entry": "n = 0;", "transitions": [{"when": "true", "to": "WORK"}]},
        {"name": "WORK", "internal": "if (n < 3) n = n + 1;", "transitions": [{"when": "n == 2", "to": "END"}]},
        {"name": "END", "on_entry": "ends = ends < 9 ? ends + 1 : ends;"},
    ],
}
BOARD = {"n": {"type": "0..3"}, "ends": {"type": "0..9"}, "go": {"type": "bool", "role": "input"}}


def owner(*states: Document) -> Document:
    return {"inline": {"machine": "Owner", "states": list(states)}}


RUN = {"name": "RUN", "runs": ["w"], "transitions": [{"when": "done(w)", "to": "REST"}]}
REST = {"name": "REST", "transitions": [{"when": "go", "to": "RUN"}]}


def arrangement(machines: Document, **more: object) -> Document:
    return {"whiteboard": BOARD, "machines": machines, "schedule": list(machines), **more}


def nest(*states: Document, **more: object) -> Document:
    return arrangement({"o": owner(*(states or (RUN, REST))), "w": {"inline": WORKER}}, **more)


def verdicts(document: Document, *formulas: str, engine: str = "explicit") -> list[str]:
    lines = parse_properties([Source("p", "\n".join(formulas))])
    return [p.verdict.value for p in verify(build_arrangement(document), lines, Options(), engine).properties]


def hold(document: Document, *formulas: str, engine: str = "explicit") -> None:
    assert verdicts(document, *formulas, engine=engine) == ["holds"] * len(formulas)


def test_it_runs_each_time_and_its_last_on_entry_has_run_when_it_is_done() -> None:
    document = nest()
    hold(
        document, "w.suspended && !done(w)", "F (o@REST && ends == 1)",
        "G (rose(done(w)) -> w@END && w.entered && w.ran)",
        "G (o@REST && w.ran -> w.suspended)", "G (o@RUN && o.entered && !w.suspended -> F done(w))",
        "G (w@END -> done(w) || !w.entered || !o@RUN)",
    )  # fmt: skip
    # It runs twice: the second time from its beginning.
    assert verdicts(document, "G ends <= 1", "G (fell(done(w)) -> X (w@START || w@WORK))") == ["violated", "holds"]


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["induction", "pdr"])
def test_other_engines(engine: str) -> None:
    hold(nest(), "G (o@REST && w.ran -> w.suspended)", "G (done(w) -> !w@START || o@REST)", engine=engine)


def test_all_of_them() -> None:
    states = (
        {"name": "RUN", "runs": ["v", "w"], "transitions": [{"when": "all_done", "to": "REST"}]},
        REST,
    )
    document = arrangement({"o": owner(*states), "v": {"inline": WORKER}, "w": {"inline": WORKER}})
    hold(document, "G (o.fired(RUN, 0) -> done(v) && done(w))", "F o@REST")


def test_leaving_suspends_before_on_exit_and_a_self_transition_does_neither() -> None:
    states = (
        {"name": "RUN", "runs": ["w"], "on_exit": "n = 3;",
         "transitions": [{"when": "go", "to": "RUN"}, {"when": "w@WORK", "to": "REST"}]},
        REST,
    )  # fmt: skip
    hold(
        nest(*states), "G (o.fired(RUN, 1) -> X (w.suspended && w.ran))",
        "G (o.fired(RUN, 0) && w@WORK -> X (w.ran && (w@WORK || w@END)))",
    )  # fmt: skip


@pytest.mark.slow
def test_suspended_and_resumed_with_its_owner() -> None:
    boss = {"inline": {"machine": "B", "states": [
        {"name": "ON", "transitions": [{"when": "go", "to": "OFF"}]},
        {"name": "OFF", "on_entry": "suspend(o);", "on_exit": "resume(o);",
         "transitions": [{"when": "go", "to": "ON"}]},
    ]}}  # fmt: skip
    document = arrangement({"b": boss, "o": owner(RUN, REST), "w": {"inline": WORKER}})
    hold(
        document, "G (o.suspended && w.ran -> w.suspended)", "G (o@RUN && w.ran && !w.suspended -> n <= 3)",
        # It goes on where it was: START is entered only where the owner enters RUN.
        "G (w.ran && w.entered(START) -> o@RUN)", "G (rose(w.suspended) && o.suspended -> n <= 3)",
    )  # fmt: skip
    # In WORK when both were suspended, in WORK again when both are resumed.
    assert verdicts(document, "G !(w@WORK && X w.suspended && F (!w.suspended && w@WORK))") == ["violated"]


def test_restarting_the_owner_suspends_what_runs() -> None:
    boss = {"inline": {"machine": "B", "states": [{"name": "ON", "internal": "if (go) restart(o);", "stays": "true"}]}}
    states = (REST, RUN)
    document = arrangement({"b": boss, "o": owner(*states), "w": {"inline": WORKER}})
    hold(document, "G (o@REST && w.ran -> w.suspended)")


def test_nests_in_nests() -> None:
    middle = owner({"name": "M", "runs": ["w"], "transitions": [{"when": "done(w)", "to": "E"}]}, {"name": "E"})
    outer = owner({"name": "RUN", "runs": ["m"], "transitions": [{"when": "done(m)", "to": "REST"}]}, REST)
    for profile in ("llfsm", "swiftfsm"):
        document = arrangement({"o": outer, "m": middle, "w": {"inline": WORKER}}, profile=profile)
        hold(
            document, "F (o@REST && ends == 1)", "G (o@REST && m.ran -> m.suspended)", "G (done(m) -> O done(w))",
            "G (m.suspended && w.ran -> w.suspended)",
        )  # fmt: skip


def test_unloading_the_owner_suspends_what_runs() -> None:
    boss = {
        "inline": {
            "machine": "B",
            "states": [{"name": "ON", "internal": "if (go) unload(o); else load(o);", "stays": "true"}],
        }
    }
    document = arrangement({"b": boss, "o": owner(RUN, REST), "w": {"inline": WORKER}})
    hold(document, "G (!o.loaded && w.ran -> w.suspended)", "G (rose(o.loaded) -> !done(w) || w.suspended)")


def other(*states: Document, **more: Document) -> Document:
    """The same with another owner."""
    return {"machines": {"o": owner(*states), **more, "w": {"inline": WORKER}}}


WRONG = {
    "there is no machine `x` to run": other({**RUN, "runs": ["x"]}, REST),
    "`w` appears twice here": other({**RUN, "runs": ["w", "w"]}, REST),
    "`o` would be inside itself": other({**RUN, "runs": ["w", "o"]}, REST),
    "two states of `o` run `w`": other(RUN, {**REST, "runs": ["w"]}),
    "`w` has two owners, `o` and `p`": {**other(RUN, REST, p=owner(RUN, REST)), "schedule": ["o", "p", "w"]},
    "`w` belongs to the pool, so no state can run it": {"schedule": ["o"], "pool": ["w"]},
    "no state runs `w`, so it is never done": other({**RUN, "runs": []}, REST),
    "`w` runs inside a state of `o`, so only `o` starts and stops it": other(RUN, {**REST, "on_entry": "unload(w);"}),
    "`w` runs inside a state, so only its owner starts and stops it": {"operators": {"unload": ["w"]}},
}


@pytest.mark.parametrize(("said", "change"), WRONG.items(), ids=WRONG)
def test_what_cannot_be(said: str, change: Document) -> None:
    with pytest.raises(DiagnosticError) as raised:
        build_arrangement({**nest(), **change})
    assert any(d.code == "E159" and said == d.message for d in raised.value.diagnostics), raised.value


@pytest.mark.slow
def test_lint_notes_a_machine_before_its_owner() -> None:
    found = [f for f in lint(build_arrangement({**nest(), "schedule": ["w", "o"]})).shown if f.code == "L017"]
    assert [(f.level, f.message) for f in found] == [
        ("note", "`w` has its turn before `o`, so it begins and ends a cycle late")
    ]
    assert "L017" not in {f.code for f in lint(build_arrangement(nest())).shown}


def test_a_property_asks_for_what_is_inside_only() -> None:
    with pytest.raises(DiagnosticError, match="no state runs `o`"):
        verdicts(nest(), "G done(o)")
    with pytest.raises(DiagnosticError, match="this state runs no machines"):
        build_arrangement(nest(RUN, {**REST, "transitions": [{"when": "all_done", "to": "RUN"}]}))


def test_a_machine_inside_a_state_that_is_in_no_schedule_is_an_error() -> None:
    states = [{"name": "A", "runs": ["k"], "transitions": [{"when": "done(k)", "to": "A"}]}]
    machines = {
        "m": {"inline": {"machine": "M", "states": states}},
        "k": {"inline": {"machine": "K", "states": [{"name": "A"}]}},
    }
    with pytest.raises(DiagnosticError) as found:
        build_arrangement({"name": "x", "machines": machines, "schedule": ["m"]})
    assert [d.code for d in found.value.diagnostics] == ["E083"]


@pytest.mark.slow
@pytest.mark.parametrize("leaves", ["unload(self);", "n = 1 / (n - n);"])
@pytest.mark.parametrize("commands", ["next_turn", "end_of_ringlet"])
def test_an_owner_that_unloads_itself_suspends_what_runs_inside(commands: str, leaves: str) -> None:
    last = {"name": "LAST", "runs": ["w"], "internal": leaves, "stays": "true"}
    first = {"name": "FIRST", "transitions": [{"when": "true", "to": "LAST"}]}
    document = nest(first, last, profile={"base": "llfsm", "commands": commands}, observe="cycle")
    document["machines"]["o"]["on_fault"] = "unload"  # type: ignore[index]
    hold(document, "G (!o.loaded -> w.suspended)", "F !o.loaded")
    model = build_arrangement({**document, "observe": "ringlet"})
    Lockstep(model, lower(model, keep_all_bits=True), Direct(model, {})).walk(100)
