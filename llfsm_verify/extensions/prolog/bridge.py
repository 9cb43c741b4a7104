"""The program behind a port of Prolog: lines of JSON on one side (decision 70), SWI-Prolog on the other.

It asks all queries with the newest facts, and posts the answers together. Prolog that does not answer within its limit
and GRACE is killed, and started again; one that ends is started again, the next times after a pause that doubles.
"""

from __future__ import annotations

import json
import os
import re
import select
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from contextlib import suppress
from decimal import Decimal, InvalidOperation
from pathlib import Path
from typing import TYPE_CHECKING, Any

from llfsm_verify.extensions.prolog.codes import NO_TERM, NO_VALUE, UNANSWERED, UNLOADABLE
from llfsm_verify.extensions.prolog.terms import HOLE, VALUE, datum, quoted

if TYPE_CHECKING:
    from llfsm_verify.plug import Json

WORKER = Path(__file__).with_name("worker.pl")
COMMAND = ("swipl", "-q", "-f", "none", "--no-tty", "--on-error=print", "--stack-limit=256m", "-t", "halt", str(WORKER))
GRACE = 0.25
"""Seconds after the limit of a query in which Prolog must have cut it."""
ENDING = 0.5
"""Seconds in which Prolog that says no more must have ended."""
PAUSE, LONGEST_PAUSE = 0.05, 10.0
"""Seconds until Prolog that has ended twice without an answer between is started again."""
LONGEST = 1 << 16
"""Bytes of a line that are kept."""
MOST_OUTPUT, MOST_LINES, MOST_WAITING = 200, 20, 100
"""Characters of a line that the program writes, and lines, which are told; lines that wait until a query ends."""
_ABSENT = re.compile(r"source_sink `(library\(.*\))' does not exist")


class _Ended(Exception):
    """Prolog is not there any more; the message says how it went."""


class _Over(Exception):
    """The run is."""


class _Unanswered(Exception):
    """A query has no answer that its input can have; the message is for the user."""

    def __init__(self, why: str, *, gone: bool = False) -> None:
        super().__init__(why)
        self.gone = gone
        """Whether Prolog has to be started again."""


class _Unloadable(Exception):
    """A program cannot be used."""


class Prolog:
    """One process of it."""

    def __init__(self) -> None:
        theirs, self._in = os.pipe()
        self._out, ours = os.pipe()
        self._output, written = os.pipe()
        streams = (
            f"open('/dev/fd/{theirs}', read, I, [encoding(utf8)]), open('/dev/fd/{ours}', write, O, [encoding(utf8)])"
        )
        try:
            self._process = subprocess.Popen(  # noqa: S603 - the user's program
                [*COMMAND[:-3], "-g", f"{streams}, catch(llfsm_worker:serve(I, O), _, halt(2))", *COMMAND[-3:]],
                stdin=subprocess.DEVNULL, stdout=written, stderr=written, pass_fds=(theirs, ours),
                env={**os.environ, "LC_ALL": "C.UTF-8"},
            )  # fmt: skip
        finally:
            for descriptor in (theirs, ours, written):
                os.close(descriptor)
        self._ends = os.pidfd_open(self._process.pid)
        self.descriptors = [self._out, self._output, self._ends]
        self._how = ""
        self._begun = {self._out: b"", self._output: b""}
        """Of lines."""
        self.waiting: list[list[str]] = []
        """Replies that nobody has taken."""
        self.written: list[str] = []
        """Lines of the program."""

    def ask(self, line: str) -> None:
        """_Ended."""
        try:
            os.write(self._in, f"{line}\n".encode())
        except OSError:
            raise _Ended(self.end(ENDING)) from None

    def read(self, ready: Mapping[int, int]) -> None:
        """Take what has come. _Ended."""
        written = self._lines(self._output, ready)
        if written is None:
            self.descriptors.remove(self._output)
        room = MOST_WAITING - len(self.written)
        self.written += [
            line.decode(errors="replace").strip()[:MOST_OUTPUT] for line in (written or [])[: max(0, room)]
        ]
        replies = self._lines(self._out, ready)
        self.waiting += [line.decode().split(" ") for line in replies or ()]
        if replies is None or (self._ends in ready and self._out not in ready):
            raise _Ended(self.end(ENDING))

    def _lines(self, descriptor: int, ready: Mapping[int, int]) -> list[bytes] | None:
        """The lines that have come; None: no more come."""
        data = os.read(descriptor, 1 << 16) if descriptor in ready else b""
        *lines, self._begun[descriptor] = (self._begun[descriptor] + data).split(b"\n")
        self._begun[descriptor] = self._begun[descriptor][:LONGEST]
        return lines if data or descriptor not in ready else None

    def end(self, patience: float = 0.0) -> str:
        """Kill it if it still runs after so many seconds; how it ended, in words."""
        if not self._how:
            killed = not select.select([self._ends], [], [], patience)[0]
            if killed:
                self._process.kill()
            code = self._process.wait()
            for descriptor in (self._in, self._out, self._output, self._ends):
                os.close(descriptor)
            self._how = "Prolog was killed" if killed or code < 0 else f"Prolog has ended with code {code}"
        return self._how


