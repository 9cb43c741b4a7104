"""Values as people write them, turned into the numbers of a step program."""

from __future__ import annotations

import re
from fractions import Fraction

from llfsm_verify.language.types import decimal_text
from llfsm_verify.program.program import Choice

_NUMBER = re.compile(r"-?[0-9]{1,20}(?:\.([0-9]{1,18}))?\Z", re.ASCII)
_HALF = re.compile(r"-?(?:[0-9]+\.|\.[0-9]+)\Z", re.ASCII)


class ValueProblem(Exception):
    """The text is no value of the type; the message says what is."""


def choice_value(choice: Choice, text: str) -> int:
    """The number of the value that `text` names: an enumerator, `true` or `false`, or a number in the range."""
    kind = choice.type
    if choice.labels:
        if text in choice.labels:
            return kind.low + choice.labels.index(text)
        raise ValueProblem(f"`{text}` is not one of {', '.join(choice.labels)}")
    if kind.boolean:
        if text in ("true", "false"):
            return int(text == "true")
        raise ValueProblem(f"`{text}` is neither true nor false")
    match = _NUMBER.match(text)
    if match and (kind.digits or not match[1]):
        steps = Fraction(text) * 10**kind.digits
        if steps == int(steps) and kind.low <= steps <= kind.high:
            return int(steps)
    low, high = (decimal_text(bound, kind.digits) for bound in (kind.low, kind.high))
    what = f"multiple of {decimal_text(1, kind.digits)}" if kind.digits else "number"
    instead = "; write a digit on both sides of the point" if _HALF.match(text) else ""
    raise ValueProblem(f"`{text}` is not a {what} from {low} to {high}{instead}")
