"""A draft in which another machine stands in the place of one, as when a running arrangement gets it."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from llfsm_verify.arrangement.draft import Draft, Unreadable
from llfsm_verify.arrangement.formats.reading import Reading
from llfsm_verify.arrangement.formats.yaml.reader import read_machine_text


class Replacement(NamedTuple):
    """Another machine for an instance, as a text in YAML."""

    machine: str
    """The instance."""
    name: str
    """What diagnostics call the text: the name of its file."""
    text: str


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
    reading = Reading(Path())
    data = replacement.text.encode("utf-8", "surrogatepass")
    machine = read_machine_text(reading, replacement.name, data)
    instances = tuple(
        replace(instance, machine=machine) if instance.name.text == replacement.machine else instance
        for instance in arrangement.machines
    )
    given = f"{draft.digest} {replacement.machine} ".encode()
    return replace(
        draft,
        arrangement=replace(arrangement, machines=instances),
        digest=hashlib.sha256(given + data).hexdigest(),
        sources=(*draft.sources, *reading.sources),
        diagnostics=(*draft.diagnostics, *reading.diagnostics),
    )
