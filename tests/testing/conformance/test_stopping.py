"""Cases end: by themselves, by what is raised, and after their time."""

from __future__ import annotations

import gc
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress

import pytest

from llfsm_verify.interrupts import whole
from llfsm_verify.limits import LimitReached, Limits
from llfsm_verify.testing.conformance import Case, Outcome
from llfsm_verify.testing.conformance.outcome import Wrong
from llfsm_verify.testing.conformance.stopping import Overdue, StoppingBudget, interrupted, within


def outcome(look: object, patience: float = 60) -> Outcome:
    return Case("it", "it is looked at", look, patience)()


def raises(error: BaseException) -> object:
    def look() -> None:
        raise error

    return look


def forever() -> None:
    while True:
        pass


def burn(seconds: float) -> None:
    end = time.process_time() + seconds
    while time.process_time() < end:
        pass


def test_what_comes_of_a_case() -> None:
    assert outcome(lambda: None).passed
    for error, said in (
        (Wrong("it is not true"), "it is not true"),
        (ValueError("two\nlines."), "ValueError: two lines"),
        (SystemExit(3), "SystemExit: 3"),
    ):
        found = outcome(raises(error))
        assert (found.passed, found.wrong) == (False, said)


def test_the_users_own_ctrl_c_ends_the_suite() -> None:
    with pytest.raises(KeyboardInterrupt):
        outcome(raises(KeyboardInterrupt()))


@pytest.mark.slow
def test_a_case_without_end_is_ended() -> None:
    found = outcome(forever, 0.2)
    assert (found.passed, found.wrong) == (False, "it did not end within 0.2 s of processor time")
    assert found.seconds > 0


def test_in_another_thread_nothing_is_raised() -> None:
    done = []

    def work() -> None:
        with within(0.01), interrupted(0.01) as raised:
            burn(0.1)
        done.append(list(raised))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert done == [[]]


def ring() -> None:
    """What the timer of `interrupted` does."""
    signal.raise_signal(signal.SIGVTALRM)


def test_ctrl_c_waits_until_a_destructor_is_done() -> None:
    """Python forgets what is raised in one."""
    finished = []

    class Pressed:
        def __del__(self) -> None:
            ring()
            finished.append(True)

    def look() -> None:
        Pressed()
        forever()

    with pytest.raises(KeyboardInterrupt), interrupted(60):
        look()
    assert finished == [True]


def test_ctrl_c_waits_for_callbacks_of_the_garbage_collector() -> None:
    """Hypothesis has one."""
    finished = []

    def told(_phase: str, _about: object) -> None:
        if not finished:
            ring()
            finished.append(True)

    def look() -> None:
        gc.callbacks.append(told)
        gc.collect()
        forever()

    try:
        with pytest.raises(KeyboardInterrupt), interrupted(60) as raised:
            look()
    finally:
        gc.callbacks.remove(told)
    assert finished == [True] and len(raised) == 1


def test_ctrl_c_that_python_has_forgotten_comes_again() -> None:
    """No frame shows that a generator is closed because it is garbage."""
    closed = []

    def pressed() -> Iterator[None]:
        try:
            yield
        finally:
            closed.append(True)
            ring()
            closed.append(False)

    def look() -> None:
        left = pressed()
        next(left)
        del left
        forever()

    hook = sys.unraisablehook
    with pytest.raises(KeyboardInterrupt), interrupted(60) as raised:
        look()
    assert closed == [True] and len(raised) == 1
    assert sys.unraisablehook is hook


def test_an_alarm_at_work_on_what_was_forgotten_is_not_disturbed() -> None:
    """By another alarm, which comes after it."""
    pressed = []

    class Failing:
        def __del__(self) -> None:
            raise ValueError("forgotten")

    def look() -> None:
        Failing()
        forever()

    def press(_unraisable: object) -> None:
        pressed.append(True)
        signal.raise_signal(signal.SIGPROF)
        pressed.append(False)

    before, sys.unraisablehook = sys.unraisablehook, press
    try:
        with pytest.raises(Overdue), within(60) as overdue, interrupted(60) as raised:
            look()
    finally:
        sys.unraisablehook = before
    assert (pressed, len(overdue), raised) == ([True, False], 1, [])


def test_a_block_that_was_left_without_its_end_does_not_ring() -> None:
    """An exception of another signal comes before `__exit__` has begun."""
    alarm = interrupted(60)

    def look() -> None:
        alarm.__enter__()

    handler, hook = signal.getsignal(signal.SIGVTALRM), sys.unraisablehook
    look()
    ring()
    assert signal.getsignal(signal.SIGVTALRM) is handler and sys.unraisablehook is hook
    assert signal.getitimer(signal.ITIMER_VIRTUAL) == (0, 0)


def test_ctrl_c_comes_between_calls_that_are_whole() -> None:
    """However fast they follow each other."""

    @whole
    def work() -> None:
        ring()
        done.append(True)

    def look() -> None:
        while True:
            work()

    done: list[bool] = []
    with pytest.raises(KeyboardInterrupt), interrupted(60):
        look()
    assert done == [True]


def test_what_else_python_forgets_is_said_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[object] = []
    monkeypatch.setattr(sys, "unraisablehook", lambda unraisable: said.append(unraisable.exc_value))

    class Failing:
        def __del__(self) -> None:
            raise ValueError("forgotten")

    with within(60):
        Failing()
    assert [str(error) for error in said] == ["forgotten"]


@pytest.mark.slow
def test_after_the_block_nothing_rings() -> None:
    handler = signal.getsignal(signal.SIGVTALRM)
    for moment in range(50):
        with suppress(KeyboardInterrupt), interrupted(0.0002 * moment + 0.0001):
            burn(0.005)
        assert signal.getsignal(signal.SIGVTALRM) is handler
        assert signal.getitimer(signal.ITIMER_VIRTUAL) == (0, 0)


@pytest.mark.parametrize(("error", "again"), [(KeyboardInterrupt(), False), (LimitReached("used up"), True)])
def test_a_used_up_budget_stays_so_and_ctrl_c_comes_once(error: BaseException, again: bool) -> None:
    budget = StoppingBudget(Limits(), 3, error)
    part = budget.narrowed(10, 10)
    budget.tick()
    part.check()
    assert not budget.stopped
    with pytest.raises(type(error)):
        budget.tick()
    assert budget.stopped and part.stopped
    if again:
        with pytest.raises(type(error)):
            part.check()
    budget.end()
    budget.tick()
    part.tick()
