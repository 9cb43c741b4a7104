"""When two runs differ in their paths: the order in which transitions fire for the first time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from llfsm_verify.checking.trace import Trace
from llfsm_verify.language.expressions import BOOL
from llfsm_verify.language.typed import Observe
from llfsm_verify.logic.bounds import HIDDEN
from llfsm_verify.program.program import Program
from llfsm_verify.semantics.letters import Observed

Transition = tuple[str, str]
"""A machine, and a transition as traces write it: ``RED -> GREEN when car``."""
Signature = tuple[Transition, ...]

PREFIX = HIDDEN + "fired:"
"""The keys of the atoms that tell which transition fired start so."""


@dataclass(frozen=True, slots=True)
class Firing:
    """The atom `key` holds in a letter when this transition fired in the step, or cycle, before it."""

    key: str
    machine: str
    state: int
    number: int
    transition: Transition


def firings(program: Program) -> list[Firing]:
    """Every transition of a program, in the order of turns."""
    found: list[Firing] = []
    for slot in program.slots:
        info = program.machines[slot.machine]
        for state, row in enumerate(info.transitions):
            for number in range(len(row)):
                key = f"{PREFIX}{info.name}.{state}.{number}"
                transition = info.name, info.transition_text(state, number)
                found.append(Firing(key, info.name, state, number, transition))
    return found


def observe(firing: Firing, program: Program) -> Observed | None:
    """The state formula of a firing; None: there is no text of the transition, since it is none of the user's."""
    info = next(m for m in program.machines if m.name == firing.machine)
    span = info.transitions[firing.state][firing.number].span
    if span is None:
        return None
    return Observed(firing.key, Observe("fired", firing.machine, firing.state, firing.number, BOOL, span))


def signature_of(trace: Trace, machines: Iterable[str]) -> Signature:
    """The transitions of these machines that fire in a trace until the property has failed, each where it is first."""
    kept = set(machines)
    steps = trace.steps if trace.failed_at is None else trace.steps[: trace.failed_at]
    fired = ((s.machine, s.fired) for s in steps if s.machine in kept)
    return tuple(dict.fromkeys((m, text) for m, text in fired if m is not None and text is not None))


class Tree:
    """The signatures found so far, as a tree; a run goes through it until it differs from all of them.

    Letters are masks over the firings given. States are numbers: ROOT at the start, AWAY from then on.
    """

    ROOT, AWAY = 0, 1

    def __init__(self, transitions: Sequence[Transition], found: Iterable[Signature]) -> None:
        numbers: dict[Transition, int] = {}
        self._of_bit = [numbers.setdefault(t, len(numbers)) for t in transitions]
        self._children: list[dict[int, int]] = [{}, {}]
        self._fired: list[frozenset[int]] = [frozenset(), frozenset()]
        self.ends: set[int] = set()
        """The states in which a run that ends has a signature that was found."""
        for signature in found:
            state = self.ROOT
            for transition in signature:
                state = self._child(state, numbers[transition])
            self.ends.add(state)

    def _child(self, state: int, number: int) -> int:
        children = self._children[state]
        if number not in children:
            children[number] = len(self._children)
            self._children.append({})
            self._fired.append(self._fired[state] | {number})
        return children[number]

    def after(self, state: int, fired: int) -> int:
        """The state after a letter."""
        for bit, number in enumerate(self._of_bit):
            if state == self.AWAY:
                break
            if fired >> bit & 1 and number not in self._fired[state]:
                state = self._children[state].get(number, self.AWAY)
        return state

    def is_new(self, state: int) -> bool:
        """Whether a run that ends in this state has another signature than those found."""
        return state not in self.ends
