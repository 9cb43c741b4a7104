"""Clients of a page's server that say exactly what a test wants, byte by byte."""

from __future__ import annotations

import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any
from urllib.parse import parse_qs, urlsplit

SECONDS = 20.0


@dataclass(frozen=True)
class Answer:
    status: int
    headers: dict[str, str]
    body: bytes

    @property
    def text(self) -> str:
        return self.body.decode()


@dataclass(frozen=True)
class Address:
    """What a server told: where it is, and its token."""

    port: int
    token: str

    @staticmethod
    def of(line: str) -> Address:
        url = urlsplit(line.split(maxsplit=1)[0])
        assert (url.scheme, url.hostname, url.path) == ("http", "127.0.0.1", "/")
        assert url.port is not None
        return Address(url.port, parse_qs(url.query)["token"][0])

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}/?token={self.token}"

    @property
    def cookie(self) -> str:
        return f"llfsm-{self.port}={self.token}"

    def call(self) -> socket.socket:
        return socket.create_connection(("127.0.0.1", self.port), SECONDS)

    def request(
        self, path: str, *lines: str, method: str = "GET", host: str | None = None, cookie: bool = True
    ) -> bytes:
        own = [f"Host: {host or f'127.0.0.1:{self.port}'}", *([f"Cookie: {self.cookie}"] if cookie else [])]
        return "\r\n".join([f"{method} {path} HTTP/1.1", *own, *lines, "", ""]).encode()

    def ask(self, path: str, *lines: str, **how: Any) -> Answer:
        return self.send(self.request(path, *lines, **how))

    def send(self, request: bytes) -> Answer:
        with self.call() as connection:
            connection.sendall(request)
            return answer(b"".join(iter(lambda: connection.recv(1 << 16), b"")))

    @contextmanager
    def stream(self, path: str = "/events", *lines: str) -> Iterator[Iterator[tuple[str, str, Any]]]:
        """The events as they come: kind, id, JSON."""
        with self.call() as connection:
            connection.sendall(self.request(path, *lines))
            with connection.makefile("rb") as file:
                if not (first := file.readline()):
                    raise ConnectionResetError
                assert first.split()[1] == b"200"
                while file.readline().strip():
                    pass
                yield events(line.decode().rstrip("\n") for line in file)


def answer(data: bytes) -> Answer:
    head, _, body = data.partition(b"\r\n\r\n")
    first, *lines = head.decode().split("\r\n")
    pairs = (line.partition(": ") for line in lines)
    return Answer(int(first.split()[1]), {name.lower(): value for name, _, value in pairs}, body)


def events(lines: Iterator[str]) -> Iterator[tuple[str, str, Any]]:
    """Of a stream of server-sent events, as the standard reads them."""
    kind, number, data = "message", "", []
    for line in lines:
        name, _, value = line.partition(":")
        value = value.removeprefix(" ")
        if name == "event":
            kind = value
        elif name == "id":
            number = value
        elif name == "data":
            data.append(value)
        elif not line and data:
            yield kind, number, json.loads("\n".join(data))
            kind, data = "message", []


@contextmanager
def served(serve: Callable[[Callable[[str], None], threading.Event], None]) -> Iterator[Address]:
    """A server on a thread until the end of the context; its threads must end with it."""
    told: list[str] = []
    ended, ready = threading.Event(), threading.Event()
    failed: list[BaseException] = []

    def tell(line: str) -> None:
        told.append(line)
        ready.set()

    def run() -> None:
        try:
            serve(tell, ended)
        except BaseException as error:
            failed.append(error)
            raise
        finally:
            ready.set()

    before = ours()
    thread = threading.Thread(target=run)
    thread.start()
    try:
        assert ready.wait(SECONDS)
        assert not failed
        yield Address.of(told[0])
    finally:
        ended.set()
        thread.join(SECONDS)
        assert not thread.is_alive()
    wait_until(lambda: ours() <= before)


def ours() -> set[threading.Thread]:
    """The threads of servers of pages."""
    return {thread for thread in threading.enumerate() if thread.name.startswith("llfsm-view")}


def wait_until(holds: Callable[[], object], seconds: float = SECONDS) -> None:
    until = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < until, "it has not come true"
        time.sleep(0.005)
