"""An outside guard: watches the frames of a run, and gives commands when one of them violates a property.

It waits for nothing but frames and answers, so a command that waits for its cycle does not keep it from looking at the
next frames. `reaction_time.py` says how late its reaction is at worst; whether it was as quick as that assumes
is measured here.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.jsonvalue import Json
from llfsm_verify.program.program import Program
from llfsm_verify.runtime.deciding.frames import FrameMonitors
from llfsm_verify.runtime.deciding.recordings import Decided
from llfsm_verify.runtime.live.forks import readable
from llfsm_verify.runtime.live.frame import ENDING, ENDINGS, NUMBER
from llfsm_verify.runtime.live.slots import inputs_of
from llfsm_verify.runtime.outside.reaction_time import Order, Pace, reaction_time
from llfsm_verify.runtime.whiteboard.client import SECONDS, PostRefused, Whiteboard, WhiteboardError
from llfsm_verify.runtime.whiteboard.permissions import Permissions
from llfsm_verify.runtime.whiteboard.posts import Refused, by_name, operated
from llfsm_verify.runtime.whiteboard.subscription import Frames
from llfsm_verify.values import ValueProblem, choice_value

LOST = ("running", "died", "replaced")
"""How the last frame looks when a run was lost, and not ended."""


def request(order: Order) -> dict[str, Json]:
    """An order as a server is asked for it."""
    if order.kind is None:
        return {"post": {order.target: order.value}}
    return {"command": [order.kind, order.target, *([] if order.value is None else [order.value])]}


def refusal(order: Order, arrangement: Arrangement, program: Program) -> str | None:
    """Why a run of the arrangement would refuse it from this user; None: it would not, as far as one can tell."""
    try:
        if order.kind is not None:
            operated(by_name(program), order.kind, order.target, order.value)
            return Permissions.of(arrangement).denial(os.getuid(), order.kind, order.target)
        inputs = inputs_of(program)
        if order.target not in inputs:
            return f"there is no input `{order.target[:60]}`, only {', '.join(inputs) or 'none at all'}"
        choice_value(inputs[order.target], str(order.value))
    except (Refused, ValueProblem) as refused:
        return str(refused)
    return None


class Sent(NamedTuple):
    """A frame has decided that a property is violated, and the orders were sent."""

    decided: Decided
    orders: tuple[str, ...]


class Acted(NamedTuple):
    """An order is in force."""

    order: str
    seen: int
    """The number of the frame because of which it was given."""
    frame: int
    """The number of the first frame in which it is in force."""
    most: int | None
    """How many cycles later that could be at most; None: no pace was promised, or the guard was not there yet."""

    @property
    def late(self) -> bool:
        return self.most is not None and self.frame - self.seen > self.most


class _Waiting(NamedTuple):
    order: Order
    seen: int
    most: int | None


class OutsideGuard:
    """Decides properties on the frames of a whiteboard, and gives all orders when one is violated, once for each.

    `pace`: what is promised of this process; the run has so many `processes`.
    """

    def __init__(
        self,
        board: Whiteboard,
        monitors: FrameMonitors,
        orders: Sequence[Order],
        pace: Pace | None = None,
        processes: int = 1,
    ) -> None:
        self._board = board
        self._monitors = monitors
        self._orders = orders
        self._pace = pace
        self._processes = processes
        self._sent: deque[_Waiting] = deque()
        """Not answered yet."""
        self._posted: list[_Waiting] = []
        """Posts that no frame has shown yet."""
        self._slots = {slot.name: slot for slot in board.slots}
        self._began = 0
        self._last: Sequence[int] | None = None
        self._looked: tuple[int, int] | None = None
        """Of the last look: the number of its first frame, and that of the newest one when it was over."""
        self.widest = 0
        """The number of cycles within which each frame has been looked at, of those that came while it watched."""
        self.late = False
        """An order came later than was promised."""

    def watch(self) -> Iterator[Decided | Sent | Acted]:
        """What happens, until the run is over.

        PostRefused: the run refused an order; WhiteboardError: the run is lost, or ended before an order came.
        """
        with self._board.frames() as frames:
            self._began = self._board.latest
            running = True
            while running:
                running = self._board.is_running()
                for happened in self._look(frames):
                    self.late |= isinstance(happened, Acted) and happened.late
                    yield happened
                if running:
                    readable((frames.fileno(),), 1000 * frames.patience)
            self._measure([])
            yield from self._last_answers()
        self._over()

    def _last_answers(self) -> Iterator[Acted]:
        """An order may be what ended the run: the server still answers, or closes the connection."""
        limit = None if SECONDS is None else 1000 * SECONDS
        while self._sent and not self._board.is_gone and readable((self._board.fileno(),), limit):
            yield from self._answered()
        yield from self._answered()

    def _look(self, frames: Frames) -> Iterator[Decided | Sent | Acted]:
        """What is new, in frames and answers."""
        yield from self._answered()
        news = frames.read()
        self._measure(news)
        for frame in news:
            self._last = frame
            yield from self._shown(frame)
            for decided in self._monitors.read(frame):
                if decided.verdict == "violated":
                    self._order(frame[NUMBER])
                    yield Sent(decided, tuple(order.text for order in self._orders))
                else:
                    yield decided
        cycles = [frame[NUMBER] for frame in news if frame[NUMBER] > self._began and not frame[ENDING]]
        if cycles:
            self._looked = cycles[0], self._board.latest - bool(news[-1][ENDING])

    def _measure(self, news: Sequence[Sequence[int]]) -> None:
        """See how long the look before this one took. The frame of an ending comes without a cycle of its own."""
        if self._looked is not None:
            first, latest = self._looked
            ended = bool(news and news[-1][ENDING] and news[-1][NUMBER] == latest)
            self.widest = max(self.widest, latest - first + 1 - ended)
            self._looked = None

    def _order(self, seen: int) -> None:
        for order in self._orders:
            commands = sum(waiting.order.kind is not None for waiting in self._sent)
            before = commands if order.kind is not None else 0
            most = None
            if self._pace is not None and seen > self._began:
                most = reaction_time(self._pace, before + 1, self._processes).cycles
            self._board.send(request(order))
            self._sent.append(_Waiting(order, seen, most))
            if order.kind is None:
                self._posted.append(self._sent[-1])

    def _answered(self) -> Iterator[Acted]:
        refused = []
        for answer in self._board.answers():
            if not self._sent:
                raise WhiteboardError(f"the server of `{self._board.name}` answers a question that nobody asked")
            waiting = self._sent.popleft()
            match answer:
                case {"error": why}:
                    refused.append(f"`{waiting.order.text}` was refused: {why}")
                case {"frame": int(frame)} if waiting.order.kind is not None:
                    yield Acted(waiting.order.text, waiting.seen, frame, waiting.most)
                case {"ok": True} if waiting.order.kind is None:
                    pass  # a frame shows when the input has the value
                case _:
                    raise WhiteboardError(f"the server of `{self._board.name}` does not answer what was asked")
        if refused:
            raise PostRefused("; ".join(refused))

    def _shown(self, frame: Sequence[int]) -> Iterator[Acted]:
        """Inputs that have their new values in this frame."""
        for waiting in [waiting for waiting in self._posted if frame[NUMBER] > waiting.seen]:
            slot = self._slots[waiting.order.target]
            if slot.number(frame) == choice_value(slot.choice, str(waiting.order.value)):
                self._posted.remove(waiting)
                yield Acted(waiting.order.text, waiting.seen, frame[NUMBER], waiting.most)

    def _over(self) -> None:
        """WhiteboardError: the run is over in a way in which it should not be."""
        ending = "running" if self._last is None else ENDINGS[self._last[ENDING]]
        number = 0 if self._last is None else self._last[NUMBER]
        awaited = dict.fromkeys(waiting.order.text for waiting in (*self._sent, *self._posted))
        if awaited:
            named = ", ".join(f"`{text}`" for text in awaited)
            raise WhiteboardError(
                f"the run was over before {named} came, or nobody said so: frame {number:,} was its last one ({ending})"
            )
        if ending in LOST:
            why = {"running": "its server is gone", "died": "it died", "replaced": "it goes on as another one"}[ending]
            raise WhiteboardError(f"the run is lost, and is not watched any more: {why} after frame {number:,}")


def refusals(orders: Sequence[Order], arrangement: Arrangement, program: Program) -> Mapping[str, str]:
    """Why a run of the arrangement would refuse some of these orders, by their texts."""
    found = {order.text: refusal(order, arrangement, program) for order in orders}
    return {text: why for text, why in found.items() if why is not None}
