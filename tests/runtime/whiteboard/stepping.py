"""A whiteboard whose run takes a cycle when the test says so: what a guard outside does has nothing to do with time."""

from __future__ import annotations

import os
import random
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Self

from llfsm_verify.jsonvalue import Json
from llfsm_verify.runtime.live.loop import LiveCode, Loop
from llfsm_verify.runtime.live.plan import drawn_choices, starting_values
from llfsm_verify.runtime.live.slots import slots_of
from llfsm_verify.runtime.whiteboard.posts import Refused
from llfsm_verify.runtime.whiteboard.shared import Shared

LONGEST = 1000
"""Cycles that nobody takes after the last one; less are left when the last frame is there."""


class Stepped:
    """Stands for a `Whiteboard` and its `Frames`. It goes on by `cycles`, or as long as answers are awaited.

    A guard takes a whole look in any `every` cycles: some cycles pass before it reads, and some before what it sends
    comes to the run, the last of them perhaps not to its end.
    """

    name = "stepped"
    patience = 0.02

    def __init__(self, code: LiveCode, seed: int, every: int, cycles: int) -> None:
        self._loop = Loop(code, seed=seed, drawn=drawn_choices(code.program, {}), held=starting_values(code.program))
        self._shared = Shared(self.name, self._loop)
        self._loop.begin(0)
        self._chance = random.Random(seed)
        self._every = every
        self.left = cycles
        self.slots = slots_of(code)
        self.all: list[list[int]] = []
        """Every frame."""
        self._new: list[list[int]] = []
        self._withheld: list[list[int]] = []
        """Of a cycle that is under way while the guard looks."""
        self._answers: list[dict[str, Json]] = []
        self.awaited = 0
        self.lost = False
        """It ends without a last frame."""
        self._looking = 0
        """Cycles that this look may still take."""
        self._always = os.eventfd(1)
        self._take()

    @property
    def latest(self) -> int:
        return len(self.all) - len(self._withheld)

    def _take(self) -> None:
        frame = self._shared.segment.newest()
        assert frame is not None
        self.all.append(frame)
        self._new.append(frame)

    def step(self) -> None:
        """A cycle of a process."""
        self._loop.go(1)
        self._take()
        self._shared.posts.forward()
        self.left -= 1

    def frames(self) -> Stepped:
        return self

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def fileno(self) -> int:
        return self._always

    @property
    def is_gone(self) -> bool:
        return True

    def is_running(self) -> bool:
        return self.left > 0 or self.awaited > 0

    def read(self) -> list[list[int]]:
        """What has come since the last look."""
        self._new = [*self._withheld, *self._new]
        self._withheld = []
        away = self._chance.randint(1, max(1, self._every - len(self._new)))
        for _ in range(away - bool(self._new)):
            self.step()
        self._looking = max(0, self._every - len(self._new))
        if not self.is_running() and not self.lost and self.left >= -LONGEST:
            self.end("stopped")
        found, self._new = self._new, []
        return found

    def send(self, request: dict[str, Json]) -> None:
        """The rest of the look: whole cycles, and perhaps one that has begun."""
        for _ in range(self._chance.randint(0, self._looking)):
            self.step()
        self._looking = 0
        if not self._withheld and self._chance.random() < 0.7:
            self.step()
            self._withheld = [self._new.pop()]
        self.awaited += 1
        match request:
            case {"command": [str(kind), str(target), *value]}:
                try:
                    self._shared.posts.command(kind, target, value[0] if value else None, taken=self._taken)
                except Refused as refused:
                    self._answer({"error": str(refused)})
            case {"post": dict(values)}:
                self._shared.posts.post(values)
                self._answer({"ok": True})

    def _taken(self, frame: int) -> None:
        self._answer({"frame": frame})

    def _answer(self, answer: dict[str, Json]) -> None:
        self.awaited -= 1
        self._answers.append(answer)

    def answers(self) -> list[dict[str, Json]]:
        found, self._answers = self._answers, []
        return found

    def end(self, ending: str) -> None:
        """A last frame."""
        self._loop.end(ending, 0)
        self._take()
        self.left, self.awaited = -LONGEST - 1, 0

    def close(self) -> None:
        os.close(self._always)
        self._shared.close()


@contextmanager
def stepped(code: LiveCode, seed: int, every: int, cycles: int = 30) -> Iterator[Stepped]:
    board = Stepped(code, seed, every, cycles)
    try:
        yield board
    finally:
        board.close()
