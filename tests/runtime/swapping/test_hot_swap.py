"""Machines that take the places of others while the arrangement runs: what is carried over, recorded, and refused."""

from __future__ import annotations

import copy
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.formats import Given, read_arrangement
from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement, Machine
from llfsm_verify.arrangement.replacing import Replacement, with_replacement
from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.extensions.debugger.debugger import Debugger
from llfsm_verify.runtime.live import control
from llfsm_verify.runtime.live.frame import CYCLE, ENDING, ENDINGS, NUMBER, STEPS
from llfsm_verify.runtime.live.loop import LiveCode, Loop
from llfsm_verify.runtime.live.plan import drawn_choices, starting_values
from llfsm_verify.runtime.live.slots import STATE, slots_of
from llfsm_verify.runtime.recording.file import Recorder, Recording, Turn
from llfsm_verify.runtime.recording.replay import Differs, replay
from llfsm_verify.runtime.recording.walking import Recorded
from llfsm_verify.runtime.whiteboard.client import PostRefused, Whiteboard, WhiteboardError
from llfsm_verify.runtime.whiteboard.places import socket_path
from llfsm_verify.testing.arrangements import Document, arrangements
from llfsm_verify.verification.changes.state_transfer import Untransferable, transferred
from tests.cli.running import llfsm
from tests.quick import AtLeast, many, spread
from tests.runtime.live.runs import code_of, recorded, turns_of

POLICY = 4
"""A way to change an arrangement: all machines stay."""


def changed(document: Document, machine: str, how: int) -> Document:
    """The arrangement with another machine in one place: the same again, states in another order, or fewer moves; or
    with a policy by which this machine may do nothing.
    """
    other = copy.deepcopy(document)
    if how == POLICY:
        high = dict.fromkeys(document["machines"], "high")
        shared = {name: "high" for name, entry in document["whiteboard"].items() if entry.get("role") != "input"}
        other["access"] = {
            "levels": ["low", "high"], "machines": {name: "high" for name in high if name != machine},
            "write": shared, "command": high, "users": {"root": "high"}, "on_violation": "refuse",
        }  # fmt: skip
        return other
    machines: Any = other["machines"]
    text = machines[machine]["inline"]
    if how == 1:
        text.setdefault("initial", text["states"][0]["name"])
        text["states"].reverse()
    elif how == 2:
        text["states"][0].pop("transitions", None)
    elif how == 3:
        text["variables"] = {**text.get("variables", {}), "one_more": {"type": "0..5", "init": 2}}
    return other


def pair(document: Document, seed: int, how: int) -> tuple[Arrangement, Arrangement, Machine] | None:
    """The arrangement, another one in its place, and the machine that is replaced; None: there is no such one."""
    arrangement = build_arrangement(document)
    machine = arrangement.machines[seed % len(arrangement.machines)]
    if machine.nested or any(state.runs for state in machine.states):
        return None
    try:
        return arrangement, build_arrangement(changed(document, machine.name, how)), machine
    except (DiagnosticError, KeyError):
        return None  # the others ask for what is gone, or several instances share the machine's text


def go_on(old: Loop, code: LiveCode, machine: str | None, path: Path, seed: int, turns: int) -> tuple[Loop, bytes]:
    """A loop that goes on with another, and what it began with; its recording is at `path`."""
    loop = Loop(code, seed=seed, drawn=drawn_choices(code.program, {}), held=starting_values(code.program))
    record = transferred(old.code, old.record, code, loop.record, machine)
    path.unlink(missing_ok=True)
    recorder = Recorder(path, {"name": "test", "loaded": [[machine, "m.yaml", "", True]]}, loop)
    loop.take_over(old, record)
    reason = loop.go(turns)
    while reason == control.FULL:
        recorder.grow()
        reason = loop.go(loop.control[control.TURNS])
    if reason in (control.DONE, control.ENDED):
        loop.end("stopped" if reason == control.DONE else "ended")
    else:
        loop.end("fault" if loop.status > 0 else "overflow", loop.status)
    recorder.close()
    return loop, record


