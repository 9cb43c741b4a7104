"""Paths to fields of messages, such as `twist.linear.x`, `ranges.3` and `fruits.count`."""

from __future__ import annotations

import difflib
import math
from decimal import ROUND_HALF_EVEN, Decimal, InvalidOperation
from typing import Any, Callable, Container, Dict, List, Mapping, Optional, Tuple, Union

from .messages import class_of, fields_of, listed

COUNT = ("count", "length")
"""After an array: how many elements it has."""
INTEGERS = {
    **{f"int{bits}": (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) for bits in (8, 16, 32, 64)},
    **{f"uint{bits}": (0, 2**bits - 1) for bits in (8, 16, 32, 64)},
    "byte": (-128, 127), "char": (0, 255),
}  # fmt: skip
FLOATS = {"float32": 3.4028235677973366e38, "float64": math.inf}
"""With the first number that is too large for it."""
TIMES = ("time", "duration")
LONGEST = 100_000
"""Elements of an array that an output may reach."""

Json = Union[None, bool, int, float, str]


def digits_of(of: Mapping[str, Any]) -> int:
    """The decimals to which numbers for an input of this type are rounded; -1: they are not."""
    return -1 if of["labels"] or of["boolean"] else int(of["digits"])


def fits(value: Json, of: Mapping[str, Any], known: Container[str]) -> bool:
    """Whether an input of this type can have a value; `known`: texts that the file of ports says in other words."""
    text = ("false", "true")[value] if isinstance(value, bool) else str(value)
    if text in known or of["labels"] or of["boolean"]:
        return text in known or text in (of["labels"] or ("false", "true"))
    try:
        number = Decimal(text).scaleb(of["digits"])
    except InvalidOperation:
        return False
    return number.is_finite() and of["low"] <= number <= of["high"]


class NoField(Exception):
    """There is no such field; the message says why, the hint what to write."""

    def __init__(self, why: str, hint: str) -> None:
        super().__init__(why)
        self.hint = hint


class Unfit(Exception):
    """A message has no such element or no such number, or a field cannot have a value."""


class Field:
    """A field of messages of a class, by its path. Raises NoField."""

    def __init__(self, message: Any, path: str, *, output: bool = False) -> None:
        self.path = path
        self._steps: List[Tuple[Union[str, int], str]] = []
        """Each with the type of what it leads to."""
        of: str = message._type
        fields: Optional[Dict[str, str]] = fields_of(message)
        for part in path.split(".") if path else ():
            if of.endswith("]"):
                of, step = self._element(of, part, output)
            elif fields is None:
                raise NoField(f"{of} has no fields, so it has no `{part}`", f"leave out `.{part}`")
            else:
                if part not in fields and f"{part}_" not in fields:
                    near = difflib.get_close_matches(part, fields, 1)
                    hint = f"did you mean `{near[0]}`?" if near else f"it has {listed(list(fields))}"
                    raise NoField(f"{of} has no field `{part}`", hint)
                step = part if part in fields else f"{part}_"  # a word of Python
                of = fields[step]
            self._steps.append((step, of))
            fields = fields_of(class_of(of)) if "/" in of and not of.endswith("]") else None
        if of.endswith("]"):
            raise NoField(f"{path or 'it'} is an array, {of}", "write its element or its length: `.0`, `.count`")
        if fields is not None:
            named = f"`{path}` is a message" if path else "this is a message"
            raise NoField(f"{named}, {of}", f"name one of its fields: {listed(list(fields))}")
        self.type = of

    @staticmethod
    def _element(of: str, part: str, output: bool) -> Tuple[str, Union[str, int]]:
        bare, _, size = of[:-1].rpartition("[")
        if part in COUNT:
            if output:
                raise NoField(f"the length of {of} cannot be written", "write its elements: `.0`, `.1`")
            return "uint32", "count"
        if not (part.isascii() and part.isdigit() and len(part) <= 6 and int(part) < LONGEST):
            raise NoField(f"{of} is an array, in which `{part}` is not an element", "write `.0`, `.1` or `.count`")
        if size and int(part) >= int(size):
            raise NoField(f"{of} has no element {part}", f"write a number below {size}")
        return bare, int(part)

    def get(self, message: Any, digits: int = -1) -> Json:
        """The value in a message, rounded to so many decimals; -1: not rounded. Raises Unfit."""
        found = message
        for step, _ in self._steps:
            if isinstance(step, int):
                if step >= len(found):
                    raise Unfit(f"has {len(found)} elements, and no element {step}")
                found = found[step]
            else:
                found = (
                    len(found) if step == "count" and isinstance(found, (list, tuple, bytes)) else getattr(found, step)
                )
        return _shown(found, self.type, digits)

    def put(self, message: Any, value: Json) -> None:
        """Give the field a value, as JSON has it. Raises Unfit."""
        given = _stored(value, self.type)
        found = message
        for number, (step, of) in enumerate(self._steps):
            last = number + 1 == len(self._steps)
            if isinstance(step, int):
                while len(found) <= step:
                    found.append(DEFAULTS[of]() if of in DEFAULTS else class_of(of)())
                if last:
                    found[step] = given
                else:
                    found = found[step]
            elif last:
                setattr(found, step, given)
            else:
                if of.endswith("]") and not isinstance(getattr(found, step), list):  # bytes
                    setattr(found, step, list(getattr(found, step)))
                found = getattr(found, step)


