"""What is missing in YAML that cannot be read: a bracket, a quote, a comma, a colon, a blank."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from llfsm_verify.diagnostics import Diagnostic, Source, Span
from llfsm_verify.yaml.vocabulary import Vocabulary

if TYPE_CHECKING:
    import yaml

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
        array = re.compile(r"([\w.]+)\[(\w+)\]").search(source.text, start, at + 20)
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


def behind(source: Source, error: yaml.YAMLError, at: int) -> Diagnostic | None:
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
    """For a line at `begin` that is no entry of a mapping."""
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
