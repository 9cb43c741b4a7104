"""Ctrl-C at any moment ends with one word and 130: never a traceback, never another error that it turned into."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import pytest

from tests.cli.running import LIGHTS, PROPERTIES
from tests.processes import ended

# What the console script does, with a word when Ctrl-C is served: before that, it is Python's own (docs/warts.md).
SCRIPT = """
import os, sys
from llfsm_verify.cli import main
from llfsm_verify.cli.io import interrupt

def serve(served=interrupt.serve):
    served()
    os.write(1, b"up\\n")

interrupt.serve = serve
sys.exit(main())
"""


def interrupted_after(seconds: float, *arguments: str) -> tuple[int, str, str]:
    command = [sys.executable, "-c", SCRIPT, *arguments]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None and process.stdout.readline() == "up\n"
    time.sleep(seconds)
    process.send_signal(signal.SIGINT)
    output, errors = ended(process)
    return process.returncode, output, errors


@pytest.mark.long
def test_forty_moments_of_the_start():
    for moment in range(40):
        code, output, errors = interrupted_after(moment * 0.3 / 40, "verify", LIGHTS, PROPERTIES)
        # Done already, or a partial result, beside which nothing is said; or the result was just out.
        if output:
            assert (code, errors) in ((0, ""), (130, ""), (130, "interrupted\n")), moment
        else:
            assert (code, errors) == (130, "interrupted\n"), moment


def test_an_interrupt_that_the_caller_ignores_stays_ignored():
    quiet = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN); " + SCRIPT
    process = subprocess.Popen(
        [sys.executable, "-c", quiet, "schema", "result"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None and process.stdout.readline() == "up\n"
    process.send_signal(signal.SIGINT)
    output, errors = ended(process)
    assert process.returncode == 0 and '"$schema"' in output and errors == ""


def test_a_program_that_calls_us_keeps_its_own_handler():
    from llfsm_verify import cli

    before = signal.getsignal(signal.SIGINT)
    assert cli.main(["schema", "machine"]) == 0
    assert signal.getsignal(signal.SIGINT) is before


PRESSED_ONCE = """
import ctypes, gc, os, signal, threading, time, weakref
from concurrent import futures
from llfsm_verify.cli.io import interrupt
interrupt.serve()

def press():
    os.kill(os.getpid(), signal.SIGINT)
    for _ in range(1000):
        pass
    print("went on", end=", ")

class Argument:
    @classmethod
    def from_param(cls, value):
        press()
        return ctypes.c_int(value)

class Destroyed:
    def __del__(self):
        press()

class Constructed:
    def __init__(self):
        press()
        self.whole = True
    def __del__(self):
        assert self.whole

class Collected:
    pass

class Pressing:
    def __init__(self):
        self.lock = threading.Lock()
        self.acquire, self.release = self.lock.acquire, self.lock.release
    def __enter__(self):
        self.acquire()
        press()
    def __exit__(self, *_):
        self.release()

def convert():
    call = ctypes.CDLL(None).abs
    call.argtypes = [Argument]
    assert call(-3) == 3

def destroy():
    Destroyed()

def construct():
    Constructed()

def lock():
    pressing = Pressing()
    try:
        with threading.Condition(pressing):
            time.sleep(1)
    finally:
        assert pressing.acquire(blocking=False)

def wait():
    lock = threading.Lock()
    class Lock:
        pressed = False
        release, __exit__ = lock.release, lock.__exit__
        def __enter__(self):
            lock.acquire()
        def acquire(self, *how):
            taken = lock.acquire(*how)
            if not self.pressed:
                self.pressed = True
                press()
            return taken
    future = futures.Future()
    future._condition = threading.Condition(Lock())
    try:
        futures.wait([future], 1)
        time.sleep(1)
    finally:
        assert lock.acquire(blocking=False)

def forget():
    collected = Collected()
    weakref.finalize(collected, press)

def told(phase, _):
    if phase == "stop":
        press()

def collect():
    gc.disable()
    gc.callbacks.append(told)
    gc.collect()
    gc.callbacks.remove(told)

try:
    DO()
    while True:
        time.sleep(1)
except KeyboardInterrupt:
    print("as itself")
"""


@pytest.mark.parametrize("what", ["convert", "destroy", "construct", "lock", "wait", "forget", "collect"])
def test_an_interrupt_waits_where_it_would_be_lost_or_break_something(what: str):
    """Ctypes makes `ArgumentError` of it, Python forgets it, a destructor misses an attribute, a lock stays taken."""
    script = PRESSED_ONCE.replace("DO", what)
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "went on, as itself\n", "")


def test_an_interrupt_in_a_callback_is_not_swallowed():
    """No frame shows that Python would forget the exception here."""
    script = (
        "import os, signal, weakref\n"
        "from llfsm_verify.cli.io import interrupt\n"
        "interrupt.serve()\n"
        "class Held: pass\n"
        "def press(_):\n"
        "    os.kill(os.getpid(), signal.SIGINT)\n"
        "    for _ in range(1000): pass\n"
        "held = Held()\n"
        "told = weakref.ref(held, press)\n"
        "del held\n"
        "print('went on')\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "interrupted\n")


def test_nothing_is_imported_before_the_handler_stands():
    script = (
        "import os, sys, __future__; old = set(sys.modules); import llfsm_verify.cli; print(*set(sys.modules) - old)"
    )
    done = subprocess.run([sys.executable, "-S", "-c", script], capture_output=True, text=True, check=True)
    assert sorted(done.stdout.split()) == ["llfsm_verify", "llfsm_verify.cli"]
