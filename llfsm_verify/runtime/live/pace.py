"""A clock outside of the run: each cycle begins when somebody says so, and the loop waits for it without a deadline.

`clock: external` of a port, on the command line:

    $ llfsm run models/komodo_stroll/arrangement.yaml --ports world.ports.yaml --for 60s --record run.rec
    240 cycles (240 ringlets), 60 s of logical time, in 0.31 s: stopped
    the clock was external: a port began each cycle
    $ llfsm run … --rate 2              --rate is about real time, and port `world` begins each cycle
    clock: extern                       `clock` of port `world` can only be `external`
    two ports with `clock: external`    two ports begin the cycles of the run

The supervisor lets a cycle begin; the loop, which returns where `control.ROUNDS` says, tells that it waits for the next
one (decision 71). Both are numbers in shared memory; descriptors only wake the other side, so that nothing is lost or
counted twice, whichever process of the run has the token.
"""

from __future__ import annotations

import os
import select
from contextlib import suppress

from llfsm_verify.runtime.live import control
from llfsm_verify.runtime.live.control import words
from llfsm_verify.runtime.live.loop import Loop

NAP = 50
"""Milliseconds that a loop waits at most before it looks whether it is told to stop."""
BEGUN, WAITED = range(2)


class Pace:
    """How cycles of a run begin from outside. Make it before processes of the run are forked.

    `rounds`: the run is `over` after so many cycles; negative: never.
    """

    def __init__(self, rounds: int = -1) -> None:
        self._rounds = rounds
        self._numbers = words(2)
        """Cycles that have begun, and how many had when the loop began to wait for the next."""
        self._begins, self._waits = (os.eventfd(0, os.EFD_CLOEXEC | os.EFD_NONBLOCK) for _ in range(2))
        self.descriptors = (self._begins, self._waits)
        """What a process needs that runs the loop."""
        self.under_way = False
        self._poll = select.poll()
        self._poll.register(self._begins, select.POLLIN)

    # ------------------------------------------------------------ in the supervisor

    @property
    def next(self) -> int:
        """The number of the cycle that begins next: what `live.frame.CYCLE` of its frames is going to be."""
        return self._numbers[BEGUN]

    @property
    def over(self) -> bool:
        """Whether no cycle is to come."""
        return self.next == self._rounds and not self.under_way

    def begin(self) -> None:
        """Let the next cycle begin; none may be under way."""
        assert not self.under_way, "the loop has told that it waits"
        self.under_way = True
        self._numbers[BEGUN] += 1
        os.eventfd_write(self._begins, 1)

    def fileno(self) -> int:
        """Readable when `ended` has something to say."""
        return self._waits

    def ended(self) -> bool:
        """Whether the cycle under way has ended; it is said once."""
        with suppress(BlockingIOError):
            os.eventfd_read(self._waits)
        if not self.under_way or self._numbers[WAITED] != self.next:
            return False
        self.under_way = False
        return True

    def close(self) -> None:
        """The loop must not run any more."""
        for descriptor in self.descriptors:
            os.close(descriptor)

    # ------------------------------------------------------------ where the loop runs

    def wait(self, loop: Loop) -> None:
        """Wait until the next cycle may begin, or the loop is told to stop."""
        block, numbers = loop.control, self._numbers
        begun = numbers[WAITED] = block[control.ROUNDS]
        os.eventfd_write(self._waits, 1)
        while numbers[BEGUN] == begun and not block[control.STOP]:
            self._poll.poll(NAP)
            with suppress(BlockingIOError):
                os.eventfd_read(self._begins)
        block[control.ROUNDS] = numbers[BEGUN]
