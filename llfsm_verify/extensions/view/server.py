"""A page on 127.0.0.1 for whoever has its token: no other page, user or host name gets anything from it."""

from __future__ import annotations

import base64
import hashlib
import hmac
import io
import json
import os
import re
import secrets
import signal
import socket
import socketserver
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import parse_qs, urlsplit

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.view.codes import DEAF
from llfsm_verify.extensions.view.page import page_html

HOST = "127.0.0.1"
NAMES = (HOST, "localhost")
THREADS = "llfsm-view"
"""The name of threads."""
MOST = 32
"""Connections at once; a browser has at most six to one server."""
LONGEST = 1 << 15
"""Bytes of a request."""
SECONDS = 5.0
"""How long a request may take to come, a write to be taken, and the server to end."""
BUFFER = 1 << 16
"""Bytes that the system keeps for a client that reads slowly: what it reads then is not old."""
ROWS = 5000
"""Rows of the first window."""
MOST_ROWS = 100_000
"""Rows of a window."""
SAFE = {
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "X-Frame-Options": "DENY",
    "Cache-Control": "no-store",
}
SCRIPT = re.compile(r"<script(?![^>]*application/json)[^>]*>(.*?)</script>", re.DOTALL)

Events = Callable[[str], Iterator[bytes]]


@dataclass(frozen=True, slots=True)
class Site:
    """What a server shows. Its functions are called by several threads, and may raise DiagnosticError."""

    page: Callable[[], str]
    window: Callable[[int, int], str] | None = None
    """The JSON of a document with the rows of the whole run from the first to the last."""
    events: Events | None = None
    """The stream after the event of this name, or from its query's; it ends when the server does."""
    stop: Callable[[], None] = lambda: None
    """Ends the streams."""


def serve_document(
    make_document: Callable[[int, int], dict[str, object]],
    title: str,
    tell: Callable[[str], None],
    *,
    port: int = 0,
    ended: threading.Event | None = None,
) -> None:
    """Serve a page of a document, of which it asks other windows, until Ctrl-C, SIGTERM, or `ended`.

    `make_document` gets the first and the last row, from 0; it is called by one thread at a time. DiagnosticError
    (E554), and what it raises for the first window.
    """
    lock = threading.Lock()

    def window(first: int, last: int) -> dict[str, object]:
        with lock:
            return make_document(first, last)

    first = page_html(window(0, ROWS - 1), {"window": "/window"})
    serve(Site(lambda: first, lambda *rows: json.dumps(window(*rows))), title, tell, port=port, ended=ended)


def serve(
    site: Site, title: str, tell: Callable[[str], None], *, port: int = 0, ended: threading.Event | None = None
) -> None:
    """Tell the address, and serve until Ctrl-C, SIGTERM, or `ended`. DiagnosticError (E554): it cannot listen."""
    try:
        server = Server(site, port)
    except (OSError, OverflowError) as error:
        number = getattr(error, "errno", None)
        reason = os.strerror(number) if number else "there is no such port"
        message = f"it cannot listen on {HOST}:{port}: {reason}"
        raise DiagnosticError(Diagnostic(DEAF, message, hint="name another port, or 0 for a free one")) from None
    thread = threading.Thread(target=server.serve_forever, args=(0.1,), name=THREADS, daemon=True)
    with _until_told() if ended is None else nullcontext(ended.wait) as wait:
        thread.start()
        try:
            tell(f"{server.address} shows {title}; Ctrl-C ends it")
            wait()
        finally:
            site.stop()
            server.end()
            thread.join()


@contextmanager
def _until_told() -> Iterator[Callable[[], object]]:
    """What waits for Ctrl-C or SIGTERM. Ctrl-C stays ignored where the caller ignores it.

    A signal is noted in the socket before Python knows of it, so none is missed that comes as the waiting begins.
    """
    told, noted = socket.socketpair()
    noted.setblocking(False)
    earlier = signal.set_wakeup_fd(noted.fileno(), warn_on_full_buffer=False)
    before = {
        number: signal.signal(number, lambda *_: None)
        for number in (signal.SIGINT, signal.SIGTERM)
        if signal.getsignal(number) is not signal.SIG_IGN
    }

    def wait() -> None:
        while told.recv(1)[0] not in before:
            pass  # another signal

    try:
        yield wait
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        signal.set_wakeup_fd(earlier)
        told.close()
        noted.close()


