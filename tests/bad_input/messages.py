"""All that is said about wrong texts, word by word; `python -m tests.bad_input.messages` writes messages.txt anew."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment, Source
from llfsm_verify.knowledge.reading import read_theory
from llfsm_verify.language.atoms import PropertyScope, check_atom
from llfsm_verify.logic.properties import FEATURES, PLAIN, parse_properties
from llfsm_verify.logic.syntaxes import parse_in
from tests.bad_input.cases import CASES
from tests.bad_input.property_cases import BOARD_OF_PROPERTIES, PROPERTY_CASES
from tests.knowledge.wrong import WRONG as THEORIES_WRONG
from tests.logic.wrong import PATTERNS_WRONG, REGULAR_WRONG, SYNTAXES_WRONG

KEPT = Path(__file__).with_name("messages.txt")
PROPERTIES = Path(__file__).parents[1] / "bad_properties"
FIRST = "E020"
"""Smaller codes are about the text as YAML, whose parser words what it found."""


def messages() -> dict[str, str]:
    """By case what is said, most of it in one line: code, place, the marked text, message, notes and hint."""
    return {
        name: "\n".join(line for d in found for line in _lines(d)) or "nothing"
        for name, found in wrong()
        if all(d.code >= FIRST for d in found)
    }


def wrong() -> Iterator[tuple[str, Sequence[Diagnostic]]]:
    """Every case by its name, with what is said."""
    scope = PropertyScope.of(load_arrangement_text(BOARD_OF_PROPERTIES))
    for case in CASES:
        yield case.reason, _said(load_arrangement_text, case.text.replace("§", ""), "wrong.yaml")
    for case in PROPERTY_CASES:
        whole = Fragment.whole(Source("wrong.ltl", case.text.replace("§", "")))
        yield f"in a property: {case.reason}", _said(check_atom, whole, scope)
    for theory in THEORIES_WRONG:
        yield f"in a theory: {theory.reason}", _said(read_theory, Source("wrong.d", theory.text.replace("§", "")))
    for path in sorted(PROPERTIES.glob("*.ltl")):
        source = Source(path.name, path.read_text(encoding="utf-8"))
        yield path.name, _said(parse_properties, [source], features=PLAIN)
    for syntax, text, _, _ in SYNTAXES_WRONG:
        whole = Fragment.whole(Source("wrong.ltl", text))
        yield f"in {syntax}: {_short(text) or 'nothing'}", _said(parse_in, syntax, whole)
    for text in (*(f"enforce x: {text}" for text, *_ in REGULAR_WRONG), *(f"x: {text}" for text, *_ in PATTERNS_WRONG)):
        yield text, _said(parse_properties, [Source("wrong.ltl", text)], features=FEATURES)


def _said(read: Callable[..., object], *arguments: object, **options: object) -> Sequence[Diagnostic]:
    try:
        read(*arguments, **options)
    except DiagnosticError as error:
        return error.diagnostics
    return ()


def _lines(d: Diagnostic) -> Iterator[str]:
    place = "" if d.span is None else f" {d.span.line}:{d.span.column} {_short(d.span.text)!r}"
    yield f"  {d.code}{place}: {d.message}"
    yield from (f"    note: {note}" for note in d.notes)
    if d.hint is not None:
        yield f"    hint: {d.hint}"


def _short(text: str) -> str:
    return text if len(text) <= 80 else f"{text[:40]}…{text[-20:]}, {len(text)} characters"


def kept() -> dict[str, str]:
    """What is expected, from messages.txt."""
    blocks = KEPT.read_text(encoding="utf-8").rstrip("\n").split("\n\n")
    return {name: said for name, _, said in (block.partition("\n") for block in blocks)}


if __name__ == "__main__":
    KEPT.write_text("\n\n".join(f"{name}\n{said}" for name, said in messages().items()) + "\n", encoding="utf-8")
