"""Work in a context of Z3's that is ended, and what can be asked there afterwards."""

from __future__ import annotations

import faulthandler
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType

import pytest
import z3

from llfsm_verify.backends.smt import solver as asking


class Ended(Exception):
    pass


@pytest.mark.parametrize("make", [z3.main_ctx, z3.Context], ids=["main", "own"])
def test_a_context_whose_work_was_ended_can_be_asked_again(
    make: Callable[[], z3.Context], monkeypatch: pytest.MonkeyPatch
) -> None:
    context = make()
    monkeypatch.setattr(asking, "LOOK_SECONDS", 0.002)
    word = z3.BitVec("w", 8, context)

    def is_simplified() -> bool:
        return z3.simplify(word + word - word).eq(word)

    def until_interrupted() -> None:
        while is_simplified():
            pass

    def end() -> None:
        raise Ended

    with pytest.raises(Ended):
        asking.wait_for(until_interrupted, context, end)
    assert is_simplified()
    solver = z3.Solver(ctx=context)
    solver.add(z3.UGT(word, 3))
    assert (solver.check(word == 4), solver.check(word == 2)) == (z3.sat, z3.unsat)


def test_what_the_ended_work_raised_is_not_raised_by_who_ends_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Z3 keeps the failure of a call in the context, and z3py looks for one after each call, on any thread."""
    monkeypatch.setattr(asking, "LOOK_SECONDS", 0.002)
    failed, interrupted = threading.Event(), threading.Event()

    class Watched(z3.Context):
        def interrupt(self) -> None:
            try:
                super().interrupt()
            finally:
                interrupted.set()

    context = Watched()
    word = z3.BitVec("w", 8, context)
    told = z3.Solver(ctx=context)
    told.push()

    def work() -> None:
        with pytest.raises(z3.Z3Exception):
            z3.Solver(ctx=context).pop()
        failed.set()
        interrupted.wait()

    def end() -> None:
        failed.wait()
        raise Ended

    with pytest.raises(Ended):
        asking.wait_for(work, context, end)
    told.add(word + word == 5)  # a context that is still interrupted loses it
    assert told.check() == z3.unsat
    assert z3.simplify(word + word - word).eq(word)


@pytest.mark.parametrize("seconds", [0.0, 0.02], ids=["quick", "slow"])
def test_ctrl_c_at_any_instruction_ends_the_wait_and_the_work(seconds: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """It ends work that has begun before it comes out, and work that has not begun never begins."""
    monkeypatch.setattr(asking, "LOOK_SECONDS", 0.005)
    context = z3.Context()
    at_work, begun = threading.Semaphore(), [0]

    def work() -> int:
        begun[0] += 1
        with at_work:
            time.sleep(seconds)
        return 7

    def look() -> None:
        pass

    def counting(most: int) -> tuple[Callable[[FrameType, str, object], object], list[int]]:
        passed = [0]

        def trace(frame: FrameType, event: str, _: object) -> object:
            if frame.f_code.co_filename != asking.__file__ or frame.f_code.co_name not in ("wait_for", "watch"):
                return None
            frame.f_trace_opcodes = True
            if event == "opcode":
                passed[0] += 1
                if passed[0] == most:
                    raise KeyboardInterrupt
            return trace

        return trace, passed

    interrupted = 0
    faulthandler.dump_traceback_later(60, exit=True)
    try:
        for at in range(1, 1000):
            trace, passed = counting(at)
            before = sys.gettrace()
            sys._getframe().f_trace_opcodes = True  # else Python 3.12 tells of no instructions the first time
            sys.settrace(trace)
            try:
                assert asking.wait_for(work, context, look) == 7
            except KeyboardInterrupt:
                interrupted += 1
            finally:
                sys.settrace(before)
            assert at_work.acquire(blocking=False)
            after = begun[0]
            time.sleep(0.001)
            assert begun[0] == after
            at_work.release()
            if passed[0] < at:
                break
    finally:
        faulthandler.cancel_dump_traceback_later()
    assert interrupted == at - 1 > 60


PRESSED_AGAIN = """
import os, signal, threading, time
import z3
from llfsm_verify import interrupts
from llfsm_verify.backends.smt import solver as asking

interrupts.serve(lambda: os._exit(9))
asking.LOOK_SECONDS = 0.01
done = []

def press():
    for _ in range(3):
        time.sleep(0.1)
        os.kill(os.getpid(), signal.SIGINT)

def work():
    threading.Thread(target=press).start()
    time.sleep(0.6)
    done.append(True)

try:
    asking.wait_for(work, z3.Context(), lambda: None)
except KeyboardInterrupt:
    told = list(done)
    while True:
        try:
            time.sleep(0.1)  # the later ones come now
            break
        except KeyboardInterrupt:
            pass
    print(*told)
"""


@pytest.mark.slow
def test_a_second_ctrl_c_waits_until_the_work_has_ended() -> None:
    done = subprocess.run([sys.executable, "-c", PRESSED_AGAIN], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("True\n", "")


def test_a_solver_that_gives_up_says_why_and_effort_that_is_spent_says_that() -> None:
    def asked(effort: asking.SolverBudget | None, rlimit: int | None = None) -> z3.ModelRef | None:
        context = z3.Context()
        a, b, c = (z3.Int(name, context) for name in "abc")
        solver = z3.Solver(ctx=context)
        solver.add(a * a * a + b * b * b == c * c * c + 2, a > 10, b > 10, c > 10, c != a, c != b)
        if rlimit is not None:
            solver.set("rlimit", rlimit)
        return asking.model_of(solver, lambda: None, effort)

    with pytest.raises(asking.GaveUp, match="the solver gave up: "):
        asked(None, 2_000)
    effort = asking.SolverBudget(2_000)
    with pytest.raises(asking.GaveUp, match="finds no answer with 2,000 units of work"):
        asked(effort)
    assert effort.left == 0 and effort.spent >= 2_000
    with pytest.raises(asking.GaveUp, match="finds no answer with 2,000 units of work"):
        asked(asking.SolverBudget(None, effort))  # a part of what is spent
    assert (
        asking.SolverBudget(5, asking.SolverBudget(3)).left == 3
        and asking.SolverBudget(3, asking.SolverBudget(5)).left == 3
    )
    assert asking.SolverBudget().left is None and asking.SolverBudget(None, asking.SolverBudget(4)).left == 4
