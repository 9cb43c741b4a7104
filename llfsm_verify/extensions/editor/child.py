"""A child process that reads and checks, so that the server never waits: it is ended when it takes too long.

Messages are pickled values with their length before them. What it asks is `Asked` or `Wanted`; it answers with any
number of `Told`, and then with a result or a `Failed`.
"""

from __future__ import annotations

import asyncio
import os
import pickle
import struct
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import BinaryIO

HEAD = struct.Struct("<Q")


@dataclass(frozen=True, slots=True)
class Told:
    """How far it is, in words."""

    text: str


@dataclass(frozen=True, slots=True)
class Failed:
    """It found a mistake of ours; the text is for people."""

    text: str


@dataclass(frozen=True, slots=True)
class Job:
    """What a child is asked, with the texts that it reads in the place of files, by their real paths."""

    asked: object
    texts: Mapping[str, bytes] = field(default_factory=dict)


class Gone(Exception):
    """The child took too long, or ended by itself; the message says which."""


class Child:
    """The server's side: one job at a time; the process is started when it is first needed, and again after its end."""

    def __init__(self, folder: str) -> None:
        self.folder = folder
        self.turn = asyncio.Lock()
        self._process: asyncio.subprocess.Process | None = None

    async def ask(self, job: Job, seconds: float | None, told: Callable[[str], None] = lambda _: None) -> object:
        """The answer to a job. Gone; what cancels this ends the child."""
        async with self.turn:
            process = await self._started()
            try:
                return await asyncio.wait_for(self._answer(process, job, told), seconds)
            except TimeoutError:
                await self.close()
                raise Gone(f"it takes longer than {seconds:g} s") from None
            except (asyncio.IncompleteReadError, OSError):
                await self.close()
                raise Gone("the process that reads the files has ended") from None
            except asyncio.CancelledError:
                await self.close()
                raise

    async def _answer(self, process: asyncio.subprocess.Process, job: Job, told: Callable[[str], None]) -> object:
        assert process.stdin is not None
        assert process.stdout is not None
        data = pickle.dumps(job)
        process.stdin.write(HEAD.pack(len(data)) + data)
        await process.stdin.drain()
        while True:
            (length,) = HEAD.unpack(await process.stdout.readexactly(HEAD.size))
            answer = pickle.loads(await process.stdout.readexactly(length))  # noqa: S301 - of our own child
            if not isinstance(answer, Told):
                return answer
            told(answer.text)

    async def _started(self) -> asyncio.subprocess.Process:
        if self._process is None or self._process.returncode is not None:
            # -P: modules of the folder in which the user works are not ours.
            words = (sys.executable, "-P", "-c", f"from {__name__} import serve; serve()")
            pipe, nowhere = asyncio.subprocess.PIPE, asyncio.subprocess.DEVNULL
            self._process = await asyncio.create_subprocess_exec(
                *words, stdin=pipe, stdout=pipe, stderr=nowhere, cwd=self.folder or None
            )
        return self._process

    async def close(self) -> None:
        """End the process."""
        process, self._process = self._process, None
        if process is not None and process.returncode is None:
            with suppress(ProcessLookupError):
                process.kill()
            await process.wait()


# ---------------------------------------------------------------- in the child


def serve() -> None:
    """Answer jobs until there are no more. What is printed meanwhile goes nowhere."""
    incoming, outgoing = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nowhere = os.open(os.devnull, os.O_RDWR)
    os.dup2(nowhere, 0)
    os.dup2(nowhere, 1)
    while (job := _received(incoming)) is not None:
        _send(outgoing, _done(job, lambda text: _send(outgoing, Told(text))))


def _done(job: Job, tell: Callable[[str], None]) -> object:
    from llfsm_verify.extensions.editor.checking import Wanted, check
    from llfsm_verify.extensions.editor.findings import Asked, find_all
    from llfsm_verify.plug import UNSAVED

    token = UNSAVED.set(job.texts)
    try:
        if isinstance(job.asked, Asked):
            return find_all(job.asked)
        assert isinstance(job.asked, Wanted)
        return check(job.asked, tell)
    except Exception as error:  # noqa: BLE001 - the server goes on, and says it
        place = error.__traceback__
        while place is not None and place.tb_next is not None:
            place = place.tb_next
        where = "" if place is None else f" ({place.tb_frame.f_code.co_name}, line {place.tb_lineno})"
        return Failed(f"internal error: {type(error).__name__}: {' '.join(str(error).split())[:300]}{where}")
    finally:
        UNSAVED.reset(token)


def _received(file: BinaryIO) -> Job | None:
    head = file.read(HEAD.size)
    if len(head) < HEAD.size:
        return None
    found = pickle.loads(file.read(HEAD.unpack(head)[0]))  # noqa: S301 - of our own parent
    assert isinstance(found, Job)
    return found


def _send(file: BinaryIO, value: object) -> None:
    data = pickle.dumps(value)
    file.write(HEAD.pack(len(data)) + data)
    file.flush()
