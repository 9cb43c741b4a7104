"""Machines are executed as their transition files say, whatever states do, and stale answers never count."""

from __future__ import annotations

import csv
import enum
import io
import itertools
import os
import random
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Self

import pytest
import yaml

from llfsm_verify import Whiteboard, load
from llfsm_verify.extensions.crops import Data, DataTypeError, LeftState, SimpleActionState, State, StateMachine
from tests.cli.running import llfsm
from tests.extensions.crops.thesis import FIXED, TRANSITION_FILE, Scripted, machine

ODD = "unheard of"
RATE = 20
"""Cycles of half a millisecond: no test depends on how long one takes."""


class Logged(State):
    """Gives random outcomes, and keeps what they come to; ODD is one that it does not have."""

    def __init__(self, label: str, outcomes: tuple[str, ...], seed: int, log: list[tuple[str, str]]) -> None:
        self.label, self.log, self.drawn = label, log, outcomes
        self.outcomes = tuple(outcome for outcome in outcomes if outcome != ODD)
        self.random = random.Random(f"{label} {seed}")
        self.inside = threading.Lock()
        self.twice = False

    def draw(self) -> str:
        return self.random.choice(self.drawn)

    def execute(self, data: Data) -> str:
        self.twice = self.twice or not self.inside.acquire(blocking=False)
        outcome = self.draw()
        time.sleep(0.002 * (len(self.log) % 3 == 0))  # some cycles, in which the last answer still stands there
        self.log.append((self.label, "failed" if outcome == ODD else outcome))
        self.inside.release()
        if outcome == "failed":
            raise ZeroDivisionError
        return outcome


def random_file(seed: int) -> str:
    """A file of up to six states; every one may lead to an end."""
    draw = random.Random(seed)
    labels = [f"state {i}" if draw.random() < 0.5 else f"S{i}" for i in range(draw.randint(1, 6))]
    stages = []
    for label in labels:
        outcomes = draw.sample(["done", "no fruit", "Done", "moving on", "x-y", "a: 1", "failed"], draw.randint(1, 5))
        moves = {outcome: draw.choice([*labels, *labels, label]) for outcome in outcomes}
        moves["leave"] = draw.choice(["Exit", "Out of order"])
        stages.append({"state": {"state_label": label, "descriptive_name": f"({label})", "transitions": moves}})
    return yaml.safe_dump(stages, sort_keys=False)


def reference(text: str, give: dict[str, Callable[[], str]]) -> tuple[str, list[tuple[str, str]]]:
    """What a transition file means: the final outcome, and which state gave which outcome."""
    table, history = tables(text), []
    label = next(iter(table))
    while label in table:
        outcome = give[label]()
        outcome = "failed" if outcome == ODD else outcome
        history.append((label, outcome))
        label = table[label].get(outcome, outcome)
    return label, history


def tables(text: str) -> dict[str, dict[str, str]]:
    """The transitions of a file, by labels."""
    return {stage["state"]["state_label"]: stage["state"]["transitions"] for stage in yaml.safe_load(text)}


