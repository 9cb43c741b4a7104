"""What most commands begin with: the arrangement and the properties of the command line, what is said of their texts,
and the limits of the work."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from llfsm_verify.cli.io.output import tell
from llfsm_verify.cli.parser import UsageError
from llfsm_verify.limits import Limits
from llfsm_verify.registry import meant

if TYPE_CHECKING:
    from argparse import Namespace

    from llfsm_verify.arrangement.draft import Draft
    from llfsm_verify.arrangement.model import Arrangement
    from llfsm_verify.diagnostics import Source
    from llfsm_verify.logic.properties import Feature, PropertySet

COMMAND_LINE: Final = "<command line>"
"""The name of what is given as it is."""


def open_draft(path: str) -> tuple[Draft, Arrangement]:
    """What is read of an arrangement, and the arrangement; its warnings are said. DiagnosticError."""
    from llfsm_verify.arrangement.formats import Given, read_arrangement
    from llfsm_verify.arrangement.resolve.arrangement import resolve

    draft = read_arrangement(Given(path))
    arrangement = resolve(draft)
    tell(*arrangement.warnings)
    return draft, arrangement


def open_arrangement(path: str) -> Arrangement:
    """The arrangement alone; see `open_draft`."""
    return open_draft(path)[1]


def read_properties(options: Namespace, features: frozenset[Feature] | None = None) -> PropertySet:
    """What `properties` and `property` of the command line ask for, in `syntax`. Raises DiagnosticError, also where a
    property needs more than `features` (None: than what engines check)."""
    from llfsm_verify.logic.properties import parse_properties

    if features is None:
        from llfsm_verify.checking.goals.kinds import CHECKED

        features = CHECKED
    return parse_properties(property_sources(options), options.syntax, features)


def told(properties: PropertySet, arrangement: Arrangement | None, *, stamped: bool = False) -> PropertySet:
    """The same, after what may be meant otherwise in them was said on standard error. `stamped`: letters have times."""
    from llfsm_verify.checking.doubts import doubts

    tell(*doubts(arrangement, properties, stamped=stamped))
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
    from llfsm_verify.logic.reading import GivenLines, read_source

    sources = [read_source(path) for path in options.properties]
    if options.property:
        # One source, so that bare formulas get different names (L1, L2, …).
        sources.append(GivenLines(COMMAND_LINE, options.property))
    return sources


def limits_of(options: Namespace) -> Limits:
    """What --max-states, --memory and --timeout allow, as far as the command has them, since it began."""
    states, memory, timeout = (getattr(options, name, None) for name in ("max_states", "memory", "timeout"))
    left = None if timeout is None else max(timeout - (time.perf_counter() - options.started), 0.0)
    return Limits(states, memory, timeout).within(left)