class Server(ThreadingHTTPServer):
    """Listens for a site; OSError, OverflowError: it cannot on this port."""

    daemon_threads = True

    def __init__(self, site: Site, port: int) -> None:
        self.site = site
        self.token = secrets.token_urlsafe(24)
        self._open: dict[socket.socket, threading.Thread] = {}
        self._lock = threading.Lock()
        super().__init__((HOST, port), _Handler)
        self.hosts = {f"{name}:{self.server_port}" for name in NAMES}
        self.cookie = f"llfsm-{self.server_port}"  # a browser has the same cookies for all ports

    def server_bind(self) -> None:
        """Bind without asking for the name of the host."""
        socketserver.TCPServer.server_bind(self)
        self.server_name, self.server_port = HOST, self.server_address[1]

    @property
    def address(self) -> str:
        """Of the first page."""
        return f"http://{HOST}:{self.server_port}/?token={self.token}"

    def process_request(self, request: socket.socket | tuple[bytes, socket.socket], client_address: object) -> None:
        """Answer on a thread of its own; one connection too many is told so."""
        assert isinstance(request, socket.socket)
        thread = threading.Thread(target=self._converse, args=(request, client_address), name=THREADS, daemon=True)
        with self._lock:
            full = len(self._open) >= MOST
            if not full:
                self._open[request] = thread
        if full:
            with suppress(OSError):
                request.setblocking(False)
                request.send(b"HTTP/1.0 503 Service Unavailable\r\nRetry-After: 5\r\n\r\ntoo many connections\n")
            self.shutdown_request(request)
            return
        thread.start()

    def _converse(self, request: socket.socket, client_address: object) -> None:
        try:
            self.process_request_thread(request, client_address)
        finally:
            with self._lock:
                self._open.pop(request, None)

    def handle_error(self, request: socket.socket | tuple[bytes, socket.socket], client_address: object) -> None:
        """A client that is gone or slow is nothing to speak of."""
        if not isinstance(sys.exc_info()[1], OSError):
            super().handle_error(request, client_address)

    def end(self) -> None:
        """Accept no one any more, and end the connections with their threads."""
        self.shutdown()
        self.server_close()
        with self._lock:
            left = dict(self._open)
        for request in left:
            with suppress(OSError):
                request.shutdown(socket.SHUT_RDWR)
        until = time.monotonic() + SECONDS
        for thread in left.values():
            thread.join(max(0.0, until - time.monotonic()))


