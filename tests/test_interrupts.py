"""Where signals wait, and when they are served."""

from __future__ import annotations

import os
import signal
from types import FrameType

import pytest

from llfsm_verify.interrupts import uninterrupted, waits, whole


def interrupt() -> None:
    os.kill(os.getpid(), signal.SIGINT)


def test_an_interrupt_is_served_at_the_end():
    done = []
    before = signal.getsignal(signal.SIGINT)

    @whole
    def work() -> None:
        interrupt()
        done.append("all of it")

    with pytest.raises(KeyboardInterrupt):
        work()
    assert done == ["all of it"]
    assert signal.getsignal(signal.SIGINT) is before


def test_a_termination_waits_too():
    def leave(number: int, frame: object) -> None:
        raise SystemExit(128 + number)

    @whole
    def work() -> None:
        os.kill(os.getpid(), signal.SIGTERM)
        done.append("all of it")

    before = signal.signal(signal.SIGTERM, leave)
    done = []
    try:
        with pytest.raises(SystemExit, match="143"):
            work()
    finally:
        signal.signal(signal.SIGTERM, before)
    assert done == ["all of it"]


def test_what_is_ignored_stays_ignored():
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    done = []
    try:
        with uninterrupted():
            assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
            interrupt()
            done.append("all of it")
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)
    assert done == ["all of it"]


def test_an_exception_of_another_signal_waits_too():
    """Where its handler asks: that of an alarm, say."""
    asked = []

    def ring(_number: int, frame: FrameType | None) -> None:
        asked.append(waits(frame))

    before = signal.signal(signal.SIGUSR1, ring)
    try:
        whole(lambda: signal.raise_signal(signal.SIGUSR1))()
        signal.raise_signal(signal.SIGUSR1)
    finally:
        signal.signal(signal.SIGUSR1, before)
    assert asked == [True, False]


def test_without_an_interrupt_nothing_happens():
    assert whole(lambda x: x + 1)(1) == 2
