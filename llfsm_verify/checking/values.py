"""Values as people write them, turned into the numbers of a step program."""

from __future__ import annotations

from llfsm_verify.program.program import Choice


class ValueProblem(Exception):
    """The text is no value of the type; the message says what is."""


def choice_value(choice: Choice, text: str) -> int:
    """The number of the value that `text` names: an enumerator, `true` or `false`, or a number in the range."""
    kind = choice.type
    if choice.labels:
        if text in choice.labels:
            return kind.low + choice.labels.index(text)
        raise ValueProblem(f"`{text}` is none of {', '.join(choice.labels)}")
    if kind.boolean:
        if text in ("true", "false"):
            return int(text == "true")
        raise ValueProblem(f"`{text}` is neither true nor false")
    digits = text.removeprefix("-")
    if digits.isascii() and digits.isdigit() and len(digits) < 20 and kind.low <= int(text) <= kind.high:
        return int(text)
    raise ValueProblem(f"`{text}` is no number from {kind.low} to {kind.high}")
