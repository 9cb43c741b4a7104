"""Recordings compared with the models of their surroundings."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from fractions import Fraction
from pathlib import Path
from random import Random

import pytest
from hypothesis import HealthCheck, settings

from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.arrangement import plants as plants_module
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.arrangement.requests import MOVES, STATES
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.backends.reference import Interpreter
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.checking.verdict import Options, Verdict
from llfsm_verify.diagnostics import Disagreement, Source
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Program
from llfsm_verify.runtime.deciding import surroundings
from llfsm_verify.runtime.deciding.surroundings import Plants, TooManyWays
from llfsm_verify.runtime.live.plan import runnable
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.testing.arrangements import Document, arrangements
from llfsm_verify.verification.verify import verify
from tests.arrangement.requests.drawn import asking
from tests.cli.running import llfsm
from tests.quick import FRESH, many, spread
from tests.runtime.deciding.requests import Kind, Row, client, moves_of, port_runs, runs, world

KINDS: tuple[Kind, ...] = ("service", "action")


def plants_of(arrangement: Arrangement) -> Plants:
    return Plants(arrangement, lower(world(arrangement), keep_all_bits=True).choices, {})


def refuted(arrangement: Arrangement, rows: Iterable[Row], kind: Kind) -> tuple[int, str] | None:
    """The first cycle, from 0, that the plants cannot have made, and what is said of it."""
    plants = plants_of(arrangement)
    for number, row in enumerate(rows):
        difference = plants.follow(moves_of(row, kind))
        if difference is not None:
            return number, difference.sentence
    return None


class Plain:
    """The same by the definition: every successor by the interpreter in plain Python."""

    def __init__(self, program: Program) -> None:
        self.interpreter, self.layout = Interpreter(program), Layout.of(program)
        self.records = set(self.layout.initial(1))

    def follow(self, cycle: Sequence[Mapping[str, int]]) -> bool:
        """Whether there is a way to this cycle."""
        inputs = {k: v for k, v in cycle[0].items() if k != "want"}
        for number, move in enumerate(cycle):
            after = set()
            for record in self.records:
                values, outputs = self.layout.decode(record), self.layout.decode_outputs(record)
                for _, way in self.interpreter.successors(values, outputs):
                    sampled = dict(way.samples)
                    if sampled.get("want", move["want"]) != move["want"]:
                        continue
                    if number or all(way.values.get(k, v) == v for k, v in inputs.items() if k in self.driven):
                        after.add(self.layout.encode(way.values) + self.layout.encode_outputs(way.outputs))
            self.records = after
        return bool(self.records)

    driven = frozenset(("state", "answer", "near"))


def plain_of(arrangement: Arrangement, kind: Kind) -> Plain:
    found = Plain(lower(arrangement, keep_all_bits=True))
    found.driven = frozenset({"state", "answer"} | ({"near"} if kind == "action" else set()))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_each_run_of_a_port_is_a_run_of_the_plant(kind: Kind) -> None:
    """Of a port that is written here in a few lines, and of the one that is ours."""
    arrangement = client(kind)
    for seed in range(25):
        for made in (runs, port_runs):
            rows = list(made(Random(seed), kind, 60))
            assert refuted(arrangement, rows, kind) is None, (made.__name__, seed)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_each_move_of_the_plant_is_made_by_a_port(kind: Kind) -> None:
    """By what was asked in the frame before, each pair of states that follow one another."""
    native = NativeProgram(lower(client(kind), keep_all_bits=True))
    made, known = set(), set(native.layout.initial(1))
    open_ones = list(known)
    while open_ones:
        record = open_ones.pop()
        before = native.layout.decode(record)
        for edge in native.successors(record):
            if before["main.$begins"]:
                made.add((before["state"], before["ask"], native.layout.decode(edge.record)["state"]))
            if edge.record not in known:
                known.add(edge.record)
                open_ones.append(edge.record)
    seen = set()
    for seed in range(2000):
        last = Row(False, "IDLE", 0, False)
        for row in runs(Random(seed), kind, 60):
            seen.add((STATES[kind].index(last.state), int(last.ask), STATES[kind].index(row.state)))
            last = row
    assert seen == made


def removed() -> list[tuple[Kind, str, str]]:
    return [(kind, state, move) for kind in KINDS for state, moves in MOVES[kind].items() for move in moves]


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "state", "move"), removed())
def test_a_plant_without_one_of_its_moves_is_refuted(
    kind: Kind, state: str, move: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    fewer = {k: {s: tuple(m for m in ms if (s, m) != (state, move)) for s, ms in of.items()} for k, of in MOVES.items()}
    monkeypatch.setattr(plants_module, "MOVES", fewer)
    arrangement = client(kind)
    found = (refuted(arrangement, runs(Random(seed), kind, 60), kind) for seed in range(200))
    first = next(one for one in found if one is not None)
    assert f"`state` is {move}, where the models allow" in first[1]


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_with_a_time_out_the_end_is_in_time(kind: Kind) -> None:
    """A port that looks in every cycle keeps the promise; one that is silent for longer does not."""
    arrangement = client(kind, timeout="300ms")
    for seed in range(20):
        assert refuted(arrangement, runs(Random(seed), kind, 60, prompt=3), kind) is None, seed
    first = "WAITING" if kind == "service" else "PENDING"
    waits = [Row(True, "IDLE", 0, False), *[Row(True, first, 0, False)] * 30]
    found = refuted(arrangement, waits, kind)
    assert found is not None
    assert found[0] == 1 + (5 + 1) + 3 + 1  # the slack is five cycles and 100 ms
    assert "where the models allow" in found[1]
    silent = refuted(arrangement, [Row(True, "IDLE", 0, False)] * 30, kind)
    assert silent == (1 + 5 + 1, f"`state` is IDLE, where the models allow {first}")
    assert refuted(client(kind), waits, kind) is None


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_another_way_to_follow_comes_to_the_same(kind: Kind) -> None:
    """Also of runs that were changed in one place, of which most are none."""
    arrangement, refused = client(kind, timeout="500ms"), 0
    for seed in range(8):
        rng = Random(seed)
        rows = list(runs(rng, kind, 25))
        if seed % 4:
            at = rng.randrange(5, 25)
            rows[at] = rng.choice([
                rows[at]._replace(state=rng.choice(STATES[kind])), rows[at]._replace(answer=(rows[at].answer + 1) % 3),
            ])  # fmt: skip
        plants, plain = plants_of(arrangement), plain_of(arrangement, kind)
        for row in rows:
            known = plants.follow(moves_of(row, kind))
            assert plain.follow(moves_of(row, kind)) == (known is None), seed
            if known is not None:
                refused += 1
                break
            assert len(plants.records) == len(plain.records)
    assert refused > 1


class OwnPlants:
    """Random arrangements with plants: a run with them is, as the world has it, followed by them to its end."""

    def __init__(self) -> None:
        self.cycles = self.refused = 0

    def __call__(self, document: Document) -> None:
        given = build_arrangement(document)
        if not given.plants or any(machine.model for machine in given.machines):
            return
        cycle_ms = given.cycle_ms or Fraction(10)
        arrangement = runnable(given, simulated=True, cycle_ms=cycle_ms)
        recorded = lower(runnable(given, simulated=False, cycle_ms=cycle_ms), keep_all_bits=True)
        rng = Random(int(given.digest[:8], 16))
        free = {v.name: v.init for v in recorded.vars if v.free and isinstance(v.init, int)}
        plants = Plants(arrangement, recorded.choices, free)
        run, outside = Execution(plants.program), Execution(recorded)
        record, without = run.start(tuple(free.items())), outside.start(tuple(free.items()))
        for _ in range(12):
            posted = {c.input or c.name: rng.randint(c.type.low, c.type.high) for c in recorded.choices}
            moves: list[dict[str, int]] = []
            whole = False
            while not whole:
                chosen = {c.name: posted.get(c.input or c.name, rng.randint(c.type.low, c.type.high))
                          for c in plants.program.choices}  # fmt: skip
                if not run.enabled(record) or (step := run.step(record, Move(0, chosen))).status:
                    return
                record, values = step.record, run.layout.decode(step.record)
                posted |= {} if moves else {name: int(str(values[name])) for name in plants.inputs}
                moves.append({c.name: posted[c.input or c.name] for c in recorded.choices})
                without = outside.step(without, Move(0, moves[-1])).record
                whole = bool(run.layout.decode_outputs(record)[plants.program.cycle])
            known = outside.layout.decode(without)
            assert all(values[name] == value for name, value in known.items() if name in values)
            before = plants.records
            try:
                if plants.inputs and rng.random() < 0.3:
                    source = next(iter(plants.inputs.values()))
                    kind = next(c.type for c in recorded.choices if c.name == source)
                    wrong = {**moves[0], source: rng.randint(kind.low, kind.high)}
                    with suppress(Disagreement):  # it may lead a machine to a fault
                        self.refused += plants.follow([wrong] * len(moves)) is not None
                plants.records = before
                assert plants.follow(moves) is None
            except TooManyWays:
                return
            self.cycles += 1


@pytest.mark.long
def test_runs_of_random_plants_are_followed() -> None:
    check = OwnPlants()
    quiet = [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.large_base_example]
    spread(check, settings(max_examples=many(300), deadline=None, suppress_health_check=quiet), arrangements())
    assert check.cycles or not FRESH


def test_what_is_said_of_inputs_that_differ() -> None:
    asked, waits = Row(True, "IDLE", 0, False), Row(True, "WAITING", 0, False)
    arrangement = client("service")

    def said(*rows: Row) -> str:
        found = refuted(arrangement, rows, "service")
        assert found is not None
        assert found[0] == len(rows) - 1
        return found[1]

    assert said(asked, Row(True, "DONE", 0, False)) == "`state` is DONE, where the models allow IDLE or WAITING"
    assert said(asked, waits, Row(True, "WAITING", 2, False)) == (
        "`state` = WAITING, `answer` = 2 do not go together; the models allow `state` = WAITING, `answer` = 0; "
        "`state` = DONE, `answer` = 2; `state` = FAILED, `answer` = 2 or `state` = TIMED_OUT, `answer` = 0"
    )
    assert said(Row(False, "WAITING", 0, False)) == "`state` is WAITING, where the models allow IDLE"


def test_too_many_ways_are_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    plants = plants_of(client("action"))
    assert plants.follow(moves_of(Row(True, "IDLE", 0, False), "action")) is None
    monkeypatch.setattr(surroundings, "MOST_WAYS", 2)
    with pytest.raises(TooManyWays, match="the models may act in more than 2 ways"):
        plants.follow(moves_of(Row(True, "PENDING", 0, False), "action"))


NOTHING = "without one, a run in the world is compared with the `environment` that it has"
PORTS = """
ports:
  other:
    kind: stream
    read: {read}
    write: {write}
    inputs: [locate_state, arm_state, fruits]
    outputs: [locate, reach, locate_state, arm_state, fruits, beat]
    on_failure: stop
