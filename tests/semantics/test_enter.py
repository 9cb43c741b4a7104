"""Operators that let a machine enter a state, by hand and against `restart`. Random ones: see the lockstep."""

from __future__ import annotations

from itertools import islice

import pytest
from hypothesis import HealthCheck, settings

from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.backends.reference import Interpreter, Outcome
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.semantics.vocabulary import RESTART
from llfsm_verify.testing.arrangements import Document, arrangements
from tests.oracle.direct import Direct
from tests.oracle.lockstep import Lockstep, same_words
from tests.quick import examples, spread
from tests.semantics.test_pools import arrangement, fail, hold

BOARD = {"left": {"type": "0..3"}, "came": {"type": "0..3"}, "go": {"type": "bool", "role": "input"}}
STATES: list[Document] = [
    {"name": "WAIT", "transitions": [{"when": "go", "to": "MOVE"}]},
    {
        "name": "MOVE", "on_entry": "came = min(came + 1, 3);", "on_exit": "left = min(left + 1, 3);",
        "on_suspend": "left = 3;", "transitions": [{"when": "false", "to": "STOP"}],
    },
    {"name": "STOP", "transitions": [{"when": "after_ms(20)", "to": "WAIT"}]},
    {"name": "ASIDE", "on_resume": "left = 2;", "transitions": [{"when": "false", "to": "ASIDE"}]},
]  # fmt: skip
ARM = {"inline": {"machine": "Arm", "suspend": "ASIDE", "states": STATES}}
OTHER = {"inline": {"machine": "Other", "states": [{"name": "S", "stays": True}]}}


def operated(machines: Document | None = None, **operators: list[str]) -> Document:
    return arrangement(
        machines or {"arm": ARM, "other": OTHER}, whiteboard=BOARD, cycle_ms=10, observe="cycle", operators=operators
    )


@pytest.mark.long
def test_it_comes_from_any_state_into_any_state_without_leaving_actions() -> None:
    document = operated(enter=["arm"])
    hold(
        document, "G left == 0", "G (rose(arm.entered(MOVE)) -> came > 0)",
        "G (fell(arm@STOP) -> arm.ran)", "G !arm.finished",
    )  # fmt: skip
    fail(
        document, "G (arm@WAIT -> X (arm@WAIT || arm@MOVE))", "G !(arm@MOVE && X arm@STOP)", "G !arm.suspended",
        "G !(arm@ASIDE && X arm@STOP)", "G came < 3", "G (arm@STOP -> F !arm@STOP)",
    )  # fmt: skip
    hold(operated(), "G (arm@MOVE -> X arm@MOVE)", "G !arm@STOP")


@pytest.mark.long
def test_it_goes_with_the_other_commands_as_restart_does() -> None:
    """A suspended machine is not resumed by it, and one that it has put aside is: to the initial state."""
    document = operated(enter=["arm"], resume=["arm"])
    hold(document, "G (rose(left == 2) -> arm@{WAIT, MOVE})")
    fail(document, "G left == 0", "G !(arm@ASIDE && X (arm@WAIT && left == 2))")
    hold(operated(enter=["arm"], suspend=["arm"]), "G left != 2")
    fail(operated(enter=["arm"], suspend=["arm"]), "G left != 3")
    # Entered, the suspend state leaves what the last suspend command has remembered.
    remembered = "G !(arm@WAIT && X (arm@ASIDE && X (arm.entered(MOVE) && rose(left == 2))))"
    fail(operated(enter=["arm"], suspend=["arm"], resume=["arm"]), remembered)


def test_the_clock_of_the_state_begins_anew() -> None:
    document = operated(enter=["arm"])
    hold(document, "G (!arm@STOP -> X !arm.fired(STOP, 0) && X X !arm.fired(STOP, 0) && X X X !arm.fired(STOP, 0))")
    fail(document, "G !arm.fired(STOP, 0)")
    lowered = lower(build_arrangement(document), keep_all_bits=True)
    assert [(c.name, c.labels) for c in lowered.choices if c.name.startswith("operator.")] == [
        ("operator.enter(arm)", ()), ("operator.state(arm)", ("WAIT", "MOVE", "STOP", "ASIDE")),
    ]  # fmt: skip
    pending = next(v for v in lowered.vars if v.name == "arm.$pending")
    assert pending.origin.labels[3:] == ("restart", "enter WAIT", "enter MOVE", "enter STOP", "enter ASIDE")


@pytest.mark.slow
def test_a_machine_that_has_left_or_is_not_loaded_enters_nothing() -> None:
    ending: Document = {"inline": {"machine": "Once", "states": [{"name": "A"}, {"name": "B", "stays": True}]}}
    machines = {"other": OTHER, "once": ending}
    hold(operated(machines, enter=["once"]), "G (once.finished -> G once@A)")
    fail(operated(machines, enter=["once"]), "F once.finished", "G once@A")
    kept = operated(machines, enter=["once"]) | {"finished": "keep"}
    fail(kept, "G (once.finished -> G once@A)")
    pool = operated(machines, enter=["once"]) | {"schedule": ["other"], "pool": ["once"]}
    hold(pool, "G !once.loaded && G !once@B")


