"""What can be covered of an arrangement: states, transitions, branches and conditions, each with where it stands."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, get_args

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.diagnostics import Span
from llfsm_verify.language.typed import Literal as Constant
from llfsm_verify.semantics.parts import written
from llfsm_verify.semantics.probes import Condition, Outcome, Probe, deciding
from llfsm_verify.transforms.probing import Probed

Kind = Literal["state", "transition", "branch", "condition"]
KINDS: tuple[Kind, ...] = get_args(Kind)


@dataclass(frozen=True, slots=True)
class Goal:
    """Something to cover in one machine instance.

    `state`: a turn in which it is entered or stayed in. `transition`: it is taken. `branch`: a guard, or the condition
    of an `if` or a `?:`, comes out as `outcome` where it is evaluated. `condition`: an independence pair of masking
    MC/DC of a condition in a decision with several (`semantics.decisions`).
    """

    kind: Kind
    machine: str
    text: str
    span: Span
    state: int = -1
    """Of states and transitions, and of guards and their conditions: the number of the state."""
    number: int = -1
    """Of transitions, guards and their conditions: the number in the state."""
    outcome: bool | None = None
    decision: str = ""
    """Of a condition: the decision that it is in."""
    ways: tuple[frozenset[Outcome], ...] = ()
    """It is covered where all outcomes of one of these have come out; none: what covers it cannot be told."""

    def met_by(self, seen: frozenset[Outcome] | set[Outcome]) -> bool:
        """Whether these outcomes cover it."""
        return any(way <= seen for way in self.ways)


def modelled(arrangement: Arrangement) -> frozenset[str]:
    """The machines that are models of something else: what they do is not to be covered."""
    return frozenset(machine.name for machine in arrangement.machines if machine.model)


def goals_of(arrangement: Arrangement, probed: Probed) -> tuple[Goal, ...]:
    """All goals, by kind, and then by machine and place."""
    found = [*_states(arrangement), *_decisions(arrangement, probed)]
    return tuple(sorted(found, key=lambda goal: KINDS.index(goal.kind)))


def _states(arrangement: Arrangement) -> Iterator[Goal]:
    left_out = modelled(arrangement)
    for machine in (m for m in arrangement.machines if m.name not in left_out):
        for index, state in enumerate(machine.states):
            spent = Outcome(Probe("spent", machine.name, state.span, index), 1)
            yield Goal("state", machine.name, state.name, state.span, index, ways=(frozenset({spent}),))
            for number, transition in enumerate(state.transitions):
                fired = Outcome(Probe("fired", machine.name, transition.span, index, number), 1)
                text = f"{state.name} -> {machine.states[transition.target].name} when {transition.text}"
                yield Goal(
                    "transition", machine.name, text, transition.span, index, number, ways=(frozenset({fired}),)
                )  # fmt: skip


def _decisions(arrangement: Arrangement, probed: Probed) -> Iterator[Goal]:
    order = {machine.name: number for number, machine in enumerate(arrangement.machines)}
    decisions = [
        (p, e) for p, e in probed.expressions.items() if p in probed.conditions and not isinstance(e, Constant)
    ]
    for probe, expression in sorted(decisions, key=lambda d: (order[d[0].machine], d[1].span.start)):
        text, span = written(expression), expression.span
        for value in (True, False):
            way = frozenset({Outcome(probe, int(value))})
            yield Goal("branch", probe.machine, text, span, probe.state, probe.number, value, ways=(way,))
        conditions = probed.conditions[probe]
        if len(conditions) > 1:
            for number, condition in enumerate(conditions):
                yield Goal(
                    "condition", probe.machine, condition.text, condition.span, probe.state, probe.number,
                    decision=text, ways=tuple(_pairs(probe, number, condition)),
                )  # fmt: skip


def _pairs(probe: Probe, number: int, condition: Condition) -> Iterator[frozenset[Outcome]]:
    for situation in range(condition.situations):
        place = deciding(probe, number, situation)
        yield frozenset({Outcome(place, 0), Outcome(place, 1)})
