"""Which properties a guard can keep, and why not the others."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.guards.codes import NOT_GUARDABLE, UNFIT
from llfsm_verify.plug import (
    TICK,
    Arrangement,
    AtState,
    Clock,
    Edge,
    Expression,
    Observe,
    Property,
    PropertyScope,
    Query,
    Read,
    Safety,
    Sampled,
    Sampling,
    Span,
    check_atom,
    is_plain,
    is_safety_property,
    monitor_reads,
    of_kind,
    safety,
    syntax_nodes,
    without_steps,
)


@dataclass(frozen=True, slots=True)
class Refusal:
    """Why a guard cannot keep a property, in a clause, and the place of what is in the way."""

    reason: str
    span: Span
    hint: str

    def diagnostic(self, name: str) -> Diagnostic:
        return Diagnostic(NOT_GUARDABLE, f"`{name}` cannot be guarded: {self.reason}", self.span, hint=self.hint)


@dataclass(frozen=True, slots=True)
class Guardable:
    """What is known of one property: the outputs that it speaks of, and why it cannot be guarded, if so."""

    line: Property
    outputs: tuple[str, ...]
    refusal: Refusal | None


def guardable(
    line: Property, arrangement: Arrangement, clock: Clock | None = None, *, own_monitor: bool = False
) -> Guardable:
    """Whether a guard can keep a property of the arrangement.

    `clock` is that of bounds in time. `own_monitor`: the monitor is the user's, so only what the proof cannot speak of
    is refused. DiagnosticError: an atom does not fit the arrangement.
    """
    scope = PropertyScope.of(arrangement)
    atoms = [check_atom(fragment, scope) for fragment in line.atoms.values()]
    roles = {w.variable.name: w.role for w in arrangement.whiteboard}
    read = dict.fromkeys(r.variable.name for atom in atoms for r in of_kind(atom, Read))
    outputs = tuple(name for name in read if roles.get(name) == "output")
    first = (
        _only_initial(line)
        or not_safe(line, clock)
        or next((r for atom in atoms for r in _in_the_way(atom, arrangement, own_monitor)), None)
    )
    if first is None and not outputs and not own_monitor:
        first = Refusal(
            "it speaks of no output, so nothing can be routed for it",
            line.span,
            "a guard replaces outputs: name one, or give the monitor yourself with --monitor",
        )
    if first is None and not own_monitor:
        try:
            monitor_reads(line.atoms, arrangement)
        except DiagnosticError as error:
            found = error.diagnostics[0]
            first = Refusal(found.message, found.span or line.span, found.hint or "use other atoms")
    return Guardable(line, outputs, first)


def unfit_assumptions(lines: Iterable[Property], arrangement: Arrangement) -> Iterator[tuple[Property, Refusal]]:
    """The assumptions that ask what machines do, once for each place: in a proof others stand in their places."""
    scope = PropertyScope.of(arrangement)
    for line in lines:
        for atom in (check_atom(fragment, scope) for fragment in line.atoms.values()):
            for refusal in _in_the_way(atom, arrangement, own_monitor=True):
                reason = f"`{refusal.span.text}` asks what a machine does, and others stand in its place in the proof"
                yield (
                    line,
                    Refusal(reason, refusal.span, "assume something of inputs and of variables of the whiteboard"),
                )


def unfit(line: Property, refusal: Refusal) -> Diagnostic:
    """E438: what is wrong with an assumption."""
    return Diagnostic(UNFIT, f"`{line.name}` cannot be assumed: {refusal.reason}", refusal.span, hint=refusal.hint)


def _only_initial(line: Property) -> Refusal | None:
    if line.doubt is None:
        return None
    return Refusal(line.doubt.message, line.span, line.doubt.hint or "write `G (…)`")


def not_safe(line: Property, clock: Clock | None) -> Refusal | None:
    """Why a property is not one of safety."""
    if line.file is not None:
        hint = "write it as a formula, or as `enforce` or `forbid`"
        return Refusal("its automaton is in a file, which guards do not read", line.span, hint)
    if line.formula is None:
        return None  # `enforce` and `forbid`: what violates them has a prefix that does
    if is_plain(without_steps(line.formula)):
        found = safety(without_steps(line.formula))
    else:  # bounds in time, the past
        found = Safety(is_safety_property(line.formula, [*sorted(line.atoms), TICK], clock), exact=True)
    if found.holds:
        return None
    if not found.exact:
        return Refusal("its automata are too large to tell whether it is a safety property", line.span, "split it")
    reason = "it asks that something happens eventually, so it is not a safety property: no finite run violates it"
    return Refusal(reason, line.span, "bound the waiting, such as `F[<=2s] p`")


def _in_the_way(atom: Expression, arrangement: Arrangement, own_monitor: bool) -> Iterator[Refusal]:
    """What in an atom a guard's monitor cannot read once a cycle, or chaos does not have."""
    surroundings = arrangement.surroundings
    for node in syntax_nodes(atom):
        match node:
            case Edge():
                if own_monitor:
                    continue
                asks, hint = "asks for the letter before", "write it with `X` or `Y` in the formula"
            case Read(variable=variable):
                owner = variable.name.partition(".")[0]
                if variable.scope == "whiteboard" or (own_monitor and owner in surroundings):
                    continue
                asks, hint = f"is a variable of `{owner}`, which no other machine sees", "speak of outputs and inputs"
            case AtState() | Query():
                if own_monitor and node.machine in surroundings:
                    continue
                asks, hint = "asks for the state of a machine, which is not routed", "speak of what it writes"
            case Sampled() | Sampling():
                asks, hint = "asks what machines have sampled", "speak of the input: the monitor samples it itself"
            case Observe():
                if own_monitor and node.machine in surroundings:
                    continue
                asks, hint = "asks for a step, and a monitor sees cycles", "speak of outputs as they are once a cycle"
            case _:
                continue
        yield Refusal(f"`{node.span.text}` {asks}", node.span, hint)
