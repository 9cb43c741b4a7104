"""Cycles that a port begins: inputs are read in the cycle that they came with, and each frame goes back."""

from __future__ import annotations

import os
import select
import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from random import Random
from types import MappingProxyType

import pytest

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.jsonvalue import Json
from llfsm_verify.runtime.launch import serve
from llfsm_verify.runtime.live import control
from llfsm_verify.runtime.live.frame import CYCLE, ENDING, ENDINGS, PROCESS
from llfsm_verify.runtime.live.loop import LiveCode, Loop
from llfsm_verify.runtime.live.pace import Pace
from llfsm_verify.runtime.live.plan import safe_values, starting_values
from llfsm_verify.runtime.live.run import Run, Running
from llfsm_verify.runtime.live.slots import slots_of
from llfsm_verify.runtime.live.supervised import Supervised
from llfsm_verify.runtime.ports import ports as ports_of_run
from llfsm_verify.runtime.ports.port import Link, Port, PortSpec
from llfsm_verify.runtime.ports.ports import Ports
from llfsm_verify.runtime.recording.file import Recorder
from llfsm_verify.runtime.recording.replay import replay
from llfsm_verify.runtime.whiteboard.shared import Shared
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.values import Shown
from tests.runtime.live.runs import pids, turns_of
from tests.runtime.live.test_supervised import DOCUMENT, several

OUTPUTS = {"motor": "motor", "x": "x"}


class World(Port):
    """Begins cycle after cycle, each with a value; `last` is the one that it does not begin, and does `then` before."""

    every_frame = False

    def __init__(self, link: Link, last: int, then: Callable[[], object]) -> None:
        self.link, self.last, self.then = link, last, then
        self.random = Random(1)
        self.given: list[bool] = []
        self.seen: list[Mapping[str, Shown]] = []
        self._wake = os.eventfd(1, os.EFD_NONBLOCK)

    def waits(self) -> Iterator[tuple[int, int]]:
        yield self._wake, select.POLLIN

    def serve(self, ready: Mapping[int, int], now: float) -> None:
        del now
        if self._wake not in ready:
            return
        os.eventfd_read(self._wake)
        if len(self.given) == self.last:
            self.then()
            return
        self.given.append(self.random.random() < 0.3)
        self.link.cycle(len(self.given) - 1, {"x": self.given[-1]})

    def send(self, values: Mapping[str, Shown]) -> None:
        if len(self.seen) < len(self.given):
            self.seen.append(values)
            os.eventfd_write(self._wake, 1)

    def close(self) -> None:
        os.close(self._wake)


class Paced:
    """A run whose cycles a `World` begins."""

    def __init__(self, run: Running, shared: Shared, ports: Ports, said: list[str]) -> None:
        self.run, self.shared, self.ports, self.said = run, shared, ports, said
        self.then: Callable[[], object] = lambda: None

    def go(self) -> str:
        """Until its end, which is returned."""
        self.run.start()
        serve(self.run, [self.ports])
        self.ports.finish(self.run.report.ending)
        return self.run.report.ending

    @property
    def world(self) -> World:
        return self.worlds[0]

    worlds: list[World]


@contextmanager
def paced(
    record: Path | None = None,
    *,
    rounds: int = -1,
    last: int = -1,
    how: str = "separate",
    arrangement: Arrangement | None = None,
    when: str | None = None,
    timeout: float | None = None,
    events: Mapping[str, str] = MappingProxyType({}),
) -> Iterator[Paced]:
    arrangement = arrangement or several()
    code = LiveCode(lower(arrangement, keep_all_bits=True), safe=safe_values(arrangement))
    loop = Loop(code, held=starting_values(code.program))
    loop.limit(0)
    pace, said, worlds = Pace(rounds), list[str](), list[World]()
    with closing(Shared("test", loop)) as shared:
        recorder = None if record is None else Recorder(record, {}, loop)
        made: Running
        if how == "thread":
            made = Run(loop, recorder, shared=shared, pace=pace)
        else:
            made = Supervised(loop, shared, recorder, together=how == "together", pace=pace)

        def start(link: Link) -> World:
            worlds.append(World(link, rounds if last < 0 else last, lambda: of.then()))  # noqa: PLW0108 - it changes
            return worlds[0]

        spec = PortSpec("world", start, {"x": "x"}, OUTPUTS, timeout=timeout, paces=True, when=when, events=events)
        with made as run:
            ports = Ports(
                [spec], shared.posts, shared.segment.newest, slots_of(code), stop=run.stop, say=said.append, pace=pace,
                cycle_ms=10,
            )  # fmt: skip
            of = Paced(run, shared, ports, said)
            of.worlds = worlds
            with closing(ports):
                yield of


