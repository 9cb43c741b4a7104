"""Requests of ports: every state is seen by a cycle, and follows the one before as plants have it."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from copy import deepcopy
from itertools import pairwise
from pathlib import Path
from random import Random

import pytest

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.requests import IDLE, STATES, Request, RequestKind
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.jsonvalue import Json
from llfsm_verify.runtime.live.frame import CYCLE
from llfsm_verify.runtime.ports.handshake import Handshake
from llfsm_verify.runtime.ports.port import AskingPort, PortSpec
from llfsm_verify.runtime.ports.ports import RunLink
from llfsm_verify.runtime.ports.process.port import ProcessPort
from llfsm_verify.values import Shown
from tests.cli.running import llfsm
from tests.runtime.live.runs import code_of
from tests.runtime.ports.bench import bench, declared
from tests.runtime.ports.picker import PICKER, picker, port

SERVICE = """requests:
  locate: {kind: service, ask: locate, state: locate_state, sends: {gain: gain}, answers: {fruits: list.0.count}}"""
ACTION = """values: {ABORTED: PREEMPTED}
requests:
  arm: {kind: action, ask: reach, state: arm_state, feedback: {distance: d}, answers: {fruits: fruits}}"""
WANTS = "{level: level, wants: wants}"
ANSWERS = """
log = open("log", "w", buffering=1)
for message in messages:
    print(json.dumps(message), file=log)
"""


def test_a_service_is_asked_and_answers_once(tmp_path: Path) -> None:
    program = (
        ANSWERS
        + """
    if "request" in message:
        number = message["request"]
        say(answer=number, values={"list": [{"count": 4}]})
        say(answer=number, values={"list": [{"count": 5}]})
        say(values={"wants": 0})
"""
    )
    hello = json.dumps({"hello": 1, "values": {"wants": 1}})
    text = port(tmp_path, program, SERVICE, hello=hello).replace("{level: level}", WANTS)
    with bench(*declared(text, tmp_path, picker()), code=picker()) as made:
        seen: list[object] = []
        while seen[-2:] != ["DONE", IDLE]:
            made.turn()
            seen += [made.value("locate_state")] if seen[-1:] != [made.value("locate_state")] else []
        assert seen == [IDLE, "WAITING", "DONE", IDLE] and made.value("fruits") == 4
        made.until(lambda: made.ports.counts["p"].malformed == 1)
        assert "has a number for which nothing waits: 1" in made.said[0]
        made.end("stopped")
    lines = [json.loads(line) for line in (tmp_path / "log").read_text().splitlines()]
    (request,) = [line for line in lines if "request" in line]
    assert request == {"request": 1, "name": "locate", "values": {"gain": 0}}


UNFIT = {
    "out of range": ('{"count": 10}', "is not a number from 0 to 9"),
    "a text": ('{"count": "many"}', "is not a number from 0 to 9"),
    "not a number": ('{"count": NaN}', "is not a number from 0 to 9"),
    "infinite": ('{"count": 1e400}', "is not a number from 0 to 9"),
    "long to compute": ('{"count": 1e999999999}', "is not a number from 0 to 9"),
    "over 64 bits": ('{"count": 18446744073709551616}', "is not a number from 0 to 9"),
    "nothing": ('{"count": null}', "a value is a word, a number"),
    "a mapping": ('{"count": {}}', "a value is a word, a number"),
    "missing": ("{}", "it has no `list.0.count`"),
    "another one is right": ('{"count": 3}, {"count": 11}', "is not a number from 0 to 9"),
}  # fmt: skip


@pytest.mark.parametrize("name", UNFIT)
def test_an_answer_that_does_not_fit_is_a_failure_and_nothing_of_it_counts(name: str, tmp_path: Path) -> None:
    values, why = UNFIT[name]
    program = f"""
for message in messages:
    if "request" in message:
        print('{{"answer": %d, "values": {{"list": [{values}]}}}}' % message["request"], flush=True)
