"""A program that was started for a port, and the socket at which it is spoken to."""

from __future__ import annotations

import ctypes
import os
import signal
import socket
import subprocess
import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from signal import Signals

from llfsm_verify.runtime.live.forks import readable

PIECE = 1 << 14
"""Bytes of one read, so that who floods a port does not keep others waiting."""
PDEATHSIG = 1
_C = ctypes.CDLL(None)


class Child:
    """It has a session and a process group of its own, which end with it. OSError: there is no such program.

    It is known by a descriptor (`ends`), and its number is not used by others until `end` has waited for it.
    """

    def __init__(self, run: Sequence[str], folder: str, environment: Mapping[str, str]) -> None:
        self.socket, theirs = socket.socketpair()
        try:
            self.socket.setblocking(False)
            self._process = subprocess.Popen(  # noqa: S603 - the user's program
                [*run], cwd=folder, stdin=theirs.fileno(), stdout=theirs.fileno(), env={**os.environ, **environment},
                start_new_session=True, preexec_fn=_prepared(),  # noqa: PLW1509 - it takes no lock and imports nothing
            )  # fmt: skip
        except BaseException:
            self.socket.close()
            raise
        finally:
            theirs.close()
        self.ends = os.pidfd_open(self._process.pid)

    def read(self) -> bytes | None:
        """Some of what it has said; nothing (b""): it says no more; None: there is nothing now."""
        try:
            return self.socket.recv(PIECE)
        except BlockingIOError:
            return None
        except OSError:
            return b""

    def write(self, data: bytes) -> int:
        """How many bytes it takes now. OSError: it hears nothing any more."""
        try:
            return self.socket.send(data, socket.MSG_NOSIGNAL)
        except BlockingIOError:
            return 0

    @property
    def has_ended(self) -> bool:
        """Whether it has."""
        return bool(readable((self.ends,), 0))

    def signal(self, number: Signals) -> None:
        """To it and to whatever it has started in its group."""
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, number)

    def end(self) -> str:
        """Kill what is left of it, and wait for it; how it ended, in words."""
        ended = self.has_ended
        self.signal(signal.SIGKILL)
        code = self._process.wait()
        self.socket.close()
        os.close(self.ends)
        if not ended:
            return "it was killed"
        return f"it has ended with code {code}" if code >= 0 else f"{_named(-code)} has ended it"


def _named(number: int) -> str:
    try:
        return Signals(number).name
    except ValueError:
        return f"signal {number}"


def _prepared() -> Callable[[], None]:
    """What the child does before it runs the program: it is an ordinary process, whatever this one is, and SIGTERM
    tells it that this one has died (the thread that starts it is what counts there, so it must be the main one).
    """
    parent = os.getpid()
    dies = threading.current_thread() is threading.main_thread()
    caught = [number for number in signal.valid_signals() if number not in (signal.SIGKILL, signal.SIGSTOP)]

    def prepare() -> None:
        for number in caught:
            signal.signal(number, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_SETMASK, ())
        if os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK != os.SCHED_OTHER:
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        if dies:
            _C.prctl(PDEATHSIG, int(signal.SIGTERM), 0, 0, 0)
            if os.getppid() != parent:
                os._exit(1)

    return prepare