@pytest.mark.parametrize("how", ["separate", "together", "thread"])
def test_each_cycle_reads_what_began_it_and_its_frame_goes_back(tmp_path: Path, how: str) -> None:
    path, rounds = tmp_path / "recording", 40
    with paced(path, rounds=rounds, how=how) as made:
        assert made.go() == "stopped"
        report, world = made.run.report, made.world
        assert (report.cycles, report.external, report.lateness) == (rounds, True, None)
        assert len(world.given) == len(world.seen) == rounds and {*world.given} == {True, False}
    turns = turns_of(path)
    code = made.shared.loop.code
    assert list(replay(code, turns)) == turns
    slots = {slot.name: slot for slot in slots_of(code)}
    ends = [turn.frame for turn in turns if turn.frame[PROCESS] == 1 and not turn.frame[ENDING]]
    assert [frame[CYCLE] for frame in ends] == [*range(rounds)]
    assert [{name: slots[name].value(frame) for name in OUTPUTS} for frame in ends] == world.seen
    given = [world.given[turn.frame[CYCLE]] for turn in turns[1:-1]]
    assert [slots["x"].value(turn.frame) for turn in turns[1:-1]] == given, "of all processes in the cycle"


def test_a_world_that_hangs_is_waited_for_until_the_run_is_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ports_of_run, "WAITING", 0.0)
    with paced(last=3) as made:

        def stop_later() -> None:
            made.ports.serve(0)
            made.run.stop(signal.SIGINT)

        made.then = stop_later
        assert made.go() == "stopped"
        assert made.run.report.cycles == len(made.world.seen) == 3
        assert made.said == ["port world: the run waits for cycle 3, which the port begins"]


def test_a_pause_while_the_loop_waits_loses_no_cycle() -> None:
    """Nor does a `when`, which is for ports that time paces."""
    with paced(rounds=9, last=3, when="x") as made:
        asked = []

        def pause() -> bool:
            asked.append(made.run.loop.number)
            made.world.last = 9
            os.eventfd_write(made.world._wake, 1)
            return False

        made.then = lambda: made.run.hand_over(pause)
        assert made.go() == "stopped" and len(asked) == 1
        assert made.run.report.cycles == len(made.world.seen) == 9


def test_a_loop_that_dies_while_it_waits_gets_its_last_frame() -> None:
    with paced(last=3) as made:
        assert isinstance(made.run, Supervised)
        first = pids(made.run)
        made.then = lambda: [os.kill(pid, signal.SIGKILL) for pid in first]
        assert made.go() == "died"
        newest = made.shared.segment.newest()
        assert newest is not None and ENDINGS[newest[ENDING]] == "died" and made.run.report.cycles == 3


def test_the_world_gets_the_frame_of_the_cycle_that_ends_the_arrangement() -> None:
    state = {"name": "S", "on_entry": "motor = 2;"}
    machines = {name: {"inline": {"machine": "M", "states": [state]}} for name in "ab"}
    document = {**DOCUMENT, "machines": machines, "processes": {"p": ["a"], "q": ["b"]}}
    with paced(rounds=9, arrangement=build_arrangement(document)) as made:
        assert made.go() == "ended"
        assert made.run.report.cycles == len(made.world.given) == len(made.world.seen) < 9
        assert made.world.seen[-1]["motor"] == 2


def test_cycles_that_are_not_the_next_one_are_passed_over() -> None:
    with paced(rounds=5, last=2) as made:

        def wrong() -> None:
            link, counts = made.world.link, made.ports.counts["world"]
            link.cycle(7, {"x": True})
            link.cycle(2, {})
            link.cycle(2, {"x": True})
            assert counts.malformed == 2 and counts.taken == 2
            made.world.given.append(made.world.given[-1])
            made.world.last = 5
            made.then = lambda: None

        made.then = wrong
        assert made.go() == "stopped"
        assert made.said == ["port world: cycle 7 cannot begin where cycle 2 is the next one"]
        assert [values["x"] for values in made.world.seen] == made.world.given
        assert made.run.loop.control[control.OVERRUNS] == 0


def test_time_outs_count_the_cycles_of_the_world() -> None:
    """However long the world takes: 100 ms are ten cycles, and an input that comes in every cycle never fails."""
    for every, failures in ((1, 0), (9, 0), (12, 3)):
        with paced(rounds=40, timeout=0.1) as made:
            begin = made.world.link.cycle

            def cycle(number: int, values: Mapping[str, Json]) -> None:
                begin(number, {} if number % every else values)  # noqa: B023 - it is called in this round

            made.world.link.cycle = cycle  # type: ignore[method-assign]
            assert made.go() == "stopped" and made.ports.counts["world"].failures == failures
            assert made.said == (["port world: no message for 0.1 s: `x` keeps its last value"] if failures else [])


def test_events_that_wait_are_of_the_next_cycle_each() -> None:
    """Not of one that depends on when the port is served."""
    one = build_arrangement({**DOCUMENT, "processes": {"p": ["a", "b", "c"]}})
    with paced(rounds=30, arrangement=one, events={"x": "false"}) as made:
        begin, said = made.world.link.cycle, [3, 4, 5, 6, 20]
        made.world.link.look = lambda now: None  # type: ignore[attr-defined]  # which may be late

        def cycle(number: int, values: Mapping[str, Json]) -> None:
            if number in (3, 20):
                for _ in range(4 if number == 3 else 1):
                    made.world.link.take({"x": True})
            begin(number, {})

        made.world.link.cycle = cycle  # type: ignore[method-assign]
        assert made.go() == "stopped" and made.said == []
        assert [n for n, values in enumerate(made.world.seen) if values["x"]] == said
