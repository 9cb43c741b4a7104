"""A recording performed again: each turn with the choices of its frame, and every word compared; and its ringlets one
by one, as moves that an executor performs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from types import MappingProxyType
from typing import NamedTuple

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Choice, Program
from llfsm_verify.runtime.live.frame import (
    COMMITTED,
    CYCLE,
    DETAIL,
    ENDING,
    ENDINGS,
    HEADER_WORDS,
    LATENESS,
    MOVED,
    NUMBER,
    PROCESS,
    STEPS,
)  # fmt: skip
from llfsm_verify.runtime.live.loop import LiveCode, Loop, Prescribed
from llfsm_verify.runtime.live.text import largest_script
from llfsm_verify.runtime.recording import OTHER
from llfsm_verify.runtime.recording.file import Recording, Turn
from llfsm_verify.runtime.recording.origin import free_of
from llfsm_verify.values import Value

CLOCKED = frozenset({COMMITTED, LATENESS, MOVED})
"""The words of a frame that say when it was: they are taken as they are."""
FAILED = frozenset({ENDINGS.index("fault"), ENDINGS.index("overflow")})


class Differs(Exception):
    """Performing a recording again gives another frame, or none."""

    def __init__(self, number: int, what: str) -> None:
        self.number = number
        super().__init__(f"frame {number}: {what}")


@contextmanager
def compared(recording: Recording) -> Iterator[None]:
    """Where turns of a recording are performed. DiagnosticError (E482) in place of Differs."""
    try:
        yield
    except Differs as differs:
        message = f"this is not a recording of this arrangement: {differs}"
        hint = "without --arrangement the texts in it are taken; if it differs from these as well, frames were changed"
        raise DiagnosticError([Diagnostic(OTHER, message, file=str(recording.path), hint=hint)]) from None


def performed(recording: Recording, code: LiveCode) -> Iterator[Turn]:
    """The turns of a recording, each after it was performed with the code that it was made with and found to be the
    same. Raises Differs; DiagnosticError (E481): it does not say how it began."""
    return replay(code, recording, free_of(recording, code.program), goes_on=recording.goes_on)


def replay(
    code: LiveCode, turns: Iterable[Turn], free: Mapping[str, Value] = MappingProxyType({}), *, goes_on: bool = False
) -> Iterator[Turn]:
    """The turns, each after it was performed and its frame found to be the same, bit for bit. Raises Differs.

    With `goes_on`, the first frame says where an earlier run stood, and is taken as it is.
    """
    loop = Loop(code, free=free)
    frames, count = code.frames, len(code.program.choices)
    last, cycle, ended = -1, 0, False
    for turn in turns:
        frame = turn.frame
        if len(frame) != frames.words:
            raise Differs(
                loop.number + 1, f"it has {len(frame)} words, and those of this arrangement have {frames.words}"
            )
        if not 0 <= frame[ENDING] < len(ENDINGS):
            raise Differs(loop.number + 1, "there is no such way to end")
        if goes_on:
            goes_on, last, cycle = False, frame[PROCESS], frame[CYCLE]
            _begin(loop, frame)
            yield turn
            continue
        number, process = loop.number + 1, frame[PROCESS]
        if ended:
            raise Differs(number, "it comes after the last one")
        ended = frame[ENDING] != 0
        values = frame[frames.choices : frames.choices + count]
        _check(code, number, enumerate(values))
        if number == 1:
            loop.show(values)
        if ended and frame[ENDING] not in FAILED:
            loop.end(ENDINGS[frame[ENDING]], frame[DETAIL])
        elif number == 1:
            loop.commit()
        else:
            if not 0 <= process < len(code.program.processes):
                raise Differs(number, f"there is no process {process}")
            cycle += 0 <= last >= process
            last = process
            loop.frame[PROCESS], loop.frame[CYCLE] = process, cycle
            _check(code, number, ((p.choice, p.value) for p in turn.prescribed))
            if any(p.ringlet < 1 for p in turn.prescribed) or len(turn.prescribed) > largest_script(code.program):
                raise Differs(number, "it prescribes choices at no ringlet of the turn")
            script = [Prescribed(loop.steps + p.ringlet, p.choice, p.value) for p in turn.prescribed]
            status = loop.perform(process, values, script)
            if (status != 0) != ended:
                raise Differs(number, "a ringlet fails" if status else "no ringlet fails")
            if ended:
                loop.end(ENDINGS[frame[ENDING]], status)
            else:
                loop.commit()
        _compare(loop, frame)
        yield turn


def _begin(loop: Loop, frame: tuple[int, ...]) -> None:
    """Let a loop stand where a frame says."""
    code, frames = loop.code, loop.code.frames
    record = frames.record_of(frame)
    try:
        again = code.layout.encode_record(code.layout.decode_record(record))
    except ValueError:
        again = b""
    states = zip(frame[frames.monitors :], code.tables, strict=True)
    if again != record or any(not 0 <= state < len(table.states) for state, table in states):
        raise Differs(frame[NUMBER], "this arrangement cannot be in it")
    if frame[ENDING] or frame[NUMBER] < 1 or frame[STEPS] < 0 or not -1 <= frame[PROCESS] < len(code.program.processes):
        raise Differs(frame[NUMBER], "no run goes on from it")
    _check(code, frame[NUMBER], enumerate(frame[frames.choices : frames.choices + len(code.program.choices)]))
    loop.resume(frame)


def _check(code: LiveCode, number: int, values: Iterable[tuple[int, int]]) -> None:
    choices = code.program.choices
    for index, word in values:
        if index >= len(choices):
            raise Differs(number, f"there is no choice {index}")
        choice, value = choices[index], chosen(choices[index], word)
        if not choice.type.low <= value <= choice.type.high:
            raise Differs(number, f"{choice.source} = {value} is outside {choice.type.low}..{choice.type.high}")


def chosen(choice: Choice, word: int) -> int:
    """The value of a choice from a word that was read with a sign."""
    return word + (1 << 64) if word < 0 <= choice.type.low else word


def _compare(loop: Loop, frame: tuple[int, ...]) -> None:
    for word, (new, old) in enumerate(zip(loop.frame, frame, strict=True)):
        if new != old and word not in CLOCKED:
            raise Differs(loop.number, f"{_part(loop.code, word)} is {new}, and was {old}")


def _part(code: LiveCode, word: int) -> str:
    """What users call a word of a frame."""
    frames = code.frames
    if word == NUMBER:
        return "its number"
    if word < HEADER_WORDS:
        return f"word {word} of its head"
    for begin, end, what in (
        (frames.record, frames.fired, "the record"),
        (frames.fired, frames.choices, "what fired"),
        (frames.choices, frames.events, "the choices"),
        (frames.events, frames.monitors, "the counters of events"),
        (frames.monitors, frames.words, "the monitors"),
    ):
        if begin <= word < end:
            return f"word {word - begin} of {what}"
    raise AssertionError("a word beyond the frame")


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
