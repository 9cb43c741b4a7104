"""Rows of logs that have times: the times, exact and never falling, and properties whose bounds compare them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from fractions import Fraction

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.logs.codes import UNREADABLE
from llfsm_verify.extensions.logs.mapping import NUMBER, LogMapping
from llfsm_verify.plug import (
    FALSE_FORMULA,
    TIMED,
    Decided,
    Formula,
    Goal,
    Letter,
    Row,
    Stamped,
    Unstamped,
    Watch,
    evaluate_formula,
    exact_decimal,
    operators,
)  # fmt: skip

_DATE = re.compile(
    r"(\d{4}-\d\d-\d\d[T ]\d\d:\d\d(?::\d\d)?)(?:(?<=:\d\d:\d\d)\.(\d{1,12}))?(Z|[+-]\d\d:?\d\d)?\Z", re.ASCII
)
_BEGINNING = datetime(1970, 1, 1, tzinfo=UTC)
HINT = "correct the log, or leave `time` out of the mapping: rows are then steps, and bounds in time count `cycle_ms`"


class Times:
    """The times of the rows of one log, in milliseconds."""

    def __init__(self, mapping: LogMapping, path: str) -> None:
        self._mapping, self._path = mapping, path
        self._last: tuple[Fraction, str] | None = None
        self._kind: str | None = None
        """Of the rows so far: how their times are written."""

    def read(self, row: Row) -> Fraction:
        """That of the next row. DiagnosticError (E497): it has none, or one before that of the row before."""
        text = row.cells.get(self._mapping.time or "")
        if text is None:
            raise self._wrong(row, "the row has no time")
        if NUMBER.match(text):
            stamp, kind = Fraction(text) * self._mapping.unit, "a number"
        elif found := _DATE.match(text):
            whole, digits, zone = found[1], found[2] or "0", found[3] or ""
            try:
                date = datetime.fromisoformat(whole + zone)
            except ValueError as error:
                raise self._wrong(row, f"`{text[:40]}` is not a time: {error}") from None
            since = (date if zone else date.replace(tzinfo=UTC)) - _BEGINNING
            stamp = 1_000 * (since // timedelta(seconds=1) + Fraction(int(digits), 10 ** len(digits)))
            kind = "a date with a zone" if zone else "a date without a zone"
        else:
            hint = f"write `{text.replace(',', '.')}`" if NUMBER.match(text.replace(",", ".", 1)) else HINT
            raise self._wrong(row, f"`{text[:40]}` is neither a number nor a date with a time", hint)
        if self._kind not in (None, kind):
            raise self._wrong(row, f"`{text[:40]}` is {kind}, and times before it are {self._kind}")
        self._kind = kind
        if self._last is not None and stamp < self._last[0]:
            raise self._wrong(row, f"the time falls from {self._last[1]} to {text}")
        self._last = stamp, text
        return stamp

    def text(self, stamp: Fraction) -> str:
        """A time as the log writes times."""
        if self._kind is not None and "date" in self._kind:
            seconds, rest = divmod(stamp / 1_000, 1)
            try:
                whole, _, zone = (_BEGINNING + timedelta(seconds=int(seconds))).isoformat().rpartition("+")
            except OverflowError:
                return "after the year 9999"
            return f"{whole}{exact_decimal(rest)[1:]}+{zone}"
        return ("-" if stamp < 0 else "") + exact_decimal(abs(stamp) / self._mapping.unit)

    def _wrong(self, row: Row, problem: str, hint: str = HINT) -> DiagnosticError:
        message = f"{row.place}, column `{self._mapping.time}`: {problem}"
        return DiagnosticError(Diagnostic(UNREADABLE, message, file=self._path, hint=hint))


def is_timed(goal: Goal, assumptions: Sequence[Formula]) -> bool:
    """Whether a property, or what is assumed, has a bound in time."""
    return any(operators(f) & TIMED for f in (goal.line.formula, *assumptions) if f is not None)


class StampedWatch(Watch):
    """A property with bounds in time on rows that have times."""

    def __init__(self, goal: Goal, assumptions: Sequence[Formula]) -> None:
        super().__init__(goal, None)
        self._parts: list[Stamped] = []
        self._deadline: Fraction | None = None
        self._formula = formula = goal.line.formula
        if formula is None:
            self.reason = "an assumption has a bound in time, and the property is not a formula"
            return
        try:
            self._parts = [Stamped(f) for f in (formula, *assumptions)]
        except Unstamped as why:
            self.reason = str(why)

    def copied(self) -> StampedWatch:
        """See `Watch`."""
        other = copy(self)
        other._parts = [part.copied() for part in self._parts]
        return other

    def read_at(self, letter: Letter, stamp: Fraction, row: int) -> None:
        """A row with its time. What a broken assumption leaves open is satisfied, as with other monitors."""
        if self.verdict != "undecided" or not self._parts:
            return
        try:
            found = [part.read(letter, stamp) for part in self._parts]
        except Unstamped as why:
            self._parts, self.reason = [], str(why)
            return
        broken = next((part for part in self._parts[1:] if part.rest is FALSE_FORMULA), None)
        decisive = broken or (self._parts[0] if found[0] is not None else None)
        if decisive is not None:
            self.verdict = "violated" if broken is None and found[0] is False else "satisfied"
            self.place, self._deadline = (row, row), decisive.deadline

    def decide_at_end(self, word: Sequence[Letter], delays: Sequence[Fraction], *, assumed: bool) -> None:
        """The last row repeats forever, after its own delay."""
        if self.verdict == "undecided" and self._formula is not None:
            holds = evaluate_formula(self._formula, word[:-1], word[-1:], delays)
            self.verdict = "violated" if assumed and not holds else "satisfied"

    def decided_at(self, times: Times, *, open_end: str) -> Decided:
        """As `decided`, with the deadline by which it was decided."""
        deadline = None if self._deadline is None else times.text(self._deadline)
        return replace(self.decided(open_end=open_end), deadline=deadline)
