"""Guards outside a run: what they command, how late that is at worst, and what they do when something is refused."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from contextlib import closing
from functools import cache

import pytest

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.runtime.deciding.frames import FrameMonitors
from llfsm_verify.runtime.live.loop import LiveCode
from llfsm_verify.runtime.live.slots import Slot
from llfsm_verify.runtime.outside.guard import Acted, OutsideGuard, Sent
from llfsm_verify.runtime.outside.reaction_time import Order, Pace, reaction_time
from llfsm_verify.runtime.whiteboard.client import PostRefused, Whiteboard, WhiteboardError
from llfsm_verify.runtime.whiteboard.places import socket_path
from llfsm_verify.runtime.whiteboard.segment import Attached, Segment
from llfsm_verify.runtime.whiteboard.subscription import Feed, Frames, most_missed
from tests.runtime.live.runs import code_of
from tests.runtime.whiteboard.stepping import Stepped, stepped
from tests.runtime.whiteboard.test_server import boards, served, tidy  # noqa: F401 - fixtures

STATES = [
    {"name": "S", "internal": "lamp = go; seen = mode;", "transitions": [{"when": "false", "to": "S"}]},
    {"name": "WAITS", "stays": True},
]
MACHINE = {"inline": {"machine": "M", "states": STATES, "suspend": "WAITS"}}
DOCUMENT: dict[str, object] = {
    "name": "lamp",
    "cycle_ms": 1,
    "whiteboard": {
        "go": {"type": "bool", "role": "input"},
        "mode": {"type": "0..3", "role": "input"},
        "lamp": {"type": "bool", "role": "output"},
        "seen": {"type": "0..3", "role": "output"},
        "set": {"type": "0..3"},
    },
    "machines": {"m": MACHINE, "idle": {"inline": {"machine": "I", "states": STATES[1:]}}},
    "operators": {"suspend": ["m", "idle"], "write": ["set"]},
}
ALONE = build_arrangement({**DOCUMENT, "schedule": ["m", "idle"]})
TWO = build_arrangement({**DOCUMENT, "processes": {"a": ["m"], "b": ["idle"]}})


@cache
def alone() -> LiveCode:
    return code_of(ALONE)


SUSPEND, WRITE = Order("suspend", "m"), Order("write", "set", "2")


def guard_of(
    board: Stepped | Whiteboard,
    orders: Sequence[Order],
    pace: Pace | None = None,
    text: str = "dark: G !lamp",
    arrangement: object = ALONE,
) -> OutsideGuard:
    monitors = FrameMonitors(arrangement, parse_properties([Source("p", text)]), board.slots)  # type: ignore[arg-type]
    return OutsideGuard(board, monitors, orders, pace, len(arrangement.processes))  # type: ignore[arg-type, attr-defined]


def slot(board: Stepped, name: str) -> Slot:
    return next(slot for slot in board.slots if slot.name == name)


@pytest.mark.slow
@pytest.mark.parametrize(("every", "commands"), [(1, 1), (2, 1), (3, 2), (5, 3)])
def test_the_worst_reaction_is_the_computed_one(every: int, commands: int) -> None:
    """Of many runs with a guard that keeps its pace by chance: none is later, and one is as late."""
    orders = [SUSPEND, WRITE, Order("suspend", "idle")][:commands]
    delays = []
    for seed in range(1, 80):
        with stepped(alone(), seed, every) as board:
            guard = guard_of(board, orders, Pace(every))
            acted = [found for found in guard.watch() if isinstance(found, Acted)]
            assert not guard.late
            assert guard.widest <= every
            assert [one.order for one in acted] == ([order.text for order in orders] if acted else [])
            broken = next((frame[0] for frame in board.all if slot(board, "lamp").number(frame)), None)
            if acted and acted[0].most is not None:
                waits = slot(board, "m")
                suspended = next(frame[0] for frame in board.all if waits.labels[waits.number(frame)] == "WAITS")
                assert suspended == acted[0].frame
                assert {one.seen for one in acted} == {broken}
                delays.append(acted[-1].frame - acted[-1].seen)
    assert max(delays) == reaction_time(Pace(every), commands).cycles
    assert len(delays) > 40


@pytest.mark.slow
def test_with_two_processes_the_target_may_have_its_turn_later() -> None:
    code, delays = code_of(TWO), []
    for seed in range(1, 120):
        with stepped(code, seed, 2) as board:
            acted = [f for f in guard_of(board, [SUSPEND], Pace(2), arrangement=TWO).watch() if isinstance(f, Acted)]
            waits = slot(board, "m")
            done = [frame[0] for frame in board.all if waits.labels[waits.number(frame)] == "WAITS"]
            if acted and acted[0].most is not None and done:
                delays.append(done[0] - acted[0].seen)
    assert max(delays) == reaction_time(Pace(2), processes=2).cycles == 4


def test_an_input_that_is_posted_and_each_property_once() -> None:
    text = "dark: G !lamp\nno: G set == 0"
    with stepped(alone(), 7, 1) as board:
        found = list(guard_of(board, [Order(None, "mode", "1"), WRITE], text=text).watch())
        sent = [one.decided.line.name for one in found if isinstance(one, Sent)]
        assert sorted(sent) == ["dark", "no"]  # the write itself violates the other one
        acted = [one for one in found if isinstance(one, Acted)]
        assert len(acted) == 4
        first = next(one for one in acted if one.order == "mode = 1")
        shown = slot(board, "mode")
        assert all(shown.number(frame) == 1 for frame in board.all if frame[0] >= first.frame)
        assert all(one.most is None and not one.late for one in acted)


def test_what_is_refused_and_what_is_lost() -> None:
    with (
        stepped(alone(), 1, 1) as board,
        pytest.raises(PostRefused, match=r"`restart m` was refused: `operators:` does"),
    ):
        list(guard_of(board, [Order("restart", "m"), SUSPEND]).watch())
    for ending, why in ((None, "its server is gone"), ("died", "it died"), ("replaced", "it goes on as another one")):
        with stepped(alone(), 1, 1) as board:
            board.lost = True
            if ending is not None:
                board.end(ending)
            guard = guard_of(board, [SUSPEND], text="never: G set < 3")
            with pytest.raises(WhiteboardError, match=f"not watched any more: {why}"):
                list(guard.watch())
    with stepped(alone(), 1, 1) as board:
        guard = guard_of(board, [SUSPEND])
        for found in guard.watch():
            if isinstance(found, Sent):
                board.end("stopped")
                break
        with pytest.raises(WhiteboardError, match="the run was over before `suspend m` came"):
            guard._over()


def test_a_run_that_ends_by_itself_is_not_lost() -> None:
    with stepped(alone(), 1, 1) as board:
        board.end("ended")
        assert list(guard_of(board, [SUSPEND], text="never: G set < 3").watch()) == []


def test_late_is_more_than_was_promised() -> None:
    assert Acted("suspend m", 5, 9, 3).late
    assert not Acted("suspend m", 5, 8, 3).late
    assert not Acted("suspend m", 5, 9, None).late


def test_reactions_of_nothing() -> None:
    with pytest.raises(ValueError, match="at least 1"):
        reaction_time(Pace(0))
    assert reaction_time(Pace(2, 3), 4).cycles == 10 and reaction_time(Pace(2, 3), 4).first == 7
    assert reaction_time(Pace(1)).milliseconds(20) == 40


class Asleep:
    """A socket to which nothing is sent."""

    def recv(self, _: int) -> bytes:
        raise BlockingIOError


@pytest.mark.parametrize("every", [1, 62, 63, 64, 65, 80, 200])
def test_how_many_frames_are_missed_at_most(every: int) -> None:
    """A reader that reads every so many frames misses as many as are computed.

    At 64 the frame after the last one is only just there: it is not if the next one is being written.
    """
    with closing(Segment("missed", 1)) as segment, closing(Attached(segment.descriptor)) as attached:
        reader = object.__new__(Frames)
        reader._attached, reader._last, reader._pending = attached, 0, deque()
        reader._feed = Feed(attached, Asleep(), Asleep(), lambda: True, lambda: None)  # type: ignore[arg-type]
        segment.publish([1])
        reader.read()
        for number in range(2, every + 2):
            segment.publish([number])
        first = reader.read()[0][0]
        assert first - 2 == (0 if every == 64 else most_missed(every))


@pytest.mark.slow
@pytest.mark.parametrize("woken", [True, False])
def test_a_guard_of_a_run(woken: bool) -> None:
    """Over a real socket: the input that breaks the rule is posted once the guard watches, whom nobody may wake."""
    with served(ALONE), Whiteboard("board") as board, Whiteboard("board") as other:
        guard = guard_of(board, [SUSPEND, Order(None, "mode", "2")], Pace(1 << 20))
        read, posted = guard._monitors.read, []

        def post_once(frame: Sequence[int]) -> list[object]:
            for path in [] if woken else socket_path("board").parent.glob("*.wake"):
                path.unlink()
            if not posted and frame[0] > guard._began:
                other.post(go=True)
                posted.append(frame[0])
            return read(frame)  # type: ignore[return-value]

        guard._monitors.read = post_once  # type: ignore[assignment, method-assign]
        found = []
        for happened in guard.watch():
            found.append(happened)
            if len(found) == 3:
                break
        sent, *acted = found
        assert isinstance(sent, Sent) and sent.orders == ("suspend m", "mode = 2")
        assert sorted(one.order for one in acted) == ["mode = 2", "suspend m"]
        assert all(one.seen == sent.decided.frame < one.frame and not one.late for one in acted)
        assert other.state_of("m") == "WAITS" and other.get("mode") == 2