"""
    keys = (
        SERVICE.replace("fruits: list.0.count}", "fruits: list.0.count, distance: list.1.count}")
        if "," in values
        else SERVICE
    )
    hello = json.dumps({"hello": 1, "values": {"wants": 1}})
    text = port(tmp_path, program, keys, hello=hello).replace("{level: level}", WANTS)
    with bench(*declared(text, tmp_path, picker()), code=picker()) as made:
        made.until(made.has("locate_state", "FAILED"))
        made.turn()
        assert (made.value("fruits"), made.value("distance"), made.value("locate_state")) == (0, 9, "FAILED")
        (said,) = made.said
        assert said.startswith("port p: an answer does not fit the request `locate`, so it is FAILED: ") and why in said
        assert made.ports.counts["p"].refused == 1


def test_a_port_that_is_closed_fails_its_requests_now_and_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As one of another package, which may raise anything."""
    hello = json.dumps({"hello": 1, "values": {"wants": 1}})
    text = port(tmp_path, ANSWERS, SERVICE, hello=hello).replace("{level: level}", WANTS)
    with bench(*declared(text, tmp_path, picker()), code=picker()) as made:
        made.until(made.has("locate_state", "WAITING"))
        monkeypatch.setattr(ProcessPort, "serve", lambda *_: 1 / 0)
        made.until(made.has("locate_state", "FAILED"))
        why = "port p: the port has failed: ZeroDivisionError: division by zero: "
        assert made.said == [f"{why}`level`, `wants` keep their last values", f"{why}the request `locate` FAILED"]
        for wants, state in ((0, IDLE), (1, "FAILED"), (0, IDLE)):
            made.board.posts.post({"wants": wants})
            made.until(made.has("locate_state", state))
        made.end("stopped")
        assert len(made.said) == 2 or "not written" in made.said[2]


def test_an_action_goes_through_its_states_with_feedback(tmp_path: Path) -> None:
    program = (
        ANSWERS
        + """
    if "request" in message:
        n = message["request"]
        say(state="ACTIVE", of=n, values={"d": 5}); say(state="ACTIVE", of=n, values={"d": 3}); say(values={"wants": 0})
    if "cancel" in message:
        say(answer=message["cancel"], state="ABORTED", values={"fruits": 2})
"""
    )
    hello = json.dumps({"hello": 1, "values": {"wants": 2}})
    text = port(tmp_path, program, ACTION, hello=hello).replace("{level: level}", WANTS)
    with bench(*declared(text, tmp_path, picker()), code=picker()) as made:
        seen: list[object] = []
        while seen[-2:] != ["PREEMPTED", IDLE]:
            made.turn()
            seen += [made.value("arm_state")] if seen[-1:] != [made.value("arm_state")] else []
        assert seen == [IDLE, "PENDING", "ACTIVE", "PREEMPTED", IDLE]
        assert (made.value("distance"), made.value("fruits")) == (3, 2) and made.said == []


def test_a_service_that_is_late_is_timed_out_and_its_answer_thrown_away(tmp_path: Path) -> None:
    program = (
        ANSWERS
        + """
    if "cancel" in message:
        say(answer=message["cancel"], values={"list": [{"count": 7}]}); say(values={"level": 4})
"""
    )
    keys = SERVICE.replace("locate_state,", "locate_state, timeout: 45ms,")
    hello = json.dumps({"hello": 1, "values": {"wants": 1}})
    text = port(tmp_path, program, keys, hello=hello).replace("{level: level}", WANTS)
    with bench(*declared(text, tmp_path, picker()), code=picker()) as made:
        made.until(made.has("locate_state", "WAITING"))
        asked = made.loop.frame[CYCLE]
        made.now = 5000.0  # which counts for nothing: it has five cycles of 10 ms since it was asked, a cycle before
        made.until(made.has("locate_state", "TIMED_OUT"))
        assert made.loop.frame[CYCLE] - asked == 5
        made.until(made.has("level", 4))
        made.turn()
        assert made.value("fruits") == 0 and made.said == [] and made.value("locate_state") == "TIMED_OUT"


