"""Pools, faults that unload and operators by hand. Random ones: see the lockstep."""

from __future__ import annotations

import pytest

import llfsm_verify as lv
from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.backends.reference import Interpreter
from llfsm_verify.checking.verdict import Options
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.verification.verify import verify

Document = dict[str, object]
WALK = [
    {"name": "W0", "on_entry": "x = x + 1;", "transitions": [{"when": "true", "to": "W1"}]},
    {"name": "W1", "transitions": [{"when": "true", "to": "W0"}]},
]
WALKER = {"inline": {"machine": "Walker", "variables": {"x": {"type": "uint8", "init": 7}}, "states": WALK}}


def script(*actions: str, **instance: object) -> Document:
    """A machine that runs one action a turn and then stays."""
    states: list[Document] = [
        {"name": f"C{i}", "on_entry": text, "transitions": [{"when": "true", "to": f"C{i + 1}"}]}
        for i, text in enumerate(actions)
    ]
    return {
        "inline": {"machine": "Script", "states": [*states, {"name": f"C{len(actions)}", "stays": "true"}]},
        **instance,
    }


def arrangement(machines: Document, schedule: list[str] | None = None, **more: object) -> Document:
    pool = more.get("pool", [])
    return {"machines": machines, "schedule": schedule or [m for m in machines if m not in pool], **more}


def hold(document: Document, *formulas: str, engine: str = "explicit", verdict: str = "holds") -> None:
    lines = parse_properties([Source("p", "\n".join(formulas))])
    result = verify(build_arrangement(document), lines, Options(), engine)
    assert [p.verdict.value for p in result.properties] == [verdict] * len(formulas), [
        (p.text, p.verdict.value) for p in result.properties
    ]


def fail(document: Document, *formulas: str) -> None:
    hold(document, *formulas, verdict="violated")


# ---------------------------------------------------------------- pools


def test_a_machine_of_the_pool_is_not_there_until_it_is_loaded() -> None:
    document = arrangement({"c": script("", "load(w);"), "w": WALKER}, pool=["w"])
    hold(
        document,
        "!w.loaded && !w@W0 && !w.entered && !w.finished && !w.suspended && !is_running(w) && w.x == 7",
        "X (!w.loaded && c.ran) && X X (c.ran && w.loaded && w@W0 && w.x == 7) && X X X (w.ran && w@W1 && w.x == 8)",
        "G (w.ran -> w.loaded)", "G (c@C2 && c.entered -> w.loaded && is_running(w))",
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["induction", "pdr", "bmc"])
def test_other_engines_know_pools(engine: str) -> None:
    document = arrangement({"c": script("", "load(w);"), "w": WALKER}, pool=["w"])
    if engine == "bmc":
        hold(document, "G !w.ran", engine=engine, verdict="violated")
    else:
        hold(document, "G (w.ran -> w.loaded)", "G (!w.loaded -> w.x == 7)", engine=engine)


def test_a_load_is_fresh_and_of_a_loaded_machine_nothing() -> None:
    machines = {"w": WALKER, "c": script("", "unload(w);", "load(w); load(w);", "load(w);")}
    hold(
        arrangement(machines),
        "X w.x == 8", "F (!w.loaded && w.x == 7)", "G (fell(w.loaded) -> X (w.loaded && w.x == 7 && w@W0))",
        "G (c.fired(C3, 0) -> w@W1 && w.x == 8)",
    )  # fmt: skip


def test_a_finished_machine_is_loaded_again() -> None:
    ends = {
        "inline": {
            "machine": "E",
            "variables": {"n": {"type": "0..3"}},
            "states": [{"name": "A", "on_entry": "n = 2;"}],
        }
    }
    for finished in ("leave", "keep"):
        document = arrangement({"c": script("", "", "load(e);"), "e": ends}, finished=finished)
        hold(document, "F (e.finished && e.n == 2 && X (!e.finished && e.n == 0 && c@C3))", "F G e.finished")