"""


def with_beat() -> str:
    """picking.yaml in cycles of 10 ms, without time-outs, and with a slot that changes in each cycle."""
    text = Path("tests/arrangement/requests/picking.yaml").read_text(encoding="utf-8")
    text = text.replace("cycle_ms: 100", "cycle_ms: 10").replace("after_ms(300)", "after_ms(30)")
    text = text.replace(", timeout: 1s", "").replace(", timeout: 2s", "")
    beat = "{inline: {machine: Beat, states: [{name: A, internal: beat = !beat;, stays: true}]}}"
    text = text.replace("  grip:", "  beat: {type: bool, role: output}\n  grip:")
    return text.replace("schedule: [robot]", f"  beat_machine: {beat}\nschedule: [robot, beat_machine]")


def record(folder: Path, *words: str) -> Path:
    """A run of picking.yaml against a real other side, in cycles of 10 ms; how long cycles take decides nothing."""
    (folder / "a.yaml").write_text(with_beat(), encoding="utf-8")
    (to_child, from_run), (to_run, from_child) = os.pipe(), os.pipe()
    (folder / "ports.yaml").write_text(PORTS.format(read=to_run, write=from_run), encoding="utf-8")
    command = [sys.executable, "tests/runtime/deciding/other_side.py", *words]
    child = subprocess.Popen(command, stdin=to_child, stdout=from_child)
    os.close(to_child)
    os.close(from_child)
    path = folder / "run.rec"
    run = [
        "run",
        str(folder / "a.yaml"),
        "--ports",
        str(folder / "ports.yaml"),
        "--for",
        "10min",
        "--set",
        "halt=false",
    ]
    try:
        done = subprocess.run(
            [sys.executable, "-m", "llfsm_verify", *run, "--record", str(path), "-q"],
            pass_fds=(to_run, from_run), capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert "port other: the writer has closed it" in done.stdout + done.stderr
    finally:
        os.close(to_run)
        os.close(from_run)
        child.wait(60)
    return path


@pytest.mark.long
def test_a_run_in_the_world_is_compared_with_its_plants(tmp_path: Path) -> None:
    path = record(tmp_path, "1")
    kept = llfsm("check-recording", str(path))
    assert kept.returncode == 0, kept.stdout + kept.stderr
    line = r"satisfied  the run keeps to `locate`, `arm` of `environment`"
    assert re.fullmatch(line + r"\n {11}all [\d,]+ cycles are a run of them\n", kept.stdout)
    longer = (tmp_path / "a.yaml").read_text(encoding="utf-8").replace("[fruits]}", "[]}")
    (tmp_path / "other.yaml").write_text(longer, encoding="utf-8")
    other = llfsm("check-recording", str(path), "--arrangement", str(tmp_path / "other.yaml"))
    assert other.returncode == 0  # an input that no plant writes has any values


@pytest.mark.long
def test_a_run_that_does_not_keep_to_its_plants(tmp_path: Path) -> None:
    path = record(tmp_path, "2", "wrong")
    found = llfsm("check-recording", str(path))
    assert found.returncode == 1, found.stdout + found.stderr
    assert re.fullmatch(
        r"violated  the run keeps to `locate`, `arm` of `environment`\n"
        r" {10}in frame [\d,]+: (`fruits` is|`locate_state` = |`arm_state` = ).*the models allow .*\n",
        found.stdout,
    )


CHILD = """
import json, random, sys

