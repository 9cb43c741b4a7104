"""A debugger that only looks: at the frames of an arrangement that runs, as they come, and back over those seen."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from llfsm_verify import Subscription, Update, Whiteboard
from llfsm_verify.extensions.debugger.commands import ParsedCommand, parse
from llfsm_verify.extensions.debugger.debugger import Went
from llfsm_verify.extensions.debugger.session import MOST_SHOWN, helped
from llfsm_verify.plug import (
    DebugAnswer,
    DebugError,
    DebugPart,
    DebugTable,
    counted,
    text,
)  # fmt: skip

MOST_FRAMES = 100_000
"""Frames that are kept to go back to; of more, the older half is forgotten."""
_AT = re.compile(r"\s*(\w+)\s*@\s*(\w+)\s*", re.ASCII)


class Attached:
    """The commands of a debugger for a whiteboard, as far as they only look.

    Break points are states of machines: a frame does not have the letters that formulas speak of.
    """

    def __init__(self, board: Whiteboard, subscription: Subscription) -> None:
        self._board = board
        self._updates: Iterator[Update] = iter(subscription)
        self.frames: list[Update] = []
        self.position = -1
        """Index in `frames` of the one that is looked at."""
        self.breaks: dict[int, str] = {}
        self._numbers = 0
        self._forward()

    def do(self, line: str) -> DebugAnswer:
        """Do a command. DebugError: it would change the run, or cannot be done by looking."""
        given = parse(line)
        return DebugAnswer() if given is None else self._do(given)

    def _do(self, given: ParsedCommand) -> DebugAnswer:
        number, words, name = given.number or 1, given.words, given.command.name
        match name:
            case "step":
                goal = [number]
                return self._went(self._walk(self._forward, lambda: self._counted(goal)))
            case "back":
                goal = [number]
                return self._went(self._walk(self._back, lambda: self._counted(goal)))
            case "until" | "back-until":
                wanted = self._state(words[0])
                move = self._forward if name == "until" else self._back
                return self._went(self._walk(move, lambda: f"`{wanted}` is true" if self._holds(wanted) else None))
            case "continue":
                return self._went(self._walk(self._forward, lambda: None))
            case "reverse":
                return self._went(self._walk(self._back, lambda: None))
            case "break":
                self._numbers += 1
                self.breaks[self._numbers] = self._state(words[0])
                return DebugAnswer((f"break point {self._numbers}: {self.breaks[self._numbers]}",))
            case "breaks":
                return DebugAnswer((self._listed(),))
            case "delete":
                if given.number is None:
                    self.breaks.clear()
                elif self.breaks.pop(given.number, None) is None:
                    raise DebugError(f"there is no break point {given.number}")
                return DebugAnswer((self._listed(),))
            case "value" | "expect":
                value = self._holds(self._state(words[0]))
                told = f"{words[0]}: {text(value)}"
                return DebugAnswer((told,), expected=value if name == "expect" else None)
            case "show":
                return DebugAnswer((self._shown(words),))
            case "where":
                return DebugAnswer((self.where(),))
            case "help":
                return helped(words)
            case "quit":
                return DebugAnswer(quits=True)
        if given.command.changes:
            raise DebugError(
                f"`{name}` would change the run, but an attached debugger only looks; `llfsm whiteboard post` "
                "gives values to inputs, `llfsm send` commands to machines"
            )
        raise DebugError(
            f"`{name}` needs the steps of the run, but an attached debugger sees only its frames; it works on a "
            "recording of it (`llfsm run --record`)"
        )

    # ------------------------------------------------ walking

    def _forward(self) -> str | None:
        if self.position + 1 == len(self.frames):
            update = next(self._updates, None)
            if update is None:
                ending = self._board.view().ending
                if ending == "replaced":
                    return (
                        "the arrangement was changed (another machine or policy), and other frames follow: attach again"
                    )
                return f"there are no more frames: the run is over ({ending})"
            if len(self.frames) >= MOST_FRAMES:
                half = len(self.frames) // 2
                del self.frames[:half]
                self.position -= half
            self.frames.append(update)
        self.position += 1
        return None

    def _back(self) -> str | None:
        if self.position <= 0:
            return "this is the first frame that was seen, or is still kept"
        self.position -= 1
        return None

    def _walk(self, move: Callable[[], str | None], enough: Callable[[], str | None]) -> Went:
        begin = self.frames[self.position].number if self.frames else 0
        while True:
            reason = move()
            found, broken = (None, None) if reason is not None else (enough(), self._broken())
            if reason is not None or found is not None or broken is not None:
                end = self.frames[self.position].number if self.frames else 0
                return Went(begin, end, reason or broken or found or None)

    @staticmethod
    def _counted(left: list[int]) -> str | None:
        left[0] -= 1
        return None if left[0] else ""

    def _broken(self) -> str | None:
        before = self.frames[self.position - 1].values if self.position > 0 else {}
        for number, wanted in self.breaks.items():
            machine, state = wanted.split("@")
            if self._holds(wanted) and before.get(machine) != state:
                return f"break point {number}: `{wanted}` is true"
        return None

    # ------------------------------------------------ looking

    def _state(self, formula: str) -> str:
        match = _AT.fullmatch(formula)
        if match is None:
            raise DebugError(
                f"attached to a run, ask for the state of a machine, `MACHINE@STATE`, not `{formula[:60]}`; "
                "other formulas work on a recording of it"
            )
        machine, state = match.groups()
        machines = self._board.machines
        if machine not in machines:
            raise DebugError(f"there is no machine `{machine}`, only {', '.join(machines)}")
        if state not in machines[machine]:
            raise DebugError(f"`{machine}` has no state `{state}`, only {', '.join(machines[machine])}")
        return f"{machine}@{state}"

    def _holds(self, wanted: str) -> bool:
        machine, state = wanted.split("@")
        return bool(self.frames) and self.frames[self.position].values.get(machine) == state

    def _went(self, went: Went) -> DebugAnswer:
        parts: list[DebugPart] = []
        seen = [i for i, f in enumerate(self.frames) if went.begin < f.number <= went.end]
        if seen:
            first = seen[-MOST_SHOWN:]
            parts.append(DebugTable(("frame", "changes"), tuple(self._changes(i) for i in first)))
        if went.reason:
            parts.append(f"{went.reason[0].upper()}{went.reason[1:]}.")
        return DebugAnswer((*parts, self.where()))

    def _changes(self, index: int) -> tuple[str, str]:
        frame = self.frames[index]
        before = self.frames[index - 1].values if index else {}
        changed = [
            f"{n}: {text(before[n])} → {text(v)}" for n, v in frame.values.items() if n in before and before[n] != v
        ]
        if frame.missed:
            changed.append(f"{frame.missed:,} frames missed before it")
        return f"{frame.number:,}", ", ".join(changed)

    def where(self) -> str:
        """One line: the frame, and the states of all machines in it."""
        if not self.frames:
            return "no frame has been seen"
        frame = self.frames[self.position]
        later = len(self.frames) - 1 - self.position
        more = f", {counted(later, 'later frame')} seen" if later else ""
        return (
            f"at frame {frame.number:,}{more}: {' '.join(f'{m}@{text(frame.values[m])}' for m in self._board.machines)}"
        )

    def _listed(self) -> DebugPart:
        rows = tuple((str(number), wanted) for number, wanted in self.breaks.items())
        return DebugTable(("break point", "state"), rows) if rows else "there are no break points"

    def _shown(self, names: tuple[str, ...]) -> DebugPart:
        if not self.frames:
            return "no frame has been seen"
        values = self.frames[self.position].values
        wrong = next((name for name in names if name not in values), None)
        if wrong is not None:
            raise DebugError(f"there is no slot `{wrong[:60]}`, only {', '.join(values)}")
        return DebugTable(("name", "value"), tuple((n, text(v)) for n, v in values.items() if not names or n in names))
