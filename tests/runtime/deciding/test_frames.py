"""Properties decided outside the loop, on frames: as on the recording, and soundly where frames are missed."""

from __future__ import annotations

import random
import signal
import subprocess
import sys
from collections import Counter
from itertools import product
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

import llfsm_verify as lv
from llfsm_verify.arrangement.loader import build_arrangement, load_arrangement
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.monitoring.states import Monitor, MonitorEdge, MonitorVerdict
from llfsm_verify.runtime.deciding.frames import FrameMonitors, Watched
from llfsm_verify.runtime.deciding.recordings import check
from llfsm_verify.runtime.live.slots import slots_of
from llfsm_verify.runtime.recording.file import Recording
from llfsm_verify.testing.arrangements import Document, arrangements
from tests.cli.running import llfsm
from tests.quick import AtLeast, examples, many, spread
from tests.runtime.live.runs import code_of, recorded

LIGHTS, FAULTY = "models/traffic_lights/arrangement.yaml", "models/traffic_lights/faulty.yaml"


def agree(folder: Path, count: int) -> None:
    """What frames say is what the recording says; with all frames and `observe: cycle` they say as much."""
    tally: Counter[str] = Counter()

    def compare(document: Document, seed: int) -> None:
        chance = random.Random(seed)
        alone = len(build_arrangement(document).processes) == 1
        arrangement = build_arrangement({**document, "observe": chance.choice(["cycle", "ringlet"][not alone :])})
        places = [f"{m.name}@{s.name}" for m in arrangement.machines for s in m.states]
        a, b, c = (chance.choice(places) for _ in range(3))
        text = f"a: G !{a}\nb: F {b}\nc: {a} W {c}\nd: G ({b} -> X X {c})\ne: G F {a}\n"
        lines = parse_properties([Source("p", text)])
        path = folder / "r"
        code = code_of(arrangement)
        try:
            monitors = FrameMonitors(arrangement, lines, slots_of(code))
        except DiagnosticError as error:
            if {d.code for d in error.diagnostics} != {"E489"}:
                raise
            return  # it can be unloaded, which frames do not tell
        _, turns = recorded(code, path, chance.randint(1, 12), seed)
        with Recording(path) as recording:
            expected = {d.line.name: d for d in check(arrangement, lines, recording)}
        whole = chance.random() < 0.5
        kept = [turn for turn in turns[1:] if whole or chance.random() < 0.6]
        said = [decided for turn in (turns[0], *kept) for decided in monitors.read(turn.frame)]
        results = {d.line.name: d for d in monitors.results}
        assert all(results[decided.line.name] == decided for decided in said)
        exact = whole and bind(arrangement, lines).program().observe == "cycle"
        for name, decided in results.items():
            known = expected[name]
            tally[f"{'whole' if whole else 'parts'} {decided.verdict}"] += 1
            if exact:
                assert (decided.verdict, decided.frame) == (known.verdict, known.frame), (decided, known)
            elif decided.verdict != "undecided":
                # A verdict whose frame was not read may be later, or that of the whole run.
                assert decided.verdict == known.verdict, (decided, known)
                assert decided.frame is None or known.frame is None or decided.frame >= known.frame

    least = {f"{how} {verdict}": 1 for how in ("whole", "parts") for verdict in ("violated", "satisfied", "undecided")}
    amount = settings(max_examples=count, deadline=None, suppress_health_check=list(HealthCheck))
    spread(compare, amount, arrangements(), st.integers(1, 1 << 40), size=10, until=AtLeast(tally, least))


@pytest.mark.slow
def test_frames_say_what_the_recording_says(tmp_path: Path) -> None:
    agree(tmp_path, examples(12))


@pytest.mark.long
def test_many_frames_say_what_the_recordings_say(tmp_path: Path) -> None:
    agree(tmp_path, many(400))


@pytest.fixture(scope="module")
def watch():
    """Makes what watches with a monitor."""
    lines = parse_properties([Source("p", "G ns@RED")])
    (goal,) = goals_of(bind(load_arrangement(LIGHTS), lines))
    return lambda monitor: Watched(goal, monitor)


def test_unknown_letters_are_all_letters(watch) -> None:
    """By trying all words: a verdict comes exactly when each of them has it."""
    chance = random.Random(3)
    decided = 0
    for _ in range(300):
        size = chance.randint(1, 4)
        ends = [(MonitorEdge(0, 0, size),), (MonitorEdge(0, 0, size + 1),)]
        edges = [
            (MonitorEdge(1, 0, chance.randrange(size + 2)), MonitorEdge(0, 1, chance.randrange(size + 2)))
            for _ in range(size)
        ]
        verdicts = (*[MonitorVerdict.NOT_YET] * size, MonitorVerdict.TRUE, MonitorVerdict.FALSE)
        monitor = Monitor(("p",), verdicts, (*edges, *ends), (False,) * (size + 2))
        word = [chance.choice([frozenset(), frozenset({"p"}), None]) for _ in range(chance.randint(1, 6))]
        word.append(frozenset())
        found = watch(monitor)
        for letter in word:
            if letter is None:
                found.unknown(1, within_a_cycle=False)
            else:
                found.known(letter, (0, 0))
        letters = [[letter] if letter is not None else [frozenset(), frozenset({"p"})] for letter in word]
        every = {monitor.verdict(list(words)) for words in product(*letters)}
        meant = {"violated": {MonitorVerdict.FALSE}, "satisfied": {MonitorVerdict.TRUE}}.get(found.verdict)
        assert every == meant if meant else len(every) > 1 or MonitorVerdict.NOT_YET in every
        decided += meant is not None
    assert decided > 50


