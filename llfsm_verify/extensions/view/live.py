"""A run as pages follow it: one thread reads its frames, and each page is sent the rows that it has not got."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path

from llfsm_verify import Diagnostic, DiagnosticError, Whiteboard, WhiteboardError
from llfsm_verify.extensions.view.codes import ABSENT
from llfsm_verify.extensions.view.described import Described, describe
from llfsm_verify.extensions.view.frames import NUMBER, FrameReader, Row
from llfsm_verify.extensions.view.page import page_html
from llfsm_verify.extensions.view.server import Site, serve
from llfsm_verify.extensions.view.values import Exact
from llfsm_verify.plug import ENDING_WORDS, Json, NoPlace, near_names, whiteboard_names

UPDATES = 30
"""A second, at most."""
FIT = 64
"""Rows of an update."""
BEHIND = 16
"""Frames that come between two looks; 64 are kept."""
KEPT = 6000
"""Rows that a page gets which is opened later."""
SHORTEST = 0.001
"""Seconds between two looks, at least."""
AGAIN = 1.0
"""Seconds between two looks for another run of the name; soon where a machine was replaced."""
SOON = 0.05
HEARTBEAT = 5.0
"""Seconds after which a page is sent something, so that one that is gone is noticed."""


def view_live(
    name: str,
    arrangement_path: str | None,
    tell: Callable[[str], None],
    *,
    port: int = 0,
    ended: threading.Event | None = None,
) -> None:
    """Serve a page that follows the run with this whiteboard, until Ctrl-C, SIGTERM, or `ended`.

    DiagnosticError: there is no such run (E551), it runs another arrangement than that in the file (E552), it cannot
    listen (E554), or the file is wrong.
    """
    live = Live(name, arrangement_path, tell)
    serve(Site(live.page, events=live.events, stop=live.stop), f"the run `{name}`", tell, port=port, ended=ended)


class Followed:
    """One run from its first row to its end. What is not of the thread that reads it is to be used under its lock."""

    def __init__(self, board: Whiteboard, described: Described) -> None:
        self.key = str(board.told.get("epoch"))
        self.document = described.document
        self.rows: list[Row] = []
        self.first = 0
        """How many rows came before these."""
        self.base: list[Exact] = []
        """The values before the first row."""
        self.ending: str | None = None
        """In words."""
        self.latenesses: dict[str, Json] | None = None
        self.verdicts: dict[str, str] = {}
        self.replaced = False
        """Another run goes on with it."""
        self._board, self._cycle_ms = board, described.cycle_ms
        self._reader = FrameReader(
            board.slots, described.drawn, period=board.period, cycle_ms=described.cycle_ms, turns=described.turns
        )

    @property
    def end(self) -> int:
        """How many rows there have been."""
        return self.first + len(self.rows)

    @property
    def nap(self) -> float:
        """Seconds until the next look."""
        often = BEHIND * self._board.period / self._reader.processes
        return min(1 / UPDATES, max(often, SHORTEST)) if often else 1 / UPDATES

    def read(self) -> list[Row]:
        """What is new: as many rows as fit, evenly spaced, and the last one."""
        newest, number, frames = self._board.latest, self._reader.last + 1, list[list[int]]()
        while number <= newest:
            frame = self._board.frame(number)
            if frame is not None:
                frames.append(frame)
            number = number + 1 if frame is not None else max(number + 1, newest - 2 * BEHIND)
        if not frames and newest and (frame := self._board.frame()) is not None and frame[NUMBER] > self._reader.last:
            frames = [frame]  # all others are overwritten before they can be read
        every = -(-len(frames) // max(1, round(FIT * UPDATES * self.nap)))
        rows = []
        for place, frame in enumerate(frames, 1):
            if place % every and place < len(frames):
                self._reader.skip(frame)
            else:
                rows.append(self._reader.row(frame))
        return rows

    def take(self, rows: list[Row]) -> None:
        """Keep rows for pages, and forget the oldest ones."""
        self.rows += rows
        self.latenesses, self.verdicts = self._reader.latenesses.shown(), self._reader.verdicts
        more = len(self.rows) - KEPT
        if more > KEPT // 5:
            for row in self.rows[:more]:
                self.base = _after(self.base, row)
            del self.rows[:more]
            self.first += more

    def finish(self) -> None:
        """No other row comes."""
        with suppress(WhiteboardError):
            ending = self._board.view().ending
            self.replaced = ending == "replaced"
            self.ending = ENDING_WORDS.get(ending, "a fault of the model")
            return
        self.ending = ENDING_WORDS["died"]

    def window(self) -> dict[str, Json]:
        """The run of the document, with the rows that are kept."""
        run: dict[str, Json] = {
            "name": self._board.name, "kind": "live", "title": f"the run `{self._board.name}`", "ending": self.ending,
            "window": {"first": self.first, "total": None},
        }  # fmt: skip
        return run | self._columns(self.rows, 0, self.base)

    def update(self, number: int, base: int) -> tuple[dict[str, Json], int]:
        """What a page lacks which has all rows before `number`, the first of which was row `base`; and that number as
        it is for its next update: rows that are not kept any more are none of its rows.
        """
        lost = max(0, self.first - number)
        base += lost
        rows = self.rows[max(0, number - self.first) :]
        told: dict[str, Json] = {
            "missed": sum(row.missed for row in rows),
            "skipped": sum(row.skipped for row in rows) + lost,
            "behind_ms": (time.monotonic_ns() - rows[-1].committed) / 1e6 if rows else 0.0,
            "ending": self.ending,
            "lateness": self.latenesses,
            "verdicts": {**self.verdicts},
        }
        return self._columns(rows, number + lost - base, self.base if lost else ()) | told, base

    def _columns(self, rows: Sequence[Row], at: int, before: Sequence[Exact]) -> dict[str, Json]:
        """Rows from the page's row `at` on; after these values, if it does not have them."""
        timed = self._cycle_ms is not None
        changes: list[tuple[list[Json], list[Json]]] = [([], []) for _ in self._board.slots]
        fired: list[Json] = []
        marks: list[Json] = []
        for place, row in enumerate(rows, at):
            first = place == at and before
            for signal, value in enumerate(_after(before, row)) if first else row.changed:
                changes[signal][0].append(place)
                changes[signal][1].append(value)
            fired += [[place, *pair] for pair in row.fired]
            marks += [{"row": place, **mark} for mark in row.marks]
        return {
            "rows": {
                "step": [row.step for row in rows], "cycle": [row.cycle for row in rows],
                "time_ms": [row.time_ms for row in rows] if timed else None, "turn": [row.turn for row in rows],
            },
            "changes": [{"at": at, "values": values} for at, values in changes],
            "fired": fired,
            "marks": marks,
        }  # fmt: skip


