"""A run in processes of its own, and the supervisor that outlives them (decision 41).

This process, the supervisor, forks one process for the loop, or one for each process of the arrangement; these pass a
token, a byte in the pipe of the one whose turn is next. Each holds a pipe whose other end the supervisor reads: what it
says there in its last moment is why the run ends, and saying nothing is dying. The supervisor commits the last frame.
The other way round each reads from a pipe that the supervisor alone could write: its end is the supervisor's death, and
then whoever has the token commits the last frame.
"""

from __future__ import annotations

import json
import os
import select
import sys
import threading
import time
import traceback
from contextlib import suppress

from llfsm_verify.backends.broken import BrokenProgramError
from llfsm_verify.runtime.live import control, forks
from llfsm_verify.runtime.live.loop import Loop
from llfsm_verify.runtime.live.pace import Pace
from llfsm_verify.runtime.live.protocols import FrameLog, Published
from llfsm_verify.runtime.live.run import Running

LAST_TOKEN = 2000
"""Milliseconds that the first process waits for the token after the supervisor has died: then no process has it. The
second waits twice as long, and so on, so that only one commits the last frame.
"""


class DiedError(RuntimeError):
    """A process of the run failed with an error of its own, which is a mistake of ours; its traceback."""


class Supervised(Running):
    """A loop that runs in forked processes: all turns in one (`together`), or one for each process of the arrangement.

    Make it while this process has no other thread. `shared` is where the loop publishes its frames.
    """

    def __init__(
        self,
        loop: Loop,
        shared: Published,
        recorder: FrameLog | None = None,
        *,
        priority: int | None = None,
        together: bool = False,
        pace: Pace | None = None,
    ) -> None:
        super().__init__(loop, recorder, shared=shared, priority=priority, pace=pace)
        count = 1 if together else len(loop.code.program.processes)
        self._mine = [-1] if count == 1 else list(range(count))
        self._tokens = [os.pipe() for _ in range(count)]
        self._lifeline = forks.Lifeline()
        self._ended = False
        self._reports: dict[int, forks.Child] = {}
        self._ends = select.epoll()
        for number in range(count):
            self._fork(number)
        self._lifeline.forked()
        forks.keep(self)

    def let_go(self) -> None:
        """See `forks.Kept`."""
        if not self._ended:
            for hears, child in self._reports.items():
                os.close(hears)
                child.let_go()
            self._close()

    def _fork(self, number: int) -> None:
        hears, says = os.pipe()
        sys.stdout.flush()
        sys.stderr.flush()

        def take_turns() -> None:
            try:
                self._say(says, self._work(number, says))
                self._outlive()
            except BaseException:  # the supervisor says it
                with suppress(OSError):
                    self._say(says, {"error": traceback.format_exc()})
                raise

        ends = {end for pipe in self._tokens for end in pipe}
        self._reports[hears] = forks.child(take_turns, {says, *ends, *self._lifeline.descriptors, *self._kept})
        os.close(says)
        self._ends.register(hears, select.EPOLLIN)

    def fileno(self) -> int:
        """Readable when `wait` has something to do."""
        return self._ends.fileno()

    def start(self) -> None:
        """Let it run."""
        os.write(self._tokens[0][1], b"t")

    # ------------------------------------------------------------ in a process of the run

    def _work(self, number: int, says: int) -> dict[str, object] | None:
        """Turns, as long as there are any for this process. What the supervisor is told; None: it has died."""
        threading.Thread(target=self._wait_for_death, daemon=True).start()
        self._prepared()
        reason, paused = control.HANDED, False
        while reason == control.HANDED:
            if not self._has_token(number, 0 if paused else LAST_TOKEN * (1 + number)):
                return None
            paused = False
            self.loop.control[control.MINE] = self._mine[number]
            self._reach()
            if not self.loop.number:
                self._began[0] = time.monotonic_ns()
                self.loop.begin(self._began[0])
            try:
                reason = self._drive()
            except BrokenProgramError:
                return {"broken": True}
            if reason == control.HANDED:
                os.write(self._tokens[self.loop.control[control.NEXT]][1], b"t")
            elif self._has_paused(reason):
                os.write(says, json.dumps({"paused": number, **self._news(reason)}).encode() + b"\n")
                reason, paused = control.HANDED, True
        return self._news(reason)

    def _news(self, reason: int) -> dict[str, object]:
        """What the supervisor is told where the loop has returned."""
        return {
            "reason": reason, "granted": self._granted, "unrecorded": self._unrecorded, "recorded": self._recorded,
        }  # fmt: skip

    def _say(self, says: int, news: dict[str, object] | None) -> None:
        if news is not None:
            with suppress(BrokenPipeError):
                os.write(says, json.dumps(news).encode() + b"\n")
            self._lifeline.wait()  # until the supervisor has ended the run and this process, or has died

    def _has_token(self, number: int, milliseconds: int) -> bool:
        """Wait for the token, at most so long after the supervisor has died; False: it does not come any more."""
        token = self._tokens[number][0]
        ready = self._lifeline.wait((token,))
        if token not in ready:
            ready = forks.readable((token,), milliseconds)
        return token in ready and bool(os.read(token, 1))

    def _wait_for_death(self) -> None:
        self._lifeline.wait()
        self.loop.stop()

    # ------------------------------------------------------------ in the supervisor

    def _paused(self, number: int) -> bool:
        """Whether it ends there; else it has the token again."""
        if self._ends_here():
            return True
        os.write(self._tokens[number][1], b"t")
        return False

    def wait(self, seconds: float | None = None) -> bool:
        """Wait until it has ended, at most so long; whether it has.

        Raises BrokenProgramError, and DiedError: a process failed.
        """
        if not self._ended and (ends := self._ends.poll(seconds)):
            self._end(ends[0][0])
        return self._ended

    def _end(self, hears: int) -> None:
        """The process that says something there has had the last turn, or has died."""
        said = b""
        while not said.endswith(b"\n") and (more := os.read(hears, 1 << 16)):
            said += more
        if not said.endswith(b"\n"):
            ending = "died", self._reports.pop(hears).end()
            os.close(hears)
            self._kill()
            self.loop.resume(self._newest)
        else:
            news = json.loads(said)
            if news.get("broken"):
                raise BrokenProgramError(self.loop.code.program.name)
            if "error" in news:
                raise DiedError(news["error"])
            if "paused" in news and not self._paused(news["paused"]):
                return
            ending = self._why(news["reason"])
            self._granted = news["granted"]
            if news["unrecorded"] is not None:
                self._unrecorded, self._recorded = news["unrecorded"], news["recorded"]
        self._reach()
        self.loop.end(*ending)
        self._count_time()
        if self._recorder is not None:
            self._recorder.close()
        self._kill()

    def _kill(self) -> None:
        """End the processes that are left, and whatever held them together."""
        for hears, child in self._reports.items():
            child.end()
            os.close(hears)
        self._reports.clear()
        if not self._ended:
            self._close()

    def _close(self) -> None:
        self._ended = True
        self._ends.close()
        self._lifeline.close()
        for ends in self._tokens:
            for end in ends:
                os.close(end)

    def __exit__(self, *_: object) -> None:
        """Ends what still runs, with a last frame if there was one: something went wrong here."""
        if not self._ended:
            self._kill()
            self._outlive(0)