@pytest.mark.slow
def test_the_end_of_a_run_decides_what_all_its_frames_have_asked(tmp_path: Path) -> None:
    """What was asked in the middle of the run, and is not answered, is violated when the last letter repeats."""
    states = [
        {"name": name, "transitions": [{"when": True, "to": following}]}
        for name, following in zip("ABC", "BCD", strict=True)
    ]
    machine = {"inline": {"machine": "M", "states": [*states, {"name": "D"}]}}
    ends = build_arrangement({"machines": {"m": machine}, "schedule": ["m"]})
    code = code_of(ends)
    lines = parse_properties([Source("p", "back: G (m@C -> F m@A)\non: G (m@C -> F m@D)")])
    monitors = FrameMonitors(ends, lines, slots_of(code))
    _, turns = recorded(code, tmp_path / "r", 20, 1)
    for turn in turns:
        list(monitors.read(turn.frame))
    assert [d.verdict for d in monitors.results] == ["violated", "satisfied"]


def test_a_long_gap_takes_no_longer_than_its_period(watch) -> None:
    edges = tuple((MonitorEdge(0, 0, (i + 1) % 7),) for i in range(7))
    ring = Monitor(("p",), (MonitorVerdict.NOT_YET,) * 7, edges, (False,) * 7)
    for count in (0, 1, 6, 7, 8, 20, 10**15):
        found = watch(ring)
        found.unknown(count, within_a_cycle=False)
        assert found.states == {count % 7}


def test_what_frames_do_not_show_is_refused() -> None:
    lights, others = load_arrangement(LIGHTS), load_arrangement("models/microwave/arrangement.yaml")
    slots = slots_of(code_of(lights))
    for text, code in (("G !ns.entered(RED)", "E489"), ("G (rose(ns_turn) -> ns@RED)", "E489"), ("G !ns@PINK", "E112")):
        with pytest.raises(DiagnosticError) as caught:
            FrameMonitors(lights, parse_properties([Source("p.ltl", text)]), slots)
        (diagnostic,) = caught.value.diagnostics
        assert diagnostic.code == code and diagnostic.span is not None
    machine = others.machines[0]
    with pytest.raises(DiagnosticError, match="another arrangement runs"):
        FrameMonitors(others, parse_properties([Source("p", f"G !{machine.name}@{machine.states[0].name}")]), slots)


@pytest.mark.slow
def test_a_run_is_watched_in_python(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LLFSM_WHITEBOARDS", str(tmp_path / "boards"))
    counting = lv.StateDefinition(transitions=[("n == 50", "B")], internal="n = go ? n + 1 : n;")
    end = lv.build(
        "end", {"m": lv.MachineDefinition("M", {"A": counting, "B": lv.StateDefinition()})},
        whiteboard={"n": {"type": "0..60"}, "go": {"type": "bool", "role": "input"}}, cycle_ms=10,
    )  # fmt: skip
    lines = ["big: F n > 40", "small: G n < 50", "last: F G m@B"]
    with end.run(whiteboard="end") as run, lv.Whiteboard("end") as board:
        verdicts = end.watch(board, lines)
        board.post(go=True)
        found = {name: verdict for name, verdict, _ in verdicts}
        assert run.wait().ending == "ended"
    assert found["big"] == "satisfied" and found["small"] == "violated"
    assert found["last"] in ("satisfied", "undecided")  # it is decided where no frame was missed


@pytest.mark.slow
def test_a_run_is_watched_from_outside(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LLFSM_WHITEBOARDS", str(tmp_path / "boards"))
    bad, ask = "bad: G !(ew_light == GREEN && ns_light == AMBER)", ("--arrangement", FAULTY)
    run = ["run", FAULTY, "--simulate", "--seed", "3", "--rate", "200", "--whiteboard", "watched"]
    process = subprocess.Popen([sys.executable, "-m", "llfsm_verify", *run], stdout=subprocess.DEVNULL)
    try:
        while "watched" not in llfsm("whiteboard", "list").stdout:
            assert process.poll() is None
        for wrong in (("-p", bad), ("-p", bad, *ask, "ns")):
            assert llfsm("whiteboard", "watch", "watched", *wrong).returncode == 2
        done = llfsm("whiteboard", "watch", "watched", "-p", "G !ns.ran", *ask)
        assert done.returncode == 3 and "E489" in done.stderr
        command = [sys.executable, "-m", "llfsm_verify", "whiteboard", "watch", "watched", *ask]
        lines = ("-p", bad, "-p", "live: G F ns@GREEN", "-p", "done: F ns@RED")
        with subprocess.Popen([*command, *lines], stdout=subprocess.PIPE, text=True) as watching:
            assert watching.stdout is not None
            seen = [watching.stdout.readline() for _ in range(2)]
            assert {line.split(": ")[1] for line in seen} == {"bad is violated\n", "done is satisfied\n"}
            process.send_signal(signal.SIGTERM)
            rest = watching.stdout.read()
        assert watching.returncode == 1
        assert "violated   bad" in rest and "undecided  live" in rest and "satisfied  done" in rest
    finally:
        process.kill()
        process.wait()