def _after(values: Sequence[Exact], row: Row) -> list[Exact]:
    """The values of all signals at a row, from those before it."""
    found = list(values) or [False] * len(row.changed)
    for signal, value in row.changed:
        found[signal] = value
    return found


class Live:
    """The runs of a name, one after the other. DiagnosticError: see `view_live`."""

    def __init__(self, name: str, arrangement_path: str | None, tell: Callable[[str], None]) -> None:
        self._name, self._path, self._tell = name, arrangement_path, tell
        self._news = threading.Condition()
        self._stopped = threading.Event()
        try:
            self._board = Whiteboard(name)
        except (WhiteboardError, NoPlace) as error:
            raise absent(name, str(error)) from None
        try:
            self._followed = Followed(self._board, describe(self._board, arrangement_path, strict=True))
        except BaseException:
            self._board.close()
            raise
        self._thread = threading.Thread(target=self._follow, name="llfsm-view-frames", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Read no more, and end the streams."""
        self._stopped.set()
        with self._news:
            self._news.notify_all()
        self._thread.join(HEARTBEAT)

    # ------------------------------------------------------------ on the thread that reads

    def _follow(self) -> None:
        while not self._stopped.is_set():
            with self._board:
                self._read()
                if self._stopped.is_set():
                    return
            soon = self._followed.replaced
            while not self._stopped.wait(SOON if soon else AGAIN) and not self._attach():
                soon = False

    def _read(self) -> None:
        """Every frame until the run ends."""
        followed, board, goes_on = self._followed, self._board, True
        published = 0.0
        waiting: list[Row] = []
        while goes_on and not self._stopped.is_set():
            goes_on = board.is_running()
            waiting += followed.read()
            now = time.monotonic()
            if not goes_on or now >= published + 1 / UPDATES:
                with self._news:
                    followed.take(waiting)
                    if not goes_on:
                        followed.finish()
                    self._news.notify_all()
                waiting, published = [], now
            if goes_on:
                self._stopped.wait(followed.nap)

    def _attach(self) -> bool:
        """Whether another run of the name is there, which is followed from now on."""
        try:
            board = Whiteboard(self._name)
        except (WhiteboardError, NoPlace):
            return False
        if str(board.told.get("epoch")) == self._followed.key:  # it has ended, and its server not yet
            board.close()
            return False
        try:
            followed = Followed(board, describe(board, self._path, strict=False))
        except BaseException:
            board.close()
            raise
        with self._news:
            self._board, self._followed = board, followed
            self._news.notify_all()
        return True

    # ------------------------------------------------------------ on the threads of pages

    def page(self) -> str:
        """The page of the run, with what is kept of it."""
        with self._news:
            followed = self._followed
            document = {**followed.document, "runs": [followed.window()]}
            after = f"{followed.key}.{followed.end}.{followed.first}"
        return page_html(document, {"events": f"/events?after={after}"})

    def events(self, after: str) -> Iterator[bytes]:
        """What a page lacks after the event of this name, at most `UPDATES` times a second, until `stop`."""
        followed = self._followed
        number, base = _numbers(after, followed)
        told: str | None = None
        yield b"retry: 1000\n\n"
        while not self._stopped.is_set():
            with self._news:
                if number < 0 or self._followed is not followed:
                    break
                update, base = followed.update(number, base)
                number, told = followed.end, followed.ending
            name = f"{followed.key}.{number}.{base}.{time.time() * 1000:.0f}"
            yield f"id: {name}\ndata: {json.dumps(update, separators=(',', ':'))}\n\n".encode()
            self._stopped.wait(1 / UPDATES)
            while not self._has_news(followed, number, told) and not self._stopped.is_set():
                yield b": nothing new\n\n"
        if not self._stopped.is_set():
            yield b"event: document\ndata: {}\n\n"  # the page is to be loaded again

    def _has_news(self, followed: Followed, number: int, told: str | None) -> bool:
        def news() -> bool:
            other = self._followed is not followed or self._stopped.is_set()
            return other or followed.end > number or followed.ending != told

        with self._news:
            return self._news.wait_for(news, HEARTBEAT)


def _numbers(after: str, followed: Followed) -> tuple[int, int]:
    """The first row that a page lacks, and its row 0, by the last event that it got; -1: it is of another run."""
    with suppress(ValueError):
        key, number, base, *_ = after.split(".")
        if key == followed.key and 0 <= int(base) <= int(number) <= followed.end:
            return int(number), int(base)
    return -1, 0


def whiteboards() -> list[str]:
    """The names of runs."""
    try:
        return whiteboard_names()
    except NoPlace:
        return []


def absent(name: str, why: str) -> DiagnosticError:
    """E551; `why` a run that has a whiteboard cannot be shown. It names files and runs that are called nearly so."""
    known = whiteboards()
    if name in known:
        return DiagnosticError(Diagnostic(ABSENT, why, hint="`llfsm whiteboard list` says what there is"))
    path = Path(name)
    if path.is_dir():
        message = f"`{name}` is a folder: name a saved trace or a recording in it"
        return DiagnosticError(Diagnostic(ABSENT, message, hint="`llfsm whiteboard list` says what runs"))
    with suppress(OSError, ValueError):
        known += [str(path.with_name(each.name)) for each in path.parent.iterdir() if each.is_file() and path.name]
    near = near_names(name, known)
    message = f"there is no whiteboard and no file `{name[:100]}`"
    hint = f"{near or ''} `llfsm whiteboard list` says what runs".strip()
    return DiagnosticError(Diagnostic(ABSENT, message, hint=hint))
