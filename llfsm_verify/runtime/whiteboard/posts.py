"""What others have posted and commanded: frames for the loop, written where the whiteboard is served, or by those who
were lent memory.

Words: the number of the frame; for each input its value and whether it was posted; of the command to be taken next its
number, its choice, the choice of the value that is written (-1: none) and that value.
"""

from __future__ import annotations

import ctypes
import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from llfsm_verify.jsonvalue import Json
from llfsm_verify.program.program import Choice, Program
from llfsm_verify.runtime.live import control
from llfsm_verify.runtime.live.control import store, words
from llfsm_verify.runtime.live.generations import segment_words
from llfsm_verify.runtime.live.loop import Loop
from llfsm_verify.runtime.live.slots import inputs_of
from llfsm_verify.runtime.whiteboard.segment import Segment, code
from llfsm_verify.semantics.operators import ARGUMENTS, OPERATOR, is_command
from llfsm_verify.values import ValueProblem, number_of

LENT = 15
"""So many segments can be lent in a run."""
ROW_WORDS = 5


class Refused(ValueError):
    """A request that is not granted; the message says why."""


class Writers:
    """Who writes the frames that a loop reads its inputs from: rows that say where the frames, of so many words, and
    their copies are.

    The first writer is the process that serves the whiteboard. The others were `lent` a segment, one of so many, and
    write it without asking. A segment is lent once: who had it can still write it. Made before processes of the run
    are forked, which could not map a segment later.
    """

    def __init__(self, loop: Loop, frame_words: int, lent: int) -> None:
        self._loop = loop
        self._frame_words = frame_words
        self._rows = words((1 + lent) * ROW_WORDS)
        self._scratch = words(frame_words)
        self._zero = words(1)
        self.nothing = ctypes.addressof(self._zero)
        """The address of a word that is 0."""
        self._segments: list[Segment] = []
        try:
            for _ in range(lent):
                self._segments.append(Segment("posts", frame_words, lent=True))
        except OSError:
            self.close()
            raise
        self._copies = [words(frame_words) for _ in range(lent)]
        loop.control[control.WRITERS] = ctypes.addressof(self._rows)

    def add(self, segment: int, copy: ctypes.Array[ctypes.c_int64]) -> None:
        """One more row: the address of a segment, and where its newest frame is copied to."""
        number = self._loop.control[control.WRITER_COUNT]
        row = [segment, ctypes.addressof(copy), self._frame_words, 0, ctypes.addressof(self._scratch)]
        store(row, self._rows, number * ROW_WORDS)
        self._loop.control[control.WRITER_COUNT] = number + 1

    def lend(self, granted: Callable[[], None]) -> tuple[Segment, ctypes.Array[ctypes.c_int64]]:
        """A segment that no one has had, and where the loop copies it to. `granted` is called before the loop reads it.
        Refused: all were lent, or `granted` says so.
        """
        number = self._loop.control[control.WRITER_COUNT] - 1
        if number >= len(self._segments):
            raise Refused(f"{LENT} writers have had memory of their own in this run, and there is no more")
        granted()
        self.add(self._segments[number].address, self._copies[number])
        return self._segments[number], self._copies[number]

    def copy_of(self, segment: Segment) -> ctypes.Array[ctypes.c_int64]:
        """Where the loop copies a lent segment to."""
        return self._copies[self._segments.index(segment)]

    def close(self) -> None:
        """The loop must not run any more."""
        self._loop.control[control.WRITER_COUNT] = 0
        for segment in self._segments:
            segment.close()


COMMAND_WORDS = 4
SOURCE_WORDS = 5
MOST_COMMANDS = 1024
"""That wait."""
WRITE = "write"


@dataclass(frozen=True, slots=True)
class _Command:
    choice: int
    value_choice: int
    value: int
    taken: Callable[[int], None]


