"""Which kind of file a text looks like, so that files given in each other's place are one mistake and not fifty."""

from __future__ import annotations

import re
from typing import Literal

from llfsm_verify.diagnostics import Diagnostic, Source, Span

Kind = Literal["arrangement", "machine", "policy", "properties", "sweep", "trace", "theory"]

# A key at the left margin with a block or a flow collection after it.
_BLOCK = r"^{}[ \t]*:[ \t]*(?:[#&{{\[].*)?\r?$"
_ARRANGEMENT = re.compile(_BLOCK.format("(?:machines|schedule|processes|whiteboard)"), re.MULTILINE)
_STATES = re.compile(_BLOCK.format("states"), re.MULTILINE)
_MACHINE = re.compile(r"^machine[ \t]*:[ \t]*\w+[ \t]*(?:#.*)?\r?$", re.MULTILINE)
_TRACE = re.compile(r"^trace[ \t]*:[ \t]*[0-9]+[ \t]*\r?$", re.MULTILINE)
_SWEEP = re.compile(r"^arrangements[ \t]*:(?=\s)", re.MULTILINE)
_POLICY = re.compile(r"^levels[ \t]*:(?=\s|$)", re.MULTILINE)
_THEORY = re.compile(r"(?:^[ \t]*|\.[ \t]+)(?:name|input|output)[ \t]*\{", re.MULTILINE)
_KEYS = "(?:machines?|states|schedule|processes|whiteboard)"
_KEY = re.compile(rf"^([\"']?){_KEYS}\1[ \t]*:(?=\s|$)", re.MULTILINE)
_FLOW = re.compile(rf"[{{,\s]([\"']?){_KEYS}\1\s*:")
_PROPERTY = re.compile(
    r"(?:assume|enforce|forbid)\s[^:]*:"  # a word that no YAML key begins with
    r"|(?:[A-Za-z_][\w-]*\s*:)?\s*[!(]*\s*(?:[GFX][\s(!]|\[\]|<>)"  # a temporal operator first
    r"|(?:[A-Za-z_][\w-]*\s*:)?.*\S(?:\s+[UWRM]\s+|\s*->\s*)\S"  # or in the middle
)

_LOOKED_AT = 2000
"""Characters of a line: the pattern takes quadratic time on long runs of blanks."""

NAMES: dict[Kind, str] = {
    "arrangement": "an arrangement",
    "machine": "a machine file",
    "policy": "a policy file",
    "properties": "a property file",
    "sweep": "a sweep",
    "theory": "a theory",
    "trace": "a trace file",
}
_KNOWN_BY = "let the arrangement name it (`knowledge: {{NAME: {{file: …}}}}`), or call `llfsm knowledge table {file}`"
_HINTS: dict[tuple[Kind, Kind], str] = {
    ("arrangement", "theory"): _KNOWN_BY,
    ("properties", "theory"): _KNOWN_BY,
    ("theory", "arrangement"): "name a .d file, such as one that its `knowledge:` names",
    ("arrangement", "properties"): "name the arrangement before it: `llfsm-verify ARRANGEMENT {file}`",
    ("arrangement", "machine"): "write an arrangement that names it (`machines: {{m: {{file: …}}}}`, `schedule: [m]`), "
    "and give that one",
    ("arrangement", "sweep"): "call `llfsm sweep {file}`",
    ("sweep", "arrangement"): "name it in a sweep (`arrangements: [{file}]`), or call `llfsm verify {file}`",
    ("arrangement", "trace"): "call `llfsm replay {file}`",
    ("machine", "arrangement"): "name a file with `machine:` and `states:` here",
    ("properties", "arrangement"): "call `llfsm-verify ARRANGEMENT PROPERTIES`, with one arrangement",
    ("properties", "machine"): "leave it out: the arrangement names its machine files itself",
    ("properties", "trace"): "call `llfsm replay {file}`",
}


def kind_of(source: Source) -> Kind | None:
    """What the text of `source` looks like; None when it looks like nothing known."""
    text = source.text
    if _TRACE.search(text):
        return "trace"
    if _ARRANGEMENT.search(text):
        return "arrangement"
    if _MACHINE.search(text) and _STATES.search(text):
        return "machine"
    if _SWEEP.search(text):
        return "sweep"
    if _THEORY.search(text) or source.name.endswith(".d"):
        return "theory"
    start, end = _first_line(text)
    formula = _PROPERTY.match(text, start, min(end, start + _LOOKED_AT)) or source.name.endswith(".ltl")
    return "properties" if formula else None


def may_be_shown(source: Source, expected: Kind = "machine") -> bool:
    """Whether what is wrong with a file that another file names may be told: only of an arrangement, a machine or a
    trace, and of a policy or a theory where one is expected, if with mistakes. Who writes `file: PATH` must not learn
    what stands in any file that we can read.
    """
    text = source.text
    own = {"policy": _POLICY, "theory": _THEORY}.get(expected)
    if own is not None and own.search(text) is not None:
        return True
    return (
        _TRACE.search(text) is not None or (_FLOW if text.lstrip().startswith("{") else _KEY).search(text) is not None
    )


def unlike(expected: Kind, path: str, at: Span) -> Diagnostic:
    """The diagnostic (E019) for a file that is not recognised, `at` the place that names it; it shows nothing of it."""
    keys = {
        "machine": "`machine:` or `states:`", "policy": "`levels:`", "theory": "`input {` or `output {`"
    }.get(expected, "`machines:` or `schedule:`")  # fmt: skip
    message = f"`{path[:200]}` is not {NAMES[expected]}: no line of it begins with {keys}"
    return Diagnostic("E019", message, at, hint=f"name {NAMES[expected]} here")


def _first_line(text: str) -> tuple[int, int]:
    """Where the first line that is neither empty nor a comment stands, without the white space around it."""
    start = 0
    while start < len(text):
        end = text.find("\n", start)
        end = len(text) if end < 0 else end
        line = text[start:end]
        if line.strip() and not line.lstrip().startswith("#"):
            return start + len(line) - len(line.lstrip()), start + len(line.rstrip())
        start = end + 1
    return 0, min(1, len(text))


def other_kind(source: Source, expected: Kind) -> Diagnostic | None:
    """The diagnostic (E019) for a file that looks like another kind than the one expected; None when it does not."""
    found = kind_of(source)
    if found is None or found == expected:
        return None
    span = Span(source, *_first_line(source.text))
    hint = _HINTS.get((expected, found), f"name {NAMES[expected]} here").format(file=source.name)
    return Diagnostic("E019", f"this looks like {NAMES[found]}, and {NAMES[expected]} is expected", span, hint=hint)