def say(**message):
    sys.stdout.write(json.dumps(message) + chr(10))
    sys.stdout.flush()

rng, late = random.Random(5), []
for line in sys.stdin:
    message = json.loads(line)
    if "hello" in message:
        say(hello=1)
    elif "request" in message:
        number = message["request"]
        if rng.random() < 0.05:
            sys.exit(3)
        elif message["name"] == "locate":
            say(answer=number, state=rng.choice(["DONE", "FAILED"]), values={"fruits": rng.randrange(4)})
        elif rng.random() < 0.3:
            say(answer=number, state=rng.choice(["REJECTED", "RECALLED", "LOST"]))
        else:
            say(state="ACTIVE", of=number)
            late.append(number)
    elif "cancel" in message and message["cancel"] in late:
        say(answer=message["cancel"], state=rng.choice(["PREEMPTED", "SUCCEEDED"]))
    if len(late) > 0 and rng.random() < 0.7:
        say(answer=late.pop(), state=rng.choice(["SUCCEEDED", "ABORTED", "RECALLED"]))
        say(answer=1, state="SUCCEEDED")
"""
PROCESS = """
ports:
  robot:
    kind: process
    run: [{python}, child.py]
    outputs: [beat]
    requests: {{locate: {{answers: {{fruits: fruits}}}}, arm: {{}}}}
