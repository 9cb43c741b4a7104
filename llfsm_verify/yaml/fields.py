"""Reading mappings with known keys: what is missing, unknown or of the wrong shape becomes a diagnostic."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable
from fractions import Fraction
from typing import TypeVar

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment, Span
from llfsm_verify.fileformat import judge_format
from llfsm_verify.language import codes as language_codes
from llfsm_verify.language.scope import RESERVED, did_you_mean
from llfsm_verify.language.syntax import ParsedActions, ParsedExpression
from llfsm_verify.yaml.duration import duration_ms, excess
from llfsm_verify.yaml.nodes import Mapping, Node, Scalar, Sequence, mark
from llfsm_verify.yaml.vocabulary import PLAIN, Vocabulary

T = TypeVar("T")
VERSION = "format"
"""The key that says for which format of files a file was written."""
_MERGE = "merge keys are not used here; write the keys out"
_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")


class Report:
    """Collects diagnostics; `error` appends one."""

    def __init__(self, vocabulary: Vocabulary = PLAIN) -> None:
        self.vocabulary = vocabulary
        self.diagnostics: list[Diagnostic] = []

    def error(self, code: str, message: str, span: Span, hint: str | None = None, notes: tuple[str, ...] = ()) -> None:
        hint = hint or self.vocabulary.hints.get(code) or language_codes.HINTS.get(code)
        self.diagnostics.append(Diagnostic(code, message, span, notes, hint))

    def add(self, e: DiagnosticError) -> None:
        self.diagnostics += e.diagnostics

    def keep(self, diagnostics: Iterable[Diagnostic], broken: Collection[str]) -> None:
        """Add them, but not that a name is unknown whose declaration is wrong."""
        for d in diagnostics:
            if d.code not in ("E110", "E111") or d.span is None or d.span.text not in broken:
                self.diagnostics.append(d)

    def mapping(self, node: Node, what: str) -> Mapping | None:
        if isinstance(node, Mapping):
            return node
        hint = self.vocabulary.shapes.get(what)
        if hint is None and isinstance(node, Sequence):
            hint = "write `key: value`, one per line, without `-` and `[ ]`"
        self.error("E030", f"{what} must be a mapping (`key: value`)", mark(node), hint)
        return None

    def sequence(self, node: Node, what: str) -> Sequence | None:
        if isinstance(node, Sequence):
            return node
        hint = "write `[a, b]`, or one `- …` per line"
        if isinstance(node, Mapping):
            first = node.items[0][0].text[:60] if node.items else ""
            named = what == "`states`" and "name" not in {key.text for key, _ in node.items}
            hint = f"write `- name: {first}` for `{first}:`, and so on" if named else "write `- ` before each of them"
        elif isinstance(node, Scalar) and (words := re.findall(r"\w+", node.text[:200])):
            hint = f"write `[{', '.join(words)}]`"
        self.error("E031", f"{what} must be a list", mark(node), hint)
        return None

    def scalar(self, node: Node, what: str) -> Scalar | None:
        if isinstance(node, Scalar) and node.text.strip():
            return node
        hint = "write a value" if isinstance(node, Scalar) else None
        self.error("E032", f"{what} must be a single value", mark(node), hint)
        return None

    def fields(
        self, node: Node, what: str, known: Iterable[str], required: Iterable[str] = ()
    ) -> dict[str, Node] | None:
        """The values of a mapping by key. None when it is not a mapping or a required key is missing."""
        mapping = self.mapping(node, what)
        if mapping is None:
            return None
        keys = tuple(known)
        found: dict[str, Node] = {}
        joined: list[str] = []
        complete = True
        for key, value in mapping.items:
            if key.text in keys:
                found[key.text] = value
                continue
            last = list(found)[-1] if found else None
            meant = _joined(key.text, keys)
            joined += meant[:1]
            is_text = last in self.vocabulary.texts
            split = (
                None
                if last is None or meant or not is_text
                else mapping.split((last, found[last]), key, value, guard=last in self.vocabulary.guards)
            )
            if split is not None:
                self.diagnostics.append(split)
                complete = False
            else:
                self.unknown_key(key, what, keys)
        missing = [key_name for key_name in required if key_name not in found]
        for key_name in missing if complete else ():
            if key_name not in joined:
                self.error("E034", f"{what} has no `{key_name}`", mark(node), f"write `{key_name}: …`")
        return None if missing or not complete else found

    def unknown_key(self, key: Scalar, what: str, known: tuple[str, ...]) -> None:
        words = self.vocabulary
        hint = next(
            (f"write `{k}`" for k, others in words.called.items() if k in known and key.text in others.split()), None
        )
        hint = f"write `{': '.join(meant).strip()[:80]}`" if (meant := _joined(key.text, known)) else hint
        hint = words.elsewhere.get(key.text) or (_MERGE if key.text == "<<" else None) or hint
        hint = hint or (words.spelt.get(key.text) if "type" in known or "when" in known else None)
        hint = hint or did_you_mean(key.text, known) or f"known keys: {', '.join(known)}"
        self.error("E033", f"{what} has no key `{key.text[:60]}`", key.span, hint)

    def choice(self, node: Node | None, what: str, options: tuple[str, ...], default: str) -> str:
        """One of a few words; the default when the key is absent or wrong."""
        if node is None:
            return default
        scalar = self.scalar(node, what)
        if scalar is None:
            return default
        if scalar.text not in options:
            hint = f"write {' or '.join(f'`{o}`' for o in options)}"
            self.error("E035", f"{what} cannot be `{scalar.text[:60]}`", scalar.span, hint)
            return default
        return scalar.text

    def time(self, node: Node | None, what: str, code: str) -> Fraction | None:
        """A positive time in milliseconds; None where it is missing or wrong, which is reported under this code."""
        scalar = None if node is None else self.scalar(node, what)
        milliseconds = None if scalar is None else duration_ms(scalar.text)
        if scalar is not None and milliseconds is None:
            message = excess(scalar.text) or f"`{scalar.text[:40]}` is not a positive time"
            self.error(code, message, mark(scalar), "write a time such as 500ms, 90s, 5min or 2h")
        return milliseconds

    def can_read(self, node: Node, what: str) -> bool:
        """Whether the file is of a format that we know, by its key `format`; else E097 is said.

        A later format may have keys that are unknown here, so nothing else is said of such a file.
        """
        value = next((v for k, v in node.items if k.text == VERSION), None) if isinstance(node, Mapping) else None
        if value is None:
            return True
        mistake = judge_format(value.text if isinstance(value, Scalar) else "", what, VERSION)
        if mistake is not None:
            self.error("E097", mistake[0], mark(value), mistake[1])
        return mistake is None

    def name(self, node: Node, what: str) -> str | None:
        """A name of something the user declares: an identifier that is not a word of the language."""
        scalar = self.scalar(node, what)
        if scalar is None:
            return None
        if not _IDENTIFIER.match(scalar.text):
            self.error("E036", f"`{scalar.text[:60]}` cannot be {what}", scalar.span, _named(scalar.text))
            return None
        if scalar.text in RESERVED:
            message = f"`{scalar.text}` is a word of the language and cannot be {what}"
            self.error("E119", message, scalar.span, "choose another name")
            return None
        return scalar.text

    def distinct(self, names: Iterable[Scalar]) -> None:
        """Report the names that are there before (E017)."""
        seen: dict[str, Scalar] = {}
        for name in names:
            if name.text not in seen:
                seen[name.text] = name
            else:
                note = f"the first one is at {seen[name.text].span.nearby}"
                self.error("E017", f"the name `{name.text[:60]}` appears twice", mark(name), notes=(note,))

    def text(self, node: Node, key: str) -> Fragment | None:
        """The text of an expression or action; what was not meant as one gets a diagnostic that says so."""
        misread = node.misread(key, guard=key in self.vocabulary.guards)
        if misread is not None:
            self.diagnostics.append(misread)
        elif isinstance(node, Scalar):
            return node.fragment
        else:
            self.scalar(node, f"`{key}`")
        return None

    def guard(self, node: Node, key: str) -> ParsedExpression | None:
        from llfsm_verify.language.parser import parse_guard

        return self._parsed(node, key, parse_guard)

    def actions(self, node: Node, key: str) -> ParsedActions | None:
        from llfsm_verify.language.parser import parse_actions

        return self._parsed(node, key, parse_actions)

    def _parsed(self, node: Node, key: str, parse: Callable[[Fragment], T]) -> T | None:
        fragment = self.text(node, key)
        try:
            return None if fragment is None else parse(fragment)
        except DiagnosticError as e:
            self.add(e)
            return None


def _joined(text: str, known: Iterable[str]) -> tuple[str, ...]:
    """The key and the value of a text that has no `: ` between them."""
    found = re.match(r"([a-z_]+)\s*[\s:=]\s*([^{[]*)", text)
    return found.groups() if found is not None and found[1] in known else ()


def is_name(node: Node) -> bool:
    """Whether `Report.name` finds nothing wrong with it."""
    return isinstance(node, Scalar) and _IDENTIFIER.match(node.text) is not None and node.text not in RESERVED


def _named(text: str) -> str:
    """What to write in place of a text that is not a valid name."""
    words = re.findall(r"\w+", text[:60], re.ASCII)
    if len(words) > 1 and re.search("[,;|]", text):
        return "write `,` between values, and `[ ]` around all of them"
    name = "_".join(words)
    near = f", such as `{name if not name[0].isdigit() else f'_{name}'}`" if name else ""
    return f"use letters, digits and `_`, no digit first{near}"
