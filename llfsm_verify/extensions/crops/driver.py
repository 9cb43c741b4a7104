"""The program's side of a run: it sees in which state the machine is, lets that be executed, and posts the outcome.

All of it is on the thread that called `execute`, which reads frames and posts, and never calls a state: states are
executed on worker threads. The run does not wait for any of them, since its loop is machine code on a thread that needs
nothing of Python.
"""

from __future__ import annotations

import logging
import queue
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field

from llfsm_verify import LiveRun
from llfsm_verify.extensions.crops.checks import outcomes_of
from llfsm_verify.extensions.crops.data import Data, LeftState
from llfsm_verify.extensions.crops.states import State
from llfsm_verify.extensions.crops.transitions import (
    ANSWERS,
    FAILED,
    MACHINE,
    OUTCOME,
    PAUSED,
    TICKET,
    TIMED_OUT,
    TROUBLES,
    Transitions,
    near,
)

LOG = logging.getLogger("llfsm_verify.crops")
LOOKS = 5
"""Looks at the newest frame in a cycle."""
SHORTEST = 0.0002
"""Seconds between two of them, at least."""
GRACE = 0.2
"""Seconds that a `cancel` may take before another state is executed beside it; half a deadline, where that is less."""
LAST = 1.0
"""Seconds that the last `cancel` may take before `execute` returns without it."""


class Worker:
    """A thread that does one thing after the other, until it is told that there is nothing more."""

    def __init__(self) -> None:
        self._jobs: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self.thread = threading.Thread(target=self._work, name="crops-states", daemon=True)
        self.thread.start()

    def _work(self) -> None:
        while (job := self._jobs.get()) is not None:
            job()

    def do(self, job: Callable[[], None] | None) -> None:
        """Do this after all else; None: and then end."""
        self._jobs.put(job)


@dataclass(slots=True)
class Execution:
    """One call of `execute`: an answer to one ticket."""

    label: str
    ticket: int
    data: Data
    until: float
    """When it has taken too long (monotonic seconds)."""
    submitted: bool = False
    begun: bool = False
    outcome: str | None = None
    posted: str | None = None
    left: bool = False
    """Its answer does not count any more."""


@dataclass(slots=True)
class Cancellation:
    """One call of `cancel`."""

    label: str
    since: float
    returned: bool = False


@dataclass(slots=True)
class Command:
    """What an operator asks for, and whether it has happened."""

    kind: str
    label: str | None = None
    ticket: int | None = None
    """Of the frame before it was given; None: it was not given yet."""
    done: threading.Event = field(default_factory=threading.Event)
    failed: BaseException | None = None


class Commands:
    """What operators have asked for in an execution, and has not happened yet: kept until the run begins."""

    def __init__(self) -> None:
        self.asked: deque[Command] = deque()
        self.wake = threading.Event()
        self.begun = False
        self._closed = False

    def ask(self, kind: str, label: str | None = None) -> Command:
        """Let the machine be commanded, after all that was asked for before. From any thread."""
        command = Command(kind, label)
        self.asked.append(command)
        self.wake.set()
        if self._closed:
            self.refuse()
        return command

    def refuse(self) -> None:
        """Let all commands fail, now and from now on: nothing looks at them any more."""
        self._closed = True
        with suppress(IndexError):
            while True:
                command = self.asked.popleft()
                command.failed = RuntimeError("the state machine has ended")
                command.done.set()


