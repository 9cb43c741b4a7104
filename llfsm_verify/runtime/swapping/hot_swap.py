"""A run that goes on with another machine or policy: as one stands aside, the next one takes its place as a cycle ends.

What takes long (reading, compiling, allocating) is done on a thread, while the run goes on, and in another process the
change is checked (`update_check`). Then the processes of the next run are forked and wait. The run pauses after a
cycle, its state is transferred to the variables of the new program (`state_transfer`), and the token goes to the new
processes: a pause of a millisecond or so, and no process in between. In the field's words it is dynamic software
updating (M. Hicks, S. Nettles, ACM TOPLAS 27(6), 2005) with checked update points.
"""

from __future__ import annotations

import select
import threading
from collections.abc import Callable, Sequence
from contextlib import ExitStack, closing
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from llfsm_verify.arrangement.draft import Draft
from llfsm_verify.arrangement.granting import rights_given
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.arrangement.replacing import Change, NewPolicy, with_change
from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.files import Closing
from llfsm_verify.jsonvalue import Json
from llfsm_verify.runtime.live.loop import Loop
from llfsm_verify.runtime.live.run import Running, RunReport
from llfsm_verify.runtime.live.slots import slots_of
from llfsm_verify.runtime.swapping.check_process import Check, CheckTask
from llfsm_verify.runtime.swapping.settings import Loaded, RunSettings
from llfsm_verify.runtime.whiteboard.permissions import Permissions
from llfsm_verify.runtime.whiteboard.posts import Refused
from llfsm_verify.runtime.whiteboard.shared import Shared
from llfsm_verify.verification.changes.state_transfer import Untransferable, transferred, update_point

SOON, CHECKED, LATER = 0.002, 0.02, 1.0
"""Seconds between two looks, while something is on its way, while it is checked, and else."""

Follow = Callable[[Shared], None]
"""Tells whoever serves a run that frames, inputs and commands are those of another one from now on."""
Answer = Callable[[int | str, Sequence[str]], None]
"""Gets the number of the frame from which on it is changed, or why it is not; and what else is to be said."""


Made = tuple[Draft, Arrangement, Loop]
"""What was read, the arrangement as it runs, and a loop at its beginning."""


class _PendingChange:
    """A machine or a policy that is on its way into the run: on a thread it is read and compiled."""

    def __init__(self, loaded: Loaded, answer: Answer, make: Callable[[], Made], check: Check | None) -> None:
        self.loaded = loaded
        self.answer = answer
        self.check = check
        """None: it is loaded unchecked."""
        self._make = make
        self.made: Made | None = None
        self.problem = ""
        """Why there is nothing that could run."""
        self.thread = threading.Thread(target=self._guarded, name="llfsm-load", daemon=True)
        self.thread.start()

    @property
    def ready(self) -> bool:
        """Whether it is made and checked, or cannot be made."""
        if self.thread.is_alive():
            return False
        return self.made is None or self.check is None or self.check.ready

    @property
    def patience(self) -> float:
        """Seconds until the next look."""
        return SOON if self.check is None or self.check.ready else CHECKED

    @property
    def notes(self) -> tuple[str, ...]:
        """What the check has to say."""
        return self.check.answer.notes if self.check is not None and self.check.ready else ()

    @property
    def refused(self) -> str | None:
        """Why the check refuses it, where it does; once it is `ready`."""
        return self.check.answer.reason if self.check is not None and self.check.answer.accepted is None else None

    def allows(self, loop: Loop) -> bool:
        """Whether it may be loaded where the run stands now."""
        if self.check is None:
            return True
        accepted = self.check.answer.accepted
        return accepted is not None and update_point(loop.code, loop.record, loop.states) in accepted.points

    def close(self) -> None:
        """The check is not waited for any more."""
        if self.check is not None:
            self.check.close()

    def _guarded(self) -> None:
        try:
            self.made = self._make()
        except DiagnosticError as error:
            name = self.loaded.change.name
            own = [d for d in error.diagnostics if name == (d.file if d.span is None else d.span.source.name)]
            self.problem = "; ".join(_line(d) for d in own or error.diagnostics)
        except (ValueError, Untransferable) as error:
            self.problem = str(error)
        except Exception as error:  # noqa: BLE001 - who asked is told, and the run goes on
            self.problem = f"it cannot be made: {type(error).__name__}: {error}"


class _Next(NamedTuple):
    """A run that waits to go on."""

    asked: _PendingChange
    draft: Draft
    arrangement: Arrangement
    shared: Shared
    run: Running
    left: ExitStack


