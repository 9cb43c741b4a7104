"""The bounds of temporal operators as users write them: `[3]`, `[2:5]`, `[<=500ms]`, `[1s:2s]`, `[>=1s]`."""

from __future__ import annotations

import re
from collections.abc import Iterator
from fractions import Fraction
from typing import NamedTuple

from llfsm_verify.diagnostics import DiagnosticError, Span
from llfsm_verify.logic import codes
from llfsm_verify.logic.bounds import IN_STEPS, MAX_STEPS, MAX_TICKS, TimeBound, time_bound
from llfsm_verify.logic.formula import TIMED, Op
from llfsm_verify.logic.parsing.words import Words

BOUNDABLE = frozenset("XFGUROHST")
_BACK = frozenset("OHST")
_LONG = re.compile(r"[0-9]{13,}|[0-9]{10,}(?![0-9.]|ms|s|min)")
_SPELLINGS = {
    r"(?<=[0-9])(?:milliseconds?|msecs?)\b": "ms", r"(?<=[0-9])(?:seconds?|secs?)": "s",
    r"(?<=[0-9])(?:minutes?|mins|m)\b": "min", r"([<>])=?": r"\1=", r",|\.\.|;|(?<=[0-9a-z])-|to": ":",
}  # fmt: skip
_TIME = re.compile(r"([0-9]{1,12}(?:\.[0-9]{1,9})?)(ms|s|min)\Z")
_MILLISECONDS = {"ms": 1, "s": 1_000, "min": 60_000}
_HINTS = {
    "X": "write `X[3]` for three steps",
    "U": "write `p U[<=500ms] q` or `p U[1s:2s] q` for a bound in time",
    "R": "write `p R[<=500ms] q` or `p R[1s:2s] q` for a bound in time",
    "S": "write `p S[0:10] q` for steps, or `p S[<=500ms] q` or `p S[1s:2s] q` for time (in ms, s or min)",
    "T": "write `p T[0:10] q` for steps, or `p T[<=500ms] q` or `p T[1s:2s] q` for time (in ms, s or min)",
}
_UNBOUNDED = frozenset("WMYZ")
_STEP_BACK = "YZ"
_HINT = "write `{0}[2:5]` for steps, or `{0}[<=500ms]`, `{0}[1s:2s]` or `{0}[>=1s]` for time (in ms, s or min)"
_TIMED: dict[str, Op] = {op[0]: op for op in TIMED}


class Bound(NamedTuple):
    """The operator with its bound, and the number of the bound's last word."""

    op: Op
    bound: str
    last: int


def read_bound(words: Words, i: int) -> Bound | None:
    """The bound of the operator that is word number `i`; None: it has no bound. DiagnosticError (E334): a wrong one."""
    tokens = words.tokens
    letter = tokens[i].type
    if letter not in BOUNDABLE | _UNBOUNDED or i + 1 >= len(tokens) or tokens[i + 1].type != "LSQB":
        return None
    last = next(k for k in range(i + 1, len(tokens)) if tokens[k].type == "RSQB")  # brackets have been matched
    text = "".join(token.text for token in tokens[i + 2 : last])
    if letter in _UNBOUNDED:
        raise _no_bound(words, i, last, text)
    found = _time(letter, text) or _steps(letter, text)
    if isinstance(found, str) or found is None:
        least, colon, most = text.partition(":")
        turned = isinstance(_time(letter, f"{most}:{least}") or _steps(letter, f"{most}:{least}"), tuple) and colon
        hint = f"write `{letter}[{most}:{least}]`" if turned else meant(letter, text)
        hint = hint or _HINTS.get(letter, _HINT.format(letter))
        message = found or f"`[{text[:40]}]` is not a valid bound of `{letter}`"
        if _LONG.search(text):
            back = letter in _BACK
            limit = MAX_TICKS if back else MAX_STEPS
            message = f"this number is too large: a bound has at most {limit:,} steps, and a time at most 12 digits"
            every = f", or `{letter}` without a bound for all letters {'before' if back else 'to come'}"
            hint = f"write a smaller number{'' if letter == 'X' else every}"
        first = i + 1
        if letter in _BACK and not re.search("[:<>]", text) and milliseconds(text) is None:  # perhaps an index
            hint, first = f'{hint}, or `"{letter}"[{text[:40]}]` for an element of a variable of this name', i
        raise words.error(codes.BOUND, message, first, last, hint)
    return Bound(*found, last)


def _no_bound(words: Words, i: int, last: int, text: str) -> DiagnosticError:
    letter = words.tokens[i].type
    if not any(unit in text for unit in ("ms", "s", "min")):
        message, hint = f"only `X F G O H S T` take a bound in steps, and `{letter}` does not", None
        if ":" not in text:  # perhaps the index of a variable
            hint = f'write `"{letter}"[{text[:40]}]` for an element of a variable of this name'
        if letter in _STEP_BACK:
            repeated = f"write `{letter} {letter}` for two steps back"
            hint = repeated if hint is None else f"{repeated}, and {hint.removeprefix('write ')}"
    else:
        message = f"only `F G U R O H S T` take a bound in time, and `{letter}` does not"
        hint = f"write `{'O' if letter == 'Y' else 'H'}[{text}]`"
        if letter == "W":
            until_then = "G" if text.startswith(">=") else f"G[<={text.rpartition(':')[2].removeprefix('<=')}]"
            hint = f"write `p U[{text}] q || {until_then} p`"
        elif letter == "M":
            hint = f"write `q U[{text}] (p && q)` for `p M[{text}] q`"
            if not text.startswith("<="):
                upper = "" if text.startswith(">=") else f"[<={text.rpartition(':')[2]}]"
                hint = f"write `(p R[{text}] q) && F{upper} p` for `p M[{text}] q`"
    return words.error(codes.BOUND, message, i, last, hint)