"""


@pytest.mark.long
def test_a_port_that_is_a_program_keeps_to_the_plants_of_its_requests(tmp_path: Path) -> None:
    """Whatever its child does: it ends, answers twice, or says what it cannot say."""
    (tmp_path / "a.yaml").write_text(with_beat(), encoding="utf-8")
    (tmp_path / "child.py").write_text(CHILD, encoding="utf-8")
    (tmp_path / "ports.yaml").write_text(PROCESS.format(python=sys.executable), encoding="utf-8")
    path = tmp_path / "run.rec"
    run = ["run", str(tmp_path / "a.yaml"), "--ports", str(tmp_path / "ports.yaml"), "--for", "3s", "-q"]
    command = [sys.executable, "-m", "llfsm_verify", *run, "--set", "halt=false", "--record", str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = llfsm("check-recording", str(path))
    assert found.returncode == 0, found.stdout + found.stderr


@pytest.mark.slow
def test_what_cannot_be_compared_is_said(tmp_path: Path) -> None:
    path, lamp = tmp_path / "run.rec", tmp_path / "lamp.rec"
    picking = "tests/arrangement/requests/picking.yaml"
    run = ["run", picking, "--simulate", "--rate", "0", "--for", "2s", "-q"]
    assert llfsm(*run, "--record", str(path)).returncode == 0
    simulated = llfsm("check-recording", str(path))
    assert simulated.returncode == 2
    assert NOTHING in simulated.stderr
    plain = ["run", "models/traffic_lights/arrangement.yaml", "--rate", "0", "--for", "9s", "--set", "car=true"]
    assert llfsm(*plain, "--record", str(lamp), "-q").returncode == 0
    without = llfsm("check-recording", str(lamp))
    assert without.returncode == 2
    assert NOTHING in without.stderr


@pytest.mark.slow
def test_nothing_that_anybody_does_is_a_run_of_requests_too(tmp_path: Path) -> None:
    """Inputs that stay as they are: no port looks in time. A recording that is cut says so."""
    path = tmp_path / "run.rec"
    run = ["run", "tests/arrangement/requests/picking.yaml", "--rate", "0", "--for", "5s", "--set", "halt=false"]
    assert llfsm(*run, "--record", str(path), "-q").returncode == 0
    found = llfsm("check-recording", str(path))
    assert (found.returncode, found.stdout) == (1, (
        "violated  the run keeps to `locate`, `arm` of `environment`\n"
        "          in frame 9: `locate_state` is IDLE, where the models allow WAITING\n"
    ))  # fmt: skip
    data = path.read_bytes()
    path.write_bytes(data[:-1] + bytes([data[-1] ^ 1]))
    assert llfsm("check-recording", str(path)).stdout == found.stdout
    path.write_bytes(data)
    lenient = Path("tests/arrangement/requests/picking.yaml").read_text(encoding="utf-8")
    (tmp_path / "b.yaml").write_text(lenient.replace(", timeout: 1s", ""), encoding="utf-8")
    other = llfsm("check-recording", str(path), "--arrangement", str(tmp_path / "b.yaml"))
    assert other.returncode == 0, other.stdout


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(40) if FRESH else (3, 20))
def test_what_is_proved_with_plants_holds_in_runs_with_ports(seed: int, tmp_path: Path) -> None:
    """Random arrangements beside a child that does what it likes. It begins the cycles, so that nothing is late."""
    made = asking(Random(seed))
    (tmp_path / "a.yaml").write_text(json.dumps(made.document))
    child = [sys.executable, str(Path("tests/runtime/deciding/asked.py").resolve()), str(seed)]
    world: Document = {
        "kind": "process", "run": child, "clock": "external", "inputs": ["halt"], "outputs": ["grip"],
        "on_failure": "stop", "requests": made.requests,
    }  # fmt: skip
    (tmp_path / "p.yaml").write_text(json.dumps({"ports": {"world": world}}))
    record = str(tmp_path / "run.rec")
    words = ("run", str(tmp_path / "a.yaml"), "--ports", str(tmp_path / "p.yaml"), "--for", "25s", "--record", record)
    done = llfsm(*words)
    assert done.returncode == 0 and "250 cycles" in done.stdout, done.stdout + done.stderr
    checked = llfsm("check-recording", record)
    assert checked.returncode == 0, checked.stdout + checked.stderr
    asked = "\n".join(f"p{number}: {text}" for number, text in enumerate(made.properties))
    found = verify(
        build_arrangement(made.document), parse_properties([Source("p", asked)]),
        Options(Limits(max_states=20_000)), "explicit",
    )  # fmt: skip
    proved = [p.name for p in found.properties if p.verdict is Verdict.HOLDS]
    if proved:
        texts = [f"{name}: {made.properties[int(name[1:])]}" for name in proved]
        decided = llfsm("check-recording", record, "--allow-undecided", *(word for t in texts for word in ("-p", t)))
        assert decided.returncode == 0, decided.stdout + decided.stderr