class Bridge:
    """Between the run and Prolog; `hello` is the first line of the run."""

    def __init__(self, hello: Mapping[str, Any]) -> None:
        told = hello["told"]
        self._told, self._types = told, hello["inputs"]
        self._digits = {field: kind["digits"] for field, kind in hello["outputs"].items()}
        self._limit: float = told["limit"]
        self._begun = b""
        """Of a line of the run."""
        self._facts: Mapping[str, Json] | None = None if told["facts"] else {}
        """The newest values of the outputs; None: none have come."""
        self._new = not told["facts"]
        """Whether they are not asked with yet."""
        self._pause = 0.0
        self._notes: list[str] = []
        """Warnings of the program, which are told when the run goes on."""
        self._written: set[str] = set()
        """Lines of the program that were told."""
        self._prolog = Prolog()

    def load(self) -> None:
        """Until Prolog has the program. _Unloadable, _Over."""
        try:
            self._load()
        except _Ended as why:
            raise self._unloadable(": ".join([str(why), *self._prolog.written[-1:]])) from None

    def _load(self) -> None:
        told = self._told
        lists = ", ".join(f"[{', '.join(told[key].values())}]".replace(HOLE, "_") for key in ("facts", "queries"))
        self._prolog.ask(f"load({quoted(told['file'])}, {lists}).")
        problems = []
        while True:
            reply = self._reply(told["patience"])
            if reply is None:
                raise self._unloadable(f"it is not loaded within {told['patience']:g} s")
            kind, place, text = reply
            if kind == "loaded":
                break
            line, column = place[1:]
            if kind in ("fact", "query"):
                field = [*told["facts" if kind == "fact" else "queries"]][line]
                problems.append(f"{field}:0:0: {NO_TERM}: {' '.join(text.split())}")
                continue
            what = {
                "undefined": f"`{text}` is not defined",
                "clause": f"`{text}` is a fact of the port, and has clauses",
                "halt": "it ends Prolog by `halt`",
            }.get(kind, _ABSENT.sub(r"`\1` is not installed, or its name is wrong", " ".join(text.split())))
            if kind == "warning":
                self._notes.append(f"{self._at(place[0], line)}{what}")
            else:
                problems.append(f"{self._shown(place[0])}:{line}:{column}: {UNLOADABLE}: {what}")
            if kind == "halt":
                break
        problems = list(dict.fromkeys(problems))
        if problems:
            others = len(problems) - 1
            more = f" (and {others} more problem{'s' * (others > 1)} in it)" if others else ""
            raise _Unloadable(problems[0] + more)

    def serve(self) -> None:
        """Until the run has ended. _Unloadable, _Over."""
        again, every = 0.0, self._told["every"]
        for note in self._notes:
            _tell(say=note)
        while True:
            now = time.monotonic()
            try:
                if self._new or (self._facts is not None and every is not None and now >= again):
                    self._new, again = False, now + (every or 0.0)
                    self._round(self._facts or {})
                else:
                    self._move(None if every is None or self._facts is None else max(0.0, again - now))
            except _Ended as why:
                _tell(say=f"{why}, and is started again")
                self._restart()
                self._new = self._facts is not None

    def _round(self, values: Mapping[str, Json]) -> None:
        """Ask everything. _Ended, if it has ended before the first question."""
        made = (self._fact(field, fact, values) for field, fact in self._told["facts"].items())
        facts = ", ".join(fact for fact in made if fact is not None)
        answers: dict[str, Json] = {}
        for field, query in self._told["queries"].items():
            value = VALUE if HOLE in query else "true"
            line = f"ask([{facts}], {query.replace(HOLE, VALUE)}, {value}, {self._limit})."
            try:
                answers[field] = self._answer(field, line)
                self._pause = 0.0
            except _Unanswered as why:
                _tell(say=str(why))
                _tell(lost=[field], why="a query has no answer")
                if why.gone:
                    self._restart()
        if answers:
            _tell(values=answers)

    def _fact(self, field: str, fact: str, values: Mapping[str, Json]) -> str | None:
        """As Prolog reads it; None: it is not there."""
        value = values.get(field)
        if HOLE not in fact:
            return fact if value is True or self._told["values"].get(value) == "true" else None
        return fact.replace(HOLE, datum(value, self._digits[field]))

    def _answer(self, field: str, line: str) -> Json:
        """Of one query. _Unanswered."""
        try:
            self._prolog.ask(line)
            reply = self._reply(self._limit + GRACE)
        except _Ended as why:
            raise _Unanswered(f"{UNANSWERED}: `{field}`: {why}", gone=True) from None
        finally:
            self._show_output()
        if reply is None:
            raise _Unanswered(f"{UNANSWERED}: `{field}` could not be cut at its limit, so Prolog is killed", gone=True)
        kind, (file, at, _), text = reply
        if kind == "halt":
            raise _Unanswered(f"{self._at(file, at)}{UNANSWERED}: `{field}` has ended Prolog by `halt`", gone=True)
        if kind == "limit":
            raise _Unanswered(f"{UNANSWERED}: `{field}` has no answer within its limit of {1000 * self._limit:g} ms")
        if kind == "error":
            raise _Unanswered(f"{self._at(file, at)}{UNANSWERED}: `{field}`: {' '.join(text.split())}")
        found = self._value(kind, text, self._types[field])
        if found is None:
            what = "no answer" if kind == "none" else f"the answer `{text}`, which is not a value of its input"
            if kind == "name" and self._types[field]["labels"] and text not in self._told["values"]:
                near = next((one for one in self._types[field]["labels"] if one.lower() == text.lower()), "…")
                what += f": add `{text}: {near}` to `values`"
            raise _Unanswered(f"{UNANSWERED if kind == 'none' else NO_VALUE}: `{field}` has {what}")
        return found

    def _value(self, kind: str, text: str, of: Mapping[str, Any]) -> Json:
        """An answer as the run reads it; None: it is no value of this type."""
        if kind == "none":
            return False if of["boolean"] else None
        ours = self._told["values"].get(text) if kind == "name" else None
        if ours is not None and _fitting("name" if of["boolean"] or of["labels"] else "number", ours, of) is not None:
            return text
        return _fitting(kind, text, of)

    def _restart(self) -> None:
        """_Unloadable, _Over."""
        how = self._prolog.end()
        if not self._told["restart"]:
            raise self._unloadable(how)
        until = time.monotonic() + self._pause
        self._pause = min(max(PAUSE, 2 * self._pause), LONGEST_PAUSE)
        while (left := until - time.monotonic()) > 0:
            self._move(left, prolog=False)
        self._prolog = Prolog()
        self.load()

    def _unloadable(self, why: str) -> _Unloadable:
        return _Unloadable(f"{self._shown(self._told['file'])}:0:0: {UNLOADABLE}: {why}")

    def _reply(self, seconds: float) -> tuple[str, tuple[str, int, int], str] | None:
        """The next reply of Prolog; None: it takes too long. _Ended, _Over."""
        until = time.monotonic() + seconds
        while not self._prolog.waiting:
            left = until - time.monotonic()
            if left <= 0:
                return None
            self._move(left)
        kind, line, column, file, text = self._prolog.waiting.pop(0)
        return kind, (_characters(file), int(line), int(column)), _characters(text)

    def _move(self, seconds: float | None, *, prolog: bool = True) -> None:
        """Take what comes, for at most so long. _Ended, _Over."""
        poll = select.poll()
        for descriptor in (0, *(self._prolog.descriptors if prolog else ())):
            poll.register(descriptor, select.POLLIN)
        ready = dict(poll.poll(None if seconds is None else 1000 * seconds))
        if 0 in ready:
            data = os.read(0, 1 << 16)
            if not data:
                raise _Over
            *lines, self._begun = (self._begun + data).split(b"\n")
            for said in (json.loads(line, parse_float=str) for line in lines):
                if "end" in said:
                    raise _Over
                if "values" in said:
                    self._facts, self._new = said["values"], True
        if prolog:
            self._prolog.read(ready)

    def _show_output(self) -> None:
        """What the program has written is told to the user."""
        for text in self._prolog.written:
            if text and text not in self._written and len(self._written) < MOST_LINES:
                self._written.add(text)
                more = "" if len(self._written) < MOST_LINES else " (other lines are not shown)"
                _tell(say=f"the program writes: {text}{more}")
        self._prolog.written.clear()

    def _shown(self, file: str) -> str:
        return os.path.relpath(file) if file else "?"

    def _at(self, file: str, line: int) -> str:
        return f"{self._shown(file)}:{line}: " if file else ""

    def close(self) -> None:
        """Prolog ends with the bridge."""
        self._prolog.end()