class Posts:
    """Values for the inputs of a loop, and commands of operators. Make it before processes of the run are forked.

    `lends`: whether writers may have memory of their own, which takes descriptors.
    """

    def __init__(self, loop: Loop, *, lends: bool = True) -> None:
        program = loop.code.program
        self._loop = loop
        self._choices = by_name(program)
        self._inputs = {name: (1 + 2 * i, choice) for i, (name, choice) in enumerate(inputs_of(program).items())}
        self.inputs = tuple(self._inputs)
        """What can be posted."""
        self._command = 1 + 2 * len(self._inputs)
        self.words = self._command + COMMAND_WORDS
        """Of a frame."""
        self._frame = words(self.words)
        self._copy = words(self.words)
        self._segment = words(segment_words(self.words))
        self._lock = threading.RLock()
        self._issued: _Command | None = None
        self._waiting: deque[_Command] = deque()
        self._pulses: deque[_Command] = deque()
        """They wait behind commands, so that no port that floods keeps an operator waiting."""
        copy = ctypes.addressof(self._copy)
        self._writers = Writers(loop, self.words, LENT if lends and self._inputs else 0)
        self._writers.add(ctypes.addressof(self._segment), self._copy)
        self._lent: dict[str, Segment] = {}
        rows = []
        for number, choice in enumerate(program.choices):
            if choice.input:
                word, _ = self._inputs[choice.input]
                kind = choice.type
                rows += [number, copy + 8 * word, kind.low, kind.high - kind.low, copy + 8 * (word + 1)]
        self._sources = words(len(rows))
        store(rows, self._sources)
        for place, value in (
            (control.SOURCES, ctypes.addressof(self._sources)), (control.SOURCE_COUNT, len(rows) // 5),
            (control.COMMAND, copy + 8 * self._command),
        ):  # fmt: skip
            loop.control[place] = value

    def number(self, name: str, value: Json) -> int:
        """The number of a value of an input. Refused: there is no such input or value."""
        return _number(name, self._known(name)[1], value)

    def _known(self, name: str) -> tuple[int, Choice]:
        if name not in self._inputs:
            raise Refused(f"there is no input `{name[:60]}`, only {', '.join(self._inputs) or 'none at all'}")
        return self._inputs[name]

    def post(self, values: Mapping[str, Json]) -> None:
        """Give values to inputs, all together. Refused: there is no such input or value, and nothing is posted."""
        for name in values:
            self._free(name)
        numbers = [(self.number(name, value), self._inputs[name][0]) for name, value in values.items()]
        with self._lock:
            for number, word in numbers:
                self._frame[word] = number
                self._frame[word + 1] += 1
            self._publish()

    def lend(self, names: Sequence[str], granted: Callable[[], None] = lambda: None) -> Segment:
        """Memory for a writer of its own, of these inputs; its frames are those of this module without commands.

        `granted` is called before it has an effect. Refused: `granted` says so, there is no such input, it has a writer
        of its own already, or no memory is left to lend.
        """
        for name in names:
            self._known(name)
            self._free(name)
        with self._lock:
            segment, copy = self._writers.lend(granted)
            for name in names:
                word, _ = self._inputs[name]
                self._lent[name] = segment
                copy[word] = self._frame[word]  # until it has posted for the first time
                self._feed(name, ctypes.addressof(copy))
        return segment

    def give_back(self, segment: Segment) -> None:
        """The writer is gone: its inputs keep their values, and others may post them."""
        copy = self._writers.copy_of(segment)
        with self._lock:
            for name in [name for name, by in self._lent.items() if by is segment]:
                word, _ = self._inputs[name]
                if copy[word + 1]:
                    self._frame[word] = copy[word]
                    self._frame[word + 1] += 1
                    self._publish()
                del self._lent[name]
                self._feed(name, ctypes.addressof(self._copy))

    def is_lent(self, name: str, segment: Segment) -> bool:
        """Whether an input is posted in this memory."""
        return self._lent.get(name) is segment

    def place(self, name: str) -> int:
        """The word of an input in frames; the one after it is not 0 once it was posted."""
        return self._inputs[name][0]

    def _feed(self, name: str, copy: int) -> None:
        """Let an input come from the copy of another frame; what the loop reads meanwhile is one or the other."""
        word, _ = self._inputs[name]
        for row in range(len(self._sources) // SOURCE_WORDS):
            at = row * SOURCE_WORDS
            if self._loop.code.program.choices[self._sources[at]].input == name:
                self._sources[at + 4] = self._writers.nothing
                self._sources[at + 1] = copy + 8 * word
                self._sources[at + 4] = copy + 8 * (word + 1)

    def _free(self, name: str) -> None:
        if name in self._lent:
            raise Refused(f"`{name}` belongs to a writer with memory of its own")

    def command(
        self,
        kind: str,
        target: str,
        value: Json = None,
        *,
        taken: Callable[[int], None],
        granted: Callable[[], None] = lambda: None,
    ) -> None:
        """Let an operator's command come at the beginning of a cycle, after all that were given before.

        `granted` is called before it has an effect, and `taken` by a later `forward` with the number of the frame at
        the end of that cycle. Refused: `granted` says so, `operators:` does not declare it, there is no such value, or
        too many commands wait.
        """
        number, value_number, given = operated(self._choices, kind, target, value)
        if len(self._waiting) >= MOST_COMMANDS:
            raise Refused(f"{MOST_COMMANDS} commands are waiting already")
        granted()
        with self._lock:
            self._waiting.append(_Command(number, value_number, given, taken))
            self.forward()

    def pulse(self, name: str, value: Json, taken: Callable[[int], None] = lambda _: None) -> None:
        """Give an input a value for one cycle, in which no other command or pulse comes. After that it has the value
        that was posted last, so one must have been. Refused: there is no such input or value, or too many wait.
        """
        number = self.number(name, value)
        if len(self._pulses) >= MOST_COMMANDS:
            raise Refused(f"{MOST_COMMANDS} events are waiting already")
        place = self._choices[name][0]
        with self._lock:
            self._pulses.append(_Command(place, place, number, taken))
            self.forward()

    @property
    def has_pulses(self) -> bool:
        """Whether `pulse` means one cycle: not where processes take turns."""
        return len(self._loop.code.program.processes) == 1

    def close(self) -> None:
        """The loop must not run any more."""
        self._writers.close()

    def forward(self) -> None:
        """See whether the loop has taken a command, and give it the next one."""
        block, at = self._loop.control, self._command
        with self._lock:
            done, frame = self._issued, block[control.TAKEN_FRAME]
            if done is not None and block[control.TAKEN] != self._frame[at]:
                return
            self._issued = None
            if waiting := self._waiting or self._pulses:
                self._issued = issued = waiting.popleft()
                store([self._frame[at] + 1, issued.choice, issued.value_choice, issued.value], self._frame, at)
                self._publish()
            if done is not None:
                done.taken(frame)  # who may give another command at once

    def adopt(self, before: Posts) -> None:
        """Take over what was posted to a run with which this one goes on."""
        with self._lock:
            for name, (word, _) in self._inputs.items():
                value = before.posted(name)
                if value is not None:
                    self._frame[word] = value
                    self._frame[word + 1] += 1
            self._publish()

    def posted(self, name: str) -> int | None:
        """What was posted last of an input, as far as it is known without waiting for who posts; None: nothing."""
        if name not in self._inputs:
            return None
        word, _ = self._inputs[name]
        with self._lock:
            if (segment := self._lent.get(name)) is not None:
                # It is looked at once, since its writer can write anything there and leave it. Where the newest frame
                # is not whole, that counts which the loop has read last.
                number = segment.latest
                lent = (segment.frame(number) if number else None) or [*self._writers.copy_of(segment)]
                if lent[word + 1]:
                    return lent[word]
            return self._frame[word] if self._frame[word + 1] else None

    def _publish(self) -> None:
        self._frame[0] += 1
        code().publish(self._segment, self._frame, self.words)


def operated(choices: Mapping[str, tuple[int, Choice]], kind: str, target: str, value: Json) -> tuple[int, int, int]:
    """The number of the choice that a command is among those of a program, that of the choice of its value (-1: it has
    none), and the number of this value. Refused: `operators:` does not declare it, or there is no such value.
    """
    name = f"{OPERATOR}{kind}({target})"
    if name not in choices or not is_command(name):
        offered = [n.removeprefix(OPERATOR) for n in choices if is_command(n)]
        if not offered:
            raise Refused("the arrangement declares no `operators:` for commands")
        raise Refused(f"`operators:` does not declare {kind[:20]} of `{target[:60]}`, only {', '.join(offered)}")
    if kind in ARGUMENTS:
        value_number, choice = choices[f"{OPERATOR}{ARGUMENTS[kind]}({target})"]
        return choices[name][0], value_number, _number(target, choice, value)
    if value is not None:
        raise Refused(f"{kind} has no value")
    return choices[name][0], -1, 0


def by_name(program: Program) -> dict[str, tuple[int, Choice]]:
    """The choices of a program by their names, each with its number."""
    return {choice.name: (number, choice) for number, choice in enumerate(program.choices)}


def _number(name: str, choice: Choice, value: Json) -> int:
    if not isinstance(value, bool | int | float | str):
        raise Refused(f"{name}: a value is a word, a number, true or false")
    try:
        return number_of(choice, value)
    except ValueProblem as problem:
        raise Refused(f"{name}: {problem}") from None
