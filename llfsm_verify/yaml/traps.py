"""What is wrong with a text that YAML cannot read, or reads in another way than it was meant."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

from llfsm_verify.diagnostics import Diagnostic, Source, Span, counted
from llfsm_verify.yaml.vocabulary import Vocabulary

if TYPE_CHECKING:
    import yaml


_PLAIN_VALUE = r"(?:^[ \t]*(?:-[ \t]+)*|[{{,][ \t]*)({})[ \t]*:[ \t]+(?P<value>[^\s#].*)$"
_EATEN = re.compile(r"""^[!&*@`%\[{]|^["'].*["']\s*[^\s,}#]|: |:$""")

_NEXT = re.compile(r"[,;][ \t]*\w+[ \t]*:(?=[ \t])|[ \t](?:to|lint|role|type|changes|safe|transitions)[ \t]*:(?=[ \t])")
"""Where the next entry begins, whether a comma is before it or not."""


def suspect(source: Source, around: int, vocabulary: Vocabulary) -> tuple[Span, str] | None:
    """The last guard or action that starts on the line of `around` or on one of the three before it, and that YAML
    reads as something else; with its key."""
    text = source.text
    if not vocabulary.texts:
        return None
    plain = re.compile(_PLAIN_VALUE.format("|".join((*vocabulary.texts, "init"))), re.MULTILINE)
    begin = around
    for _ in range(4):
        begin = text.rfind("\n", 0, begin)
        if begin < 0:
            break
    end = text.find("\n", around)
    found: tuple[Span, str] | None = None
    for match in plain.finditer(text, begin + 1, len(text) if end < 0 else end):
        value = _NEXT.split(match["value"].split(" #")[0], maxsplit=1)[0].rstrip()
        before = text[text.rfind("\n", 0, match.start("value")) + 1 : match.start("value")]
        flow = "{" in before
        if _EATEN.search(value) or (flow and re.search(r"[\[\]{}?]", value.rstrip("}, "))):
            found = (Span(source, match.start("value"), match.start("value") + len(value)), match[1])
    return found


def eaten(span: Span, key: str, *, guard: bool) -> Diagnostic:
    """The diagnostic for a guard or action that YAML does not read as one text."""
    hint = "quote it: '…'" if guard else "write it as a block: `|` and the text indented on the next lines"
    if span.text.startswith("!") and guard:
        hint = "write `not` for `!`, or quote it: '…'"
    return Diagnostic("E020", f"YAML does not read this `{key}` as one text", span, hint=hint)


def explain(source: Source, error: yaml.YAMLError, vocabulary: Vocabulary) -> Diagnostic:
    """A YAML syntax error in our words: the trap it fell into when there is one, else what the parser says."""
    mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
    position = getattr(error, "position", None)
    at = int(mark.index) if mark is not None else int(position) if isinstance(position, int) else 0
    at = min(at, max(0, len(source.text) - 1))
    trap = suspect(source, at, vocabulary)
    better = tab_in_front(source, at) or unclosed(source, error, at) or slipped(source, error, at, vocabulary)
    if better is None and (trap is None or trap[1] == "init" or trap[0].text[:1] not in ("{", "[")):
        better = stray_sign(source, error, at)
    if better is not None:
        return better
    problem = str(getattr(error, "problem", None) or getattr(error, "reason", None) or "unreadable text")
    context = getattr(error, "context", None)
    line_start = source.text.rfind("\n", 0, at) + 1
    indentation: Diagnostic | None = None
    if str(context).startswith("while parsing a block") and not source.text[line_start:at].strip():
        indentation = misindented(source, at)
    if trap is not None and (indentation is None or trap[0].end > line_start):
        return eaten(*trap, guard=trap[1] in vocabulary.guards)
    inside = value_before(source, at)  # a second `:` on a line, which no indentation mends
    if indentation is None and not inside and problem.startswith("mapping values are not allowed"):
        indentation = misindented(source, at)
    said = f"{context}: {problem}" if context else problem
    better = indentation or missing(source, error, at, vocabulary)
    return better or Diagnostic(
        "E010", f"this is not YAML: {said}", Span(source, at, at + 1), hint=vocabulary.hints["E010"]
    )


_INDENTED = re.compile(r"(?P<blanks> *)(?P<dashes>(?:- +)*)(?P<rest>(?:-$)?.*)")
_ENTRY = re.compile(r"[\w.\"'-]+[ ]*:(?:[ ]|$)")
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
    found = _INDENTED.match(source.line(number))
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
    found = _INDENTED.match(text)
    assert found is not None
    for offset, character in enumerate(found["dashes"]):
        if character == "-":
            yield found.start("dashes") + offset, True
    if found["rest"] == "-":
        yield found.start("rest"), True
    elif _ENTRY.match(found["rest"]):
        yield found.start("rest"), False


_CLOSING = {"{": "}", "[": "]"}
_KEY = re.compile(r"[ \t]*(?:-[ ]+)*([\w.-]+)[ \t]*:[ \t]+")
_SLIPS = {
    r"(?:-[ ]+)*-([\[{].*|[A-Za-z_]\w*:(?:[ ].*)?)": ("a blank is missing after `-`", r"write `- \1`"),
    r"((?:-[ ]+)*(?:[\w.-]+:[ ]+(?=[\w.-]+:[ ]))?)([\w.-]+:[ ][^{[]*\})": ("`{` is missing", r"write `\1{\2`"),
    r"((?:-[ ]+)*(?:[\w.-]+:[ ]+)?)[(<]([\w.-]+:[ ].*)[)>],?": ("keys and values stand in `{…}`", r"write `\1{\2}`"),
    r"((?:-[ ]+)*([A-Za-z_]\w*))[ ]*=?[ ]*([\[{].*)": (r"`:` is missing after `\2`", r"write `\1: \3`"),
}
"""What is wrong on the line of a complaint, or on the one above it (only the first of them)."""
_UNMARKED = re.compile(r"[ ]*((?:-[ ]+)*([A-Za-z_]\w*))((?:[ ]+[^\s=:][^:]*)?)$")
_LINE = re.compile(r"^(?![ ]*(?:#|$)).*", re.MULTILINE)
_TYPED = re.compile(r"(bool|u?int\d*|-?\d+\.\.-?\d+)[ ]+([A-Za-z_]\w*)(?:[ ]*=[ ]*([^\s;]+))?[ ]*[;,]?")


def unclosed(source: Source, error: yaml.YAMLError, at: int) -> Diagnostic | None:
    """The bracket or quote without its other end, where that is on a line before `at`, the place of the parser's
    complaint, or on the line of it."""
    context, begin = str(getattr(error, "context", "")), _begin(error)
    if begin is None:
        return None
    if begin >= len(source.text) and source.text.rstrip().endswith(("[", "{")):
        begin = len(source.text.rstrip()) - 1
    sign, span = source.text[begin : begin + 1], Span(source, begin, begin + 1)
    if context == "while scanning a quoted scalar":
        return Diagnostic("E010", "this quote is never closed", span, hint=f"write `{sign}` where the text ends")
    rest = source.text[begin:at].split("\n")
    if (
        sign not in _CLOSING
        or not context.startswith("while parsing a flow")
        or (len(rest) == 1 and source.text[at:].strip())
    ):
        return None
    line = rest[0].split(" #")[0].rstrip()
    if line.endswith((",", sign)) and rest[-1].strip():  # several lines are meant to be inside
        return _comma(source, at)
    hint = f"write `{_CLOSING[sign]}` where it ends"
    if _CLOSING[sign] in rest[0][len(line) :]:
        hint = "` #` begins a comment: quote the text in which it stands"
    return Diagnostic("E010", f"this `{sign}` is never closed", span, hint=hint)


def missing(source: Source, error: yaml.YAMLError, at: int, vocabulary: Vocabulary) -> Diagnostic | None:
    """The sign that is missing, or too much, on the line of the parser's complaint, or where what it read began."""
    context, begin = str(getattr(error, "context", "")), _begin(error)
    problem = str(getattr(error, "problem", ""))
    if context == "while scanning a simple key" and begin is not None:
        return _colon(source, begin, vocabulary)
    start = source.text.rfind("\n", 0, at) + 1
    line, before = source.line(source.position(at)[0]), source.text[start:at]
    here = Span(source, at, at + 1)
    if context.startswith("while parsing a flow"):
        array = re.compile(r"(?<![\w.])([\w.]+)\[(\w+)\]").search(source.text, start, at + 20)
        if source.text[at] == "[" and array is not None:
            hint = f"write `{{array: {array[1]}, size: {array[2]}}}` for a type, and quote anything else"
            return Diagnostic("E010", "YAML reads `[` as the beginning of a list", here, hint=hint)
        return _comma(source, at)
    if "cannot start any token" in problem:
        return Diagnostic("E010", f"a text cannot begin with `{line[len(before)]}`", here, hint="quote it: '…'")
    if not problem.startswith("mapping values"):
        return None
    last = line.split(" #")[0].rstrip()
    key = _KEY.match(line)
    if key is None or not value_before(source, at):
        return None
    hint = "quote it: '…'"
    if re.search(r",[ ]+[\w.-]+:[ ]", last[key.end() :] + " "):  # several keys without their brackets
        begin = key.start(1) if "-" in line[: key.start(1)] else key.end()
        kind = "type: " if re.match(r"[^:]*,[ ]+(?:init|role):[ ]", last[begin:]) else ""
        hint = f"write `{last[:begin].lstrip()}{{{kind}{last[begin:][:80]}}}`"
    return Diagnostic("E010", f"the value of `{key[1]}` has `: ` in it", here, hint=hint)


def stray_sign(source: Source, error: yaml.YAMLError, at: int) -> Diagnostic | None:
    """The sign at `at` that follows a whole value, or that cannot close what another sign opened."""
    context, begin, sign = str(getattr(error, "context", "")), _begin(error), source.text[at]
    here, before = Span(source, at, at + 1), source.text[:at].rstrip()
    opened = "" if begin is None or sign not in "}])" else source.text[begin : begin + 1]
    if context.startswith("while parsing a flow") and opened in _CLOSING:
        return Diagnostic("E010", f"`{sign}` cannot close `{opened}`", here, hint=f"write `{_CLOSING[opened]}`")
    if context.startswith("while parsing a block") and sign in ",;.}])" and before.endswith(("}", "]", "'", '"')):
        return Diagnostic("E010", "nothing can follow here", here, hint=f"remove the `{sign}`")
    return None


def slipped(source: Source, error: yaml.YAMLError, at: int, vocabulary: Vocabulary) -> Diagnostic | None:
    """A `-` without its blank, a key without its `:`, or `(…)` for `{…}`, on the line of the complaint or on those
    before it that it goes on from."""
    context, problem = str(getattr(error, "context", "")), str(getattr(error, "problem", ""))
    if not problem.startswith("mapping values") and not context.startswith("while parsing a block"):
        return None
    names = tuple(f"{key}:" for key in vocabulary.named)
    end, found = source.text.find("\n", at), None
    above = list(_LINE.finditer(source.text, 0, end if end >= 0 else len(source.text)))[-200:]
    lines = [(line.start(), line[0].split(" #")[0].rstrip()) for line in reversed(above)]
    for number, (begin, line) in enumerate(lines):
        indent = len(line) - len(line.lstrip(" "))
        span = Span(source, begin + indent, begin + len(line))
        for pattern, said in tuple(_SLIPS.items())[: (4, 1)[number] if number < 2 and len(line) < 120 else 0]:
            if (slip := re.fullmatch(rf"[ ]*{pattern}", line)) is not None:
                return Diagnostic("E010", slip.expand(said[0]), span, hint=slip.expand(said[1]))
        outer = next((text for _, text in lines[number + 1 :] if len(text) - len(text.lstrip(" ")) < indent), "")
        if outer.endswith(names) and _TYPED.fullmatch(line.strip()):
            return _colon(source, begin + indent, vocabulary)
        bare = None if line.endswith(";") or len(line) > 200 else _UNMARKED.match(line)
        if number and bare is None:  # here begins the text that the complaint is about
            return None if line.endswith(("|", ">")) else found
        if bare is not None and (bare[2] in vocabulary.keys or outer.endswith(names)):
            hint = f"write `{bare[1]}:{bare[3][:60]}`"
            found = Diagnostic("E010", f"`:` is missing after `{bare[2]}`", span, hint=hint)
    return found


def value_before(source: Source, at: int) -> bool:
    """Whether a key and the beginning of its value stand before `at` on its line."""
    start = source.text.rfind("\n", 0, at) + 1
    key = _KEY.match(source.text, start, at)
    return key is not None and bool(source.text[key.end() : at].strip())


def _begin(error: yaml.YAMLError) -> int | None:
    """Where what the parser was reading begins."""
    mark = getattr(error, "context_mark", None)
    return None if mark is None else int(mark.index)


def _comma(source: Source, at: int) -> Diagnostic | None:
    before = re.compile(r"(\w+)[ \t]*\Z").search(source.text, max(0, at - 60), at) if source.text[at] == ":" else None
    word = before or re.compile(r"(\w+)").match(source.text, at)
    if word is None:
        return None
    instead = "write `,` for `;`" if source.text[: word.start()].rstrip().endswith(";") else "write `,`"
    return Diagnostic("E010", f"`,` is missing before `{word[1]}`", Span(source, *word.span(1)), hint=instead)


def _colon(source: Source, begin: int, vocabulary: Vocabulary) -> Diagnostic | None:
    """For a line at `begin` that is not an entry of a mapping."""
    line = source.text[begin:].split("\n", 1)[0].rstrip()
    span = Span(source, begin, begin + len(line))
    joined, first = re.match(r"([\w.-]+):(\S.*)", line), re.match(r"[A-Za-z_]\w*(?=\s|$)", line)
    if joined is not None:
        hint = f"write `{joined[1]}: {joined[2][:60]}`"
        return Diagnostic("E010", f"a blank is missing after `{joined[1]}:`", span, hint=hint)
    if vocabulary.named and (typed := _TYPED.fullmatch(line)) is not None:
        hint = f"write `{typed[2]}: {{type: {typed[1]}{f', init: {typed[3]}' if typed[3] else ''}}}`"
        return Diagnostic("E010", "the type of a variable follows its name", span, hint=hint)
    keys = re.compile(rf"^[ \t]*(?:-[ ]+)*(?:{'|'.join(vocabulary.actions)})[ \t]*:", re.MULTILINE)
    actions = list(keys.finditer(source.text, max(0, begin - 2000), begin)) if vocabulary.actions else []
    if line.endswith((";", "{", "}")) and actions and not line.startswith(vocabulary.actions):
        key = actions[-1][0].strip(" \t-:")
        hint = f"write `{key}: |`, and indent the lines of the action by more than `{key}`"
        return Diagnostic("E010", "this line belongs to no key", span, hint=hint)
    if first is None:
        return None
    rest = line[first.end() :].lstrip(" \t=")[:60]
    return Diagnostic(
        "E010", f"`:` is missing after `{first[0]}`", span, hint=f"write `{f'{first[0]}: {rest}'.strip()}`"
    )
