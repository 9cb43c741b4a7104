"""Supervisors that die or fail where it is awkward: the last frame has safe values all the same."""

from __future__ import annotations

import ctypes
import os
import select
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import closing

import pytest

from llfsm_verify.runtime.live import supervised
from llfsm_verify.runtime.live.frame import ENDING, ENDINGS
from llfsm_verify.runtime.live.loop import LiveCode, Loop
from llfsm_verify.runtime.live.plan import safe_values, starting_values
from llfsm_verify.runtime.live.supervised import Supervised
from llfsm_verify.runtime.whiteboard.shared import Shared
from llfsm_verify.semantics.lowering import lower
from tests.runtime.live.runs import pids
from tests.runtime.live.test_supervised import SAFE, running, several, values

pytestmark = pytest.mark.slow


@pytest.fixture
def shared() -> Iterator[Shared]:
    code = LiveCode(lower(several(), keep_all_bits=True), safe=safe_values(several()))
    with closing(Shared("test", Loop(code, held=starting_values(code.program), period=1_000_000))) as made:
        yield made


def ending(shared: Shared) -> str:
    """How the last frame says that a run ended, which must have safe values."""
    newest = shared.segment.newest()
    assert newest is not None and {**values(shared), **SAFE} == values(shared)
    return ENDINGS[newest[ENDING]]


def begun(shared: Shared) -> None:
    while shared.loop.number < 3:
        time.sleep(0.001)


def outlived(shared: Shared, die: Callable[[Supervised], object]) -> None:
    """Wait until the loop has ended whose supervisor, a process of its own, does this."""
    told, tells = os.pipe()
    goes, go = os.pipe()
    supervisor = os.fork()
    if not supervisor:
        try:
            run = Supervised(shared.loop, shared, together=True)
            os.write(tells, pids(run)[0].to_bytes(4, "little"))
            os.read(goes, 1)
            run.start()
            begun(shared)
            die(run)
        finally:
            os._exit(0)
    process = os.pidfd_open(int.from_bytes(os.read(told, 4), "little"))
    os.write(go, b"g")
    os.waitpid(supervisor, 0)
    select.select([process], [], [])
    for descriptor in (told, tells, goes, go, process):
        os.close(descriptor)


def test_a_loop_that_pauses_waits_for_no_token(shared: Shared, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its supervisor dies while another machine takes over, and nobody else has the token."""
    monkeypatch.setattr(supervised, "LAST_TOKEN", 10**8)

    def die(run: Supervised) -> None:
        run.hand_over(lambda: os._exit(0))
        run.wait()

    outlived(shared, die)
    assert ending(shared) == "died"


def test_a_child_that_a_library_forks_does_not_keep_the_loop_going(shared: Shared) -> None:
    """Python does not see such a fork, so the child has all descriptors of the supervisor."""
    hears, keeps = os.pipe()

    def die(_: Supervised) -> None:
        if not ctypes.PyDLL(None).fork():
            os.close(keeps)
            os.read(hears, 1)  # until the test is over
        os._exit(0)

    outlived(shared, die)
    assert ending(shared) == "died"
    os.close(hears)
    os.close(keeps)


def test_an_error_in_the_supervisor_leaves_safe_values(shared: Shared) -> None:
    def fail() -> None:
        with Supervised(shared.loop, shared) as run:
            run.start()
            begun(shared)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert ending(shared) == "died"


@pytest.mark.parametrize("ends", ["stop", "kill"])
@pytest.mark.parametrize("reaps", ["the system", "somebody else"])
def test_children_that_nobody_can_wait_for(ends: str, reaps: str) -> None:
    before = signal.getsignal(signal.SIGCHLD)
    with running(several(), together=True, period=1_000_000) as (run, shared):
        run.start()
        begun(shared)
        if reaps == "the system":
            signal.signal(signal.SIGCHLD, signal.SIG_IGN)
        try:
            if ends == "stop":
                run.stop()
            else:
                (pid,) = pids(run)
                os.kill(pid, signal.SIGKILL)
                if reaps == "somebody else":
                    os.waitpid(pid, 0)
            assert run.wait()
        finally:
            signal.signal(signal.SIGCHLD, before)
        assert ending(shared) == {"stop": "stopped", "kill": "died"}[ends]
