"""Which guards a step evaluated, what their parts were, and which transition fired: from the events of the step."""

from __future__ import annotations

from dataclasses import dataclass

from llfsm_verify import Disagreement
from llfsm_verify.plug import (
    GUARD_PART,
    Arrangement,
    GuardPart,
    GuardParts,
    Interpreter,
    Move,
    StepOutcome,
    Value,
    lower,
    value_text,
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class PartValue:
    """A part of a guard, and the text of what it was when the guard was evaluated."""

    text: str
    value: str


@dataclass(frozen=True, slots=True)
class Evaluated:
    """A guard that a step evaluated, in the order of evaluation. `value` None: the step failed in the middle of it.

    Parts that were not needed (after `&&` and `||`) are not in `parts`; constants are not, either.
    """

    machine: str
    state: str
    number: int
    """Of the transition in its state, from 1."""
    target: str
    guard: str
    value: bool | None
    parts: tuple[PartValue, ...]


class Guards:
    """Performs single steps with the reference interpreter, on a program that tells the parts of guards."""

    def __init__(self, arrangement: Arrangement) -> None:
        self._parts = GuardParts()
        self._unit = "cycles" if arrangement.timing == "timed" else "bounds"
        self.program = lower(arrangement, keep_all_bits=True, parts=self._parts)
        self._interpreter = Interpreter(self.program)

    def of(
        self, values: dict[str, Value], outputs: dict[str, Value], move: Move, after: dict[str, Value] | None
    ) -> tuple[Evaluated, ...]:
        """The guards of a step from a configuration; `after` is where the executor came to (None: it failed there).

        Disagreement: the interpreter comes to another configuration.
        """
        outcome = self._interpreter.step(values, outputs, move.process, lambda c: move.choices.get(c.name, c.type.low))
        failed = outcome.fault is not None or outcome.overflow
        if failed != (after is None) or (after is not None and outcome.values != after):
            raise Disagreement("the reference interpreter takes another step than the executor")
        return tuple(self._told(outcome))

    def _told(self, outcome: StepOutcome) -> list[Evaluated]:
        found: list[Evaluated] = []
        parts: list[PartValue] = []
        for kind, index, arguments in outcome.events:
            if kind == GUARD_PART:
                parts.append(self._part(self._parts.found[arguments[0]], arguments[1]))
            elif kind == "guard":
                state, number, value = arguments
                info = self.program.machines[index]
                transition = info.transitions[state][number]
                target = info.states[transition.target]
                seen = tuple(dict.fromkeys(p for p in parts if p.text != transition.text))
                found.append(
                    Evaluated(info.name, info.states[state], number + 1, target, transition.text, bool(value), seen)
                )
                parts = []
        if parts:
            found.append(Evaluated("", "", 0, "", "", None, tuple(dict.fromkeys(parts))))
        return found

    def _part(self, part: GuardPart, value: int) -> PartValue:
        if part.clock:
            return PartValue(part.text, f"{value} {self._unit}")
        return PartValue(part.text, value_text(part.type, part.labels, value))