def test_what_is_under_way_where_the_run_ends_is_cancelled(tmp_path: Path) -> None:
    hello = json.dumps({"hello": 1, "values": {"wants": 2}})
    text = port(tmp_path, ANSWERS, ACTION, hello=hello).replace("{level: level}", WANTS)
    with bench(*declared(text, tmp_path, picker()), code=picker()) as made:
        made.until(made.has("arm_state", "PENDING"))
        made.end("stopped")
    lines = [json.loads(line) for line in (tmp_path / "log").read_text().splitlines()]
    assert lines[-2:] == [{"cancel": 1}, {"end": "stopped"}]


def test_a_request_goes_on_when_a_machine_is_replaced(tmp_path: Path) -> None:
    """Whose variables may take more room, so that frames have all others elsewhere."""
    program = (
        ANSWERS
        + """
    if "request" in message: number = message["request"]
    if message.get("values", {}).get("doubled") == 4: say(answer=number, values={"list": [{"count": 4}]})
"""
    )
    document = deepcopy(PICKER)
    machine = document["machines"]["m"]["inline"]
    machine["variables"] = {"list": {"type": {"array": "int32", "size": 9}}}
    machine["states"][0]["internal"] += " list[level > 0 ? 1 : 0] = -1;"
    hello = json.dumps({"hello": 1, "values": {"wants": 1}})
    text = port(tmp_path, program, SERVICE, hello=hello).replace("{level: level}", WANTS)
    with bench(*declared(text, tmp_path, picker()), code=picker()) as made:
        made.until(made.has("locate_state", "WAITING"))
        made.swap(code_of(build_arrangement(document)))
        made.until(made.has("locate_state", "WAITING"))
        made.board.posts.post({"level": 2})
        made.until(made.has("locate_state", "DONE"))
        made.board.posts.post({"wants": 0})
        made.until(made.has("locate_state", IDLE))
        assert made.value("fruits") == 4 and made.said == []


def test_states_are_called_as_the_plant_calls_them(tmp_path: Path) -> None:
    program = (
        ANSWERS
        + """
    if "request" in message:
        say(state="ACTIVE", of=message["request"]); say(answer=message["request"], state="ABORTED", values={})
"""
    )
    hello = json.dumps({"hello": 1, "values": {"wants": 2}})
    text = port(tmp_path, program, "requests: {arm: {}}", hello=hello).replace("{level: level}", WANTS)
    plant = Request("arm", "action", "reach", "arm_state", values={"ABORTED": "PREEMPTED"})
    with bench(*declared(text, tmp_path, picker(), arm=plant), code=picker()) as made:
        made.until(made.has("arm_state", "PREEMPTED"))
        assert made.said == []


class Breaks(AskingPort):
    """A port of another package that fails when it is asked for the second time, and tells nothing."""

    every_frame = False

    def __init__(self) -> None:
        self.asked = 0

    def ask(self, number: int, name: str, values: Mapping[str, Shown]) -> None:
        self.asked += 1
        if self.asked == 2:
            raise RuntimeError("it is broken")

    def cancel(self, number: int) -> None:
        """It goes on."""


def test_what_a_closed_port_is_asked_fails() -> None:
    requests = (
        Request("locate", "service", "locate", "locate_state"),
        Request("arm", "action", "reach", "arm_state", values={"ABORTED": "PREEMPTED"}),
    )
    spec = PortSpec("p", lambda _: Breaks(), requests=requests)
    with bench(spec, code=picker()) as made:
        made.board.posts.post({"wants": 1})
        made.until(made.has("locate_state", "WAITING"))
        made.board.posts.post({"wants": 2})
        made.until(made.has("arm_state", "LOST"))
        why = "port p: the port has failed: RuntimeError: it is broken"
        assert made.said == [why, f"{why}: the request `arm` LOST"]
        made.board.posts.post({"wants": 1})
        made.until(made.has("locate_state", "FAILED"))
        made.end("stopped")