def time_bounds(words: Words) -> Iterator[tuple[Span, TimeBound]]:
    """The places of the operators with a bound in time in a formula, and the bounds."""
    for i in range(len(words.tokens)):
        bound = read_bound(words, i)
        if bound is not None and bound.op in TIMED:
            yield words.span(i, bound.last), time_bound(bound.bound)


def _time(letter: str, text: str) -> tuple[Op, str] | str | None:
    """The operator and its key. A message: what is wrong with a bound in time. None: it is not one."""
    least, colon, most = text.partition(":")
    if text.startswith("<="):
        times = ["0", milliseconds(text.removeprefix("<="))]
    elif text.startswith(">="):
        times = [milliseconds(text.removeprefix(">=")), ""]
    else:
        times = [milliseconds(least), milliseconds(most)]
        if text[:1] not in ("<", ">") and times == [None, None]:
            return None
    if letter in _TIMED and colon and None in times:
        known = least if times[0] is not None else most
        other = most if known == least else least
        if other.isdigit():
            return f"one end of `[{text[:40]}]` is a time, but `{other[:40]}` has no unit"
    if re.search(r"(?<![0-9a-z])-", text):
        return "a time cannot be negative"
    if letter not in _TIMED or None in times:
        return f"`[{text[:40]}]` is not a valid time bound of `{letter}`"
    start, end = (t or "" for t in times)
    if end and Fraction(end) < Fraction(start):
        return f"`[{text}]` ends before it starts"
    return _TIMED[letter], end if end and Fraction(start) == 0 else f"{start}:{end}"


def meant(letter: str, text: str) -> str | None:
    """What to write for a bound in the signs of others, or where one end of it is not there."""
    text = spelt(text)
    least, colon, most = text.partition(":")
    if isinstance(_time(letter, text) or _steps(letter, text), tuple):
        return f"write `{letter}[{text}]`"
    if letter in _TIMED:
        if milliseconds(least) is not None and colon and not most:
            return f"write `{letter}[>={least}]`"
        if milliseconds(text.removeprefix(":")) is not None:
            return f"write `{letter}[<={text.removeprefix(':')}]`"
    if letter in IN_STEPS and letter != "X":
        if re.fullmatch(r":?[0-9]{1,9}", text):
            return f"write `{letter}[0:{text.removeprefix(':')}]`"
        if letter not in "ST" and re.fullmatch(r"[0-9]{1,9}:", text):
            back = " ".join(("Y" if letter in "OS" else "Z") * min(int(least), 9))
            return f"write `X[{least}] {letter}`" if letter in "FG" else f"write `{back} {letter}`"
    if letter in _TIMED and re.fullmatch(r"[<>]=[0-9]{1,9}", text):
        steps = f"{letter}[0:{text[2:]}]" if text[0] == "<" else f"X[{text[2:]}] {letter}"
        in_steps = letter in "FG" or (letter in _BACK and text[0] == "<")
        return f"write `{letter}[{text}s]` for seconds" + (f", or `{steps}` for steps" if in_steps else "")
    return None


def spelt(text: str) -> str:
    """A bound, written without blanks, with the signs and units of other languages in ours: `0..3`, `<3seconds`."""
    for foreign, ours in _SPELLINGS.items():
        text = re.sub(foreign, ours, text)
    return text


def milliseconds(time: str) -> str | None:
    """The milliseconds of a time such as `500ms`, `1.5s` or `2min`, in decimal notation; None: it is not a time."""
    match = _TIME.match(time)
    return None if match is None else decimal(Fraction(match[1]) * _MILLISECONDS[match[2]])


def decimal(value: Fraction) -> str:
    """A number that has an end in decimal notation, written so."""
    if value.denominator == 1:
        return str(value.numerator)
    digits = 0
    while (value * 10**digits).denominator != 1:
        digits += 1
    text = str(int(value * 10**digits)).rjust(digits + 1, "0")
    return f"{text[:-digits]}.{text[-digits:]}"


def _steps(letter: str, text: str) -> tuple[Op, str] | str | None:
    match = re.match(r"([0-9]{1,9})(?::([0-9]{1,9}))?\Z", text)
    if match is None or letter not in IN_STEPS or (match[2] is None) != (letter == "X"):
        return None
    numbers = [int(n) for n in match.groups() if n is not None]
    if max(numbers) > (MAX_TICKS if letter in _BACK else MAX_STEPS):
        return f"a bound has at most {MAX_TICKS if letter in _BACK else MAX_STEPS:,} steps"
    if numbers != sorted(numbers):
        return f"`[{text}]` ends before it starts"
    if numbers[0] > MAX_STEPS:
        return f"a bound of the past begins at most {MAX_STEPS:,} steps back: each of them takes a bit"
    return IN_STEPS[letter], ":".join(map(str, numbers))