def _shown(value: Any, of: str, digits: int) -> Json:
    if of == "bool":
        return bool(value)
    if of == "string":
        return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
    if of in TIMES:
        value = Decimal(value.secs) + Decimal(value.nsecs).scaleb(-9)
    elif of in FLOATS and not math.isfinite(value):
        raise Unfit("is not a number" if math.isnan(value) else f"is {'' if value > 0 else '-'}infinite")
    elif of in INTEGERS:
        return int(value)
    return rounded(value, digits)


def rounded(value: Union[float, Decimal], digits: int) -> Json:
    """A number with so many decimals, as text, because JSON's numbers are binary."""
    number = value if isinstance(value, Decimal) else Decimal(repr(value))
    if digits < 0:
        return float(number)
    try:
        return format(number.quantize(Decimal(1).scaleb(-digits), ROUND_HALF_EVEN), "f")
    except InvalidOperation:  # more digits than any input has
        return format(number, "f")


def _stored(value: Json, of: str) -> Any:
    if of == "string":
        return {True: "true", False: "false"}[value] if isinstance(value, bool) else str(value)
    if of == "bool":
        if isinstance(value, bool):
            return value
        if value in ("true", "false"):
            return value == "true"
        raise Unfit(f"cannot be `{value}`, because it is a bool")
    try:
        number = Decimal(int(value)) if isinstance(value, bool) else Decimal(str(value))
    except InvalidOperation:
        number = Decimal("nan")
    if not number.is_finite():
        raise Unfit(f"cannot be `{value}`, because it is a number ({of})")
    if of in FLOATS:
        if abs(float(number)) >= FLOATS[of]:
            raise Unfit(f"cannot be {value}, because it is a {of}")
        return float(number)
    if of in TIMES:
        return _time(number, of)
    low, high = INTEGERS[of]
    if number != number.to_integral_value() or not low <= number <= high:
        raise Unfit(f"cannot be {value}, because it is an {of}")
    return int(number)


def _time(number: Decimal, of: str) -> Any:
    from genpy import Duration, Time

    low, high = (0, 2**32) if of == "time" else (-(2**31), 2**31)
    within = low - 1 <= number <= high  # before it has as many digits as its exponent says
    seconds, rest = divmod(int(number.scaleb(9).to_integral_value(ROUND_HALF_EVEN)) if within else -1, 10**9)
    if not within or not low <= seconds < high:
        raise Unfit(f"cannot be {number}, because it is a {of}")
    return (Time if of == "time" else Duration)(seconds, rest)


DEFAULTS: Dict[str, Callable[[], Any]] = {
    **dict.fromkeys(INTEGERS, int), **dict.fromkeys(FLOATS, float), "bool": bool, "string": str,
    "time": lambda: _time(Decimal(0), "time"), "duration": lambda: _time(Decimal(0), "duration"),
}  # fmt: skip
"""Of the elements that an array gets where a later one is written."""
