"""What is missing in YAML that cannot be read: a bracket, a quote, a comma, a colon, a blank."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from llfsm_verify.arrangement.model import ACTION_KINDS
from llfsm_verify.diagnostics import Diagnostic, Source, Span

if TYPE_CHECKING:
    import yaml

_CLOSING = {"{": "}", "[": "]"}
_KEY = re.compile(r"[ \t]*(?:-[ ]+)*([\w.-]+)[ \t]*:[ \t]+(\()?")
_TO = re.compile(rf"^[ \t]*(?:-[ ]+)*(?:{'|'.join(ACTION_KINDS)})[ \t]*:", re.MULTILINE)


def unclosed(source: Source, error: yaml.YAMLError, at: int) -> Diagnostic | None:
    """The bracket or quote without its other end, where that is on a line before `at`, the place of the parser's
    complaint, or on the line of it."""
    context, begin = str(getattr(error, "context", "")), _begin(error)
    if begin is None:
        return _unopened(source, at)
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


def missing(source: Source, error: yaml.YAMLError, at: int) -> Diagnostic | None:
    """The sign that is missing, or too much, on the line of the parser's complaint, or where what it read began."""
    context, begin = str(getattr(error, "context", "")), _begin(error)
    problem = str(getattr(error, "problem", ""))
    if context == "while scanning a simple key" and begin is not None:
        return _colon(source, begin)
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
    if source.text[at] == ",":
        return Diagnostic("E010", "nothing can follow here", here, hint="remove the `,`")
    if not problem.startswith("mapping values"):
        return None
    last = line.split(" #")[0].rstrip()
    key = _KEY.match(line)
    if key is not None and last.endswith(")") and key[2]:
        return Diagnostic("E010", "keys and values cannot stand in `(…)`", here, hint="write `{…}`")
    if key is None or not value_before(source, at):
        return None
    hint = "quote it: '…'"
    if re.search(r",[ ]+[\w.-]+:[ ]", last[key.end() :] + " "):  # several keys without their brackets
        begin = key.start(1) if "-" in line[: key.start(1)] else key.end()
        hint = f"write `{last[:begin].lstrip()}{{{last[begin:][:80]}}}`"
    return Diagnostic("E010", f"the value of `{key[1]}` has `: ` in it", here, hint=hint)


def value_before(source: Source, at: int) -> bool:
    """Whether a key and the beginning of its value stand before `at` on its line."""
    start = source.text.rfind("\n", 0, at) + 1
    key = _KEY.match(source.text, start, at)
    return key is not None and bool(source.text[key.end() : at].strip())


def _unopened(source: Source, at: int) -> Diagnostic | None:
    start = source.text.rfind("\n", 0, at) + 1
    line = source.text[start:].split("\n", 1)[0].split(" #")[0].rstrip()
    key = _KEY.match(line)
    if key is None or not line.endswith("}") or "{" in line:
        return None
    span = Span(source, start + len(line) - 1, start + len(line))
    return Diagnostic("E010", "this `}` closes nothing", span, hint=f"write `{{` before `{key[1]}`")


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


def _colon(source: Source, begin: int) -> Diagnostic | None:
    """For a line at `begin` that is no entry of a mapping."""
    line = source.text[begin:].split("\n", 1)[0].rstrip()
    span = Span(source, begin, begin + len(line))
    joined, first = re.match(r"([\w.-]+):(\S.*)", line), re.match(r"[A-Za-z_]\w*(?=\s)", line)
    if joined is not None:
        hint = f"write `{joined[1]}: {joined[2][:60]}`"
        return Diagnostic("E010", f"a blank is missing after `{joined[1]}:`", span, hint=hint)
    actions = list(_TO.finditer(source.text, max(0, begin - 2000), begin))
    if line.endswith((";", "{", "}")) and actions and not line.startswith(ACTION_KINDS):
        key = actions[-1][0].strip(" \t-:")
        hint = f"write `{key}: |`, and indent the lines of the action by more than `{key}`"
        return Diagnostic("E010", "this line belongs to no key", span, hint=hint)
    if first is None:
        return None
    rest = line[first.end() :].lstrip(" \t=")[:60]
    return Diagnostic("E010", f"`:` is missing after `{first[0]}`", span, hint=f"write `{first[0]}: {rest}`")
