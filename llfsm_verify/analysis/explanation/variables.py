"""From atoms to the variables, inputs and machines that they read, with their values at a step."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from llfsm_verify.checking.trace import Trace
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import AtState, Observe, Query, Read, Sampled
from llfsm_verify.semantics.letters import Observed, TimePasses
from llfsm_verify.semantics.samples import scalars_of
from llfsm_verify.semantics.walk import elements


def names_of(atom: Observed) -> tuple[str, ...]:
    """What an atom reads, by the names that traces use: scalars (``a[1].x``) and machines, each once."""
    if isinstance(atom.expression, TimePasses):
        return ()
    found: dict[str, None] = {}
    for read in of_kind(atom.expression, Read):
        found.update(dict.fromkeys(elements(read)))
    for at in of_kind(atom.expression, AtState):
        found[at.machine] = None
    for query in of_kind(atom.expression, Query):
        found[query.machine] = None
    for sample in of_kind(atom.expression, Sampled):
        found.update(dict.fromkeys(_sampled(sample.machine, name) for name in scalars_of(sample)))
    for seen in of_kind(atom.expression, Observe):
        if seen.machine:
            found[f"{seen.machine}.{seen.kind}" if seen.kind in ("finished", "loaded") else seen.machine] = None
    return tuple(found)


def values_along(trace: Trace) -> Iterator[dict[str, str]]:
    """The text of every variable's value at the start and after each step; of an input, the one shown last.

    The same dictionary each time, changed."""
    values = dict(trace.initial)
    yield values
    for step in trace.steps:
        values.update((change.variable, change.after) for change in step.changes)
        values.update((sampled.input, sampled.text) for sampled in step.choices if sampled.input)
        for sampled in step.sampled:
            values[_sampled("", sampled.input)] = values[_sampled(step.machine or "", sampled.input)] = sampled.text
        yield values


def _sampled(machine: str, scalar: str) -> str:
    """What a machine ("": any) sampled last, as a property writes it."""
    return f"{machine}.sampled({scalar})" if machine else f"sampled({scalar})"


def by_key(atoms: Sequence[Observed]) -> dict[str, tuple[str, ...]]:
    """`names_of` by the key of each atom."""
    return {atom.name: names_of(atom) for atom in atoms}
