"""Places in a text as editors count them: lines that end as LSP says, and characters in the units of an encoding.

The core counts characters of a text without its byte order mark.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from difflib import SequenceMatcher
from functools import lru_cache

from lsprotocol.types import Position, PositionEncodingKind, Range

_END = re.compile(r"\r\n|\n|\r")
_BOM = "\ufeff"
MOST_LINES = 1_000
"""Changed lines that are compared one by one."""


class Lines:
    """A text of an editor. Offsets are characters after the byte order mark, as the core counts them."""

    def __init__(self, text: str, encoding: str = PositionEncodingKind.Utf16) -> None:
        self.encoding = encoding
        self.skipped = len(_BOM) if text.startswith(_BOM) else 0
        self.whole = text
        self.text = text[self.skipped :]
        self._starts = [0, *(found.end() for found in _END.finditer(text))]
        self._ends = [*(found.start() for found in _END.finditer(text)), len(text)]

    def _units(self, text: str) -> int:
        if self.encoding == PositionEncodingKind.Utf32 or text.isascii():
            return len(text)
        if self.encoding == PositionEncodingKind.Utf8:
            return len(text.encode("utf-8", "surrogatepass"))
        return len(text.encode("utf-16-le", "surrogatepass")) // 2

    def position(self, offset: int) -> Position:
        """The position of an offset, which may be anything."""
        at = min(max(offset, 0) + self.skipped, len(self.whole))
        line = bisect_right(self._starts, at) - 1
        return Position(line, self._units(self.whole[self._starts[line] : min(at, self._ends[line])]))

    def offset(self, position: Position) -> int:
        """The offset of a position; one beyond the end of a line is that end, as LSP says."""
        if position.line >= len(self._starts):
            return len(self.text)
        start, end = self._starts[max(position.line, 0)], self._ends[max(position.line, 0)]
        line, left = self.whole[start:end], position.character
        if line.isascii() or self.encoding == PositionEncodingKind.Utf32:
            at = start + min(max(left, 0), len(line))
        else:
            at = start
            for char in line:
                left -= self._units(char)
                if left < 0:
                    break
                at += 1
        return max(0, at - self.skipped)

    def range(self, start: int, end: int) -> Range:
        """The range of the characters `start` to `end` (end not included)."""
        return Range(self.position(start), self.position(max(start, end)))

    def at(self, line: int, column: int) -> Range:
        """The range of one character, by a line and a column in characters, both from 0, lines as the core has them."""
        lines = self.text.split("\n")
        start = sum(len(each) + 1 for each in lines[:line]) + column
        return self.range(start, start + 1)


@lru_cache(maxsize=64)
def _difference(old: str, new: str) -> tuple[int, int]:
    """How many characters two texts have in common at the beginning, and at the end."""
    most = min(len(old), len(new))
    low, high = 0, most
    while low < high:  # the longest common beginning, by halving: comparisons of slices are fast
        middle = (low + high + 1) // 2
        low, high = (middle, high) if old[:middle] == new[:middle] else (low, middle - 1)
    start, low, high = low, 0, most - low
    while low < high:
        middle = (low + high + 1) // 2
        same = old[len(old) - middle :] == new[len(new) - middle :]
        low, high = (middle, high) if same else (low, middle - 1)
    return start, low


@lru_cache(maxsize=64)
def _kept(old: str, new: str) -> list[tuple[int, int, int]]:
    """The pieces that two texts share, in order: where each begins in the one and in the other, and its length. Between
    a common beginning and end these are whole lines."""
    start, end = _difference(old, new)
    found, at_old, at_new = [(0, 0, start)], start, start
    before, after = (text[start : len(text) - end].splitlines(keepends=True) for text in (old, new))
    if max(len(before), len(after)) <= MOST_LINES:
        line = 0, 0
        for block in SequenceMatcher(None, before, after, autojunk=False).get_matching_blocks():
            at_old += sum(map(len, before[line[0] : block.a]))
            at_new += sum(map(len, after[line[1] : block.b]))
            size = sum(map(len, before[block.a : block.a + block.size]))
            found.append((at_old, at_new, size))
            line, at_old, at_new = (block.a + block.size, block.b + block.size), at_old + size, at_new + size
    return [*found, (len(old) - end, len(new) - end, end)]


def moved(offset: int, old: str, new: str) -> int:
    """Where the character at an offset of the old text is in the new one; what was replaced is at its beginning."""
    if old == new:
        return offset
    last = 0
    for first, second, size in _kept(old, new):
        if offset < first:
            return last
        if offset < first + size or first + size == len(old):
            return min(second + offset - first, len(new))
        last = second + size
    return last
