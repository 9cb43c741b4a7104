"""Where the characters of a YAML scalar stand in the file: quotes, escapes, folding and indentation undone."""

from __future__ import annotations

import re

from llfsm_verify.diagnostics import Fragment, Source

_WHITE = " \t\r\n\x85\u2028\u2029"
_ESCAPE_LENGTHS = {"x": 4, "u": 6, "U": 10}
_MAX_ALIGNED = 1 << 17
"""Characters of a scalar whose places are found; a longer one is refused as too long, at its first character."""

_ANCHOR = re.compile(r"&[^\s,\[\]{}]+\s+")


def scalar_fragment(source: Source, start: int, end: int, style: str | None, value: str) -> Fragment:
    """The fragment of the scalar `value`, written as source[start:end] in YAML's `style` (None: plain)."""
    text = source.text
    anchor = _ANCHOR.match(text, start, end)
    if anchor is not None:
        start = anchor.end()
    if style in ("'", '"'):
        start += 1
        end -= 1
    elif style in ("|", ">"):
        newline = text.find("\n", start, end)
        start = end if newline < 0 else newline + 1
    if text[start : start + len(value)] == value and (style is None or end - start == len(value)):
        return Fragment(value, source, range(start, start + len(value) + 1))
    offsets = _align(text, start, end, style, value[:_MAX_ALIGNED])
    offsets += [offsets[-1]] * (len(value) - _MAX_ALIGNED)
    return Fragment(value, source, tuple(offsets))


def _align(text: str, start: int, end: int, style: str | None, value: str) -> list[int]:
    """The offset of each character of `value`, and the one after the last: whitespace may have been folded or
    stripped, everything else stands in the text as it is or as an escape."""
    offsets: list[int] = []
    at = start
    for character in value:
        if character not in _WHITE:
            at = _skip_white(text, at, end)
        if style == '"':
            while text.startswith("\\", at) and at + 1 < end and text[at + 1] in "\r\n":
                at = _skip_white(text, at + 1, end)
            if text.startswith("\\", at):
                offsets.append(at)
                at += _ESCAPE_LENGTHS.get(text[at + 1 : at + 2], 2)
                continue
        offsets.append(min(at, end))
        if at < end and text[at] == character:
            at += 2 if style == "'" and character == "'" else 1
        elif character == "\n" and text.startswith("\r\n", at):
            at += 2
    last = offsets[-1] + 1 if offsets else start
    offsets.append(min(max(last, start), len(text)))
    return offsets


def _skip_white(text: str, at: int, end: int) -> int:
    while at < end and text[at] in _WHITE:
        at += 1
    return at
