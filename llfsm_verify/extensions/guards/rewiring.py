"""Routed outputs in the texts of machines: each place where one is read or written gets the name of its slot."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.guards.codes import UNFIT
from llfsm_verify.plug import (
    Arrangement,
    ArrangementDraft,
    InstanceDraft,
    MachineDraft,
    Read,
    Scalar,
    Span,
    UnreadablePart,
    of_kind,
)

_WORD = re.compile(r"[A-Za-z_]\w*", re.ASCII)

Renaming = tuple[Span, str]
"""A place, and what is to stand there."""


def renamings(arrangement: Arrangement, draft: ArrangementDraft, requests: Mapping[str, str]) -> Iterator[Renaming]:
    """The places in machines and arguments that name a routed output and mean it.

    The typed trees know what a name means: a variable, parameter or local variable that is called like an output is
    none of these places. DiagnosticError: a name is written in such a way that its place cannot be told, or a theory
    is told of an output where that cannot be renamed for the machines alone.
    """
    for owner in (None, *arrangement.texts):
        for asked, entry in (arrangement if owner is None else owner).knowledge.items():
            for read in of_kind(entry, Read):
                own = owner is not None and read.span.source is entry.span.source  # it is renamed as the rest is
                if read.variable.scope == "whiteboard" and read.variable.name in requests and not own:
                    message = f"`{asked}` depends on the output `{read.variable.name}`, which is routed"
                    hint = "let a machine keep it in a variable, and tell the theory that"
                    raise DiagnosticError(Diagnostic(UNFIT, message, entry.span, hint=hint))
    for instance in instances(draft):
        machine = instance.machine
        assert isinstance(machine, MachineDraft)
        kinds = {parameter.name.text: parameter.kind for parameter in machine.parameters}
        # A parameter that is called like a variable is bound to it, in every instance.
        for name in (p.name for p in machine.parameters if p.name.text in requests):
            yield name.span, requests[name.text]
        for key, value in instance.arguments:
            if key.text in requests and key.text in kinds:
                yield key.span, requests[key.text]
            if isinstance(value, Scalar) and value.text in requests and kinds.get(key.text) == "whiteboard":
                yield value.span, requests[value.text]
        for read in of_kind(arrangement.machine(instance.name.text).states, Read):
            routed = read.variable.name
            if read.variable.scope != "whiteboard" or routed not in requests:
                continue
            start = read.span.start
            found = _WORD.match(read.span.source.text, start)
            if found is None or found[0] not in {routed, *kinds}:
                message = f"the name of `{routed}` is not written out here"
                raise DiagnosticError(Diagnostic(UNFIT, message, read.span, hint="write it without escapes"))
            if found[0] == routed:  # other parameters are bound to another variable where the instance stands
                yield Span(read.span.source, start, found.end()), requests[routed]


def instances(draft: ArrangementDraft) -> tuple[InstanceDraft, ...]:
    """The machines of a draft that was resolved, without the model of the surroundings."""
    assert not isinstance(draft.machines, UnreadablePart)
    return draft.machines