def counted(recording: Path, sm: StateMachine, text: str) -> list[tuple[str, str]]:
    """Which state gave which outcome, as far as that counted: the moments of a recording at which a ticket of a state
    was answered, and the machine went where that leads."""
    done = llfsm("trace", str(recording), "--to", "csv")
    assert done.returncode == 0, done.stderr
    table, found = tables(text), []
    labels = {name: label for label, name in sm._transitions.states.items()}
    outcomes = {name: outcome for outcome, name in sm.values.items()}
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    for before, after in itertools.pairwise(rows):
        label, ticket = labels.get(before["sm"]), int(before["sm.ticket"])
        if label not in table:
            continue
        number, size = list(table).index(label), len(table) + 1
        due = ticket if ticket % size == number else (ticket // size + 1) % 8 * size + number
        outcome = outcomes.get(after["outcome"], "")
        if int(after["answers"]) == due and labels.get(after["sm"]) == table[label].get(outcome, outcome):
            found.append((label, outcome))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_a_random_machine_does_what_its_file_means(seed: int, tmp_path: Path, caplog) -> None:
    text, recording = random_file(seed), tmp_path / "run.rec"
    log: list[tuple[str, str]] = []

    def states() -> dict[str, Logged]:
        return {label: Logged(label, (*moves, "failed", ODD), seed, log) for label, moves in tables(text).items()}

    meant = reference(text, {label: state.draw for label, state in states().items()})
    sm = machine(tmp_path, states(), text, ("Exit", "Out of order"))
    caplog.set_level("ERROR", "llfsm_verify.crops")
    end = sm.execute(rate=RATE, record=recording, properties=[f"end: G !sm@{sm._transitions.states[meant[0]]}"])
    assert (end, log) == meant
    assert counted(recording, sm, text) == log
    assert sm.report is not None and sm.report.ending == "ended"
    assert sm.report.monitored[0][1] == "violated"
    assert caplog.messages.count("the property `end` is violated") == 1
    assert llfsm("replay", str(recording)).returncode == 0
    assert llfsm("check-recording", str(recording), "-p", "G !sm@Paused").returncode in (0, 4)


class Gate(State):
    """Waits in its first execution until it is let go, and then gives its first outcome; later ones give the second."""

    def __init__(self, first: str, second: str) -> None:
        self.outcomes = (first, second)
        self.inside, self.go, self.gone, self.cancelled = (threading.Event() for _ in range(4))
        self.executed = 0
        self.stored: Exception | None = None

    def execute(self, data: Data) -> str:
        self.executed += 1
        if self.executed > 1:
            return self.outcomes[1]
        self.inside.set()
        assert self.go.wait(60)
        try:
            data["stored"] = True
        except LeftState as error:
            self.stored = error
        self.gone.set()
        return self.outcomes[0]

    def cancel(self) -> None:
        self.cancelled.set()


GATE = """\
- state:
    state_label: Gate
    descriptive_name: Waiting
    transitions: {early: Wrong, late: Right}
"""


class Executed:
    """`execute` on a thread, and its outcome at the end of the block."""

    def __init__(self, sm: StateMachine, **options) -> None:
        self.outcome: str | None = None
        self._thread = threading.Thread(target=self._run, args=(sm, options))

    def _run(self, sm: StateMachine, options) -> None:
        self.outcome = sm.execute(**options)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._thread.join(60)
        assert not self._thread.is_alive()


def test_what_is_answered_in_a_pause_never_counts(tmp_path: Path) -> None:
    gate = Gate("early", "late")
    sm = machine(tmp_path, {"Gate": gate}, GATE, ("Right", "Wrong"))
    with Executed(sm, rate=RATE) as done:
        assert gate.inside.wait(60)
        assert sm.current == ("Gate", "Waiting")
        sm.pause()
        assert sm.current is None
        assert gate.cancelled.wait(60)
        gate.go.set()
        assert gate.gone.wait(60)
        assert gate.executed == 1
        sm.pause()  # it is paused already
        sm.resume()
    assert (done.outcome, gate.executed) == ("Right", 2)
    assert isinstance(gate.stored, LeftState)
    assert sm.current is None


def test_what_is_answered_after_a_change_of_state_never_counts(tmp_path: Path) -> None:
    """Also where the machine is in the same state again, which waits until the first execution has returned."""
    text = GATE + GATE.replace("label: Gate", "label: Other")
    gate, other = Gate("early", "late"), Gate("early", "late")
    sm = machine(tmp_path, {"Gate": gate, "Other": other}, text, ("Right", "Wrong"))
    with Executed(sm, rate=RATE, record=tmp_path / "run.rec") as done:
        assert gate.inside.wait(60)
        sm.change_state("Other")
        assert gate.cancelled.wait(60)
        assert other.inside.wait(60)
        sm.change_state("Gate")
        assert sm.current == ("Gate", "Waiting")
        assert gate.executed == 1
        gate.go.set()
        assert gate.gone.wait(60)
        other.go.set()
    assert (done.outcome, gate.executed, other.executed) == ("Right", 2, 1)
    assert isinstance(other.stored, LeftState | None)
    assert counted(tmp_path / "run.rec", sm, text) == [("Gate", "late")]


def test_it_begins_where_it_is_told_and_ends_where_it_is_sent(tmp_path: Path) -> None:
    text = GATE + GATE.replace("label: Gate", "label: Other")
    gate, other = Gate("early", "late"), Gate("early", "late")
    sm = machine(tmp_path, {"Gate": gate, "Other": other}, text, ("Right", "Wrong"))
    with Executed(sm, initial="Other", rate=RATE) as done:
        assert other.inside.wait(60)
        assert gate.executed == 0
        sm.pause()
        sm.change_state("Other")  # it ends the pause
        sm.change_state("Wrong")
        other.go.set()
    assert (done.outcome, gate.executed) == ("Wrong", 0)
    assert sm.report is not None and sm.report.ending == "ended"


def test_what_is_monitored_and_recorded_begins_in_the_state_of_execute(tmp_path: Path) -> None:
    text = GATE + GATE.replace("label: Gate", 'label: "ä: #1"') + "# the end"
    gate, other = Gate("early", "late"), Gate("late", "early")
    sm = machine(tmp_path, {"Gate": gate, "ä: #1": other}, text, ("Right", "Wrong"))
    for each in (gate, other):
        each.go.set()
    for initial, verdict in (("ä: #1", "undecided"), (None, "violated"), ("Gate", "violated")):
        recording = tmp_path / f"{initial and sm._transitions.states[initial]}.rec"
        sm.execute(initial, rate=RATE, record=recording, properties=["G !sm@Gate"])
        assert sm.report is not None
        assert [found for _, found, *_ in sm.report.monitored] == [verdict]
        assert llfsm("replay", str(recording)).returncode == 0
        done = llfsm("check-recording", str(recording), "-p", "G !sm@Gate")
        said = verdict.replace("undecided", "satisfied")  # of the whole run
        assert done.stdout.startswith(said), done.stdout + done.stderr


def test_a_command_is_kept_until_the_run_begins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Here while the model is compiled: the state in which it begins is never executed."""
    text = GATE + GATE.replace("label: Gate", "label: Other")
    gate, other = Gate("early", "late"), Gate("early", "late")
    sm = machine(tmp_path, {"Gate": gate, "Other": other}, text, ("Right", "Wrong"))
    assert sm._model is not None
    run, commands = sm._model.run, list[threading.Thread]()

    def late(*words: object, **options: object):
        for what in (sm.pause, lambda: sm.change_state("Other")):
            asked = len(commands)
            commands.append(threading.Thread(target=what))
            commands[-1].start()
            wait_for(lambda asked=asked: sm._commands is not None and len(sm._commands.asked) > asked)
        return run(*words, **options)

    monkeypatch.setattr(type(sm._model), "run", lambda _, *words, **options: late(*words, **options))
    other.go.set()
    assert sm.execute(rate=RATE) == "Wrong"
    for command in commands:
        command.join(60)
    assert (gate.executed, other.executed) == (0, 1)


def test_commands_to_a_run_that_cannot_begin_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sm, refused = machine(tmp_path, {"Gate": Gate("early", "late")}, GATE, ("Right", "Wrong")), list[str]()

    def pause() -> None:
        try:
            sm.pause()
        except RuntimeError as error:
            refused.append(str(error))

    def fails(*_: object, **__: object) -> None:
        asked.start()
        wait_for(lambda: sm._commands is not None and bool(sm._commands.asked))
        raise ZeroDivisionError

    asked = threading.Thread(target=pause)
    monkeypatch.setattr(type(sm._model), "run", fails)
    with pytest.raises(ZeroDivisionError):
        sm.execute()
    asked.join(60)
    assert refused == ["the state machine has ended"]


@pytest.mark.parametrize("deadline", [1e6, None])
def test_a_cancel_that_hangs_holds_up_no_other_state(deadline: float | None, tmp_path: Path, caplog) -> None:
    """And the same object waits until it has returned, which is said."""
    text = GATE + GATE.replace("label: Gate", "label: Other")
    gate, other, go = Gate("early", "late"), Gate("early", "late"), threading.Event()
    gate.cancel = lambda: go.wait(60) and None  # type: ignore[method-assign]
    gate.deadline = other.deadline = deadline
    sm = machine(tmp_path, {"Gate": gate, "Other": other}, text, ("Right", "Wrong"))
    told = "`cancel` of the state `Gate` has not returned: `"
    with Executed(sm, rate=RATE) as done:
        assert gate.inside.wait(60)
        sm.change_state("Other")
        assert other.inside.wait(60), "it waits for what hangs"
        assert f"{told}Other` is executed meanwhile" in caplog.messages
        gate.go.set()
        sm.change_state("Gate")
        wait_for(lambda: f"{told}Gate` waits for it" in caplog.messages)
        assert gate.executed == 1
        go.set()
        other.go.set()
    assert (done.outcome, gate.executed) == ("Right", 2)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_commands_at_random_moments_lose_and_double_nothing(seed: int, tmp_path: Path) -> None:
    text, draw, log = random_file(seed), random.Random(seed), []
    text = text.replace("leave: ", "left: ").replace(": Exit", ": Out of order")
    states = {label: Logged(label, (*moves,), seed, log) for label, moves in tables(text).items()}
    for state in states.values():  # it goes on until it is told to end
        state.drawn = tuple(o for o in state.outcomes if tables(text)[state.label][o] in states)
    sm = machine(tmp_path, states, text, ("Out of order",))
    with Executed(sm, rate=RATE, record=tmp_path / "run.rec") as done:
        wait_for(lambda: bool(log))
        for _ in range(12):
            time.sleep(draw.random() * 0.01)  # a moment like any other
            match draw.choice(["pause", "change", "change"]):
                case "pause":
                    sm.pause()
                    sm.resume()
                case _:
                    sm.change_state(draw.choice(list(states)))
        sm.change_state("Out of order")
    assert done.outcome == "Out of order"
    assert not any(state.twice for state in states.values())
    answers = iter(log)
    found = counted(tmp_path / "run.rec", sm, text)
    assert len(found) > 3
    assert all(each in answers for each in found), "an answer counts that was not given then"
    assert len(log) - len(found) <= 2 * 12 + 1, "answers were lost without a command"
    assert llfsm("replay", str(tmp_path / "run.rec")).returncode == 0
    assert llfsm("check-recording", str(tmp_path / "run.rec"), "-p", "G !sm@timed_out").returncode in (0, 4)


def test_a_state_that_blocks_has_timed_out_and_counts_no_more(tmp_path: Path) -> None:
    text = GATE.replace("late: Right", "late: Right, timed out: Gate")
    gate = Gate("early", "late")
    sm = machine(tmp_path, {}, text, ("Right", "Wrong"))
    sm.add("Gate", gate, deadline=0.05)
    with Executed(sm, rate=RATE) as done:
        assert gate.cancelled.wait(60)
        gate.go.set()
    assert done.outcome in ("Right", "timed out")
    assert gate.executed == 2


def test_a_state_that_hangs_ends_the_machine_where_the_file_says_nothing(tmp_path: Path) -> None:
    gate = Gate("early", "late")
    sm = machine(tmp_path, {}, GATE, ("Right", "Wrong"))
    sm.add("Gate", gate, deadline=0.05)
    assert sm.execute(rate=RATE, record=tmp_path / "run.rec") == "timed out"
    assert not gate.gone.is_set()
    gate.go.set()
    assert counted(tmp_path / "run.rec", sm, GATE) == [("Gate", "timed out")]


def test_data_keep_the_types_that_they_first_had() -> None:
    data = Data({"fruit": [1]})
    data["left"] = 3
    place = f"{__file__}:"
    with pytest.raises(
        DataTypeError, match=r"`left` has had the type int since .*:\d+, and cannot be of type str"
    ) as raised:
        data["left"] = "three"
    assert str(raised.value).count(place) == 2
    with pytest.raises(DataTypeError, match="bool"):
        data["left"] = True
    del data["left"]
    with pytest.raises(DataTypeError):
        data.update(left=None)
    data["speed"] = 1.5
    data["speed"] = 2
    assert repr(data["speed"]) == "2.0"
    for wrong in (True, 10**400):
        with pytest.raises(DataTypeError, match="type float since"):
            data["speed"] = wrong
    data["found"] = None
    data["found"] = None
    data["found"] = 3
    with pytest.raises(DataTypeError, match="type int since"):
        data["found"] = None
    for key in ("speed", "found"):
        del data[key]
    assert dict(data) == {"fruit": [1]}
    data["left"] = 4
    assert sorted(data) == ["fruit", "left"]


class Client:
    """A client of an action, such as actionlib has: a goal is reached after some looks."""

    def __init__(self, *states: int | str) -> None:
        self.states, self.goals, self.looks, self.cancelled = states, [], 0, 0

    def send_goal(self, goal: object, *, feedback_cb=None) -> None:
        self.goals.append(goal)
        self.looks = 0
        self.feedback = feedback_cb

    def get_state(self) -> int | str:
        self.feedback(len(self.states) - self.looks)
        self.looks += 1
        return self.states[min(self.looks, len(self.states)) - 1]

    def get_result(self) -> object:
        return f"after {self.looks}"

    def cancel_goal(self) -> None:
        self.cancelled += 1


class MoveToFruit(SimpleActionState):
    def goal(self, data: Data) -> object:
        return data["fruit_loc"]

    def feedback(self, feedback: object, data: Data) -> None:
        data["distance"] = feedback

    def done(self, result: object, data: Data) -> None:
        data["result"] = result


ENDS = {"SUCCEEDED": "Goal", "PREEMPTED": "Out of reach"}
REACH = TRANSITION_FILE.replace("Goal: Fruit_to_basket", "Goal: Fruit_to_basket\n      Out of reach: Exit")


@pytest.mark.parametrize(
    ("states", "end", "goals"),
    [((0, 1, 1, 3), "Exit", 2), ((0, "ACTIVE", 2), "Exit", 1), ((1, 9), "failed", 1), ((8,), "failed", 1)],
)
def test_an_action_is_followed_to_its_end(states, end: str, goals: int, tmp_path: Path) -> None:
    client, data = Client(*states), Data({"fruit_loc": (1.0, 2.0)})
    move = MoveToFruit("/move_box_arm_action", client, ends=ENDS, otherwise="Moving to fruit")
    picked = Scripted("Fruit selected", "Fruit selected", "All fruits picked")
    found = {label: Scripted(*outcomes) for label, outcomes in FIXED.items()}
    sm = machine(tmp_path, {**found, "Pick_fruit": move, "Select_fruit": picked}, REACH)
    assert sm.execute("Locate_fruits", data=data, rate=RATE) == end
    assert client.goals == [(1.0, 2.0)] * goals
    assert client.cancelled == 0
    assert data["distance"] == 1
    assert data.get("result") == (f"after {len(states)}" if states[-1] in (2, 3) else None)


def test_the_goal_of_an_action_is_cancelled_in_a_pause_and_sent_again(tmp_path: Path) -> None:
    client = Client("ACTIVE")
    move = MoveToFruit("/arm", client, ends={"SUCCEEDED": "late"}, otherwise="early")
    sm = machine(tmp_path, {"Gate": move}, GATE.replace("early: Wrong", "early: Gate"), ("Right",))
    board = f"crops-{os.getpid()}"
    with Executed(sm, data={"fruit_loc": 1}, rate=RATE, whiteboard=board) as done:
        wait_for(lambda: client.looks > 3)
        sm.pause()
        wait_for(lambda: client.cancelled == 1)
        sm.resume()
        wait_for(lambda: len(client.goals) == 2)
        sm.change_state("Gate")
        wait_for(lambda: client.cancelled == 2 and len(client.goals) == 3)
        with Whiteboard(board) as others:
            others.command("suspend", "sm")
            wait_for(lambda: client.cancelled == 3)
            others.command("resume", "sm")
        wait_for(lambda: len(client.goals) == 4)
        client.states = ("SUCCEEDED",)
    assert (done.outcome, client.cancelled) == ("Right", 3)
    with pytest.raises(ValueError, match="does not end as 'ACTIVE', only as PREEMPTED"):
        MoveToFruit("/arm", client, ends={"ACTIVE": "late"}, otherwise="early")


def wait_for(condition: Callable[[], bool]) -> None:
    limit = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < limit
        time.sleep(0.001)


def test_it_is_executed_once_at_a_time_and_commanded_only_then(tmp_path: Path) -> None:
    gate = Gate("early", "late")
    sm = machine(tmp_path, {"Gate": gate}, GATE, ("Right", "Wrong"))
    with pytest.raises(RuntimeError, match="is not executed"):
        sm.pause()
    with Executed(sm, rate=RATE) as done:
        assert gate.inside.wait(60)
        with pytest.raises(RuntimeError, match="executed already"):
            sm.execute()
        with pytest.raises(ValueError, match="there is no label 'Gaol', only Gate, Wrong, Right"):
            sm.change_state("Gaol")
        gate.go.set()
    assert done.outcome == "Wrong"
    with pytest.raises(ValueError, match="has a state already"):
        sm.add("Gate", gate)
    with pytest.raises(ValueError, match="has a transition file already"):
        sm.add_transition_file(tmp_path / "transfile.yaml")
    with pytest.raises(ValueError, match="call `add_transition_file`"):
        StateMachine(["Exit"]).check()
    for wrong in ("Exit", ()):
        with pytest.raises(ValueError, match="is a list of texts"):
            StateMachine(wrong)


class Rogue(State):
    """Gives what is not one of its outcomes, and the last time one that is."""

    def __init__(self, *given: object) -> None:
        self.given, self.outcomes = list(given), {"early", "late"}

    def execute(self, data: Data) -> str:
        self.outcomes.add("later")  # not any more
        return self.given.pop(0) if self.given else Outcome.LATE  # type: ignore[return-value]


class Outcome(str, enum.Enum):  # noqa: UP042 - its `str` is not its text
    LATE = "late"


class Unshowable:
    def __repr__(self) -> str:
        raise ZeroDivisionError


def test_what_is_none_of_its_outcomes_is_a_failure_of_the_state(tmp_path: Path, caplog) -> None:
    rogue = Rogue(None, ["late"], {}, "lade", b"late", 7, "later", Unshowable())
    text = GATE.replace("late: Right", "late: Right, failed: Gate, later: Wrong")
    sm = machine(tmp_path, {"Gate": rogue}, text, ("Right", "Wrong"))
    assert sm.execute(rate=RATE) == "Right"
    assert not rogue.given
    said = [message for message in caplog.messages if "the state `Gate` has" in message]
    assert "the state `Gate` has returned None, which is not in its `outcomes`" in said
    assert "the state `Gate` has returned 'lade', which is not in its `outcomes`: did you mean `late`?" in said
    assert said[-1] == "the state `Gate` has raised ZeroDivisionError"
    assert len(said) == 8


class Hanging(State):
    """Hangs in each execution, until all are let go."""

    outcomes = ("early", "late")

    def __init__(self) -> None:
        self.executed, self.go = 0, threading.Event()

    def execute(self, data: Data) -> str:
        self.executed += 1
        self.go.wait()
        return "early"


def test_a_state_that_hangs_again_and_again_keeps_one_thread(tmp_path: Path, caplog) -> None:
    def threads() -> int:
        return sum(thread.name == "crops-states" for thread in threading.enumerate())

    hanging, before = Hanging(), threads()
    text = GATE.replace("late: Right", "late: Right, timed out: Other")
    text += text.replace("label: Gate", "label: Other").replace("timed out: Other", "timed out: Gate")
    sm = machine(tmp_path, {}, text, ("Right", "Wrong"))
    for label in ("Gate", "Other"):
        sm.add(label, hanging, deadline=0.01)
    why = "could not begin for 0.01 s: `cancel` of a state, or an execution before it, has not returned"
    with Executed(sm, rate=RATE, record=tmp_path / "run.rec") as done:
        wait_for(lambda: hanging.executed == 1)
        wait_for(lambda: {f"the state `{label}` {why}" for label in ("Gate", "Other")} <= set(caplog.messages))
        wait_for(lambda: threads() <= before + 3)  # and one that cancels it
        sm.change_state("Right")
    assert (done.outcome, hanging.executed) == ("Right", 1)
    assert len(counted(tmp_path / "run.rec", sm, text)) >= 2
    wait_for(lambda: threads() <= before + 1)
    hanging.go.set()
    wait_for(lambda: threads() <= before)


def test_python_ends_though_a_state_hangs(tmp_path: Path) -> None:
    (tmp_path / "transfile.yaml").write_text(GATE, encoding="utf-8")
    program = (
        "import time\nfrom llfsm_verify.extensions.crops import State, StateMachine\n"
        "class Gate(State):\n    outcomes = ('early', 'late')\n    deadline = 0.05\n"
        "    def execute(self, data):\n        time.sleep(10**6)\n"
        "sm = StateMachine(['Right', 'Wrong'])\nsm.add_transition_file('transfile.yaml')\nsm.add('Gate', Gate())\n"
        "print(sm.execute())\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False
    )
    assert (done.returncode, done.stdout) == (0, "timed out\n")
    assert "the state `Gate` took longer than 0.05 s" in done.stderr


class Inside(State):
    """Calls what it is given from inside."""

    outcomes = ("early", "late")

    def __init__(self, *calls: Callable[[], object]) -> None:
        self.calls = list(calls)
        self.raised: list[str] = []

    def execute(self, data: Data) -> str:
        if not self.calls:
            return "late"
        try:
            self.calls.pop(0)()
        except Exception as error:  # noqa: BLE001 - which one is compared
            self.raised.append(type(error).__name__)
        return "early"

    def cancel(self) -> None:
        try:
            self.sm.resume()
        except RuntimeError as error:
            self.raised.append(str(error))


def test_states_may_command_their_machine_from_inside(tmp_path: Path) -> None:
    """What they return then does not count; a machine that is executed cannot be again."""
    sm = machine(tmp_path, {}, GATE.replace("early: Wrong", "early: Gate"), ("Right", "Wrong"))
    inside = Inside(
        sm.execute, sm.pause, lambda: sm.change_state("Gate"), lambda: sm.change_state("Gaol"), lambda: 1 // 0,
    )  # fmt: skip
    inside.sm = sm  # type: ignore[attr-defined]
    sm.add("Gate", inside)
    with Executed(sm, rate=RATE) as done:
        wait_for(lambda: not inside.calls)
    assert done.outcome == "Right"
    assert inside.raised == ["RuntimeError", "ValueError", "ZeroDivisionError"]


def test_a_command_to_a_machine_that_ends_is_refused_at_once(tmp_path: Path) -> None:
    gate, inside = Gate("early", "late"), Inside()
    sm = machine(tmp_path, {"Gate": gate}, GATE, ("Right", "Wrong"))
    inside.sm = gate.sm = sm  # type: ignore[attr-defined]
    gate.cancel = inside.cancel  # type: ignore[method-assign]
    with Executed(sm, rate=RATE) as done:
        assert gate.inside.wait(60)
        commands = sm._commands
        assert commands is not None
        sm.change_state("Right")
        gate.go.set()
    assert done.outcome == "Right"
    late = commands.ask("suspend")
    assert late.done.is_set()
    assert str(late.failed) == "the state machine has ended"


def test_of_two_threads_that_execute_it_one_is_refused(tmp_path: Path) -> None:
    """Also where the other has not begun yet: here it is in `check`."""
    gate = Gate("early", "late")
    sm = machine(tmp_path, {"Gate": gate}, GATE, ("Right", "Wrong"))
    checked, refused = sm.check, list[str]()

    def check(initial: str | None = None) -> tuple[str, ...]:
        sm.check = checked  # type: ignore[method-assign]
        try:
            sm.execute()
        except RuntimeError as error:
            refused.append(str(error))
        return checked(initial)

    sm.check = check  # type: ignore[method-assign]
    gate.go.set()
    assert sm.execute(rate=RATE) == "Wrong"
    assert refused == ["the state machine is executed already"]
    assert sm.execute(rate=RATE) == "Right"


def test_deadlines_are_those_of_labels_and_positive(tmp_path: Path) -> None:
    gate = Gate("early", "late")
    sm = machine(tmp_path, {}, GATE + GATE.replace("label: Gate", "label: Other"))
    sm.add("Gate", gate, deadline=1)
    sm.add("Other", gate, deadline=2)
    assert (sm._deadlines, gate.deadline) == ({"Gate": 1, "Other": 2}, 5.0)
    for wrong in (0, -1, float("nan"), True, "5"):
        with pytest.raises(ValueError, match="positive number of seconds"):
            sm.add("Third", gate, deadline=wrong)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="not int and Gate"):
        sm.add(3, gate)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="not str and NoneType"):
        sm.add("Third", None)  # type: ignore[arg-type]


def test_a_goal_that_is_sent_while_the_state_is_left_is_cancelled() -> None:
    """`cancel` came before there was a goal to cancel: it would be pursued in the pause."""
    client, data = Client("ACTIVE"), Data({"fruit_loc": 1})
    move = MoveToFruit("/arm", client, ends=ENDS, otherwise="Moving to fruit")
    send, execution = client.send_goal, data._for()

    def slow(goal: object, *, feedback_cb=None) -> None:
        execution._leave("paused")
        move.cancel()
        send(goal, feedback_cb=feedback_cb)

    client.send_goal = slow  # type: ignore[method-assign]
    move.execute(execution)
    assert (client.goals, client.cancelled, client.looks) == ([1], 1, 0)
    client.send_goal = send  # type: ignore[method-assign]
    assert move.execute(data) == "Moving to fruit"
    assert (client.goals, client.cancelled) == ([1, 1], 1)


def test_feedback_is_that_of_the_goal_under_way() -> None:
    client, data = Client("ACTIVE", 6, "SUCCEEDED", 42), Data({"fruit_loc": 1})
    move = MoveToFruit("/arm", client, ends=ENDS, otherwise="Moving to fruit")
    assert move.execute(data) == "Moving to fruit"
    assert data["distance"] == 4
    old = client.feedback
    move.cancel()
    send = client.send_goal

    def late(goal: object, *, feedback_cb=None) -> None:
        old(-1)
        send(goal, feedback_cb=feedback_cb)
        old(-2)

    client.send_goal, client.get_state = late, lambda: 7  # type: ignore[method-assign]
    assert move.execute(data) == "Moving to fruit"
    assert data["distance"] == 4, "it is of the goal before"
    client.get_state = lambda: 42  # type: ignore[method-assign]
    with pytest.raises(RuntimeError, match="is in the state 42, which no client"):
        move.execute(data)
    move.cancel()
    assert client.cancelled == 2, "nobody knows whether it has ended"


@pytest.mark.long
@pytest.mark.parametrize("seed", range(6))
def test_what_is_proved_of_a_random_file_never_breaks_when_it_is_executed(seed: int, tmp_path: Path) -> None:
    """Also with states that raise and give what they do not have, and with commands meanwhile. What `verify` finds
    violated may hold of one run."""
    text, draw, log = random_file(seed), random.Random(seed), list[tuple[str, str]]()
    states = {label: Logged(label, (*moves, "failed", ODD), seed, log) for label, moves in tables(text).items()}
    sm = machine(tmp_path, states, text, ("Exit", "Out of order"))
    names, initial = sm._transitions.states, draw.choice(list(states))
    (tmp_path / "begun.yaml").write_text(sm._transitions.text_with(initial), encoding="utf-8")
    table, formulas = tables(text), []
    for label, target in itertools.product(table, names):
        at, to, moves = names[label], names[target], list(table[label])
        place = draw.randrange(len(moves))
        outcome, number = sm.values[draw.choice([moves[place], draw.choice(moves)])], list(table).index(label)
        fired = f"sm.fired({at}, {place + 1})"
        formulas += [
            f"G ({fired} -> sm@{to})",
            f"G ({fired} -> sampled(outcome) == {outcome})",
            f"G ({fired} -> sampled(answers) % {len(table) + 1} == {draw.choice([number, number, 0])})",
            f"G (sm@{at} -> G !sm@{to})",
            f"G !(sm@{at} && X sm@{to})",
        ]
    formulas = [f"p{number}: {one}" for number, one in enumerate(draw.sample(formulas, min(16, len(formulas))))]
    model = load(tmp_path / "begun.yaml")
    proved = {one.name for one in model.check(formulas) if one.verdict == "holds"}
    kept = [line for line in formulas if line.split(":")[0] in proved]
    assert kept
    with Executed(sm, initial=initial, rate=RATE, properties=kept, record=tmp_path / "run.rec") as done:
        for _ in range(draw.randrange(4)):
            with suppress(RuntimeError):  # it has ended, or not begun
                draw.choice([sm.pause, lambda: sm.change_state(draw.choice(list(states)))])()
                sm.resume()
    assert done.outcome is not None and sm.report is not None
    assert "violated" not in [verdict for _, verdict, *_ in sm.report.monitored]
    checked = llfsm("check-recording", str(tmp_path / "run.rec"), *[part for line in kept for part in ("-p", line)])
    assert "violated" not in checked.stdout
    assert checked.returncode in (0, 4), checked.stderr