def test_loaded_suspended() -> None:
    body = {
        "machine": "M", "suspend": "OFF", "variables": {"n": {"type": "0..9"}},
        "states": [
            {"name": "ON", "on_entry": "n = 1;", "on_suspend": "n = 5;", "stays": "true"},
            {"name": "OFF", "internal": "if (n < 9) n = n + 1;", "on_resume": "n = 9;"},
        ],
    }  # fmt: skip
    machines = {"c": script("load_suspended(m);", "", "resume(m);"), "m": {"inline": body}}
    hold(
        arrangement(machines, pool=["m"]),
        "X (m.suspended && m@OFF && m.n == 0)", "X X (m.ran && m.n == 6)", "F G (m@ON && m.n == 1)",
        "G (rose(m@ON) -> m.n == 1)",
    )  # fmt: skip


def test_unloading_oneself_waits_for_the_end_of_the_ringlet() -> None:
    states = [
        {
            "name": "A",
            "internal": "unload(self); load(self); lit = true;",
            "on_exit": "lit = false;",
            "transitions": [{"when": "go", "to": "A"}],
        }
    ]
    board = {"lit": {"type": "bool"}, "go": {"type": "bool", "role": "input"}}
    document = arrangement({"a": {"inline": {"machine": "A", "states": states}}, "b": script("")}, whiteboard=board)
    hold(document, "G (fell(a.loaded) -> lit && a.ran)", "G (!a.loaded -> G !a.loaded)", "G (a.loaded -> !lit)")


def test_the_end_of_a_process_whose_machines_are_unloaded() -> None:
    lone = {
        "inline": {
            "machine": "L",
            "states": [{"name": "A", "on_entry": "unload(self);", "transitions": [{"when": "true", "to": "A"}]}],
        }
    }
    document = arrangement({"l": lone, "p": script("")}, ["l"], pool=["p"])
    hold(document, "X G (!l.loaded && !l.ran || l.ran && cycle)", "F G !l.ran")
    loads = {"inline": {"machine": "L", "states": [{"name": "A", "on_entry": "load(p);"}]}}
    hold(
        arrangement({"l": loads, "p": script("")}, ["l"], pool=["p"]),
        "X (p.loaded && l.loaded && l.finished && !is_running(l))",
        "G F p.ran",
    )


def test_the_turn_of_another_process_passes_on() -> None:
    machines = {"a": script("", "unload(b);"), "b": WALKER, "d": WALKER}
    document = {"machines": machines, "processes": {"one": ["a"], "two": ["b", "d"]}}
    hold(document, "G (b.ran -> b.loaded)", "G F d.ran", "F G !b.loaded", "G (!b.loaded -> !b.ran)")
    alone = {"machines": {"a": script("", "unload(b);"), "b": WALKER}, "processes": {"one": ["a"], "two": ["b"]}}
    hold(alone, "F G !b.ran", "G (fell(b.loaded) -> a.ran)")


def test_commands_to_an_absent_machine_are_lost() -> None:
    document = arrangement({"c": script("suspend(w);", "restart(w);", "load(w);"), "w": WALKER}, pool=["w"])
    hold(document, "G !w.suspended", "G (rose(w.loaded) -> X w@W1)")


# ---------------------------------------------------------------- faults that unload

DIVIDES = {
    "machine": "D", "variables": {"own": {"type": "0..9"}},
    "states": [{
        "name": "S", "internal": "n = 9; own = 3; suspend(w); lit = true; n = 8 / n0; n = 1;",
        "transitions": [{"when": "go", "to": "S"}],
    }],
}  # fmt: skip
BOARD = {
    "n": {"type": "0..9", "init": 4}, "n0": {"type": "0..3", "role": "input"}, "lit": {"type": "bool"},
    "go": {"type": "bool", "role": "input"},
}  # fmt: skip


def dividing(**instance: object) -> Document:
    machines = {"d": {"inline": DIVIDES, **instance}, "w": WALKER}
    return arrangement(machines, whiteboard=BOARD)


@pytest.mark.slow
def test_a_fault_that_unloads_has_no_effect() -> None:
    unloads = dividing(on_fault="unload")
    hold(
        unloads,
        "G (faulted(d) -> d.ran && !d.loaded && d.own == 0 && (n == 4 && !lit || n == 1 && lit))",
        "G (!faulted(d) && !Y true -> n == 4)", "G (faulted(d) -> X (G !d.ran && w.ran))",
        "G (d.fired(S, 0) -> !faulted(d))", "G (faulted(d) && !w.suspended -> G F w.ran)",
    )  # fmt: skip
    fail(unloads, "G !faulted(d)", "G !lit")
    result = verify(build_arrangement(unloads), parse_properties([Source("p", "x: G true")]), Options(), "explicit")
    assert result.faults.verdict.value == "holds"
    result = verify(build_arrangement(dividing()), parse_properties([Source("p", "x: G true")]), Options(), "explicit")
    assert result.faults.verdict.value == "violated"


