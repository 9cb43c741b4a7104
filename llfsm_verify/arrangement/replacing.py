"""A draft in which another machine or policy stands in the place of one, as when a running arrangement gets it."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from llfsm_verify.arrangement.draft import UNREADABLE, ArrangementDraft, Draft, Unreadable
from llfsm_verify.arrangement.formats.reading import Reading
from llfsm_verify.arrangement.granting import other_levels


class Replacement(NamedTuple):
    """Another machine for an instance, as a text in a format of machines."""

    machine: str
    """The instance."""
    name: str
    """What diagnostics call the text: the name of its file, whose ending tells the format."""
    text: str


class NewPolicy(NamedTuple):
    """Another policy: what `access` says."""

    name: str
    """As of `Replacement`."""
    text: str


Change = Replacement | NewPolicy


def with_change(draft: Draft, change: Change) -> Draft:
    """The draft with this change. KeyError: there is no such instance."""
    return with_replacement(draft, change) if isinstance(change, Replacement) else with_policy(draft, change)


def with_policy(draft: Draft, policy: NewPolicy) -> Draft:
    """The draft with another policy. Its digest is of the old one and of the text."""
    arrangement = draft.arrangement
    assert not isinstance(arrangement, Unreadable)
    reading = Reading(Path())
    access = reading.policy_text(policy.name, policy.text)
    reading.diagnostics += other_levels(arrangement.access, access)
    found = UNREADABLE if access is None else access
    return _changed(draft, replace(arrangement, access=found), reading, "access:", policy.text)


def with_replacement(draft: Draft, replacement: Replacement) -> Draft:
    """The draft with another machine for one instance, which keeps its arguments and its place in the schedule.

    Its digest is of the old one and of the text. KeyError: there is no such instance.
    """
    arrangement = draft.arrangement
    assert not isinstance(arrangement, Unreadable)
    assert not isinstance(arrangement.machines, Unreadable)
    names = [instance.name.text for instance in arrangement.machines]
    if replacement.machine not in names:
        raise KeyError(replacement.machine)
    replaced = next(i.machine for i in arrangement.machines if i.name.text == replacement.machine)
    place = draft.path if isinstance(replaced, Unreadable) else replaced.states_at.source.name
    reading = Reading(Path(place).parent)
    reading.known = {source.name: source for source in draft.sources}
    machine = reading.machine_text(replacement.name, replacement.text)
    instances = tuple(
        replace(instance, machine=machine) if instance.name.text == replacement.machine else instance
        for instance in arrangement.machines
    )
    return _changed(draft, replace(arrangement, machines=instances), reading, replacement.machine, replacement.text)


def _changed(draft: Draft, arrangement: ArrangementDraft, reading: Reading, what: str, text: str) -> Draft:
    """The draft that has this `arrangement` now, after `reading` the text of `what`, which is not the name of a
    machine where it has a colon.
    """
    given = f"{draft.digest} {what} {text}".encode("utf-8", "surrogatepass")
    return replace(reading.added(draft, arrangement), digest=hashlib.sha256(given).hexdigest())
