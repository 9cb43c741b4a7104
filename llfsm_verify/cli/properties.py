"""The properties that a command line names: files, and lines given with -p."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from llfsm_verify.cli.usage import UsageError
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import PLAIN, Feature, PropertySet, parse_properties
from llfsm_verify.logic.reading import GivenLines, read_source
from llfsm_verify.registry import meant

if TYPE_CHECKING:
    from llfsm_verify.arrangement.model import Arrangement

COMMAND_LINE: Final = "<command line>"
"""The name of what is given as it is."""


def read_properties(options: Namespace, features: frozenset[Feature] = PLAIN) -> PropertySet:
    """What `properties` and `property` of the command line ask for, in `syntax`. Raises DiagnosticError, also where a
    property needs more than `features`."""
    return parse_properties(property_sources(options), options.syntax, features)


def told(properties: PropertySet, arrangement: Arrangement | None) -> PropertySet:
    """The same, after what may be meant otherwise in them was said on standard error."""
    from llfsm_verify.checking.doubts import doubts

    for doubt in doubts(arrangement, properties):
        print(doubt.render(), file=sys.stderr)
    return properties


def chosen(properties: PropertySet, names: Sequence[str]) -> PropertySet:
    """The properties of these names (`--only`), or all when none is given, with all assumptions.

    UsageError: there is no property of one of the names; the message says so of the first one.
    """
    if not names:
        return properties
    there = [p.name for p in properties.goals]
    for name in names:
        if name not in there:
            near = meant(name, there)
            others = f"; there are: {', '.join(there)}" if there else ", and there are no others"
            raise UsageError(f"--only: there is no property `{name[:100]}`{near or others}")
    return replace(properties, properties=tuple(p for p in properties if p.kind == "assume" or p.name in names))


def property_sources(options: Namespace) -> list[Source]:
    """The texts of `properties` and `property` of the command line. DiagnosticError: a file cannot be read."""
    sources = [read_source(path) for path in options.properties]
    if options.property:
        # One source, so that bare formulas get different names (L1, L2, …).
        sources.append(GivenLines(COMMAND_LINE, options.property))
    return sources
