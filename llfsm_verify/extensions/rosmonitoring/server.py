"""The server: a monitor for each connection, until a signal ends it."""

from __future__ import annotations

import asyncio
import logging
import os
import re
import signal
from collections.abc import Callable
from contextlib import suppress
from http import HTTPStatus
from typing import TYPE_CHECKING

from websockets.asyncio.server import ServerConnection
from websockets.asyncio.server import serve as listen
from websockets.exceptions import ConnectionClosed

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.rosmonitoring.answers import Monitor
from llfsm_verify.extensions.rosmonitoring.codes import DEAF
from llfsm_verify.plug import LogReading

if TYPE_CHECKING:
    from websockets.http11 import Request, Response

LOCAL = re.compile(r"https?://(localhost|127(\.\d{1,3}){3}|\[::1\])(:\d{1,5})?", re.IGNORECASE)
"""Origins of pages that are on this computer."""
QUIET = logging.getLogger(f"{__name__}.library")
"""What the library says of wrong handshakes, with tracebacks, goes nowhere."""
LARGEST = 1 << 20
"""Bytes of a message; a connection with a longer one is closed (code 1009)."""
SECONDS = 1.0
"""How long a client may take to close its connection when the server ends."""


def serve(reading: LogReading, host: str, port: int, *, filtering: bool, tell: Callable[[str], None]) -> None:
    """See `Oracle`. DiagnosticError (E550)."""

    QUIET.disabled = True
    said: set[str] = set()
    refused: set[str] = set()

    def say(line: str) -> None:
        with suppress(OSError):  # nobody reads it
            tell(f"note: {line}")

    def admit(client: ServerConnection, request: Request) -> Response | None:
        """A page in a browser says where it is from, and may call this computer from anywhere: it is refused."""
        foreign = next((origin for origin in request.headers.get_all("Origin") if not LOCAL.fullmatch(origin)), None)
        if foreign is None:
            return None
        if not refused:
            refused.add(foreign)
            say(f"a page from `{foreign[:100]}` was refused, and so are all that are not from this computer")
        return client.respond(HTTPStatus.FORBIDDEN, "pages from elsewhere get no verdicts\n")

    async def converse(client: ServerConnection) -> None:
        monitor = Monitor(reading, say, said, filtering=filtering)
        try:
            async for message in client:
                await client.send(monitor.answer(message))
        except ConnectionClosed:
            return

    async def run() -> None:
        ended = asyncio.Event()
        server = await listen(
            converse, host, port, process_request=admit, max_size=LARGEST, close_timeout=SECONDS, logger=QUIET
        )
        for number in (signal.SIGINT, signal.SIGTERM):
            asyncio.get_running_loop().add_signal_handler(number, ended.set)
        address, free = server.sockets[0].getsockname()[:2]
        tell(f"listening on ws://{f'[{address}]' if ':' in address else address}:{free}")
        await ended.wait()
        server.close()
        with suppress(TimeoutError):  # somebody has not said all of a handshake
            await asyncio.wait_for(server.wait_closed(), 2 * SECONDS)

    try:
        asyncio.run(run())
    except OSError as error:
        number = error.errno or 0
        reason = os.strerror(number) if number > 0 else error.strerror
        message = f"it cannot listen on {host}:{port}: {reason}"
        hint = "name another port, or 0 for a free one, and an address of this computer"
        raise DiagnosticError(Diagnostic(DEAF, message, hint=hint)) from None
