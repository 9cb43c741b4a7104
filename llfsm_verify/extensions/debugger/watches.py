"""Formulas of a debugger: whether one is true after a step, or how a monitor that begins somewhere has decided it."""

from __future__ import annotations

from dataclasses import replace

from llfsm_verify import Disagreement
from llfsm_verify.plug import (
    VERDICT_WORDS,
    Arrangement,
    Choice,
    DebugError,
    Execution,
    Letter,
    MonitorVerdict,
    Move,
    PathStart,
    Property,
    PropertySet,
    Source,
    bind,
    evaluate_formula,
    is_boolean,
    monitors_of,
    parse_properties,
    tokenise,
)  # fmt: skip

NAME = "the formula"


class FormulaWatch:
    """One formula, along the steps of a debugger.

    A state formula is looked at after every ringlet, whatever `observe` says. One with temporal operators is read by a
    monitor, which begins at position `begin` and reads the letters of the observed word. The formula has a step program
    of its own, on which the steps of the debugger are performed once more.
    """

    def __init__(self, arrangement: Arrangement, text: str, start: PathStart, begin: int) -> None:
        self.text = " ".join(text.split())
        line = _one(parse_properties([Source(NAME, text)]), self.text)
        self.is_state = line.formula is not None and is_boolean(line.formula)
        if self.is_state and any(token.type == "INITIALLY" for token in tokenise(text)):
            raise DebugError("a state formula is looked at after every step: leave out `initially`")
        if self.is_state:
            arrangement = replace(arrangement, observe="ringlet")
        problem = bind(arrangement, PropertySet((line,)))
        self._formula = line.formula
        self._monitor = None
        if not self.is_state:
            monitors, reasons = monitors_of(problem)
            self._monitor = monitors.get(line.name)
            if self._monitor is None:
                raise DebugError(f"`{self.text}` has no monitor: {reasons[line.name]}")
            if self._monitor.hopeless[0]:
                raise DebugError(f"`{self.text}` is never decided by a finite part of a run, so nothing stops there")
        self._execution = Execution(problem.program(keep_all_bits=True))
        self._by_cycle = arrangement.observe == "cycle" and not self.is_state
        self._cycle = self._execution.layout.reader(self._execution.program.cycle)
        self.begin = begin
        self._records = [start.record(self._execution)]
        # A monitor reads on where an earlier run stood: the letter that was made there is not known any more.
        try:
            letter = start.letter(self._execution) if self.is_state or start.stood is None else None
        except OverflowError as overflow:
            raise DebugError(f"{overflow} where the run begins") from None
        self._letters: list[Letter | None] = [letter]
        """None: no letter follows that step, or it reads an input whose value there is not known."""
        self._states: list[int] = []
        self.unknown: set[str] = set()
        """Inputs that it reads and that the path does not give."""

    # ------------------------------------------------ the steps

    @property
    def length(self) -> int:
        """How many steps it has seen."""
        return len(self._records) - 1

    def follow(self, move: Move) -> None:
        """One more step, which the debugger has taken."""
        program, before = self._execution.program, self._records[-1]
        choices = {c.name: v for c in program.choices if (v := _given(c, move)) is not None}
        result = self._execution.step(before, Move(move.process, choices))
        if result.status > 0:
            raise Disagreement(f"`{self.text}`: a step faults on the program of the formula, and not on the other")
        if result.status < 0:
            raise DebugError(f"`{self.text}`: a value leaves 64 bits here")
        missing = {program.choices[i].source for i, _ in result.samples if program.choices[i].name not in choices}
        self.unknown |= missing
        observed = move.process is None or not self._by_cycle or self._cycle(result.record)
        self._records.append(result.record)
        self._letters.append(self._read(result.record) if observed and not missing else None)
        if missing and self._monitor is not None and observed:
            raise DebugError(
                f"`{self.text}` reads {', '.join(f'`{m}`' for m in sorted(missing))}, which the path does not give"
            )

    def _read(self, record: bytes) -> Letter:
        values = self._execution.layout.decode_outputs(record)
        return frozenset(atom.name for atom in self._execution.program.atoms if values[atom.output])

    def cut(self, length: int) -> None:
        """Forget all steps but so many first ones."""
        del self._records[length + 1 :]
        del self._letters[length + 1 :]
        del self._states[max(0, length + 1 - self.begin) :]

    # ------------------------------------------------ what it says

    def value(self, position: int) -> bool | None:
        """Of a state formula: whether it is true at a position; None: it cannot be told."""
        assert self._formula is not None
        letter = self._letters[position]
        return None if letter is None else evaluate_formula(self._formula, (), [letter])

    def verdict(self, position: int) -> MonitorVerdict:
        """Of the monitor: what it says at a position, from where it began."""
        assert self._monitor is not None
        if position < self.begin:
            return MonitorVerdict.NOT_YET
        while len(self._states) <= position - self.begin:
            at = self.begin + len(self._states)
            state = self._states[-1] if self._states else 0
            letter = self._letters[at]
            self._states.append(state if letter is None else self._monitor.step(state, self._monitor.letter(letter)))
        return self._monitor.verdicts[self._states[position - self.begin]]

    def breaks(self, position: int) -> str | None:
        """Why a break point stops at a position: a state formula becomes true there, or a monitor has decided."""
        reason = self.stops(position)
        return None if reason and self.is_state and position and self.value(position - 1) else reason

    def stops(self, position: int) -> str | None:
        """Why one stops at a position that one looks for; None: one does not."""
        if self.is_state:
            return f"`{self.text}` is true" if self.value(position) else None
        verdict = self.verdict(position)
        decided = verdict in (MonitorVerdict.TRUE, MonitorVerdict.FALSE)
        if not decided or (position > self.begin and self.verdict(position - 1) is verdict):
            return None
        return f"`{self.text}` is {VERDICT_WORDS[verdict]}, read from step {self.begin:,} on"


def _one(lines: PropertySet, text: str) -> Property:
    if len(lines) != 1 or lines.assumptions:
        raise DebugError(f"`{text[:60]}` is not one property; write a formula such as `m@STATE && x > 3`")
    line = lines.properties[0]
    if line.file is not None:
        raise DebugError("an automaton from a file cannot be a break point; write a formula")
    return line


def _given(choice: Choice, move: Move) -> int | None:
    if choice.name in move.choices:
        return move.choices[choice.name]
    return move.choices.get(choice.input) if choice.input else None