def _fitting(kind: str, text: str, of: Mapping[str, Any]) -> Json:
    """The value; None: it is not of this type."""
    if of["boolean"] or of["labels"]:
        known: Mapping[str, Json] = (
            {"true": True, "false": False} if of["boolean"] else {one: one for one in of["labels"]}
        )
        return known.get(text) if kind == "name" else None
    with suppress(InvalidOperation, OverflowError):
        number = Decimal(text if kind == "number" else "NaN").scaleb(of["digits"])
        if number.is_finite() and number == number.to_integral_value() and of["low"] <= number <= of["high"]:
            return f"{number.scaleb(-of['digits']):.{of['digits']}f}"
    return None


def _characters(codes: str) -> str:
    return "".join(chr(int(code)) for code in codes.split(",")[1:])


def _tell(**message: Json) -> None:
    with suppress(OSError):
        sys.stdout.write(f"{json.dumps(message)}\n")
        sys.stdout.flush()


def main() -> int:
    """Until the run has ended, or the program cannot be used."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))
    bridge = Bridge(json.loads(sys.stdin.readline()))
    try:
        bridge.load()
        _tell(hello=1)
        bridge.serve()
    except _Unloadable as why:
        _tell(say=str(why))
        return 1
    except _Over:
        pass
    finally:
        bridge.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
