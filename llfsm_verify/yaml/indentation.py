"""Wrong indentation in a YAML file, said by the lines that do not fit and not by what the parser looked for."""

from __future__ import annotations

import re
from collections.abc import Iterator

from llfsm_verify.diagnostics import Diagnostic, Source, Span, counted

_LINE = re.compile(r"(?P<blanks> *)(?P<dashes>(?:- +)*)(?P<rest>(?:-$)?.*)")
_KEY = re.compile(r"[\w.\"'-]+[ ]*:(?:[ ]|$)")
_BLOCK = re.compile(r"(?::|-)[ ]+[|>][-+0-9]*(?:[ ]+#.*)?$")


def tab_in_front(source: Source, at: int) -> Diagnostic | None:
    """The diagnostic for a tab among the blanks that `at`, the place of the parser's complaint, has before it."""
    start = source.text.rfind("\n", 0, at) + 1
    blanks = source.text[start : at + 1]
    tab = blanks.find("\t")
    if tab < 0 or blanks.strip():
        return None
    hint = "use spaces, as many as the lines that belong together have"
    return Diagnostic("E010", "a tab cannot indent a line", Span(source, start + tab, start + tab + 1), hint=hint)


def misindented(source: Source, at: int) -> Diagnostic | None:
    """The diagnostic for the line of `at` when it stands beside none of the lines it can belong to; else None.

    It is compared with the nearest level that is open there: list items with list items, keys with keys.
    """
    number = source.position(at)[0]
    found = _LINE.match(source.line(number))
    assert found is not None
    own = len(found["blanks"])
    item = bool(found["dashes"]) or found["rest"] == "-"
    levels = [level for level in _levels(source, number) if level[2] == item]
    if not levels or not found["rest"]:
        return None
    # Of two as near, the inner one.
    column, line, _ = min(reversed(levels), key=lambda level: abs(level[0] - own))
    if column == own:
        return None
    start = at - source.position(at)[1] + 1 + own
    than = "less" if own < column else "more"
    message = f"this line is indented {than} than line {line}: by {counted(own, 'space')}, not {column}"
    hint = f"indent it by {counted(column, 'space')} if it belongs beside line {line}"
    others = sorted({level[0] for level in levels} - {column})
    notes = (f"other lines around it are indented by {', '.join(map(str, others))}",) if others else ()
    return Diagnostic("E010", message, Span(source, start, start + len(found[0].strip())), notes, hint)


def _levels(source: Source, before: int) -> list[tuple[int, int, bool]]:
    """The levels open at line `before`: column, line of the last key or item in it, whether it is a list."""
    open_levels: list[tuple[int, int, bool]] = []
    block: int | None = None
    for number in range(1, before):
        text = source.line(number)
        blanks = len(text) - len(text.lstrip(" "))
        if not text.strip() or text.lstrip().startswith("#") or (block is not None and blanks > block):
            continue
        block = None
        for column, is_item in _places(text):
            while open_levels and open_levels[-1][0] > column:
                open_levels.pop()
            if open_levels and open_levels[-1][0] == column and open_levels[-1][2] == is_item:
                open_levels.pop()
            open_levels.append((column, number, is_item))
        if _BLOCK.search(text):
            block = blanks
    return open_levels


def _places(text: str) -> Iterator[tuple[int, bool]]:
    """The columns (from 0) in which a line has a dash of a list, or a key."""
    found = _LINE.match(text)
    assert found is not None
    for offset, character in enumerate(found["dashes"]):
        if character == "-":
            yield found.start("dashes") + offset, True
    if found["rest"] == "-":
        yield found.start("rest"), True
    elif _KEY.match(found["rest"]):
        yield found.start("rest"), False
