"""A loop and its ports on one thread, turn by turn, so that nothing depends on how fast anything is."""

from __future__ import annotations

import os
import select
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.requests import Request
from llfsm_verify.runtime.live.loop import LiveCode, Loop
from llfsm_verify.runtime.live.plan import starting_values
from llfsm_verify.runtime.live.slots import inputs_of, slots_of
from llfsm_verify.runtime.ports.file import read_ports
from llfsm_verify.runtime.ports.port import PortSpec
from llfsm_verify.runtime.ports.ports import Ports, opened
from llfsm_verify.runtime.stepping.drawing import free_inputs
from llfsm_verify.runtime.whiteboard.shared import Shared
from llfsm_verify.values import Shown
from tests.runtime.live.runs import code_of
from tests.runtime.whiteboard.test_server import KINDS


@cache
def kinds() -> LiveCode:
    """An arrangement with inputs of all types, which its machine copies where `go` is true."""
    return code_of(build_arrangement(KINDS))


class Bench:
    """`now` is the time that ports have; `said` is what they said."""

    def __init__(self, specs: Sequence[PortSpec], code: LiveCode | None = None) -> None:
        code = code or kinds()
        self.now = 0.0
        self.said: list[str] = []
        self.loop = Loop(code, held=starting_values(code.program))
        self.board = Shared("bench", self.loop)
        self.slots = slots_of(code)
        slots = {slot.name: slot for slot in self.slots}
        early = {spec.name: opened(spec, slots, 10, self.said.append) for spec in specs if spec.never}
        self.parameters = {name: link.parameters() for name, link in early.items()}
        try:
            self.ports = Ports(
                specs, self.board.posts, self.board.segment.newest, self.slots, say=self.said.append,
                clock=lambda: self.now, cycle_ms=10,
                early=early,
            )  # fmt: skip
        except BaseException:
            self.board.close()
            raise
        self.loop.begin(0)

    def turn(self) -> None:
        """Ports are served, and then a cycle runs."""
        self.ports.serve(0)
        self.loop.go(1)

    def swap(self, code: LiveCode) -> None:
        """Another run takes the place of this one, from its own beginning, but with what was posted."""
        before, self.loop = self.board, Loop(code, held=starting_values(code.program))
        self.board, self.slots = Shared("bench", self.loop), slots_of(code)
        self.board.posts.adopt(before.posts)
        self.ports.follow(self.board.posts, self.board.segment.newest, self.slots)
        before.close()
        self.loop.begin(0)

    def until(self, condition: Callable[[], bool]) -> None:
        """Turns, until something is so; the limit of the test ends them."""
        while not condition():
            self.turn()

    def value(self, name: str) -> Shown:
        """Of a slot in the newest frame."""
        return next(slot for slot in self.slots if slot.name == name).value(self.loop.frame)

    def has(self, name: str, value: Shown) -> Callable[[], bool]:
        """Whether a slot has a value."""
        return lambda: self.value(name) == value

    def end(self, ending: str) -> None:
        """The last frame, and what ports do with it."""
        self.loop.end(ending)
        self.ports.finish(ending)

    def close(self) -> None:
        self.ports.close()
        self.board.close()


@contextmanager
def bench(*specs: PortSpec, code: LiveCode | None = None) -> Iterator[Bench]:
    made = Bench(specs, code)
    try:
        yield made
    finally:
        made.close()


def declared(text: str, folder: Path, code: LiveCode | None = None, **requests: Request) -> tuple[PortSpec, ...]:
    """The ports that a file of this text declares, beside the requests of plants."""
    code = code or kinds()
    path = folder / "test.ports.yaml"
    path.write_text(text)
    return read_ports(str(path), inputs_of(code.program), slots_of(code), requests, free_inputs(code.program))


def lines_of(descriptor: int, serve: Callable[[], None]) -> Iterator[str]:
    """The lines that come from a descriptor, while others are served."""
    rest = b""
    while True:
        while b"\n" not in rest:
            serve()
            if select.select([descriptor], [], [], 0)[0]:
                data = os.read(descriptor, 1 << 16)
                assert data, f"there is no line: {rest!r}"
                rest += data
            else:
                time.sleep(0)
        line, _, rest = rest.partition(b"\n")
        yield line.decode()
