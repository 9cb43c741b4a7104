"""What a switch does to other machines while the alarm is set: commands, and the rights that they need."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from llfsm_verify import Diagnostic
from llfsm_verify.extensions.guards.codes import UNFIT, UNKNOWN_NAME
from llfsm_verify.plug import Arrangement, Machine, Source, Span, did_you_mean

KINDS: Final[Mapping[str, str]] = {
    "suspend": "suspended",
    "resume": "resumed",
    "restart": "restarted",
    "load": "loaded",
    "unload": "unloaded",
}
"""The commands, each with its participle."""
STOPPING: Final = ("suspend", "restart", "unload")
STARTING: Final = ("resume", "restart", "load")
POOL: Final = ("load", "unload")
_OWN_NAME = re.compile(r"(monitor|switch)(_\d+)?", re.ASCII)


@dataclass(frozen=True, slots=True)
class Reaction:
    """A command to a machine of the arrangement; `span` is the place of the machine's name."""

    kind: str
    machine: str
    span: Span


def reaction(text: str) -> Reaction:
    """What `suspend M` says. ValueError: it is not a command and a name."""
    kind, *names = text.split() or [""]
    if kind not in KINDS or len(names) != 1:
        raise ValueError(text)
    return Reaction(kind, names[0], Span(Source("--react", text), text.rindex(names[0]), len(text.rstrip())))


@dataclass(frozen=True, slots=True)
class Rights:
    """What gets the level of the guard, beside the monitors, the switch, the alarm and the outputs."""

    commanded: tuple[str, ...] = ()
    """Machines that only the guard may command, and they themselves."""
    substitutes: tuple[str, ...] = ()
    """Machines that a reaction starts, and that write what a fallback reads."""
    variables: tuple[str, ...] = ()
    """What the substitutes write."""


def begin(reactions: Sequence[Reaction], memory: Mapping[str, str], chaos: Collection[str] = ()) -> Iterator[str]:
    """The commands of the switch when the alarm is set. `memory` names, for a machine, the variable that keeps whether
    the command changes anything; of the machines `chaos` that is chosen."""
    changes = {
        "suspend": "is_running({0})",
        "resume": "is_suspended({0})",
        "load": "!is_running({0}) && !is_suspended({0})",
        "unload": "is_running({0}) || is_suspended({0})",
    }
    for each in reactions:
        if each.machine in memory:
            known = changes[each.kind].format(each.machine)
            yield f"{memory[each.machine]} = {'choose(bool)' if each.machine in chaos else known};"
        yield f"{each.kind}({each.machine});"


def end(reactions: Sequence[Reaction], memory: Mapping[str, str]) -> Iterator[str]:
    """The commands that take back what `begin` has changed, the last one first."""
    back = {"suspend": "resume", "resume": "suspend", "load": "unload", "unload": "load"}
    for each in reversed(reactions):
        if each.machine in memory:
            yield f"if ({memory[each.machine]}) {back[each.kind]}({each.machine});"


def unknown(arrangement: Arrangement, reactions: Sequence[Reaction]) -> Iterator[Diagnostic]:
    """The reactions to what is not a machine of the arrangement (E439), or is the guard itself (E438)."""
    known = [machine.name for machine in arrangement.machines]
    for each in reactions:
        name = each.machine[:60]
        if each.machine in known:
            continue
        if each.machine in arrangement.surroundings:
            message = f"`{name}` is the model of the surroundings, and takes no commands"
            yield Diagnostic(UNFIT, message, each.span, hint=_among(known))
        elif _OWN_NAME.fullmatch(each.machine):
            message = f"`{name}` is not a machine of the arrangement, and a guard does not {each.kind} its own parts"
            yield Diagnostic(UNFIT, message, each.span, hint=_among(known))
        else:
            hint = did_you_mean(each.machine, known) or _among(known)
            yield Diagnostic(UNKNOWN_NAME, f"there is no machine `{name}` to {each.kind}", each.span, hint=hint)


def _among(known: Sequence[str]) -> str:
    return f"the machines are {', '.join(f'`{name}`' for name in known)}"


def unfit(arrangement: Arrangement, reactions: Sequence[Reaction], guarded: Collection[str]) -> Iterator[Diagnostic]:
    """The reactions to machines of the arrangement that cannot be performed, or must not (E438)."""
    seen: dict[str, Reaction] = {}
    for each in reactions:
        first = seen.setdefault(each.machine, each)
        if first is not each:
            message = f"`{each.machine}` has two reactions, {first.kind} and {each.kind}"
            hint = "give one; with --for or --until the switch takes it back itself"
            yield Diagnostic(UNFIT, message, each.span, hint=hint)
        if each.kind in POOL and arrangement.machine(each.machine).nested:
            message = (
                f"`{each.machine}` is inside a state of another machine, and is loaded and unloaded with that state"
            )
            yield Diagnostic(UNFIT, message, each.span, hint="suspend or restart it")
        if each.kind in STOPPING and each.machine not in guarded and _is_highest(arrangement, each.machine):
            message = f"`{each.machine}` has the highest clearance and is not guarded, so no guard stops it"
            hint = f"{each.kind} a machine of a lower clearance, or also name `{each.machine}` with --guard"
            yield Diagnostic(UNFIT, message, each.span, hint=hint)


def _is_highest(arrangement: Arrangement, machine: str) -> bool:
    """Whether a policy trusts no machine more, such as the monitor of another guard."""
    access = arrangement.access
    return access is not None and 0 < access.clearance(machine) == len(access.levels) - 1


def rights(
    arrangement: Arrangement,
    reactions: Sequence[Reaction],
    guarded: Collection[str],
    routed: Collection[str],
    read: Collection[str],
) -> Rights:
    """The rights that the reactions need; `read` are the names in fallbacks of the outputs `routed`.

    A class is raised only where no one then does what he may not: who commands or writes otherwise goes on doing so.
    """
    commanded = tuple(r.machine for r in reactions if not _others_command(arrangement, r.machine))
    started = [r.machine for r in reactions if r.kind in STARTING and r.machine in commanded]
    substitutes = [
        machine
        for machine in map(arrangement.machine, started)
        if machine.name not in guarded and _is_substitute(arrangement, machine, routed, read)
    ]
    variables = dict.fromkeys(name for machine in substitutes for name, _ in machine.writes())
    return Rights(commanded, tuple(machine.name for machine in substitutes), tuple(variables))


def _others_command(arrangement: Arrangement, target: str) -> bool:
    """Whether a machine or an operator gives it commands that need a right."""
    operators = (*arrangement.operators, *arrangement.replaceable)
    return any(o.kind != "write" and o.target == target for o in operators) or any(
        command.machine == target and (machine.name != target or command.kind not in ("suspend", "resume", "restart"))
        for machine in arrangement.machines
        for command in machine.commands()
    )


def _is_substitute(arrangement: Arrangement, machine: Machine, routed: Collection[str], read: Collection[str]) -> bool:
    """Whether it writes what a fallback reads, no other writes its variables, and no policy has a level for it."""
    written = {name for name, _ in machine.writes()}
    if not written & set(read) or (arrangement.access is not None and arrangement.access.clearance(machine.name)):
        return False
    others = {name for other in arrangement.machines if other is not machine for name, _ in other.writes()}
    return not written & (set(routed) | others | {o.target for o in arrangement.operators if o.kind == "write"})
