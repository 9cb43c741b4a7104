"""Guards and actions that YAML would eat: recognised in the text, so that the error says to quote them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from llfsm_verify.diagnostics import Diagnostic, Source, Span
from llfsm_verify.yaml.indentation import misindented, tab_in_front
from llfsm_verify.yaml.unfinished import behind, missing, slipped, unclosed, value_before
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
        better = behind(source, error, at)
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
