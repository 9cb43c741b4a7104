"""What the letters of a regular property say of a configuration, and which configurations there can be."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

from llfsm_verify.logic.formula import Formula, atom, conjunction, negation

RegularKind = Literal["enforce", "forbid", "forbid initially"]


class ExpressionTooLarge(Exception):
    """A question about an expression took more than its limit."""


def state_groups(keys: Iterable[str]) -> list[tuple[str, ...]]:
    """The atoms `m@STATE` of each machine that has several: a machine is in one state at a time."""
    groups: dict[str, list[str]] = {}
    for key in dict.fromkeys(keys):
        machine, sign, state = key.partition("@")
        if sign and machine.isidentifier() and state.isidentifier():
            groups.setdefault(machine, []).append(key)
    return [tuple(group) for group in groups.values() if len(group) > 1]


def exclusions(keys: Iterable[str]) -> Formula:
    """The state formula that no machine is in two states."""
    return conjunction(
        negation(conjunction((atom(a), atom(b))))
        for group in state_groups(keys)
        for i, a in enumerate(group)
        for b in group[i + 1 :]
    )