def test_a_machine_that_faulted_can_be_loaded_again() -> None:
    loads = {"inline": {"machine": "R", "states": [{"name": "S", "internal": "load(d);", "stays": "true"}]}}
    document = arrangement({"d": {"inline": DIVIDES, "on_fault": "unload"}, "w": WALKER, "r": loads}, whiteboard=BOARD)
    hold(document, "G (faulted(d) -> F d.ran)", "G F d.loaded")


def test_a_fault_is_an_event_with_its_place() -> None:
    program = lower(build_arrangement(dividing(on_fault="unload")))
    layout = Layout.of(program)
    told = [
        (event, program.faults[event[2][0]].code)
        for _, outcome in Interpreter(program).successors(layout.decode(layout.first()), layout.initial_outputs())
        for event in outcome.events
        if event[0] == "faulted"
    ]
    assert told and {code for _, code in told} == {"F002"}


# ---------------------------------------------------------------- operators


@pytest.mark.slow
def test_operators_may_act_where_a_cycle_begins() -> None:
    free = arrangement({"w": WALKER, "v": WALKER}, operators={"suspend": ["w"], "resume": ["w"]})
    fail(free, "G !w.suspended", "F w.suspended", "G (w.suspended -> F !w.suspended)")
    hold(free, "G !v.suspended", "G (rose(w.suspended) -> w.ran)", "G F w.ran")
    hold(arrangement({"w": WALKER, "v": WALKER}), "G !w.suspended")


@pytest.mark.slow
def test_operators_write() -> None:
    board = {"mode": {"type": "Mode"}, "n": {"type": "0..3", "role": "output"}}
    document = arrangement(
        {"w": WALKER, "v": WALKER},
        whiteboard=board,
        types={"Mode": ["SAFE", "FAST"]},
        operators={"write": ["mode", "n"]},
    )
    hold(document, "G (changed(mode) || changed(n) -> w.ran)")
    fail(document, "G mode == SAFE", "G n == 0", "G F (n == 0)")


@pytest.mark.slow
def test_operators_unload_the_machine_that_begins_when_its_ringlet_is_over() -> None:
    document = arrangement({"w": WALKER, "v": WALKER}, operators={"unload": ["w"], "load": ["w"]})
    hold(document, "G (fell(w.loaded) -> w.ran)", "G (rose(w.loaded) -> v.ran)", "G F v.ran")
    fail(document, "G w.loaded", "G F w.ran")


def test_names_of_the_choices_of_operators() -> None:
    board = {"mode": {"type": "Mode"}}
    document = arrangement(
        {"w": WALKER},
        whiteboard=board,
        types={"Mode": ["SAFE", "FAST"]},
        operators={"suspend": ["w"], "write": ["mode"]},
    )
    choices = lower(build_arrangement(document)).choices
    assert [(c.name, c.labels) for c in choices] == [
        ("operator.suspend(w)", ()), ("operator.write(mode)", ()), ("operator.value(mode)", ("SAFE", "FAST")),
    ]  # fmt: skip


def test_all_of_it_from_python() -> None:
    walker = lv.MachineDefinition("W", {"S": lv.StateDefinition(internal="n = n + 1;", stays=True)})
    model = lv.build(
        "m",
        {"a": lv.InstanceDefinition(walker, on_fault="unload"), "b": walker},
        whiteboard={"n": {"type": "0..3"}},
        pool=["b"],
        operators={"load": ["b"]},
        access={"levels": ["low", "high"], "users": {"alice": "high"}},
    ).wrapped
    assert model.processes[0].pool == ("b",) and model.processes[0].schedule == ("a", "b")
    assert [o.target for o in model.operators] == ["b"]
    assert model.machine("a").on_fault == "unload" and model.access is not None
