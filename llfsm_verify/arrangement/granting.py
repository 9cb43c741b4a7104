"""Policies of runs: their digest, and what one may not do that takes the place of another: name other levels, or give
machines more."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator

from llfsm_verify.arrangement.draft import Unreadable
from llfsm_verify.arrangement.model import Access, Arrangement
from llfsm_verify.diagnostics import Diagnostic, Span
from llfsm_verify.yaml.nodes import Mapping, Node, Scalar, Sequence, mark


def other_levels(before: Node | Unreadable | None, after: Node | None) -> Iterator[Diagnostic]:
    """What is wrong with the levels of a policy, as it is written, that takes the place of another one; E165."""
    levels, given = _levels(before), _levels(after)
    if levels is not None and given is not None and _words(levels) != _words(given):
        message = "a policy for a running arrangement has its levels, in their order"
        yield Diagnostic("E165", message, mark(given), hint=f"write `levels: [{', '.join(_words(levels))}]`")


def _levels(node: Node | Unreadable | None) -> Sequence | None:
    items = node.items if isinstance(node, Mapping) else ()
    return next((value for key, value in items if key.text == "levels" and isinstance(value, Sequence)), None)


def _words(levels: Sequence) -> list[str]:
    return [item.text if isinstance(item, Scalar) else "" for item in levels.items]


def rights_given(first: Arrangement, following: Arrangement) -> Iterator[Diagnostic]:
    """What is wrong with the policy of `following` in a run that began with that of `first`, of the same levels; E165.

    Users may be given other rights, and machines back what they had at first.
    """
    before, after = first.access, following.access
    assert before is not None
    assert after is not None
    assert before.levels == after.levels
    for machine in first.machines:
        yield from _raised(before, after, machine.name)
        for entry in first.whiteboard:
            if entry.role != "input":
                yield from _writable(before, after, machine.name, entry.variable.name)
        for target in first.machines:
            yield from _commandable(before, after, machine.name, target.name)


def _raised(before: Access, after: Access, machine: str) -> Iterator[Diagnostic]:
    level = before.levels[before.clearance(machine)]
    if after.clearance(machine) > before.clearance(machine):
        message = f"machine `{machine}` gets a higher clearance than it had when the run began"
        yield _denied(after, message, f"write `machines: {{{machine}: {level}}}`", f"machines.{machine}")


def _writable(before: Access, after: Access, machine: str, variable: str) -> Iterator[Diagnostic]:
    if after.may_write(machine, variable) and not before.may_write(machine, variable):
        level = before.levels[before.write_class(variable)]
        message = f"machine `{machine}` may write `{variable}`, which it might not when the run began"
        yield _denied(after, message, f"write `write: {{{variable}: {level}}}`", f"write.{variable}")


def _commandable(before: Access, after: Access, machine: str, target: str) -> Iterator[Diagnostic]:
    if after.may_command(machine, "unload", target) and not before.may_command(machine, "unload", target):
        level = before.levels[before.command_class(target)]
        message = f"machine `{machine}` may command `{target}`, which it might not when the run began"
        places = f"command.{target}", f"machines.{target}"
        yield _denied(after, message, f"write `command: {{{target}: {level}}}`", *places)


def _denied(after: Access, message: str, hint: str, *places: str) -> Diagnostic:
    """Its place is the first of these, or the levels, where the policy does not name it."""
    span: Span = next(after.marks[place] for place in (*places, "levels") if place in after.marks)
    return Diagnostic("E165", message, span, hint=hint)


def policy_digest(arrangement: Arrangement) -> str:
    """SHA-256 (hex) of who may do what: the keys `access` and `operators` of an arrangement, in whatever order."""
    access = arrangement.access
    operated = sorted([o.kind, o.target] for o in arrangement.operated)
    levels = None if access is None else {
        "levels": list(access.levels), "machines": dict(access.machines), "write": dict(access.write),
        "command": dict(access.command), "users": dict(access.users), "refuses": access.refuses,
    }  # fmt: skip
    return hashlib.sha256(json.dumps([levels, operated], sort_keys=True).encode()).hexdigest()