def test_requests_that_are_never_answered_push_out_none_that_is_under_way(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("llfsm_verify.runtime.ports.ports.MOST_UNANSWERED", 3)
    said: list[str] = []
    requests = (Request("locate", "service", "locate", "locate_state"), Request("arm", "action", "reach", "arm_state"))
    link = RunLink(PortSpec("p", lambda _: Breaks(), requests=requests), {}, 10, said.append, lambda: 0.0)
    service, action = link.handshakes
    action.number = link.number(action)
    for _ in range(5):
        service.number = link.number(service)
    for late in (4, 3, 2):
        link.report(late, "DONE", {}, end=True)
    assert not said and link.counts.malformed == 0
    link.report(action.number, "nonsense", {}, end=False)
    link.report(7, "DONE", {}, end=True)
    assert ["cannot have now" in said[0], "nothing waits: 7" in said[1]] == [True, True]


def test_a_goal_that_is_asked_again_before_its_end_is_cancelled_and_ends_first() -> None:
    """As its plant has it."""
    asked = Asked()
    handshake = Handshake(Request("r", "action", "ask", "state"), asked)
    handshake.begin()
    for ask, now in ((True, 0), (False, 1), (True, 2)):
        handshake.see(ask, shown=True, now=now)
    handshake.report("RECALLED", {}, 3, end=True)
    assert asked.posted == [IDLE, "PENDING", "RECALLED"] and asked.cancelled == [1]
    for ask, now in ((True, 4), (False, 5), (True, 6)):
        handshake.see(ask, shown=True, now=now)
    assert asked.posted[2:] == ["RECALLED", IDLE, "PENDING"] and asked.asked == [1, 2]


def test_a_service_that_is_asked_again_before_a_frame_shows_it_fails() -> None:
    """Its answer will not come: the child was told that it is not wanted."""
    asked = Asked()
    handshake = Handshake(Request("r", "service", "ask", "state"), asked)
    handshake.begin()
    handshake.see(True, shown=True, now=0)
    handshake.see(False, shown=False, now=1)
    handshake.see(True, shown=False, now=2)
    handshake.see(True, shown=True, now=3)
    assert asked.posted == [IDLE, "WAITING", "FAILED"] and asked.cancelled == [1]


def test_what_never_changes_may_be_said_again(tmp_path: Path) -> None:
    program = (
        ANSWERS
        + """
    say(values={"gain": 3}); say(values={"gain": 3, "level": 2})
    say(values={"gain": 4, "level": 3}); say(values={"gain": 4})
"""
    )
    hello = json.dumps({"hello": 1, "values": {"gain": 3}})
    text = port(tmp_path, program, "", hello=hello).replace("{level: level}", "{level: level, gain: gain}")
    with bench(*declared(text, tmp_path, picker()), code=picker()) as made:
        assert made.parameters == {"p": {"gain": 3}}
        made.until(made.has("level", 3))
        made.until(lambda: made.ports.counts["p"].refused == 2)
        assert made.said == ["port p: another value comes during the run for `gain`, which never changes"]


@pytest.mark.parametrize(("keys", "wants", "state", "end"), [
    (SERVICE, 1, "locate_state", "FAILED"), (ACTION, 2, "arm_state", "LOST"),
])  # fmt: skip
def test_a_child_that_dies_fails_its_requests(keys: str, wants: int, state: str, end: str, tmp_path: Path) -> None:
    hello = json.dumps({"hello": 1, "values": {"wants": wants}})
    program = 'for message in messages:\n    if "request" in message: os._exit(1)\n'
    text = port(tmp_path, program, f"{keys}\nrestart: false", hello=hello).replace("{level: level}", WANTS)
    with bench(*declared(text, tmp_path, picker()), code=picker()) as made:
        made.until(made.has(state, end))


# ---------------------------------------------------------------- against another description of the handshake

MOVES: dict[str, dict[str, set[str]]] = {
    "service": {"WAITING": {"DONE", "FAILED", "TIMED_OUT", IDLE}},
    "action": {
        "PENDING": {"ACTIVE", "RECALLED", "REJECTED", "LOST"},
        "ACTIVE": {"SUCCEEDED", "PREEMPTED", "ABORTED", "LOST"},
    },
}  # fmt: skip
"""As the page draws them; IDLE follows only what was seen to be not wanted any more."""


class Asked:
    """The run of a handshake: frames come late, and whoever answers says anything at any time."""

    def __init__(self) -> None:
        self.posted: list[str] = []
        self.asked: list[int] = []
        self.cancelled: list[int] = []
        self.shown: list[tuple[str, dict[str, Json]]] = []

    def show(self, request: Request, state: str, answers: Mapping[str, str], values: Mapping[str, Json]) -> None:
        self.shown.append((state, dict(values)))
        self.posted += [state] if self.posted[-1:] != [state] else []

    def number(self, handshake: Handshake) -> int:
        return len(self.asked) + 1

    def ask(self, request: Request, number: int) -> None:
        self.asked.append(number)

    def cancel(self, number: int) -> None:
        self.cancelled.append(number)


@pytest.mark.parametrize("kind", ["service", "action"])
@pytest.mark.parametrize("seed", range(60))
def test_random_orders_of_events_are_runs_of_the_plant(kind: RequestKind, seed: int) -> None:
    random, asked = Random(seed), Asked()
    handshake = Handshake(Request("r", kind, "ask", "state", timeout=random.choice([None, 3.0])), asked)
    handshake.begin()
    ask, frame, now, seen, had = False, IDLE, 0.0, False, False
    changes: list[tuple[str, str, bool]] = []
    for _ in range(300):
        before = len(asked.posted)
        match random.randrange(4):
            case 0:
                ask = random.random() < 0.6
                frame, seen = asked.posted[-1] if random.random() < 0.8 else frame, ask
                had = had or frame == handshake.state
                handshake.see(ask, shown=frame == handshake.state, now=now)
            case 1:
                now += random.random()
                handshake.look(now)
            case 2 if handshake.number:
                handshake.report(random.choice(STATES[kind]), {}, now, end=False)
            case 3 if handshake.number:
                end = random.choice([*STATES[kind], "", "nonsense"])
                handshake.report(end, {"fruits": 1}, now, end=True)
        new = asked.posted[before:]
        assert not new or (had and len(new) == 1), "a state that no cycle could see"
        had = had and not new
        changes += [(old, state, seen) for old, state in pairwise(asked.posted[before - 1 :])]
        assert len(asked.cancelled) == len(set(asked.cancelled)) and set(asked.cancelled) <= set(asked.asked)
    moves, first = MOVES[kind], "WAITING" if kind == "service" else "PENDING"
    for old, new_state, wanted in changes:
        if old == IDLE:
            assert (new_state, wanted) == (first, True)
        elif new_state == IDLE:
            assert not wanted and (old not in moves or kind == "service")
        else:
            assert new_state in moves[old], (old, new_state)
    assert len(changes) > 20


# ---------------------------------------------------------------- what is wrong in a file

PLANT = Request("locate", "service", "locate", "locate_state", answers={"fruits": "fruits"}, timeout=2.0)
TEXT = "ports: {p: {kind: process, run: [a], REST}}"
LOCATE = "requests: {locate: {kind: service, ask: locate, state: locate_state}}"
SENDS = LOCATE.replace("state}}", "state, sends: [now]}}")
FED = TEXT.replace("REST", f"inputs: [fruits], on_failure: stale, {LOCATE}")
ALONE = "inputs: {§fruits: a}, on_failure: stale"
WRONG = [
    (TEXT.replace("run: [a]", "run: §[]").replace("REST", LOCATE), "E493", "python3"),
    (TEXT.replace("run: [a]", "run: §a 'b").replace("REST", LOCATE), "E493", "python3"),
    (TEXT.replace("run: [a]", "run: §''").replace("REST", LOCATE), "E032", "value"),
    ("ports: {p: §{kind: process, outputs: [now]}}", "E034", "run"),
    (TEXT.replace("REST", "patience: §soon, outputs: [now]"), "E493", "500ms"),
    (TEXT.replace("REST", "restart: §never, outputs: [now]"), "E035", "true"),
    (TEXT.replace("REST", "clock: §outside, outputs: [now]"), "E035", "external"),
    (TEXT.replace("REST", "outputs: [now], values: {Go: §STRAT}"), "E493", "START"),
    (TEXT.replace("REST", "outputs: [now], values: §[Go]"), "E030", "key: value"),
    (TEXT.replace("REST", "outputs: [now], values: {Go: START, §Begin: START}"), "E494", "leave out one"),
    (TEXT.replace("REST", "outputs: [now], values: {§PAUSE: START}"), "E494", "no value of an output"),
    (TEXT.replace("REST", "outputs: [doubled], values: {§7: 5}"), "E494", "no value of an output"),
    (TEXT.replace("REST", f"{SENDS}, values: {{a: NONE, §b: NONE}}"), "E494", "one"),
    (TEXT.replace("REST", "outputs: [now], when: §nwo"), "E493", "now"),
    (TEXT.replace("REST", "inputs: [start], on_failure: stale, when: §now"), "E493", "leave out"),
    (TEXT.replace("REST", "inputs: [start], on_failure: stale, events: {§level: 0}"), "E493", "start"),
    (TEXT.replace("REST", "inputs: [start], on_failure: stale, events: {start: §STOP}"), "E493", "type"),
    (TEXT.replace("REST", "inputs: [gain], on_failure: stale, events: {§gain: 1}"), "E493", "under `inputs`"),
    (TEXT.replace("REST", "outputs: {now: a, starts: §a.b}"), "E494", "not both"),
    ("ports: {p: {kind: stream, read: a, inputs: §[gain], on_failure: stale}}", "E527", "--set gain"),
    ("ports: {p: {kind: stream, write: a, outputs: [now], §requests: {}}}", "E033", "known keys"),
    (TEXT.replace("REST", "requests: {§arm: {ask: reach, state: arm_state}}"), "E034", "environment"),
    (TEXT.replace("REST", "requests: {§arm: {kind: action, state: arm_state}}"), "E034", "ask"),
    (TEXT.replace("REST", LOCATE.replace("service", "§servce")), "E035", "service"),
    (TEXT.replace("REST", LOCATE.replace("ask: locate", "ask: §lcate")), "E493", "locate"),
    (TEXT.replace("REST", LOCATE.replace("ask: locate", "ask: §starts")), "E526", "bool"),
    (TEXT.replace("REST", LOCATE.replace("locate_state", "§arm_state")), "E526", "add it"),
    (TEXT.replace("REST", LOCATE.replace("locate_state", "§gain")), "E493", "states"),
    (TEXT.replace("REST", LOCATE.replace("state}", "state, answers: §[gain]}")), "E526", "under `inputs`"),
    (TEXT.replace("REST", f"values: {{IDLE: DONE}}, {LOCATE}").replace("state: l", "state: §l"), "E526", "WAITING"),
    (TEXT.replace("REST", f"values: {{FAILED: WAITING}}, {LOCATE}").replace("state: l", "state: §l"), "E526", "ends"),
    (TEXT.replace("REST", LOCATE.replace("state}", "state, feedback: §{fruits: a}}")), "E526", "leave it out"),
    (TEXT.replace("REST", "requests: {arm: {kind: action, ask: reach, state: §arm_state}}"), "E526", "ABORTED"),
    (TEXT.replace("REST", LOCATE.replace("state}", "state, answers: {§friuts: a}}")), "E493", "fruits"),
    (FED.replace("state}", "state, answers: [§fruits]}"), "E494", "remove"),
    (TEXT.replace("REST", "requests: {locate: {ask: §reach}}"), "E526", "plant says"),
    (TEXT.replace("REST", "requests: {locate: {timeout: §3s}}"), "E526", "the same"),
    (TEXT.replace("REST", "requests: {locate: {answers: §{level: a}}}"), "E526", "`answers` of the plant"),
    (TEXT.replace("REST", "requests: {locate: {§servce: a}}"), "E033", "known keys"),
    (TEXT.replace("REST", "values: {FAILED: TIMED_OUT}, requests: {§locate: {}}"), "E526", "the plant says"),
    (TEXT.replace("REST", "requests: §{}"), "E034", "name some"),
    (TEXT.replace("REST", "clock: external, outputs: [now], on_failure: §stop"), "E493", "restart: false"),
    (TEXT.replace("REST", f"{ALONE}, requests: {{locate: {{}}}}"), "E526", "under `answers` of the request `locate`"),
    (TEXT.replace("REST", ALONE), "E526", "under `answers` of the request `locate`"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "code", "hint"), WRONG)
def test_what_is_wrong_is_said_at_its_place(text: str, code: str, hint: str, tmp_path: Path) -> None:
    plants = {} if "kind: service" in text or "kind: §" in text else {"locate": PLANT}
    with pytest.raises(DiagnosticError) as caught:
        declared(text.replace("§", ""), tmp_path, picker(), **plants)
    place = Source("x", text.replace("§", "")).position(text.index("§"))
    found = [(d.code, d.span and (d.span.line, d.span.column)) for d in caught.value.diagnostics]
    assert found == [(code, place)], caught.value
    assert hint in (caught.value.diagnostics[0].hint or ""), caught.value.diagnostics[0].hint


def test_a_plant_describes_a_request(tmp_path: Path) -> None:
    text = TEXT.replace("REST", "requests: {locate: {answers: {fruits: list.count}, sends: [now]}}")
    (spec,) = declared(text, tmp_path, picker(), locate=PLANT)
    assert spec.requests == (
        Request(
            "locate",
            "service",
            "locate",
            "locate_state",
            {"now": "now"},
            {"fruits": "list.count"},
            timeout=2.0,
        ),
    )
    assert spec.fed == {"locate_state", "fruits"}


def test_who_has_the_state_may_keep_the_order_of_events_by_itself(tmp_path: Path) -> None:
    text = TEXT.replace("REST", "inputs: [locate_state, fruits], outputs: [locate], on_failure: stale")
    (spec,) = declared(text, tmp_path, picker(), locate=PLANT)
    assert spec.fed == {"locate_state", "fruits"}


OTHER_SIDE = """
import json, os, random, select, sys
rng, asked, said, greeted = random.Random(int(sys.argv[1])), {}, 0, False
def say(**message): print(json.dumps(message), flush=True)
def heard(rest=b""):
    while True:
        if select.select([0], [], [], 0.002)[0]:
            data = os.read(0, 1 << 16)
            if not data: return
            *lines, rest = (rest + data).split(b"\\n")
            yield from map(json.loads, lines)
        yield {}
for message in heard():
    if "hello" in message: greeted = say(hello=1) is None
    if not greeted: continue
    if "request" in message: asked[message["request"]] = [message["name"], "PENDING"]
    if "cancel" in message and message["cancel"] in asked:
        name, state = asked[message["cancel"]]
        if name == "locate": del asked[message["cancel"]]
        else: asked[message["cancel"]][1] = "CANCELLED"
    for number, (name, state) in list(asked.items()):
        if rng.random() < 0.5: continue
        said += 1
        if name == "arm" and state == "PENDING" and rng.random() < 0.7:
            say(state="ACTIVE", of=number, values={})
            asked[number][1] = "ACTIVE"
            continue
        ends = ["DONE", "FAILED"] if name == "locate" else ["SUCCEEDED", "ABORTED", "PREEMPTED", "REJECTED", "nonsense"]
        say(answer=number, state=rng.choice(ends), values={"fruit_list": {"count": rng.randrange(4)}})
        say(answer=number, state=rng.choice(ends), values={"fruit_list": {"count": rng.randrange(4)}})
        del asked[number]
    say(values={"halt": rng.random() < 0.3})
    if said > 60: sys.exit()
"""


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_a_recorded_run_keeps_to_the_plants_of_its_requests(seed: int, tmp_path: Path) -> None:
    """Whatever the other side does, and whenever: the port does what the plant of the same name may do."""
    text = Path("tests/arrangement/requests/picking.yaml").read_text(encoding="utf-8")
    for limit in (", timeout: 1s", ", timeout: 2s"):  # which a busy machine would exceed
        text = text.replace(limit, "")
    (tmp_path / "a.yaml").write_text(text)
    (tmp_path / "other.py").write_text(OTHER_SIDE)
    (tmp_path / "a.ports.yaml").write_text(
        f"ports:\n  robot:\n    kind: process\n    run: [{json.dumps(sys.executable)}, other.py, '{seed}']\n"
        "    inputs: [halt]\n    outputs: [arm_state, locate_state, robot, grip]\n    on_failure: stop\n"
        "    requests:\n      locate: {answers: {fruits: fruit_list.count}}\n      arm: {}\n"
    )
    record = str(tmp_path / "run.rec")
    words = ["run", str(tmp_path / "a.yaml"), "--ports", str(tmp_path / "a.ports.yaml"), "--rate", "50"]
    done = llfsm(*words, "--record", record)
    assert done.returncode == 1 and "it has ended with code 0: `halt` failed" in done.stdout, done.stderr
    checked = llfsm("check-recording", record)
    assert checked.returncode == 0, checked.stdout + checked.stderr
    assert "satisfied  the run keeps to `locate`, `arm`" in checked.stdout


CLOCKED = """
import json, random, sys
rng, asked, cycle = random.Random(int(sys.argv[1])), {}, 0
def say(**message): print(json.dumps(message), flush=True)
log = open("log", "w", buffering=1)
for line in sys.stdin:
    message = json.loads(line)
    if "hello" in message: say(hello=1)
    if "request" in message and rng.random() < 0.6: asked[message["request"]] = message["name"]
    if "time" in message:
        print(message["values"]["locate_state"], message["values"]["arm_state"], file=log)
        cycle = message["cycle"] + 1
    if "hello" in message or "cycle" in message:
        for number, name in list(asked.items()):
            if rng.random() < 0.05:
                end = rng.choice(["DONE", "FAILED"] if name == "locate" else ["SUCCEEDED", "ABORTED", "LOST"])
                say(answer=number, state=end, values={"fruit_list": {"count": rng.randrange(4)}})
                del asked[number]
        say(cycle=cycle, values={"halt": rng.random() < 0.02})
"""


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_with_an_external_clock_time_outs_are_those_of_the_plants(seed: int, tmp_path: Path) -> None:
    """Whatever time it takes: both count cycles."""
    (tmp_path / "a.yaml").write_text(Path("tests/arrangement/requests/picking.yaml").read_text(encoding="utf-8"))
    (tmp_path / "other.py").write_text(CLOCKED)
    (tmp_path / "a.ports.yaml").write_text(
        f"ports:\n  robot:\n    kind: process\n    run: [{json.dumps(sys.executable)}, other.py, '{seed}']\n"
        "    clock: external\n    inputs: [halt]\n    outputs: [arm_state, locate_state, robot, grip]\n"
        "    on_failure: stop\n    requests:\n      locate: {answers: {fruits: fruit_list.count}}\n      arm: {}\n"
    )
    record = str(tmp_path / "run.rec")
    words = ["run", str(tmp_path / "a.yaml"), "--ports", str(tmp_path / "a.ports.yaml"), "--for", "120s"]
    done = llfsm(*words, "--record", record)
    assert done.returncode == 0, done.stdout + done.stderr
    checked = llfsm("check-recording", record)
    assert checked.returncode == 0, checked.stdout + checked.stderr
    assert "satisfied  the run keeps to `locate`, `arm`" in checked.stdout
    seen = set((tmp_path / "log").read_text().split())
    assert {"WAITING", "DONE", "FAILED", "TIMED_OUT", "ACTIVE", "LOST"} <= seen, seen
