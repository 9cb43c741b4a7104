"""Where signals wait, and when they are served."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable

import pytest

from llfsm_verify import interrupts
from llfsm_verify.interrupts import whole


def interrupt() -> None:
    os.kill(os.getpid(), signal.SIGINT)


def again_and_again(work: Callable[[], None]) -> None:
    while True:
        work()


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
    @whole
    def work() -> None:
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
        interrupt()
        done.append("all of it")

    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    done = []
    try:
        work()
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGINT, before)
    assert done == ["all of it"]


@pytest.mark.parametrize("number", [signal.SIGALRM, signal.SIGUSR1])
def test_a_signal_of_the_program_that_imports_us_waits(number: signal.Signals):
    """That of a timeout, say."""

    def late(_number: int, _frame: object) -> None:
        raise TimeoutError

    @whole
    def work() -> None:
        signal.raise_signal(number)
        done.append("all of it")

    before = signal.signal(number, late)
    done = []
    try:
        with pytest.raises(TimeoutError):
            work()
    finally:
        signal.signal(number, before)
    assert done == ["all of it"]


def test_of_two_signals_both_are_served():
    served = []

    @whole
    def work() -> None:
        interrupt()
        os.kill(os.getpid(), signal.SIGTERM)

    def note(number: int, _frame: object) -> None:
        served.append(number)

    before = signal.signal(signal.SIGTERM, note)
    try:
        with pytest.raises(KeyboardInterrupt):
            work()
    finally:
        signal.signal(signal.SIGTERM, before)
    assert served == [signal.SIGTERM]


def test_our_own_handler_is_served_between_two_calls():
    """However fast they follow each other."""

    @whole
    def work() -> None:
        signal.raise_signal(signal.SIGINT)
        done.append("all of it")

    before = signal.signal(signal.SIGINT, interrupts.interrupt)
    done = []
    try:
        with pytest.raises(KeyboardInterrupt):
            again_and_again(work)
    finally:
        signal.signal(signal.SIGINT, before)
    assert done == ["all of it"]


def test_a_signal_while_handlers_are_put_back_leaves_no_other_dead(monkeypatch):
    """Python serves signals before it changes a handler, so an exception comes out of that."""
    pressed, served = [], []
    change = signal.signal

    def pressing(number, handler):
        before = change(number, handler)
        if number == signal.SIGINT and handler is signal.default_int_handler and not pressed:
            pressed.append(True)
            interrupt()
        return before

    def note(number: int, _frame: object) -> None:
        served.append(number)

    before = signal.signal(signal.SIGTERM, note)
    try:
        monkeypatch.setattr(signal, "signal", pressing)
        with pytest.raises(KeyboardInterrupt):
            whole(lambda: None)()
        monkeypatch.undo()
        assert pressed
        signal.raise_signal(signal.SIGTERM)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert served == [signal.SIGTERM]


def test_without_an_interrupt_nothing_happens():
    assert whole(lambda x: x + 1)(1) == 2