class _Handler(BaseHTTPRequestHandler):
    """Answers one request; the connection ends with it."""

    server: Server
    too_long = False

    def setup(self) -> None:
        """Read the whole request first, so that one that does not end is not waited for."""
        self.request.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER)
        super().setup()
        self.rfile.close()
        self.rfile = io.BytesIO(self._head())
        self.request.settimeout(SECONDS)

    def _head(self) -> bytes:
        """The request with its empty line; another one in place of a longer one; nothing, if it does not end."""
        head, until = b"", time.monotonic() + SECONDS
        while b"\r\n\r\n" not in head and len(head) <= LONGEST:
            self.request.settimeout(max(0.001, until - time.monotonic()))
            try:
                piece = self.request.recv(LONGEST)
            except OSError:
                return b""
            if not piece or time.monotonic() > until:
                return b""
            head += piece
        self.too_long = len(head) > LONGEST
        return b"GET / HTTP/1.0\r\n\r\n" if self.too_long else head

    def version_string(self) -> str:
        """What the server calls itself."""
        return "llfsm"

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002 - it is called so
        """Nothing is logged: addresses have the token."""

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:  # noqa: ARG002
        """What the library finds wrong with a request, in one line."""
        if code == HTTPStatus.NOT_IMPLEMENTED:
            self._say(HTTPStatus.METHOD_NOT_ALLOWED, "only GET and HEAD are served", Allow="GET, HEAD")
        else:
            self._say(HTTPStatus(code), message or HTTPStatus(code).phrase)

    def do_HEAD(self) -> None:
        """As GET, without what it would say."""
        self.do_GET()

    def do_GET(self) -> None:
        """Answer, if the client may ask."""
        if not self.path.startswith("/"):
            self._say(HTTPStatus.BAD_REQUEST, "a request names a path of this server")
            return
        asked = urlsplit(self.path)
        given = {name: values[-1] for name, values in parse_qs(asked.query).items()}
        site, why = self.server.site, self._foreign()
        if self.too_long:
            self._say(HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE, f"a request has at most {LONGEST:,} bytes")
        elif why is not None:
            self._say(HTTPStatus.FORBIDDEN, f"{why} is refused: paste the address that llfsm view told into a new tab")
        elif not self._may_read(given.get("token") if asked.path == "/" else None):
            self._say(HTTPStatus.FORBIDDEN, "open the address that llfsm view told, with its token")
        elif asked.path == "/":
            self._page(site.page)
        elif asked.path == "/window" and site.window is not None:
            self._window(site.window, given)
        elif asked.path == "/events" and site.events is not None:
            self._stream(site.events, self.headers.get("Last-Event-ID") or given.get("after", ""))
        else:
            self._say(HTTPStatus.NOT_FOUND, "there is no such page")

    def _foreign(self) -> str | None:
        """From where the request is, if not from this page or the address bar."""
        hosts = [host.lower() for host in self.headers.get_all("Host", [])]
        if len(hosts) != 1 or hosts[0] not in self.server.hosts:
            return "another host name"
        if any(
            origin.removeprefix("http://") not in self.server.hosts for origin in self.headers.get_all("Origin", [])
        ):
            return "a page from elsewhere"
        if any(site not in ("none", "same-origin") for site in self.headers.get_all("Sec-Fetch-Site", [])):
            return "a page from elsewhere"  # also from another port of this computer, which gets our cookies
        return None

    def _may_read(self, token: str | None) -> bool:
        pairs = [pair.strip().partition("=") for line in self.headers.get_all("Cookie", []) for pair in line.split(";")]
        given = [value for name, _, value in pairs if name == self.server.cookie]
        known = self.server.token.encode()
        return any(hmac.compare_digest(one.encode(errors="replace"), known) for one in (*given, token or ""))

    def _page(self, page: Callable[[], str]) -> None:
        text = self._made(page)
        if text is not None:
            cookie = f"{self.server.cookie}={self.server.token}; HttpOnly; SameSite=Strict; Path=/"
            policy = {"Set-Cookie": cookie, "Content-Security-Policy": policy_of(text)}
            self._answer(HTTPStatus.OK, "text/html; charset=utf-8", text.encode(), **policy)

    def _window(self, window: Callable[[int, int], str], given: dict[str, str]) -> None:
        try:
            first, last = (int(given.get(name, "")) for name in ("first", "last"))
        except ValueError:
            first, last = 0, -1
        if not 0 <= first <= last < first + MOST_ROWS:
            self._say(HTTPStatus.BAD_REQUEST, f"/window?first=0&last=999 asks for rows, at most {MOST_ROWS:,}")
            return
        text = self._made(lambda: window(first, last))
        if text is not None:
            self._answer(HTTPStatus.OK, "application/json", text.encode())

    def _made(self, make: Callable[[], str]) -> str | None:
        """What a site gives; None: it cannot, and the client is told why."""
        try:
            return make()
        except DiagnosticError as error:
            self._say(HTTPStatus.INTERNAL_SERVER_ERROR, error.diagnostics[0].message)
            return None

    def _stream(self, events: Events, after: str) -> None:
        self._begin(HTTPStatus.OK, "text/event-stream")
        if self.command != "HEAD":
            for event in events(after):
                self.wfile.write(event)

    def _say(self, status: HTTPStatus, words: str, **headers: str) -> None:
        self._answer(status, "text/plain; charset=utf-8", f"{words}\n".encode(), **headers)

    def _answer(self, status: HTTPStatus, kind: str, body: bytes, **headers: str) -> None:
        self._begin(status, kind, **{"Content-Length": str(len(body))}, **headers)
        if self.command != "HEAD":
            self.wfile.write(body)

    def _begin(self, status: HTTPStatus, kind: str, **headers: str) -> None:
        self.send_response(status)
        for name, value in {
            "Content-Security-Policy": "default-src 'none'",
            **SAFE,
            "Content-Type": kind,
            **headers,
        }.items():
            self.send_header(name, value)
        self.end_headers()


def policy_of(page: str) -> str:
    """A policy by which a page runs its own scripts only, has its own styles, and asks its server only."""
    digests = (base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in SCRIPT.findall(page))
    scripts = " ".join(f"'sha256-{digest}'" for digest in digests) or "'none'"
    return (
        f"default-src 'none'; script-src {scripts}; style-src 'unsafe-inline'; connect-src 'self'; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    )
