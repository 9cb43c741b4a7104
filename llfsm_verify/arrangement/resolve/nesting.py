"""Machines inside states: who runs whom."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from llfsm_verify.arrangement.model import Machine
from llfsm_verify.diagnostics import Span
from llfsm_verify.language.scope import MachineSignature, did_you_mean
from llfsm_verify.language.trees import nodes
from llfsm_verify.language.typed import Command, Query
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Node, mark


def resolve_runs(
    report: Report, node: Node | None, machines: dict[str, MachineSignature]
) -> tuple[tuple[str, Span], ...]:
    """The instances that the key `runs` of a state names, each with its place; `machines` by the names in the text."""
    sequence = None if node is None else report.sequence(node, "`runs`")
    found: dict[str, Span] = {}
    for item in sequence.items if sequence else ():
        scalar = report.scalar(item, "an entry of `runs`")
        if scalar is None:
            continue
        known = machines.get(scalar.text)
        if known is None or scalar.text == "self":
            hint = did_you_mean(scalar.text, [m for m in machines if m != "self"])
            report.error("E159", f"there is no machine `{scalar.text[:60]}` to run", mark(scalar), hint)
        elif known.name in found:
            report.error("E159", f"`{known.name}` appears twice here", mark(scalar), "remove one")
        else:
            found[known.name] = mark(scalar)
    return tuple(found.items())


def nest(report: Report, machines: Sequence[Machine], places: dict[tuple[str, str], Span]) -> tuple[Machine, ...]:
    """The machines, with those that a state runs marked. `places`: where each owner names each machine."""
    owner: dict[str, str] = {}
    by_name = {m.name: m for m in machines}
    for machine in machines:
        for number, state in enumerate(machine.states):
            for name in state.runs:
                place = places[machine.name, name]
                if number == machine.suspend:
                    report.error("E159", "the suspend state runs no machines", place, "let another state run it")
                elif name in by_name and not by_name[name].loaded:
                    hint = "put it into the schedule: it is suspended until its state runs it"
                    report.error("E159", f"`{name}` belongs to the pool, so no state can run it", place, hint)
                elif name in owner:
                    hint = "write another instance of it under `machines`"
                    message = f"`{name}` has two owners, `{owner[name]}` and `{machine.name}`"
                    if owner[name] == machine.name:
                        message = f"two states of `{machine.name}` run `{name}`"
                    report.error("E159", message, place, hint)
                else:
                    owner[name] = machine.name
    for machine in machines:
        for node in nodes(machine.states):
            if isinstance(node, Query) and node.kind == "done" and node.machine not in owner:
                hint = f"let a state run it: `runs: [{node.machine}]`"
                report.error("E159", f"no state runs `{node.machine}`, so it is never done", node.span, hint)
            elif isinstance(node, Command) and node.machine in owner and "load" in node.kind:
                above = owner[node.machine]
                message = f"`{node.machine}` runs inside a state of `{above}`, so only `{above}` starts and stops it"
                report.error("E159", message, node.span, "suspend or restart it")
    for name, above in owner.items():
        chain = [name]
        while above in owner and above not in chain:
            chain.append(above)
            above = owner[above]
        if above == name:
            report.error("E159", f"`{name}` would be inside itself", places[owner[name], name], "remove it from `runs`")
            return tuple(machines)
    return tuple(replace(m, nested=True, suspended=True) if m.name in owner else m for m in machines)
