"""What a guard is wanted to do, and the names of what it needs for that."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import count

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.guards.codes import UNFIT, UNKNOWN_NAME
from llfsm_verify.extensions.guards.reactions import KINDS, Reaction, Rights, rights, unfit, unknown
from llfsm_verify.plug import (
    Arrangement,
    ArrayType,
    Edits,
    Fragment,
    PathNode,
    RecordType,
    Source,
    did_you_mean,
    expressions_in,
    parse_guard,
)

_WORD = re.compile(r"[A-Za-z_]\w*", re.ASCII)


@dataclass(frozen=True, slots=True)
class Wanted:
    """`fallbacks`: the outputs that are routed, each with the expression that takes the place of what was requested, in
    which their names mean what was requested. `guarded`: machines; none: all that write one of these outputs."""

    fallbacks: Mapping[str, Fragment]
    guarded: tuple[str, ...] = ()
    until: Fragment | None = None
    """A guard, such as `after(2)`: when it holds, requests count again, and the monitors begin again. None: never."""
    reactions: tuple[Reaction, ...] = ()
    """What the switch does to other machines when the alarm is set, and takes back when requests count again."""


@dataclass(frozen=True, slots=True)
class Names:
    """What a guarded arrangement is made of, by name."""

    requests: Mapping[str, str]
    """The slot of each output that is routed."""
    alarm: str
    monitors: tuple[str, ...]
    switch: str
    level: str
    """The highest one in `access`."""
    guarded: tuple[str, ...]
    memory: Mapping[str, str]
    """For machines that the switch commands: its variable that keeps whether that changed anything."""
    rights: Rights


class Fresh:
    """Names that no word of some texts is, and that were not given before."""

    def __init__(self, texts: Iterable[str]) -> None:
        self._taken = {word for text in texts for word in _WORD.findall(text)}

    def __call__(self, word: str) -> str:
        """The word, or the word with a number."""
        name, number = word, 2
        while name in self._taken:
            name, number = f"{word}_{number}", number + 1
        self._taken.add(name)
        return name


def names(arrangement: Arrangement, texts: Iterable[str], wanted: Wanted, monitors: int) -> Names:
    """The names of a guard, which no word of `texts` is. DiagnosticError: something is not in the arrangement (E439),
    or cannot be guarded (E438)."""
    refuse_unknown(arrangement, wanted)
    guarded = wanted.guarded or tuple(_writers(arrangement, wanted.fallbacks))
    problems = list(_unfit(arrangement, wanted, guarded))
    if problems:
        raise DiagnosticError(problems)
    fresh = Fresh(texts)
    return Names(
        {name: fresh(f"{name}_requested") for name in wanted.fallbacks},
        fresh("alarm"),
        tuple(fresh("monitor") for _ in range(monitors)),
        fresh("switch"),
        level_above(arrangement),
        guarded,
        {r.machine: fresh(f"{r.machine}_{KINDS[r.kind]}") for r in wanted.reactions if r.kind != "restart"},
        rights(arrangement, wanted.reactions, guarded, wanted.fallbacks, set(_read(wanted))),
    )


def _read(wanted: Wanted) -> Iterator[str]:
    """The names in fallbacks. DiagnosticError: an expression is not valid."""
    for expression in wanted.fallbacks.values():
        yield from (n.name.text for n in expressions_in(parse_guard(expression).root) if isinstance(n, PathNode))


def level_above(arrangement: Arrangement) -> str:
    """A name for a level above all others."""
    levels = () if arrangement.access is None else arrangement.access.levels
    return next(name for i in count(1) if (name := f"guard_{i}" if i > 1 else "guard") not in levels)


def _writers(arrangement: Arrangement, outputs: Mapping[str, object]) -> Iterator[str]:
    for machine in arrangement.machines:
        if any(name in outputs for name, _ in machine.writes()):
            yield machine.name


def refuse_unknown(arrangement: Arrangement, wanted: Wanted) -> None:
    """DiagnosticError (E439): what is to be routed or guarded is not in the arrangement."""
    problems = list(_unknown(arrangement, wanted))
    if problems:
        raise DiagnosticError(problems)


def _unknown(arrangement: Arrangement, wanted: Wanted) -> Iterator[Diagnostic]:
    outputs = [w.variable.name for w in arrangement.whiteboard if w.role == "output"]
    for name in wanted.fallbacks:
        if name not in outputs:
            hint = did_you_mean(name, outputs) or f"the outputs are {', '.join(f'`{o}`' for o in outputs) or 'none'}"
            yield Diagnostic(UNKNOWN_NAME, f"there is no output `{name[:60]}` to route", hint=hint)
    known = [m.name for m in arrangement.machines]
    for name in wanted.guarded:
        if name not in known:
            hint = did_you_mean(name, known) or f"the machines are {', '.join(f'`{m}`' for m in known)}"
            yield Diagnostic(UNKNOWN_NAME, f"there is no machine `{name[:60]}` to guard", hint=hint)
    yield from unknown(arrangement, wanted.reactions)


def _unfit(arrangement: Arrangement, wanted: Wanted, guarded: tuple[str, ...]) -> Iterator[Diagnostic]:
    if len(arrangement.processes) > 1:
        message = "between the turns of monitor and switch a machine of another process could change what was judged"
        hint = "a guard needs a single process: write `schedule`"
        yield Diagnostic(UNFIT, message, arrangement.processes[1].span, hint=hint)
    for operator in arrangement.policy_users:
        message = f"`{operator.target}` may change the policy, and then the guard would be as strong as that"
        yield Diagnostic(UNFIT, message, operator.span, hint="leave `policy` out of `operators`")
    for entry in arrangement.whiteboard:
        variable = entry.variable
        if variable.name in wanted.fallbacks and isinstance(variable.type, ArrayType | RecordType):
            message = f"`{variable.name}` has several parts, and a switch routes single values"
            yield Diagnostic(UNFIT, message, variable.span, hint="make an output of each part")
    yield from unfit(arrangement, wanted.reactions, guarded)
    if not guarded:
        outputs = " or ".join(f"`{name}`" for name in wanted.fallbacks)
        message = f"no machine writes {outputs}" if outputs else "no output is routed, so nothing says what is guarded"
        yield Diagnostic(UNFIT, message, hint="name what is guarded with --guard")
    for machine in arrangement.machines:
        routed = any(name in wanted.fallbacks for name, _ in machine.writes())
        if not machine.loaded and (routed or machine.name in guarded):
            message = f"`{machine.name}` is of the pool, so its turn is after those of the monitor and the switch"
            hint = "put it in the schedule, and unload it in a machine of the schedule"
            yield Diagnostic(UNFIT, message, machine.span, hint=hint)


def as_requested(expression: Fragment, requests: Mapping[str, str]) -> str:
    """An expression in which the names of outputs mean what was requested. DiagnosticError: it is not a valid one."""
    source = Source(expression.source.name, expression.text)
    parsed = parse_guard(expression)
    edits = Edits(source)
    for node in expressions_in(parsed.root):
        if isinstance(node, PathNode) and node.name.text in requests:
            edits.replace(node.name.start, node.name.end, requests[node.name.text])
    return edits.result()
