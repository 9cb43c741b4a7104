"""The numbers in brackets of Spot's and NuSMV's operators: repetitions `[*2..5]` and bounds in steps `F[2:5]`."""

from __future__ import annotations

import re

from llfsm_verify.plug import IN_STEPS, MAX_STEPS, MAX_TICKS, PAST_STEPS
from llfsm_verify.plug import FormulaOp as Op

MAX_REPETITIONS = 10_000

_RANGE = re.compile(r"([0-9]+|\$|inf)?(\.\.|:|,|to)?([0-9]+|\$|inf)?\Z")


class WrongRange(Exception):
    """What is wrong with the numbers."""


def repetitions(text: str) -> tuple[int, int | None]:
    """Least and largest number (None: any) of `*`, `[*…]`, `[+]`, `[->…]` or `[=…]`; WrongRange when it has none."""
    if text == "*":
        return 0, None
    if text == "[+]":
        return 1, None
    if text.startswith("[:"):
        raise WrongRange("repetition by `:` is not supported; write the fusions out")
    sign = re.match(r"\[(?:\*|=|->)", text)
    assert sign is not None
    goto = sign.group() == "[->"
    inside = re.sub(r"\s", "", text[sign.end() : -1])
    low_text, separator, high_text = _split(inside)
    if not inside:
        return (1, 1) if goto else (0, None)
    low = _number(low_text, MAX_REPETITIONS, "repetitions") if low_text else 1 if goto else 0
    high = low
    if separator:
        high = _number(high_text, MAX_REPETITIONS, "repetitions") if high_text else None
    if low is None:
        raise WrongRange(f"`{text}` never ends")
    if high is not None and high < low:
        raise WrongRange(f"`{text}` ends before it starts")
    return low, high


def step_operators(text: str) -> list[tuple[Op, str]]:
    """The operators with their bounds that `X[3]`, `X[!]`, `F[2:5]`, `G[2:]` or `O[2,5]` stands for; WrongRange."""
    letter = text[0]
    inside = re.sub(r"[\s!]", "", text[text.index("[") + 1 : -1])
    low_text, separator, high_text = _split(inside)
    op = IN_STEPS[letter]
    endless: Op = "F" if letter == "F" else "G"
    most = MAX_TICKS if op in PAST_STEPS else MAX_STEPS
    if letter == "X" and not inside:
        return [("X", "")]
    low = _number(low_text, MAX_STEPS, "steps") if low_text else None
    if low is None or (letter == "X") == bool(separator):
        raise WrongRange(f"`{text}` has a bound that says nothing")
    if letter == "X":
        return [("X[]", str(low))]
    high = _number(high_text, most, "steps") if high_text else None
    if high is None:
        return [("X[]", str(low)), (endless, "")]
    if high < low:
        raise WrongRange(f"`{text}` ends before it starts")
    return [(op, f"{low}:{high}")]


def _split(text: str) -> tuple[str, str, str]:
    """Low, separator and high of `2..5`, `2:5`, `2to5`, `2,5`."""
    match = _RANGE.match(text)
    return (match[1] or "", match[2] or "", match[3] or "") if match else ("", "", "")


def _number(text: str, largest: int, what: str) -> int | None:
    """The number; None: `$` or `inf`."""
    if text in ("$", "inf"):
        return None
    digits = text.lstrip("0") or "0"
    if len(digits) > len(str(largest)) or int(digits) > largest:
        raise WrongRange(f"more than {largest:,} {what}")
    return int(digits)