def carry(folder: Path, count: int) -> None:
    tally: Counter[str] = Counter()

    def check(document: Document, seed: int, how: int) -> None:
        found = pair(document, seed, how)
        if found is None:
            return
        arrangement, other, machine = found
        code, following = code_of(arrangement), code_of(other)
        old, _ = recorded(code, folder / "r", 1 + seed % 9, seed)
        replaced = None if how == POLICY else machine.name
        if old.ending != "stopped":
            return
        before = list(old.frame)
        try:
            loop, record = go_on(old, following, replaced, folder / "r.2", seed, 5)
        except Untransferable:
            tally["uncarried"] += 1
            return
        turns = turns_of(folder / "r.2")
        with Recording(folder / "r.2") as recording:
            assert recording.goes_on
            assert list(replay(following, recording, goes_on=True)) == turns
            tally["walked"] += walk(other, following, recording, turns)
        first = turns[0].frame
        assert (first[NUMBER], first[CYCLE], first[STEPS]) == (before[NUMBER], before[CYCLE], before[STEPS])
        assert following.frames.record_of(first) == record
        was = {slot.name: slot.value(before) for slot in slots_of(code) if slot.kind == STATE or "." not in slot.name}
        now = {slot.name: slot.value(first) for slot in slots_of(following)}
        fresh = resolve_initial(following, machine.name)
        for name, value in was.items():
            assert now[name] == (fresh if name == replaced else value), (name, how)
        tally["carried"] += 1
        tally["went on"] += loop.number > before[NUMBER] + 1
        tally[f"changed in way {how}"] += 1

    amount = settings(max_examples=count, deadline=None, suppress_health_check=list(HealthCheck))
    least = {"carried": count // 2, "went on": 1 + count // 4, "walked": count, f"changed in way {POLICY}": count // 12}
    spread(
        check,
        amount,
        arrangements(),
        st.integers(1, 1 << 40),
        st.integers(0, POLICY),
        size=10,
        until=AtLeast(tally, least),
    )


def walk(arrangement: Arrangement, code: LiveCode, recording: Recording, turns: list[Turn]) -> int:
    """A debugger comes through all the frames that there are; how many steps it takes."""
    walked = Recorded(recording, code)
    debugger = Debugger(arrangement, lambda _: walked, walked.start)
    assert debugger.frame == turns[0].frame[NUMBER]
    for machine, state in debugger.states.items():
        stands = debugger.value(f"{machine}.loaded") == "true"
        assert debugger.value(f"{machine}@{state}") == str(stands).lower()
    assert debugger.value(f"{machine}.ran") == "unknown"
    debugger.go(1 << 40)
    for turn in turns:
        if ENDINGS[turn.frame[ENDING]] == "running":
            debugger.go(turn.frame[STEPS] - turns[0].frame[STEPS])
            assert debugger.record() == code.frames.record_of(turn.frame)
    return len(debugger.history)


def resolve_initial(code: LiveCode, machine: str) -> object:
    """The state in which a machine begins."""
    layout = code.layout
    frame = [0] * code.frames.words
    words = layout.first()
    for i in range(len(words) // 8):
        frame[code.frames.record + i] = int.from_bytes(words[8 * i : 8 * i + 8], "little", signed=True)
    return next(slot.value(frame) for slot in slots_of(code) if slot.name == machine)


@pytest.mark.long
def test_everything_but_the_machine_stays_as_it_was(tmp_path: Path) -> None:
    carry(tmp_path, many(300))


TWO = {
    "name": "two",
    "cycle_ms": 1,
    "whiteboard": {"n": {"type": "0..100", "init": 0}},
    "machines": {
        "a": {"inline": {
            "machine": "A", "variables": {"k": {"type": "0..9", "init": 1}, "l": {"type": "0..9", "init": 1}},
            "states": [{"name": "S", "internal": "k = 4; l = 5;", "transitions": [{"when": "n == 1", "to": "T"}]},
                       {"name": "T", "on_entry": "suspend(b);", "stays": True}],
        }},
        "b": {"inline": {"machine": "B", "states": [{"name": "S", "internal": "n = 1;", "stays": True}]}},
    },
    "schedule": ["a", "b"],
}  # fmt: skip


def stopped(document: Document, turns: int) -> Loop:
    code = code_of(build_arrangement(document))
    loop = Loop(code, held=starting_values(code.program))
    loop.begin(0)
    loop.go(turns)
    return loop


def with_machine(text: dict[str, object]) -> LiveCode:
    document: Any = copy.deepcopy(TWO)
    document["machines"]["a"]["inline"] = text
    return code_of(build_arrangement(document))


@pytest.mark.slow
def test_variables_are_carried_over_by_name_and_type() -> None:
    old = stopped(TWO, 1)
    quiet = {"name": "S", "stays": True}
    new = with_machine(
        {"machine": "A", "variables": {"k": {"type": "0..9", "init": 7}, "l": {"type": "0..8", "init": 7}},
         "states": [quiet, {"name": "T", "on_entry": "suspend(b);"}]}
    )  # fmt: skip
    values = new.layout.decode(transferred(old.code, old.record, new, new.layout.first(), "a"))
    assert values["a.k"] == 4 and values["a.l"] == 7 and values["n"] == 1


@pytest.mark.slow
def test_what_nothing_could_undo_is_refused() -> None:
    """The new machine cannot suspend `b`, so its program has no suspended `b`."""
    old = stopped(TWO, 3)
    new = with_machine({"machine": "A", "states": [{"name": "S", "stays": True}]})
    with pytest.raises(Untransferable, match=r"`b\.\$state` cannot be __suspend any more"):
        transferred(old.code, old.record, new, new.layout.first(), "a")


@pytest.mark.slow
def test_a_forged_first_frame_is_refused(tmp_path: Path) -> None:
    old = stopped(TWO, 1)
    code = with_machine({"machine": "A", "states": [{"name": "S", "stays": True}] * 1})
    go_on(old, code, "a", tmp_path / "r", 1, 3)
    (first, *rest) = turns_of(tmp_path / "r")
    for word in range(code.frames.events):
        for value in (-1, 1 << 62, -(1 << 63)):
            frame = (*first.frame[:word], value, *first.frame[word + 1 :])
            forged = [first._replace(frame=frame) if hasattr(first, "_replace") else type(first)((), frame), *rest]
            try:
                for _ in replay(code, forged, goes_on=True):
                    pass
            except Differs:
                pass


@contextmanager
def running(folder: Path, *options: str) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "llfsm_verify", "run", str(folder / "a.yaml"), "--whiteboard", "loading", *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()


def called(process: subprocess.Popen[str]) -> Whiteboard:
    while True:
        assert process.poll() is None
        try:
            board = Whiteboard("loading")
            board.view()
        except WhiteboardError:
            time.sleep(0.01)
        else:
            return board


@pytest.fixture
def counter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An arrangement whose machine counts, with files of machines that could take its place."""
    monkeypatch.setenv("LLFSM_WHITEBOARDS", str(tmp_path / "boards"))
    machine = {
        "machine": "Count", "variables": {"n": {"type": "0..9", "init": 0}},
        "states": [{"name": "UP", "internal": "n = (n + 1) % 10; out = n;", "stays": True}],
    }  # fmt: skip
    document = {
        "name": "counter", "cycle_ms": 1, "whiteboard": {
            "out": {"type": "0..9", "init": 0, "role": "output", "safe": 9}, "go": {"type": "bool", "role": "input"},
        },
        "machines": {"count": {"file": "count.yaml"}, "other": {"file": "other.yaml"}},
        "schedule": ["count", "other"], "operators": {"replace": ["count"]},
    }  # fmt: skip
    other = {"machine": "Other", "states": [{"name": "S", "stays": True}]}
    down = copy.deepcopy(machine)
    down["states"] = [{"name": "DOWN", "internal": "n = (n + 9) % 10; out = go ? n : 0;", "stays": True}]
    divides = copy.deepcopy(machine)
    divides["states"] = [{"name": "S", "internal": "out = 9 / n;", "stays": True}]
    texts = {"a": document, "count": machine, "other": other, "down": down, "divides": divides}
    for name, content in texts.items():
        (tmp_path / f"{name}.yaml").write_text(yaml.safe_dump(content))
    (tmp_path / "wrong.yaml").write_text("machine: Wrong\nstates:\n  - {name: S, internal: m = 1;}\n")
    return tmp_path


@pytest.mark.slow
def test_a_machine_takes_the_place_of_another_in_a_run(counter: Path) -> None:
    record = counter / "r"
    with running(counter, "--record", str(record), "-p", "small: G out < 10") as process:
        with called(process) as board:
            board.post(go=True)
            with pytest.raises(PostRefused, match="does not declare replace of `other`, only count"):
                board.replace("other", counter / "down.yaml", unchecked=True)
            with pytest.raises(PostRefused, match=r"a fault: division by zero.*\(recorded in .*r\.refused\.1\)"):
                board.replace("count", counter / "divides.yaml")
            with pytest.raises(PostRefused, match=r"wrong\.yaml:3:25: there is no variable `m`"):
                board.replace("count", counter / "wrong.yaml", unchecked=True)
            assert board.state_of("count") == "UP"
            frame, notes = board.replace("count", counter / "down.yaml")
            assert re.fullmatch(r"checked: \d+ configurations in which it may be loaded, \d+ from there on", notes[-1])
            while not board.is_gone:
                time.sleep(0.001)
            assert board.view().ending == "replaced" and board.view().number == frame
        with called(process) as board:
            assert board.state_of("count") == "DOWN" and board.get("go") is True
            assert board.get("verdict(small)") == "undecided"
            later, notes = board.replace("count", counter / "count.yaml", unchecked=True)
            assert later > frame and not notes
        with called(process) as board:
            assert board.state_of("count") == "UP"
        process.send_signal(signal.SIGTERM)
        out, errors = process.communicate()
        assert process.returncode == 0, errors
    assert f"recorded: {record}, {record}.2, {record}.3 (" in out
    for number, path in enumerate([record, Path(f"{record}.2"), Path(f"{record}.3")]):
        done = llfsm("replay", str(path))
        assert done.returncode == 0 and ("replaced" if number < 2 else "stopped") in done.stdout, done.stdout
        done = llfsm("check-recording", str(path), "-p", "small: G out < 10", "-p", "bad: G out < 9")
        assert done.returncode in (1, 4), done.stderr
        assert "undecided  small" in done.stdout
    done = llfsm("debug", f"{record}.refused.1", "--command", "continue")
    assert done.returncode == 0 and "division by zero" in done.stdout, done
    assert llfsm("replay", f"{record}.refused.1").returncode == 0
    done = llfsm(
        "debug", f"{record}.2", "--command", "where", "--command", "expect count@DOWN", "--command", "continue"
    )
    assert done.returncode == 0 and f"at step 0, 0 cycles, 0 s, frame {frame - 1:,}: count@DOWN" in done.stdout, done
    assert "The recording ends here: replaced." in done.stdout
    done = llfsm("trace", f"{record}.2", "--to", "trace", "--arrangement", str(counter / "a.yaml"), "-p", "G out < 9")
    assert done.returncode == 3 and "E488" in done.stderr and "continues an earlier" in done.stderr
    turns = turns_of(Path(f"{record}.2"))
    with Recording(f"{record}.2") as recording:
        ((machine, name, text, unchecked),) = recording.header["loaded"]  # type: ignore[misc]
    assert (machine, name, unchecked) == ("count", "down.yaml", False) and "DOWN" in text
    assert turns[0].frame[NUMBER] == frame - 1 == turns_of(record)[-2].frame[NUMBER]


@pytest.mark.slow
def test_what_was_posted_and_commanded_is_not_lost(counter: Path) -> None:
    text = (counter / "a.yaml").read_text().replace("cycle_ms: 1\n", "cycle_ms: 300\n")
    (counter / "a.yaml").write_text(text.replace("replace:", "suspend: [other]\n  replace:"))
    with running(counter, "--record", str(counter / "r")) as process:
        with called(process) as board, socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as client:
            client.connect(str(socket_path("loading")))
            with client.makefile("rb") as answers:
                answers.readline()
                down = {"replace": ["count", "down.yaml", (counter / "down.yaml").read_text()], "unchecked": True}
                client.sendall(json.dumps(down).encode() + b"\n")
                while not board.is_gone:
                    with suppress(WhiteboardError, PostRefused):
                        board.post(go=True)  # also between the last cycle of the old run and the first of the new one
                assert json.loads(answers.readline())["ok"] is True
        with called(process) as board:
            while board.get("go") is not True:
                time.sleep(0.001)
            with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as client, client.makefile("rb") as answers:
                client.connect(str(socket_path("loading")))
                answers.readline()
                suspend = json.dumps({"command": ["suspend", "other"]}).encode() + b"\n"
                client.sendall(suspend * 1000)  # some of them wait when the other machine comes
                board.replace("count", counter / "count.yaml", unchecked=True)
                heard = [json.loads(line) for line in answers]
            assert heard and "the arrangement was changed" in heard[-1]["error"]
            assert all(answer.get("ok") for answer in heard[:-1])
        process.send_signal(signal.SIGTERM)
        process.communicate()
    assert llfsm("replay", str(counter / "r.3")).returncode == 0


@pytest.mark.slow
def test_a_run_that_is_killed_after_a_replacement_leaves_safe_values(counter: Path) -> None:
    with running(counter, "--record", str(counter / "r")) as process:
        with called(process) as board:
            board.replace("count", counter / "down.yaml", unchecked=True)
        board = called(process)
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
        assert len(children) == 1, "the processes of the first run are gone"
        os.kill(int(children[0]), signal.SIGKILL)
        process.communicate()
        assert process.returncode == 1
        view = board.view()
        assert view.ending == "died" and view.values["out"] == 9
        board.close()
    assert "died" in llfsm("replay", str(counter / "r.2")).stdout


@pytest.mark.slow
def test_requests_after_a_replacement_that_is_refused_are_answered(counter: Path) -> None:
    with (
        running(counter) as process, called(process), socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as client,
        client.makefile("rb") as answers,
    ):  # fmt: skip
        client.settimeout(60)
        client.connect(str(socket_path("loading")))
        answers.readline()
        wrong = {"replace": ["count", "wrong.yaml", (counter / "wrong.yaml").read_text()], "unchecked": True}
        client.sendall(b"".join(json.dumps(request).encode() + b"\n" for request in (wrong, {"post": {"go": True}})))
        assert "there is no variable `m`" in json.loads(answers.readline())["error"]
        assert json.loads(answers.readline()) == {"ok": True}


@pytest.mark.slow
def test_a_recording_that_lies_about_machines(counter: Path, tmp_path: Path) -> None:
    draft = read_arrangement(Given(counter / "a.yaml"))
    replacement = Replacement("count", "down.yaml", (counter / "down.yaml").read_text())
    other = resolve(with_replacement(draft, replacement))
    assert [state.name for state in other.machine("count").states] == ["DOWN"]
    assert other.digest != draft.digest
    with pytest.raises(KeyError):
        with_replacement(draft, Replacement("nobody", "down.yaml", ""))
    header = {
        "arrangement": "a.yaml", "digest": draft.digest, "cycle_ms": "1",
        "files": {name: (counter / name).read_text() for name in ("a.yaml", "count.yaml", "other.yaml")},
    }  # fmt: skip
    loop = stopped(TWO, 1)
    for number, loaded in enumerate(
        [1, [1], [["count", "x", "y"]], [["nobody", "x", "y", True]], [["count", "x", "[", True]]]
    ):
        Recorder(tmp_path / str(number), {**header, "loaded": loaded}, loop).close()
        done = llfsm("replay", str(tmp_path / str(number)))
        assert done.returncode == 3 and "E481" in done.stderr, (loaded, done)


@pytest.mark.slow
def test_a_check_ends_with_its_time_and_with_the_run(counter: Path) -> None:
    """The machine counts without an end, so its check has none."""
    (counter / "grows.yaml").write_text(
        "machine: Grows\nvariables: {n: {type: int, init: 0}}\n"
        'states:\n  - {name: S, internal: "n = n + 1; out = go ? 1 : 0;", stays: true}\n'
    )
    with running(counter, "--load-timeout", "0.5") as process, called(process) as board:
        with pytest.raises(
            PostRefused, match=r"unknown whether it may be loaded: the time limit of 0\.5 s was reached"
        ):
            board.replace("count", counter / "grows.yaml")
        assert board.state_of("count") == "UP"
    with running(counter) as process, called(process) as board:
        command = [sys.executable, "-m", "llfsm_verify", "send", "loading", "replace", "count"]
        asking = subprocess.Popen([*command, str(counter / "grows.yaml")], stderr=subprocess.PIPE, text=True)
        while len(children := children_of(process.pid)) < 2:  # the loop, and the check
            time.sleep(0.01)
        process.send_signal(signal.SIGTERM)
        assert "E486" in asking.communicate()[1] and asking.returncode == 3
        process.communicate()
        assert process.returncode == 0
        assert not any(Path(f"/proc/{child}").exists() for child in children)


def children_of(pid: int) -> list[str]:
    return Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
