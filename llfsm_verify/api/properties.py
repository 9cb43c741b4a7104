"""What a check is asked: properties as a text, files, lines, or a mapping from names to formulas."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import FEATURES, PropertySet, parse_properties
from llfsm_verify.logic.reading import GivenLines, names_file, read_source
from llfsm_verify.logic.syntax_names import SYNTAXES

Properties = str | Path | Sequence[str | Path] | Mapping[str, str]
"""- A **str** is the text of a property file, of one line or many; one line that ends in ``.ltl`` names a file.
- A **Path** names a property file.
- A **sequence** has lines of property files, and paths of files, which a `Path` or the ending ``.ltl`` tells apart.
- A **mapping** leads from what stands before the colon of a line, such as ``"safe"``, ``"assume fair"`` or
  ``"forbid both"``, to what comes after it.
"""

GIVEN = "<properties>"
"""The name of texts in diagnostics."""


def read_properties(properties: Properties, syntax: str = "llfsm") -> PropertySet:
    """The properties.

    DiagnosticError: what is wrong with them; TypeError: they are something else; ValueError: there is no such syntax.
    """
    check_syntax(syntax)
    return parse_properties(property_sources(properties), syntax, FEATURES)


def check_syntax(syntax: str) -> None:
    """ValueError: there is no syntax of this name."""
    if syntax not in SYNTAXES:
        raise ValueError(f"there is no syntax `{syntax}`; there are: {', '.join(SYNTAXES)}")


def property_sources(properties: Properties) -> list[Source]:
    """Their texts. DiagnosticError: a file cannot be read; TypeError: they are something else."""
    if isinstance(properties, str | Path):
        return [_source(properties)]
    if isinstance(properties, Mapping):
        return [GivenLines(GIVEN, [f"{name}: {_text(text)}" for name, text in properties.items()])]
    items = _items(properties)
    lines = [one for one in items if isinstance(one, str) and not names_file(one)]
    files = [read_source(one) for one in items if names_file(one)]
    # One source, so that formulas without a name get different names (L1, L2, …).
    return [*files, GivenLines(GIVEN, lines)] if lines else files


def _source(given: str | Path) -> Source:
    return read_source(given) if names_file(given) else Source(GIVEN, str(given))


def _items(given: object) -> list[str | Path]:
    if not isinstance(given, Sequence) or isinstance(given, bytes):
        raise TypeError(f"properties are a text, a path, a sequence of these or a mapping, not {given!r:.80}")
    return [one if isinstance(one, Path) else _text(one) for one in given]


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError(f"a property is a text or a path, not {value!r:.80}")
    return value
