"""Where a place in YAML is: the keys that lead to it, found in the text alone, so also while the file is broken."""

from __future__ import annotations

import re
from dataclasses import dataclass

_ITEM = re.compile(r"[ ]*-(?=[ ]|$)")
_KEY = re.compile(r"""[ ]*("[^"]*"|'[^']*'|[^\s#&*!|>'"{}\[\],?:][^#{}\[\],:]*?)[ ]*:(?=[ ]|$)""")
_FLOW = re.compile(
    r"""(?P<text>"(?:[^"\\]|\\.)*"?|(?<![^\s{\[,:])'(?:[^']|'')*'?)|(?P<comment>(?:^|(?<=\s))\#.*)"""
    r"""|(?P<sign>[{}\[\],]|:(?=[\s,\[\]{}]|$))|(?P<word>[^\s{}\[\],:#]+|[:#'])"""
)


@dataclass(frozen=True, slots=True)
class Spot:
    """A place in YAML: the keys from the outside to it (`-` for an item of a list), whether a key is written there, and
    the offset at which that key, or the value, begins."""

    keys: tuple[str, ...]
    is_key: bool
    start: int


def spot_at(text: str, offset: int) -> Spot:
    """The place at an offset of a text."""
    scan = _Scan()
    begin = 0
    while (end := text.find("\n", begin)) >= 0 and end < offset:
        scan.line(text[begin:end].rstrip("\r"), begin)
        begin = end + 1
    end = len(text) if end < 0 else end
    return scan.spot(text[begin:end].rstrip("\r"), begin, offset - begin)


class _Scan:
    """What is open after the lines so far."""

    def __init__(self) -> None:
        self.open: list[tuple[int, str]] = []
        """Keys and items of blocks, each with its column."""
        self.flow: list[tuple[str, str | None]] = []
        """Braces and brackets, each with the key whose value has begun in it."""
        self.flow_column = 0
        self.text_column: int | None = None
        """The column of the key whose value is a block of text."""
        self.word = ""
        self.start = 0
        """Where the key or value begins that is not complete."""

    def line(self, line: str, begin: int) -> None:
        """Read a whole line."""
        self._read(line, begin, len(line))

    def spot(self, line: str, begin: int, column: int) -> Spot:
        """Read a line up to a column, and say what is there."""
        indent = len(line) - len(line.lstrip(" "))
        blank = not line.strip()
        if self._is_text(line) and not (blank and column <= (self.text_column or 0)):
            return Spot(self._keys(), False, self.start)
        if blank and not self.flow:
            self._close(min(column, len(line)))
            return Spot(self._keys(), True, begin + column)
        self._read(line, begin, column)
        if self.flow:
            kind, key = self.flow[-1]
            return Spot(self._keys(), kind == "{" and key is None, self.start)
        own, before = _key_after_items(line), line[:column]
        if own is not None and column <= own[1]:
            if column <= indent:
                self._close(indent)
            return Spot(self._keys(), True, begin + own[0])
        if own is None and re.fullmatch(r"[ ]*(-[ ]+)*\w*", before):
            return Spot(self._keys(), True, begin + column - len(_word(before)))
        return Spot(self._keys(), False, self.start)

    def _keys(self) -> tuple[str, ...]:
        inner = ["-" if kind == "[" else key for kind, key in self.flow if kind == "[" or key is not None]
        return (*(key for _, key in self.open), *(key for key in inner if key is not None))

    def _is_text(self, line: str) -> bool:
        if self.text_column is None:
            return False
        if line.strip() and len(line) - len(line.lstrip(" ")) <= self.text_column:
            self.text_column = None
            return False
        return True

    def _close(self, column: int, *, item: bool = False) -> None:
        """Something begins at a column: what stands there or further in has ended, but for the key of a list."""
        while self.open:
            at, key = self.open[-1]
            if at < column or (item and at == column and key != "-"):
                return
            self.open.pop()

    def _read(self, line: str, begin: int, most: int) -> None:
        if self._is_text(line) or not line.strip() or line.lstrip().startswith("#"):
            return
        indent = len(line) - len(line.lstrip(" "))
        at = 0
        if self.flow and _key_after_items(line) is not None and (indent <= self.flow_column or _ITEM.match(line)):
            self.flow = []  # it was never closed
        if not self.flow:
            while (item := _ITEM.match(line, at)) is not None and item.end() <= most:
                self._close(item.end() - 1, item=True)
                self.open.append((item.end() - 1, "-"))
                at, self.start = item.end(), begin + item.end()
            key = _KEY.match(line, at)
            if key is not None:
                self._close(key.start(1))
            if key is None or key.end() > most:
                rest = line[at:most]
                if key is None and rest.lstrip()[:1] in ("{", "[") and rest.strip():
                    self._flow(line, at, begin, most, indent)
                return
            self.open.append((key.start(1), key[1].strip("\"'")))
            at = key.end()
            rest = re.sub(r"^(?:[&!]\S*[ ]+)+", "", line[at:].lstrip())  # after an anchor or a tag
            self.start = begin + len(line) - len(rest) if rest else begin + at
            if rest[:1] in ("|", ">"):
                self.text_column = key.start(1)
                return
            if rest[:1] not in ("{", "["):
                return
            at = len(line) - len(rest)
        self._flow(line, at, begin, most, indent)

    def _flow(self, line: str, at: int, begin: int, most: int, indent: int) -> None:
        if not self.flow:
            self.flow_column = indent
        for token in _FLOW.finditer(line, at, most):
            sign = token["sign"]
            if token["comment"]:
                return
            if not sign:
                if not self.word:
                    self.start = begin + token.start()
                self.word += token[0]
                continue
            if sign in "{[":
                self.flow.append((sign, None))
            elif sign in "}]":
                self.flow.pop()
                if not self.flow:
                    self.word = ""
                    return
            elif sign == ",":
                self.flow[-1] = (self.flow[-1][0], None)
            elif self.flow[-1][0] == "{" and self.flow[-1][1] is None:
                self.flow[-1] = ("{", self.word.strip("\"'"))
            else:
                continue
            self.word, self.start = "", begin + token.end()


def _key_after_items(line: str) -> tuple[int, int] | None:
    """Where the key of a line begins and ends, after the marks of items."""
    at = 0
    while (item := _ITEM.match(line, at)) is not None:
        at = item.end()
    key = _KEY.match(line, at)
    return None if key is None else (key.start(1), key.end(1))


def _word(text: str) -> str:
    found = re.search(r"\w*$", text)
    return found[0] if found else ""
