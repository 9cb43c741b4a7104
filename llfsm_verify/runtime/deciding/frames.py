"""Monitors outside the loop: properties decided on the frames of a run, by a process that may miss some of them.

A frame is the letter where a cycle of a process has ended. What lies between two frames that were read (frames that
were overwritten; where letters follow every ringlet, the other ringlets of the cycle) is letters that are not known. A
monitor is therefore in one of a set of states: those to which some letters lead. There is a verdict when all of them
have it, so it holds whatever the unknown letters were.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.claims import claim_of
from llfsm_verify.checking.goals.goal import Goal
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.replay.confirm import Letter
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.logic.bounds import TICK
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.monitoring.states import Monitor, MonitorVerdict
from llfsm_verify.runtime.deciding.letters import SlotLetters
from llfsm_verify.runtime.deciding.recordings import Decided, Watch, watches_of
from llfsm_verify.runtime.live import ABSENT, UNSEEN
from llfsm_verify.runtime.live.frame import ENDING, ENDINGS, NUMBER, STEPS
from llfsm_verify.runtime.live.slots import Slot

MOST_LETTERS = 1 << 20
"""Letters that are kept, to decide what only a whole run decides."""


class FrameMonitors:
    """Properties of an arrangement, decided on frames that have these slots.

    `read` takes frames in their order; the first one that it gets is where everything begins. DiagnosticError: a
    property is wrong, or needs what frames do not show (E489); the slots are not those of the arrangement (E486).
    """

    def __init__(self, arrangement: Arrangement, properties: PropertySet, slots: Iterable[Slot]) -> None:
        problem = bind(arrangement, properties)
        program = problem.program(keep_all_bits=True)
        self._letters = SlotLetters(problem, program)
        needed = dict.fromkeys(name for names in self._letters.needed.values() for name in names)
        self._slots = _agreed(self._letters, needed, {slot.name: slot for slot in slots}, arrangement)
        if self._letters.timed and len(program.processes) > 1:
            message = "with several processes, frames do not say when time passes: bounds in time are not decided"
            raise DiagnosticError(Diagnostic(UNSEEN, message, hint="let the run monitor them: llfsm run -p"))
        self._inits = {i.name: i.init for i in program.inputs}
        self._by_cycle = program.observe == "cycle"
        self._alone = len(program.processes) == 1
        self._watches = watches_of(problem, Watched)
        self._assumptions = [claim_of(line, problem.clock) for line in properties.assumptions]
        self._worldly = self._inits.keys()
        self._before: Sequence[int] | None = None
        self._word: list[Letter] | None = []
        """All letters, as long as each is known."""
        self._open = "the run was not over"
        self.first: int | None = None
        """The number of the frame with which everything began."""

    def read(self, frame: Sequence[int]) -> list[Decided]:
        """What is decided by this frame."""
        before, self._before = self._before, frame
        ending = ENDINGS[frame[ENDING]] if 0 <= frame[ENDING] < len(ENDINGS) else "died"
        if before is None:
            self.first = frame[NUMBER]
            if ending in ("running", "ended"):
                self._step(frame, ticks=frame[NUMBER] > 1)
        else:
            missed = frame[NUMBER] - before[NUMBER] - 1
            shows = frame[STEPS] > before[STEPS] and ending == "running"
            lost = missed if self._by_cycle else frame[STEPS] - before[STEPS] - shows
            if missed or lost:
                self._lose(lost, before[NUMBER] + 1, frame[NUMBER] - 1)
            if shows or ending == "ended":
                self._step(frame, ticks=True)
        if ending == "ended":
            self._decide_at_end()
        elif ending != "running":
            self._open = f"the run ended in another way: {ending}"
        return [
            watch.decided(open_end=self._open)
            for watch in self._watches
            if watch.place == (frame[STEPS], frame[NUMBER])
        ]

    def _step(self, frame: Sequence[int], *, ticks: bool) -> None:
        numbers = {name: slot.number(frame) for name, slot in self._slots.items()}
        if frame[NUMBER] == 1:  # nothing is sampled before the first cycle
            numbers |= {name: init for name, init in self._inits.items() if name in numbers}
        try:
            letter = self._letters.letter(numbers, ticks=ticks)
        except OverflowError as overflow:
            self._word, self._open = None, f"{overflow} in frame {frame[NUMBER]:,}"
            for watch in self._watches:
                watch.unknown(1, within_a_cycle=False)
            return
        if self._word is not None:
            self._word.append(letter)
            if len(self._word) > MOST_LETTERS:
                self._word, self._open = None, f"the run was longer than {MOST_LETTERS:,} letters"
        for watch in self._watches:
            watch.known(letter, (frame[STEPS], frame[NUMBER]))

    def _lose(self, count: int, first: int, last: int) -> None:
        """So many letters are unknown; frames from `first` to `last`, if any, were missed."""
        self._word = None
        if first <= last:
            self._open = f"frame{f' {first:,} was' if first == last else f's {first:,} to {last:,} were'} missed"
        elif self._open == "the run was not over":
            self._open = "frames do not show each ringlet of a cycle, and the run was not over"
        within = self._letters.timed and self._alone and not self._by_cycle and first > last
        for watch in self._watches:
            watch.unknown(count, within_a_cycle=within)

    def _decide_at_end(self) -> None:
        """The last letter repeats forever."""
        if self._word is None:
            return
        stem, loop = self._word[:-1], self._word[-1:]
        assumed = all(claim.true_on(stem, loop) for claim in self._assumptions)
        given = {name for claim in self._assumptions for name in claim.atoms}
        for watch in self._watches:
            names = {name for atom in {*watch.goal.atoms, *given} for name in self._letters.needed.get(atom, ())}
            if names & self._worldly:
                watch.reason = watch.reason or "inputs may change after the end"
            else:
                watch.decide_on_lasso(stem, loop, assumed=assumed)

    @property
    def results(self) -> list[Decided]:
        """What is known of each property so far."""
        return [watch.decided(open_end=self._open) for watch in self._watches]


class Watched(Watch):
    """A property, and the states that its monitor may be in."""

    def __init__(self, goal: Goal, monitor: Monitor | None, reason: str = "") -> None:
        super().__init__(goal, monitor, reason)
        self.states = frozenset({0})

    def known(self, letter: Letter, place: tuple[int, int]) -> None:
        if self.monitor is None or self.verdict != "undecided":
            return
        mask = self.monitor.letter(letter)
        self.states = frozenset(self.monitor.step(state, mask) for state in self.states)
        verdicts = {self.monitor.verdicts[state] for state in self.states}
        if len(verdicts) == 1 and MonitorVerdict.NOT_YET not in verdicts:
            self.verdict = "violated" if MonitorVerdict.FALSE in verdicts else "satisfied"
            self.place = place

    def unknown(self, count: int, *, within_a_cycle: bool) -> None:
        """So many letters that could be any; `within_a_cycle`: time does not pass after them."""
        if self.monitor is None or self.verdict != "undecided":
            return
        tick = self.monitor.letter({TICK}) if within_a_cycle else 0
        seen: dict[frozenset[int], int] = {}
        left = count
        while left:
            if self.states in seen:
                left %= seen[self.states] - left
                seen = {}
                if not left:
                    break
            seen[self.states] = left
            edges = (edge for state in self.states for edge in self.monitor.edges[state])
            self.states = frozenset(edge.target for edge in edges if not edge.positive & tick)
            left -= 1


def _agreed(
    letters: SlotLetters, needed: Collection[str], slots: dict[str, Slot], arrangement: Arrangement
) -> dict[str, Slot]:
    """The slots that letters need. DiagnosticError: see `FrameMonitors`."""
    hidden = [atom for atom, names in letters.needed.items() if any(name not in letters.slots for name in names)]
    if hidden:
        raise DiagnosticError([_unseen(atom, letters) for atom in hidden])
    found: dict[str, Slot] = {}
    for name in needed:
        slot, choice = slots.get(name), letters.slots[name]
        if slot is None or (slot.choice.type, slot.labels) != (choice.type, choice.labels):
            message = f"`{name}` is not on the whiteboard as `{arrangement.name}` has it: another arrangement runs"
            raise DiagnosticError(Diagnostic(ABSENT, message, hint="name the arrangement that runs"))
        found[name] = slot
    return found


def _unseen(atom: str, letters: SlotLetters) -> Diagnostic:
    message = (
        f"`{atom}` asks what happened in a step, what came before it, or whether a machine is loaded, and a frame does "
        "not tell it"
    )
    return Diagnostic(UNSEEN, message, letters.place(atom), hint="let the run monitor it: llfsm run -p")
