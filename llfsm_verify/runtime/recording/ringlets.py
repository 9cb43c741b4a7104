"""The ringlets of a recording one by one, as moves that an executor performs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Program
from llfsm_verify.runtime.live.frame import ENDING, ENDINGS, NUMBER, PROCESS, STEPS
from llfsm_verify.runtime.live.loop import LiveCode
from llfsm_verify.runtime.recording.file import Turn
from llfsm_verify.runtime.recording.replay import FAILED, chosen


class Ringlet(NamedTuple):
    """A ringlet, or the stutter after the end (its move has no process), and the frame that it belongs to. `fails`: it
    ended in a fault, so that it may read choices that the move does not give."""

    move: Move
    frame: int
    fails: bool = False


def ringlets(turns: Iterable[Turn], code: LiveCode, program: Program | None = None, done: int = 0) -> Iterator[Ringlet]:
    """The ringlets of the turns after the first frame, `done` ringlets having been taken before.

    `program` is the one that performs them, where it is another one of the same arrangement than the run's.
    """
    choices = _Choices(code, code.program if program is None else program)
    for turn in turns:
        frame = turn.frame
        number, process, ending = frame[NUMBER], frame[PROCESS], frame[ENDING]
        if ENDINGS[ending] == "ended":
            yield Ringlet(Move(None, choices.of(turn, 0)), number)
            return
        count = frame[STEPS] - done
        for ringlet in range(count):
            yield Ringlet(Move(process, choices.of(turn, ringlet)), number)
        done = frame[STEPS]
        if ending in FAILED:
            yield Ringlet(Move(process, choices.of(turn, count)), number, fails=True)
        if ending:
            return


class _Choices:
    """What was chosen in a turn, by the names that a program has for it."""

    def __init__(self, code: LiveCode, program: Program) -> None:
        self._recorded = code.program.choices
        self._at = code.frames.choices
        self._sources = _sources(program, code.program)

    def of(self, turn: Turn, ringlet: int) -> dict[str, int]:
        """As the loop had them in this ringlet: what is prescribed holds from its ringlet on."""
        values = list(turn.frame[self._at : self._at + len(self._recorded)])
        for prescribed in turn.prescribed:
            if prescribed.ringlet <= ringlet:
                values[prescribed.choice] = prescribed.value
        return {name: chosen(self._recorded[source], values[source]) for name, source in self._sources.items()}


def _sources(program: Program, recorded: Program) -> dict[str, int]:
    """For each choice of the program the recorded one that has its value."""
    names = {choice.name: i for i, choice in enumerate(recorded.choices)}
    inputs = {choice.input: i for i, choice in reversed(list(enumerate(recorded.choices))) if choice.input}
    found: dict[str, int] = {}
    for choice in program.choices:
        source = names.get(choice.name, inputs.get(choice.input))
        assert source is not None, "a program has a choice for each of its inputs"
        found[choice.name] = source
    return found
