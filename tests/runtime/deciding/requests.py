"""A client, a port and what it asks, as a few lines of Python that know nothing of plants: the runs that there may be.

The client asks as it likes. The port looks at times, and then makes a move if the last one has been in a frame; the
child answers late, fails, or is lost; what it says after an end comes to nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from random import Random
from typing import Literal, NamedTuple

from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.arrangement.requests import STATES, Request
from llfsm_verify.runtime.live.plan import runnable
from llfsm_verify.runtime.ports.handshake import Handshake

Kind = Literal["service", "action"]
FIRST = {"service": "WAITING", "action": "PENDING"}
RUNNING = ("WAITING", "PENDING", "ACTIVE")


class Row(NamedTuple):
    """A cycle: what the client makes of `ask` in it, and the inputs that it has."""

    ask: bool
    state: str
    answer: int
    feedback: bool


def client(kind: Kind, **keys: object) -> Arrangement:
    """A machine that asks when a free input says so, with the plant of its request."""
    plant = {"use": kind, "ask": "ask", "state": "state", "answers": ["answer"], **keys}
    return build_arrangement({
        "cycle_ms": 100,
        "types": {"State": list(STATES[kind])},
        "whiteboard": {
            "want": {"type": "bool", "role": "input", "changes": "cycle"},
            "ask": {"type": "bool", "role": "output"},
            "state": {"type": "State", "role": "input"},
            "answer": {"type": "0..2", "role": "input"},
            "near": {"type": "bool", "role": "input"},
        },
        "machines": {
            "client": {"inline": {"machine": "C", "states": [{"name": "A", "internal": "ask = want;", "stays": True}]}},
            "idle": {"inline": {"machine": "I", "states": [{"name": "A", "stays": True}]}},
        },
        "environment": {"p": plant if kind == "service" else {**plant, "feedback": ["near"]}},
        "schedule": ["client", "idle"],
    })  # fmt: skip


def world(arrangement: Arrangement) -> Arrangement:
    """As it runs without its plants."""
    return runnable(arrangement, simulated=False)


def moves_of(row: Row, kind: Kind) -> list[Mapping[str, int]]:
    """The recorded choices of the two ringlets of a cycle."""
    state = STATES[kind].index(row.state)
    near = {"near": int(row.feedback)}
    return [{"want": int(row.ask), "state": state, "answer": row.answer, **near}] * 2


def asks(rng: Random, ask: bool, state: str, wild: bool) -> bool:
    """Whether the client asks now: as the handshake has it, or `wild`."""
    if wild:
        return ask != (rng.random() < 0.3)
    if not ask:
        return state == "IDLE" and rng.random() < 0.7
    return state in ("IDLE", *RUNNING)


def script(rng: Random, kind: Kind) -> list[str]:
    """What a child says of one request, in this order; nothing: its answer is lost."""
    if rng.random() < 0.15:
        return []
    if kind == "service":
        return [rng.choice(["DONE", "FAILED"])]
    if rng.random() < 0.4:
        return [rng.choice(["REJECTED", "RECALLED", "LOST"])]
    return ["ACTIVE", *rng.choices(["SUCCEEDED", "PREEMPTED", "ABORTED", "LOST"], k=rng.random() < 0.9)]


def runs(rng: Random, kind: Kind, cycles: int, *, prompt: int | None = None) -> Iterator[Row]:
    """A run. `prompt`: the port looks in every cycle, and times out after so many."""
    wild, ask, state, answer, near = rng.random() < 0.5, False, "IDLE", 0, False
    posted, saw, settled, waited = "IDLE", False, True, 0
    to_come: list[str] = []
    heard: list[str] = []
    for _ in range(cycles):
        if prompt is not None or rng.random() < 0.6:
            saw, settled = ask, settled or state == posted
        if to_come and rng.random() < 0.4:
            heard.append(to_come.pop(0))
        waited += posted in RUNNING
        if waited == prompt if prompt is not None else rng.random() < 0.02:
            to_come, heard = [], ["TIMED_OUT" if kind == "service" else "LOST"]
        before, running = posted, posted in RUNNING
        if settled and (prompt is not None or rng.random() < 0.7):
            if posted == "IDLE" and saw:
                posted, to_come, heard, waited = FIRST[kind], script(rng, kind), [], 0
            elif running and kind == "service" and not saw:
                posted = "IDLE"
            elif running and heard:
                posted = heard.pop(0)
                answered = posted not in (*RUNNING, "TIMED_OUT") and rng.random() < 0.7
                answer = rng.randrange(3) if answered else answer
            elif posted != "IDLE" and not running and not saw:
                posted = "IDLE"
        settled = settled and posted == before
        if kind == "action" and (running or posted in RUNNING):
            near = rng.random() < 0.5
        state = posted
        ask = asks(rng, ask, state, wild)
        yield Row(ask, state, answer, near)


class Inputs:
    """What a handshake of a real port does, with the inputs of the run in the place of posts."""

    def __init__(self) -> None:
        self.shown: dict[str, object] = {"state": "IDLE", "answer": 0, "near": False}
        self.asked = 0
        self.under_way = 0

    def show(self, request: Request, state: str, answers: Mapping[str, str], values: Mapping[str, object]) -> None:
        self.shown |= {"state": state, **{name: values[name] for name in answers if name in values}}

    def number(self, handshake: Handshake) -> int:
        self.asked += 1
        return self.asked

    def ask(self, request: Request, number: int) -> None:
        self.under_way = number

    def cancel(self, number: int) -> None:
        """The child may ignore it."""


def port_runs(rng: Random, kind: Kind, cycles: int) -> Iterator[Row]:
    """The same with the handshake of our ports, in the middle of a child and a client at random; a cycle is 1 s."""
    feedback = {"near": "near"} if kind == "action" else {}
    timeout = rng.choice([None, 3.0, 8.0])
    request = Request("p", kind, "ask", "state", answers={"answer": "answer"}, feedback=feedback, timeout=timeout)
    inputs, wild, ask = Inputs(), rng.random() < 0.5, False
    port = Handshake(request, inputs)
    port.begin()
    row = Row(False, "IDLE", 0, False)
    known, to_come = 0, []
    for cycle in range(cycles):
        for part in range(rng.randrange(4)):
            now = cycle + part / 4
            if rng.random() < 0.6:
                port.see(row.ask, shown=row.state == port.state, now=now)
            port.look(now)
            if inputs.under_way != known:
                known, to_come = inputs.under_way, script(rng, kind)
            if port.number and port.number == known and to_come and rng.random() < 0.3:
                said = to_come.pop(0)
                end = said != "ACTIVE"
                port.report(said, {"answer": rng.randrange(3)} if end else {"near": True}, now, end=end)
            elif kind == "action" and port.number and rng.random() < 0.2:
                port.report(port._last, {"near": rng.random() < 0.5}, now, end=False)
        shown = inputs.shown
        ask = asks(rng, ask, str(shown["state"]), wild)
        row = Row(ask, str(shown["state"]), int(str(shown["answer"])), bool(shown["near"]))
        yield row