class SwappableRun(Closing):
    """Runs one after the other, as one. It is made with the first, whose processes are forked then.

    `draft` is what was read of its arrangement; None: it does not come from files, and is not changed. The first
    `shared` is closed by whoever made it.
    """

    def __init__(self, draft: Draft | None, shared: Shared, settings: RunSettings, arrangement: Arrangement) -> None:
        self.shared = shared
        """Of the run that goes on now."""
        self.arrangement = self._began = arrangement
        """As it runs now."""
        self._draft, self._settings = draft, settings
        self._loaded: tuple[Loaded, ...] = ()
        self._earlier: tuple[tuple[Draft, str | None], ...] = ()
        """What ran before, with the machine that was replaced then."""
        self._asked: _PendingChange | None = None
        self._given_up: list[threading.Thread] = []
        """They make what is not waited for any more."""
        self._next: _Next | None = None
        self._stopped: int | None = None
        """The detail with which it was asked to stop."""
        self._first = 0
        """The number of the first frame of the run that took over last."""
        self._followers: tuple[Follow, ...] = ()
        self._unrecorded: str | None = None
        self._missing = 0
        """Frames that are not in the recordings of earlier runs."""
        self.recordings: list[Path] = []
        """The file of each run, where there are any."""
        self._run = self._made(arrangement, shared, ())
        self._left = ExitStack()
        self._left.enter_context(self._run)
        self._ends = select.epoll()
        self._ends.register(self._run.fileno(), select.EPOLLIN)

    def _made(self, arrangement: Arrangement, shared: Shared, loaded: tuple[Loaded, ...]) -> Running:
        run = self._settings.running(arrangement, shared, loaded)
        self.recordings += run.recordings
        return run

    def fileno(self) -> int:
        """Readable when `wait` has something to do."""
        return self._ends.fileno()

    @property
    def patience(self) -> float:
        """After so many seconds `serve` should be called in any case."""
        return LATER if self._asked is None else self._asked.patience

    @property
    def replaced(self) -> list[Json]:
        """The machines of which others have taken the places."""
        return [loaded.machine for loaded in self._loaded if loaded.machine is not None]

    def tell(self, *followers: Follow) -> None:
        """Tell these of each run that goes on with it."""
        self._followers = followers

    def start(self) -> None:
        """Let it run."""
        self._run.start()

    def stop(self, detail: int = 0) -> None:
        """Let it end after the cycle under way; `detail`: the number of the signal that asks for it."""
        self._stopped = detail
        self._run.stop(detail)

    @property
    def report(self) -> RunReport:
        """How it went, after it has ended; also why the recording of an earlier run ended before that."""
        report = self._run.report
        return replace(
            report, unrecorded=report.unrecorded or self._unrecorded, recorded=report.recorded - self._missing
        )

    def ask(self, change: Change, answer: Answer, unchecked: bool) -> None:
        """Let another machine take the place of one, with its variables carried over by name and type, or another
        policy that of the one in force.

        `answer` is called later, by `serve` or `wait`. Refused: see `admit`.
        """
        before = self.admit(change)
        draft, running = with_change(before, change), self.shared.loop
        loaded = Loaded(change, unchecked)

        def make() -> Made:
            arrangement, loop = self._settings.loop(resolve(draft))
            if isinstance(change, NewPolicy) and (given := list(rights_given(self._began, arrangement))):
                raise DiagnosticError(given)
            _compare(running, loop, self._settings.fed | self._settings.shown)
            return draft, arrangement, loop

        check = None if unchecked else self._check(loaded, before, draft)  # forked before there is a thread
        try:
            self._asked = _PendingChange(loaded, answer, make, check)
        except RuntimeError:  # there is no room for another thread
            if check is not None:
                check.close()
            raise

    def admit(self, change: Change) -> Draft:
        """What the change would be made to. Refused: `operators:` does not declare it, the arrangement does not come
        from files, another change is on its way, or the run has not begun.
        """
        undeclared = Permissions.of(self.arrangement).undeclared(change)
        if undeclared is not None:
            raise Refused(undeclared)
        if self._draft is None:
            raise Refused(
                "nothing of this arrangement can be replaced: it does not come from files, or they were edited"
            )
        if self._asked is not None:
            raise Refused("another machine or policy is already being loaded into this run")
        if self.shared.segment.newest() is None:
            raise Refused("the run has not begun")
        return self._draft

    def _check(self, loaded: Loaded, before: Draft, draft: Draft) -> Check:
        """Begin the check of a change from where the run stands."""
        newest = self.shared.segment.newest()
        assert newest is not None, "`admit` has seen a frame"
        code, settings = self.shared.loop.code, self._settings
        record, states = code.frames.record_of(newest), tuple(newest[code.frames.monitors :])
        task = CheckTask(settings, before, draft, (*self._loaded, loaded), code, record, states, self._earlier)
        return Check(task.finding, settings.limits)

    def serve(self, seconds: float) -> None:  # noqa: ARG002 - there is nothing to wait for
        """Let the next run take over, when it has been made."""
        if self._asked is not None and self._next is None and self._asked.ready:
            self._fork_next(self._asked)

    def wait(self, seconds: float | None = None) -> bool:
        """Wait until it has ended, at most so long; whether it has. Errors as for `Running.wait`."""
        if not self._run.wait(seconds):
            return False
        if self._run.handed_over:
            self._go_on()
            return False
        if self._asked is not None:
            self._refuse("the run has ended")
        return True

    def _refuse(self, why: str) -> None:
        asked, self._asked = self._asked, None
        if asked is not None:
            notes = asked.notes
            asked.close()
            self._given_up = [thread for thread in (*self._given_up, asked.thread) if thread.is_alive()]
            asked.answer(why, notes)

    def _fork_next(self, asked: _PendingChange) -> None:
        """The next run is made: let its processes wait, and the one under way pause."""
        asked.thread.join()  # processes are forked where there is no other thread
        if asked.made is None or asked.refused is not None:
            self._refuse(asked.problem or str(asked.refused))
            return
        draft, arrangement, loop = asked.made
        left = ExitStack()
        try:
            shared = left.enter_context(closing(Shared(self.shared.name, loop, served=self.shared.served)))
            following = left.enter_context(self._made(arrangement, shared, (*self._loaded, asked.loaded)))
        except DiagnosticError as error:
            left.close()
            self._refuse(error.diagnostics[0].message)
            return
        except OSError as error:
            left.close()
            self._refuse(f"it cannot be started: {error.strerror or error}")
            return
        self._next = _Next(asked, draft, arrangement, shared, following, left)
        self._run.hand_over(self._take_over)

    def _take_over(self) -> bool:
        """The run pauses; whether the next one goes on."""
        following, before = self._next, self.shared.loop
        assert following is not None
        loop, machine = following.shared.loop, following.asked.loaded.machine
        if not following.asked.allows(before):
            self._drop_next()
            self._refuse("the run is in a configuration from which loading was not checked")
            return False
        try:
            record = transferred(before.code, before.record, loop.code, loop.record, machine)
        except Untransferable as problem:
            self._drop_next()
            self._refuse(str(problem))
            return False
        loop.take_over(before, record)
        following.shared.posts.adopt(self.shared.posts)
        self._first = loop.number + 1
        following.run.take_over(self._run)
        following.run.start()
        return True

    def _drop_next(self) -> None:
        following, self._next = self._next, None
        if following is not None:
            following.left.close()
            if self.recordings:
                self.recordings.pop().unlink(missing_ok=True)

    def _go_on(self) -> None:
        """The run has been replaced: all users go on with the new one."""
        following = self._next
        assert following is not None
        self._next = self._asked = None
        self._ends.register(following.run.fileno(), select.EPOLLIN)
        self._loaded = (*self._loaded, following.asked.loaded)
        assert self._draft is not None
        self._earlier = (*self._earlier, (self._draft, following.asked.loaded.machine))
        self._draft, self.arrangement = following.draft, following.arrangement
        report = self._run.report
        self._unrecorded = self._unrecorded or report.unrecorded
        self._missing += report.frames - report.recorded
        before, left = self.shared, self._left
        # What fails from here on leaves the run that goes on to `close`.
        self.shared, self._run, self._left = following.shared, following.run, following.left
        if self._stopped is not None:
            self._run.stop(self._stopped)
        with closing(before), left:
            following.asked.answer(self._first, following.asked.notes)
            following.shared.posts.adopt(before.posts)  # with what was posted since the pause
            for follow in self._followers:
                follow(following.shared)

    def close(self) -> None:
        """End what still runs: something went wrong."""
        if self._asked is not None:
            self._asked.close()
            self._given_up.append(self._asked.thread)
        self._drop_next()
        self._left.close()
        self._ends.close()
        for thread in self._given_up:
            thread.join()  # LLVM must not be at work while Python ends


def _line(found: Diagnostic) -> str:
    """What is wrong, where, and what to write instead."""
    where = found.span or found.file
    place = f"{where}: " if where else ""
    return f"{place}{found.message}" + (f" ({found.hint})" if found.hint else "")


def _compare(running: Loop, following: Loop, ported: frozenset[str]) -> None:
    """Untransferable: the monitors or the ports of a run cannot go on in another one."""
    before, after = running.code, following.code
    kinds = [{slot.name: slot.choice for slot in slots_of(code)} for code in (before, after)]
    other = sorted(name for name in ported if kinds[0][name] != kinds[1].get(name))
    if other:
        raise Untransferable(f"a port needs `{other[0]}`, which would not be there, or be of another type")
    if before.monitors != after.monitors or before.tables != after.tables:
        raise Untransferable("a property that is monitored would need another monitor")