WORKER: Document = {"inline": {"machine": "Worker", "states": [STATES[0], {"name": "MOVE", "stays": True}]}}
OWNER: Document = {
    "inline": {
        "machine": "Owner",
        "states": [
            {"name": "RUN", "runs": ["w"], "transitions": [{"when": "false", "to": "REST"}]},
            {"name": "REST", "transitions": [{"when": "false", "to": "RUN"}]},
        ],
    }
}


@pytest.mark.slow
@pytest.mark.parametrize("commands", ["next_turn", "end_of_ringlet"])
@pytest.mark.parametrize(
    "operators",
    [
        {"enter": ["arm"], "resume": ["arm"]}, {"suspend": ["arm"], "enter": ["arm"]},
        {"enter": ["w"], "suspend": ["o"], "resume": ["o"]}, {"suspend": ["o"], "enter": ["w"], "resume": ["w"]},
    ],
)  # fmt: skip
def test_commands_that_come_together(operators: dict[str, list[str]], commands: str) -> None:
    """In the order in which they are declared: each step of small arrangements as the page says."""
    machines = {"arm": ARM, "other": OTHER} if "arm" in str(operators) else {"o": OWNER, "w": WORKER}
    profile = {"base": "llfsm", "commands": commands}
    model = build_arrangement(operated(machines, **operators) | {"profile": profile, "observe": "ringlet"})
    full = lower(model, keep_all_bits=True)
    Lockstep(model, full, Direct(model, {})).walk(100)
    same_words(full, lower(model), 100)


@pytest.mark.slow
@pytest.mark.parametrize("commands", ["next_turn", "end_of_ringlet"])
@pytest.mark.parametrize("kind", ["enter", "restart", "suspend"])
def test_an_owner_takes_what_runs_inside_with_it(kind: str, commands: str) -> None:
    """Also where the machine that begins the cycle has nothing to do with it."""
    document = operated({"x": OTHER, "o": OWNER, "w": WORKER}, **{kind: ["o"]})
    document |= {"profile": {"base": "llfsm", "commands": commands}}
    if kind == "enter":
        hold(document, "G (o@REST -> w.suspended)", "G (o@RUN -> F (!w.suspended || o@REST))")
    model = build_arrangement(document | {"observe": "ringlet"})
    full = lower(model, keep_all_bits=True)
    assert Lockstep(model, full, Direct(model, {})).walk(300).configurations > 15
    assert same_words(full, lower(model), 300) > 10


def same_as_restart(document: Document) -> None:
    """`enter` with the initial state is `restart`: two programs step side by side, for one machine of a document."""
    machines = document["machines"]
    assert isinstance(machines, dict)
    name = max(machines)
    one, other = (build_arrangement({**document, "operators": {kind: [name]}}) for kind in ("restart", "enter"))
    restart, enter = lower(one, keep_all_bits=True), lower(other, keep_all_bits=True)
    layouts = Layout.of(restart), Layout.of(enter)
    initial = one.machine(name).initial
    pairs = [tuple((u.decode(u.first()), u.initial_outputs()) for u in layouts)]
    for before, beside in pairs:
        for process, outcome in islice(Interpreter(restart).successors(*before), 30):
            given = {n.replace("operator.restart", "operator.enter"): value for n, value in outcome.samples}
            given[f"operator.state({name})"] = initial
            reply = Interpreter(enter).step(*beside, process, lambda choice: given[choice.name])  # noqa: B023
            assert _told(outcome, name) == _told(reply, name)
            if len(pairs) < 12 and outcome.fault is None and not outcome.overflow:
                pairs.append(((outcome.values, outcome.outputs), (reply.values, reply.outputs)))


def _told(outcome: Outcome, name: str) -> object:
    """What came of a step, with the slot and the event of `enter` as those of `restart`."""
    waits = f"{name}.$pending"
    values = {k: min(v, RESTART) if k == waits and isinstance(v, int) else v for k, v in outcome.values.items()}
    outputs = {k: min(v, RESTART) if k == waits and isinstance(v, int) else v for k, v in outcome.outputs.items()}
    events = [("restart", machine, told[:1]) if kind == "enter" else (kind, machine, told)
              for kind, machine, told in outcome.events]  # fmt: skip
    return values, outputs, events, outcome.fault, outcome.overflow


@pytest.mark.slow
def test_to_enter_the_initial_state_is_to_restart() -> None:
    quiet = list(HealthCheck)
    spread(
        same_as_restart,
        settings(max_examples=examples(60), deadline=None, suppress_health_check=quiet),
        arrangements(),
    )
