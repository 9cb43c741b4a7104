"""Arrangements guarded in tests, without files."""

from __future__ import annotations

from pathlib import Path

import yaml

from llfsm_verify.arrangement.formats import Given, read_arrangement
from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.verdict import Options
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.extensions.guards.proof import prove
from llfsm_verify.extensions.guards.reactions import reaction
from llfsm_verify.extensions.guards.transform import Task, guard
from llfsm_verify.extensions.guards.wanted import Wanted
from llfsm_verify.limits import Budget, Limits
from llfsm_verify.logic.properties import parse_properties


class _Plain(yaml.SafeDumper):
    def ignore_aliases(self, data):
        return True


def text_of(document):
    """A document as a YAML text."""
    return yaml.dump(document, Dumper=_Plain, sort_keys=False, default_flow_style=None, width=1000)


def lines_of(*texts):
    return parse_properties([Source("test", "\n".join(texts))])


def draft_of(given):
    """Of a path, or of a text."""
    return read_arrangement(Given(given) if isinstance(given, Path) else Given("test", given))


def guarded(given, properties, fallbacks, guard_only=(), own=None, until=None, reactions=()):
    """The guarded arrangement, and the property set."""
    draft = draft_of(given)
    lines = lines_of(*properties)
    expressions = {name: Fragment.whole(Source(name, text)) for name, text in fallbacks.items()}
    until = None if until is None else Fragment.whole(Source("until", until))
    wanted = Wanted(expressions, guard_only, until, tuple(map(reaction, reactions)))
    task = Task(lines.goals, lines.assumptions, own, bind(resolve(draft), lines).clock)
    return guard(draft, wanted, task, Path("guarded")), lines


def proved(made, lines, engine="auto", limits=Limits()):  # noqa: B008 - it is frozen
    return prove(made, lines, Options(limits), engine, Budget(limits))
