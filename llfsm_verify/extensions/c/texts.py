"""The parts of `runtime.c` that an image needs, and small functions of each width."""

from __future__ import annotations

import re
import textwrap
from functools import cache
from importlib import resources

_PART = re.compile(r"^/\* @(\w+)((?: \w+)*):", re.MULTILINE)
_SIGNS = ("min", "max", "abs", "div", "mod")
_SMALL = re.compile(rf"({'|'.join(_SIGNS)})_(16|32|64)\Z")


WIDTH = 110
"""Columns of a line."""
_BREAKS = (
    " = ",
    " ? ",
    " || ",
    " && ",
    " == ",
    " != ",
    " < ",
    " <= ",
    " > ",
    " >= ",
    " + ",
    " - ",
    " * ",
    " / ",
    " & ",
)


def wrapped(text: str) -> str:
    """C whose lines are as short as `WIDTH` where they can be broken."""
    return "".join(f"{line}\n" for long in text.splitlines() for line in _lines(long))


def _lines(line: str) -> list[str]:
    if len(line) <= WIDTH:
        return [line]
    indent = line[: len(line) - len(line.lstrip())]
    code, mark, told = line.partition("/*")
    if mark and code.strip():  # what is said of a statement goes before it
        lines = [*_lines(f"{indent}/*{told}"), *_lines(code.rstrip())]
        return lines if told.endswith("*/") else [line]
    if mark:
        told = line.strip().removesuffix(" */") + "\0*/"
        breaks = textwrap.TextWrapper(WIDTH, indent, f"{indent} * ", break_long_words=False, break_on_hyphens=False)
        return [part.replace("\0", " ") for part in breaks.wrap(told)]
    found: list[str] = []
    while len(line) > WIDTH:
        at = _break(line)
        if not at:
            break
        found.append(line[:at].rstrip())
        line = f"{indent}        {line[at:].lstrip()}"
    return [*found, line]


def _break(line: str) -> int:
    """Where to break a line of code: after a comma or before an operator, as far outside as can be; 0: nowhere."""
    best, depth, start = (0, 0), 0, len(line) - len(line.lstrip())
    for at, letter in enumerate(line[: WIDTH + 1]):
        depth += (letter in "([") - (letter in ")]")
        after = letter == "," or (letter == "(" and line[at + 1 : at + 2] not in ("", ")"))
        operator = next((sign for sign in _BREAKS if line.startswith(sign, at)), None)
        if at > start + 8 and at < WIDTH and (after or operator):
            place = at + 1 if after else at + 2 if operator == " = " else at
            outside = -depth - 2 * (letter == "(" or operator == " = ")
            best = max(best, (outside, place), key=lambda b: (b[1] > 0, *b))
    return best[1]


@cache
def _parts() -> dict[str, tuple[tuple[str, ...], str]]:
    """By name: the parts that it calls, and its text."""
    text = resources.files(__package__).joinpath("runtime.c").read_text(encoding="utf-8")
    found = list(_PART.finditer(text))
    ends = [match.start() for match in found[1:]] + [len(text)]
    return {
        match[1]: (tuple(match[2].split()), text[text.index("*/", match.start()) + 2 : end].strip())
        for match, end in zip(found, ends, strict=True)
    }


def runtime_names() -> frozenset[str]:
    """All names that an image may have of its own."""
    return frozenset(_parts()) | {f"{kind}_{bits}" for kind in _SIGNS for bits in (16, 32, 64)}


def _small(name: str) -> str:
    found = _SMALL.match(name)
    assert found is not None, name
    kind, bits = found[1], found[2]
    of = f"int{bits}_t"
    if kind == "abs":
        return f"static inline {of} {name}({of} a)\n{{\n    return ({of})(a < 0 ? -a : a);\n}}"
    value = {"min": "a < b ? a : b", "max": "a > b ? a : b", "div": "a / b", "mod": "a % b"}[kind]
    return f"static inline {of} {name}({of} a, {of} b)\n{{\n    return ({of})({value});\n}}"


def runtime(text: str) -> str:
    """The functions that a text calls, after those that they call."""
    done: dict[str, str] = {}
    called = set(re.findall(r"\b\w+(?=\()", text))
    todo = sorted((name for name in called if name in _parts() or _SMALL.match(name)), reverse=True)
    while todo:
        name = todo[-1]
        calls, body = _parts().get(name) or ((), _small(name))
        missing = [call for call in calls if call not in done]
        if not missing:
            done[todo.pop()] = body
        todo += missing
    return "".join(f"{body}\n\n" for body in done.values())