class Driver:
    """Drives one run. `busy`: a lock for each state, so that an object is never executed twice at a time."""

    def __init__(
        self,
        live: LiveRun,
        found: Transitions,
        states: Mapping[str, State],
        deadlines: Mapping[str, float],
        data: Data,
        period: float,
        commands: Commands,
    ) -> None:
        self._live, self._found, self._states, self._data = live, found, states, data
        self._deadlines = deadlines
        self._given = {label: {*outcomes_of(state), *TROUBLES} for label, state in states.items()}
        self._pause = max(period / LOOKS, SHORTEST)
        self._names = {name: text for text, name in found.states.items()}
        self._busy = {id(state): threading.Lock() for state in states.values()}
        self._worker = Worker()
        self._current: Execution | None = None
        self._active: str | None = None
        """The state that was executed last, until it leads to another or is cancelled."""
        self._cancellations: list[Cancellation] = []
        """Those that have not returned."""
        self._cancellers: dict[int, Worker] = {}
        """For each object that was cancelled, so that one that hangs holds up no other."""
        self._commands, self._asked, self._wake = commands, commands.asked, commands.wake
        commands.begun = True
        self._said: set[str] = set()
        self.label: str | None = None
        """The label or final outcome in which the machine is; None: it is paused."""

    def drive(self) -> str:
        """Until the run has ended: the final outcome. RuntimeError: it ended otherwise."""
        try:
            while True:
                ended = self._ended()  # before the frame is read, so that the last one is
                self._look(self._live.values())
                if ended:
                    break
                now = time.monotonic()
                wait = self._pause if self._current is None else min(self._pause, self._current.until - now)
                self._wake.wait(max(wait, SHORTEST))
                self._wake.clear()
        finally:
            self._close()
        if self.label not in self._found.ends:
            raise RuntimeError(f"the run has ended before the state machine has: {self._live.wait().ending}")
        return self.label

    def _ended(self) -> bool:
        try:
            self._live.wait(0)
        except TimeoutError:
            return False
        return True

    def _look(self, values: Mapping[str, object]) -> None:
        for slot in [slot for slot, verdict in values.items() if slot.startswith(VERDICT) and verdict == "violated"]:
            self._say(f"the property `{slot.removeprefix(VERDICT)[:-1]}` is violated")
        name, ticket = str(values[MACHINE]), int(str(values[TICKET_SLOT]))
        self.label = self._names.get(name)
        label = self.label if self.label in self._found.labels else None
        entered = label is None or self._found.is_of(ticket, label)
        due = ticket if entered else self._found.next_ticket(ticket, str(label))  # it is entered in the next cycle
        current = self._current
        if current is not None and (current.label, current.ticket) != (label, due):
            self._leave(current)
            current = self._current = None
        if self._asked and entered and (current is None or current.posted is None):
            self._operate(name, ticket)  # now the machine goes nowhere by itself
        if label is None or self._asked:
            return  # what is about to be left is not begun, nor answered
        if current is None:
            current = self._begin(label, due)
        self._submit(current)
        self._answer(current)

    def _begin(self, label: str, ticket: int) -> Execution:
        until = time.monotonic() + self._deadlines[label]
        self._current = execution = Execution(label, ticket, self._data._for(), until)
        self._active = label
        return execution

    def _submit(self, execution: Execution) -> None:
        """Let it be executed, once an execution of its object that was left has returned, and what is cancelled."""
        state = self._states[execution.label]
        if not (execution.submitted or self._busy[id(state)].locked() or self._is_cancelling(execution)):
            execution.submitted = True
            self._worker.do(lambda: self._execute(execution, state))

    def _is_cancelling(self, execution: Execution) -> bool:
        """Whether it has to wait for a `cancel`, as it does for one of its object, and else for a short time."""
        self._cancellations = [one for one in self._cancellations if not one.returned]
        now, grace = time.monotonic(), min(GRACE, self._deadlines[execution.label] / 2)
        waits = False
        for one in self._cancellations:
            same = self._states[one.label] is self._states[execution.label]
            if now - one.since > grace:
                then = "waits for it" if same else "is executed meanwhile"
                self._say(f"`cancel` of the state `{one.label}` has not returned: `{execution.label}` {then}")
            waits = waits or same or now - one.since <= grace
        return waits

    def _execute(self, execution: Execution, state: State) -> None:
        """On a worker."""
        lock = self._busy[id(state)]
        if not lock.acquire(blocking=False):  # by an execution that was left while it began
            execution.submitted = False
            return
        try:
            if not execution.left:
                execution.begun = True
                execution.outcome = self._outcome(execution, state)
        finally:
            lock.release()
            self._wake.set()

    def _outcome(self, execution: Execution, state: State) -> str:
        given = self._given[execution.label]
        try:
            outcome: object = state.execute(execution.data)
            if isinstance(outcome, str) and (text := str.__str__(outcome)) in given:
                return text
            meant = near(outcome, given) if isinstance(outcome, str) else None
            what = f"has returned {outcome!r:.60}, which is not in its `outcomes`{f': {meant}' if meant else ''}"
            self._say(f"the state `{execution.label}` {what}")
        except BaseException as error:  # noqa: BLE001 - whatever is raised, the machine goes on
            if not (execution.left and isinstance(error, LeftState)):
                self._say(f"the state `{execution.label}` has raised {type(error).__name__}", error)
        return FAILED

    def _answer(self, execution: Execution) -> None:
        if execution.posted is not None:
            return
        outcome = execution.outcome
        if outcome is None and time.monotonic() < execution.until:
            return
        if outcome is None:
            label, seconds = execution.label, self._deadlines[execution.label]
            late = f"took longer than {seconds:g} s" if execution.begun else f"could not begin for {seconds:g} s"
            why = "" if execution.begun else ": `cancel` of a state, or an execution before it, has not returned"
            self._say(f"the state `{label}` {late}{why}")
        execution.posted = TIMED_OUT if outcome is None else outcome
        try:
            answer: dict[str, str | int] = {OUTCOME: self._found.values[execution.posted], ANSWERS: execution.ticket}
            self._live.post(**answer)
        except ValueError:
            if not self._ended():
                raise

    def _leave(self, execution: Execution) -> None:
        """Its answer does not count any more. It is cancelled if the machine went elsewhere than what it returned leads
        to, and if it raised an exception."""
        returned = execution.outcome if execution.posted == execution.outcome else None
        led = returned is not None and self._found.target(execution.label, returned) == self.label
        execution.left = True
        execution.data._leave(f"the state `{execution.label}` was left, and stores nothing any more")
        if execution.submitted and execution.outcome is None:  # the worker may hang
            self._worker.do(None)
            self._worker = Worker()
        if not led or returned == FAILED:
            self._cancel()
        elif self.label != execution.label:
            self._active = None

    def _cancel(self) -> None:
        """Let the state that is active stop what moves."""
        label, self._active = self._active, None
        if label is None:
            return
        one = Cancellation(label, time.monotonic())
        self._cancellations.append(one)
        key = id(self._states[label])
        if key not in self._cancellers:
            self._cancellers[key] = Worker()
        self._cancellers[key].do(lambda: self._call_cancel(one))

    def _call_cancel(self, one: Cancellation) -> None:
        try:
            self._states[one.label].cancel()
        except BaseException as error:  # noqa: BLE001 - whatever is raised, the machine goes on
            self._say(f"`cancel` of the state `{one.label}` has raised {type(error).__name__}", error)
        finally:
            one.returned = True
            self._wake.set()

    def _say(self, what: str, error: BaseException | None = None) -> None:
        """Log it the first time, and with the place of what was raised."""
        if what not in self._said:
            self._said.add(what)
            LOG.error("%s", what, exc_info=error)

    def _operate(self, name: str, ticket: int) -> None:
        """Give the command that was asked for first, or see that it has happened: nothing is answered meanwhile, so
        another ticket comes from it."""
        command = self._asked[0]
        if command.kind == "enter":
            done = self.label == command.label and self.label in self._found.ends
            done = done or (command.ticket is not None and ticket != command.ticket)
        else:
            done = (name == PAUSED) == (command.kind == "suspend")
        if done:
            self._cancel()  # also where the machine is in the same state again
            self._asked.popleft()
            command.done.set()
        elif command.ticket is None:
            command.ticket = ticket
            try:
                self._live.command(command.kind, MACHINE, self._found.states[command.label] if command.label else None)
            except ValueError as error:
                command.failed = error
                self._asked.popleft()
                command.done.set()

    def _close(self) -> None:
        current, self._current = self._current, None
        if current is not None:
            self._leave(current)
        self._commands.refuse()
        self._cancel()
        until = time.monotonic() + LAST
        for worker in (self._worker, *self._cancellers.values()):
            worker.do(None)
            worker.thread.join(max(0, until - time.monotonic()))
        for label in dict.fromkeys(one.label for one in self._cancellations if not one.returned):
            self._say(f"`cancel` of the state `{label}` has not returned, and is left behind")


TICKET_SLOT, VERDICT = f"{MACHINE}.{TICKET}", "verdict("
