"""The kind `whiteboard`: inputs that are slots of another run, so that arrangements work together.

Each run writes a whiteboard of its own, and reads those of others; two that read one another may start in any order.
"""

from __future__ import annotations

import select
import socket
from collections.abc import Iterator, Mapping
from decimal import Decimal

from llfsm_verify.runtime.ports import UNKNOWN
from llfsm_verify.runtime.ports.port import Kind, Link, Port, Started
from llfsm_verify.runtime.whiteboard.client import Whiteboard, WhiteboardError, called
from llfsm_verify.runtime.whiteboard.places import NoPlace, socket_path
from llfsm_verify.values import Shown
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Node, mark
from llfsm_verify.yaml.tables import Field, Single, Table

RETRY = 1.0
"""Seconds between two calls of a server who is not there."""


class BoardPort(Port):
    """Reads the newest frame of a whiteboard whenever it is served: all its values are of one moment."""

    every_frame = False

    def __init__(self, link: Link, name: str) -> None:
        self._link = link
        self._name = name
        self._calling: socket.socket | None = None
        """A call that the server has not answered yet; it may wait for us as we wait for it."""
        self._board: Whiteboard | None = None
        self._last = 0
        self._next = 0.0

    def waits(self) -> Iterator[tuple[int, int]]:
        """See `Port`."""
        for one in (self._calling, self._board):
            if one is not None:
                yield one.fileno(), select.POLLIN

    def serve(self, ready: Mapping[int, int], now: float) -> None:
        """See `Port`."""
        try:
            if self._board is None:
                self._call(ready, now)
            if self._board is not None:
                self._read(self._board)
        except (WhiteboardError, NoPlace) as problem:
            self.close()
            self._next = now + RETRY
            self._link.lost(str(problem))

    def _call(self, ready: Mapping[int, int], now: float) -> None:
        if self._calling is None:
            if now >= self._next:
                self._calling = called(self._name)
        elif self._calling.fileno() in ready:
            connection, self._calling = self._calling, None
            self._board, self._last = Whiteboard(self._name, connection), 0
            there = {slot.name for slot in self._board.slots}
            lacking = sorted(self._link.fields - there)
            if lacking:
                raise WhiteboardError(f"the whiteboard `{self._name}` has no slot `{lacking[0]}`")

    def _read(self, board: Whiteboard) -> None:
        if board.latest > self._last:
            view = board.view()
            self._last = view.number
            self._link.take({name: _told(view.values[name]) for name in self._link.fields})
            if view.ending not in ("running", "died"):
                raise WhiteboardError(f"the run of `{self._name}` is over: {view.ending}")
        if board.is_gone:
            raise WhiteboardError(f"the server of `{self._name}` is gone")

    def close(self) -> None:
        """See `Port`."""
        for one in (self._calling, self._board):
            if one is not None:
                one.close()
        self._calling = self._board = None


def _told(value: Shown) -> bool | int | str:
    return str(value) if isinstance(value, Decimal) else value


class Board(Kind):
    """`whiteboard:`, the name that the other run is given by ``--whiteboard``."""

    table = Table(
        "slots of another run",
        (
            Field(
                "whiteboard",
                "the name that the other run has by `--whiteboard`",
                Single(("string",), "^[A-Za-z0-9_][A-Za-z0-9_.-]{0,63}$"),
                required=True,
            ),
        ),
        needs={"whiteboard": ("inputs",)},
    )
    keys, required = table.keys, (*table.required, "inputs")

    def settings(self, report: Report, found: Mapping[str, Node], what: str, folder: str) -> Started | None:  # noqa: ARG002 - no path here
        """See `Kind`."""
        if "outputs" in found:
            message = f"{what} has `outputs`, but this run writes only to its own whiteboard"
            hint = "leave out `outputs`, and let the other run read it by a port of this kind"
            report.error(UNKNOWN, message, mark(found["outputs"]), hint)
            return None
        scalar = report.scalar(found["whiteboard"], "`whiteboard`")
        if scalar is None:
            return None
        name = scalar.text
        try:
            socket_path(name)
        except NoPlace as problem:
            report.error(UNKNOWN, str(problem), mark(scalar), "write the name that the other run has by `--whiteboard`")
            return None
        return Started(lambda link: BoardPort(link, name))


KIND = Board()
