"""Starts runs for tests of signals: one process that has everything loaded, and forks one more for each run.

It reads lines of JSON. `[KIND, ARRANGEMENT, WHITEBOARD, PORTS, SAID, FOLDER]` is answered with the number of the new
process, and `null` with how that one ended or was suspended (the status of `os.waitpid`). KIND is ``command``
(`llfsm run`), or ``thread`` or ``separate``: a Python program that waits. What it says goes to the file SAID; its
whiteboard is in FOLDER.
"""

from __future__ import annotations

import ctypes
import json
import os
import signal
import sys
import time
import traceback
from typing import Literal, cast

import llfsm_verify as lv
from llfsm_verify import cli
from llfsm_verify.runtime.swapping.check_process import PR_SET_PDEATHSIG


def run(kind: str, arrangement: str, name: str, ports: str) -> int:
    """What the process does; its exit code."""
    if kind == "command":
        return cli.main(["run", arrangement, "--whiteboard", name, "--ports", ports])
    processes = cast(Literal["thread", "separate"], kind)
    with lv.load(arrangement).run(whiteboard=name, processes=processes):
        print("begun", flush=True)
        while True:
            time.sleep(1)


def start(kind: str, arrangement: str, name: str, ports: str, said: str, folder: str) -> int:
    """The number of a process, in a group of its own, which runs it."""
    pid = os.fork()
    if pid:
        return pid
    status = 70
    try:
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)  # it does not outlive a test that is ended
        os.setpgid(0, 0)  # of the same session, so that a terminal could suspend it
        os.environ["LLFSM_WHITEBOARDS"] = folder
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        output = os.open(said, os.O_CREAT | os.O_WRONLY)
        os.dup2(output, 1)
        os.dup2(output, 2)
        status = run(kind, arrangement, name, ports)
    except BaseException:  # noqa: BLE001 - what it says is looked at
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)


if __name__ == "__main__":
    for number in signal.valid_signals():  # as at a terminal, however the tests were started
        if signal.getsignal(number) is signal.SIG_IGN and number not in (signal.SIGPIPE, signal.SIGXFSZ):
            signal.signal(number, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    pid = 0
    for line in sys.stdin:
        if (asked := json.loads(line)) is None:
            print(os.waitpid(pid, os.WUNTRACED)[1], flush=True)
        else:
            pid = start(*asked)
            print(pid, flush=True)
