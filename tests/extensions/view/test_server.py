"""The server of pages: who may ask, what clients that do not keep to the rules can do, and how it ends."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator

import pytest

from llfsm_verify import DiagnosticError
from llfsm_verify.extensions.view import server
from llfsm_verify.extensions.view.server import Site, policy_of, serve, serve_document
from tests.extensions.view.clients import Address, answer, ours, served, wait_until

PAGE = "<!doctype html><style>p { color: red }</style><p>hello</p><script>1</script>"


def window(first: int, last: int) -> str:
    if first == 13:
        raise DiagnosticError([server.Diagnostic("E551", "the file is gone")])
    return json.dumps([first, last])


def endless(after: str) -> Iterator[bytes]:
    """As many events as are taken."""
    yield f"id: {after}\ndata: 0\n\n".encode()
    while True:
        yield b"data: " + b"1" * 100_000 + b"\n\n"


SITE = Site(lambda: PAGE, window, endless)


@pytest.fixture(scope="module")
def address() -> Iterator[Address]:
    with served(lambda tell, ended: serve(SITE, "a test", tell, ended=ended)) as found:
        yield found


def test_the_first_page_is_told_and_gives_a_cookie(address):
    page = address.ask(f"/?token={address.token}", cookie=False)
    assert (page.status, page.text) == (200, PAGE)
    assert page.headers["content-type"] == "text/html; charset=utf-8"
    assert page.headers["set-cookie"] == f"{address.cookie}; HttpOnly; SameSite=Strict; Path=/"
    assert len(address.token) == 32
    assert address.ask("/").text == PAGE
    assert json.loads(address.ask("/window?first=3&last=9").text) == [3, 9]


def test_head_says_what_get_would_but_its_body(address):
    got, head = address.ask("/window?first=0&last=1"), address.ask("/window?first=0&last=1", method="HEAD")
    assert (head.status, head.body) == (200, b"")
    assert head.headers["content-length"] == got.headers["content-length"] == str(len(got.body))
    assert address.ask("/events", method="HEAD").headers["content-type"] == "text/event-stream"


@pytest.mark.parametrize("path", ["/", "/window?first=0&last=9", "/events", "/none", "//", "/?token=", "/?token=ü"])
def test_nothing_is_served_without_the_token(address, path):
    refused = address.ask(path, cookie=False)
    assert refused.status == 403
    assert "with its token" in refused.text
    assert "set-cookie" not in refused.headers


@pytest.mark.parametrize("cookie", ["x", "", "ü", "a=b; c", "=", 'llfsm-1="x"', "llfsm-{port}={wrong}", "{token}"])
def test_another_cookie_is_no_token(address, cookie):
    text = cookie.format(port=address.port, token=address.token, wrong=address.token[:-1])
    assert address.ask("/", f"Cookie: {text}", cookie=False).status == 403


def test_cookies_of_other_servers_do_not_matter(address):
    """A browser sends the cookies of all ports of this computer."""
    line = f'Cookie: x="; {{]; {address.cookie} ; _xsrf=2|1'
    assert address.ask("/", line, cookie=False).status == 200


def test_the_token_counts_only_for_the_page(address):
    """An address with a token stands in histories: nothing else has one."""
    assert address.ask(f"/window?first=0&last=1&token={address.token}", cookie=False).status == 403


@pytest.mark.parametrize(
    "host", ["evil.example", "127.0.0.1", "127.0.0.1:1", "localhost.evil.example:{port}", "[::1]:{port}"]
)
def test_a_foreign_host_is_refused(address, host):
    """A name of someone else that leads to 127.0.0.1 (DNS rebinding) has none of our cookies, and gets nothing."""
    refused = address.ask(f"/?token={address.token}", host=host.format(port=address.port))
    assert refused.status == 403
    assert PAGE not in refused.text
    assert address.ask("/", host=f"LOCALHOST:{address.port}").status == 200


def test_one_host_must_be_named(address):
    assert address.send(f"GET / HTTP/1.1\r\nCookie: {address.cookie}\r\n\r\n".encode()).status == 403
    assert address.ask("/", "Host: evil.example").status == 403


@pytest.mark.parametrize(
    "line",
    [
        "Origin: https://evil.example", "Origin: null", "Origin: http://127.0.0.1:1", "Origin: https://127.0.0.1:{port}",
        "Sec-Fetch-Site: cross-site", "Sec-Fetch-Site: same-site", "Sec-Fetch-Site: new-word",
    ],
)  # fmt: skip
def test_a_foreign_page_is_refused_even_with_the_cookie(address, line):
    """`same-site` are other ports of this computer: a browser sends them our cookies."""
    for path in (f"/?token={address.token}", "/window?first=0&last=1", "/events"):
        assert address.ask(path, line.format(port=address.port)).status == 403


def test_our_own_page_may_say_where_it_is_from(address):
    own = f"Origin: http://127.0.0.1:{address.port}"
    assert address.ask("/window?first=0&last=1", own, "Sec-Fetch-Site: same-origin").status == 200
    assert address.ask("/", "Sec-Fetch-Site: none").status == 200


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS", "TRACE", "CONNECT", "get"])
def test_only_get_and_head_are_served(address, method):
    refused = address.ask("/", method=method)
    assert (refused.status, refused.headers["allow"]) == (405, "GET, HEAD")


@pytest.mark.parametrize("path", ["/x", "/../etc/passwd", "/%2e%2e/", "/page/main.js", "/window/", "/events/1"])
def test_there_are_no_other_pages(address, path):
    assert address.ask(path).status == 404


@pytest.mark.parametrize(
    "query", ["", "?first=1", "?first=2&last=1", "?first=-1&last=2", "?first=0&last=100000", "?first=a&last=1e3"]
)
def test_a_window_has_a_first_and_a_last_row(address, query):
    refused = address.ask(f"/window{query}")
    assert refused.status == 400
    assert "/window?first=0&last=999" in refused.text


def test_what_goes_wrong_with_a_window_is_told(address):
    wrong = address.ask("/window?first=13&last=20")
    assert (wrong.status, wrong.text) == (500, "the file is gone\n")


@pytest.mark.parametrize("path", ["/", "/window?first=0&last=1", "/none", "/?token=wrong"])
def test_every_answer_is_fenced_in(address, path):
    headers = address.ask(path).headers
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["cache-control"] == "no-store"
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["cross-origin-resource-policy"] == "same-origin"
    assert headers["content-security-policy"].startswith("default-src 'none'")
    assert "access-control-allow-origin" not in headers
    assert "Python" not in headers["server"]


def test_the_policy_lets_our_own_scripts_and_styles_in_only():
    """The digests are those that `openssl dgst -sha256 -binary | base64` gives."""
    policy = policy_of(PAGE + '<script type="application/json">{"a": 1}</script>')
    assert "script-src 'sha256-a4ayc/80/OGda4BO/1o/V0etpOqiLx1JwB5S3beHW0s=';" in policy
    assert policy.count("sha256-") == 1
    assert "unsafe" not in policy.replace("style-src 'unsafe-inline'", "")
    assert "script-src 'none'" in policy_of("<p>hello</p>")


@pytest.mark.parametrize(
    ("request_", "status"),
    [
        (b"\r\n\r\n", None), (b"x\r\n\r\n", None),
        (b"GET / HTTP/9\r\n\r\n", None), (b"\xff\xfe / HTTP/1.1\r\n\r\n", 403),
        (b"GET http://[ HTTP/1.1\r\n\r\n", 400), (b"GET http://other/ HTTP/1.1\r\n\r\n", 400),
        (b"GET / HTTP/1.1\r\n" + b"a: b\r\n" * 101 + b"\r\n", 431), (b"GET / HTTP/1.1\r\nHost\r\n\r\n", 403),
        (b"GET / HTTP/1.1\r\nx: " + b"y" * 40_000, 431), (b"GET /" + b"a" * 40_000 + b" HTTP/1.1\r\n\r\n", 431),
    ],
)  # fmt: skip
def test_wrong_requests_are_refused(address, request_, status, capfd):
    with address.call() as connection:
        connection.sendall(request_)
        connection.shutdown(socket.SHUT_WR)
        data = b""
        try:
            while piece := connection.recv(1 << 16):
                data += piece
        except ConnectionResetError:  # it has not read all that we sent
            pass
    if status is None:  # what it says has no head: it does not know the version of HTTP
        assert not data.startswith(b"HTTP")
        assert PAGE.encode() not in data
    elif data:
        assert answer(data).status in (status, 405)
    assert address.ask("/").status == 200
    assert "Traceback" not in capfd.readouterr().err


def test_a_stream_begins_after_the_last_event(address):
    for path, line, first in (("/events?after=7", "X: y", "7"), ("/events?after=7", "Last-Event-ID: 9", "9")):
        with address.stream(path, line) as events:
            assert next(events) == ("message", first, 0)


def test_connections_are_limited(address, monkeypatch):
    monkeypatch.setattr(server, "MOST", 3)
    held = [address.call() for _ in range(3)]
    try:
        for connection in held:
            connection.sendall(b"GET / HT")
        assert address.ask("/").status == 503
    finally:
        for connection in held:
            connection.close()

    def free() -> bool:
        try:
            return address.ask("/").status == 200
        except ConnectionResetError:
            return False

    wait_until(free)


def test_a_request_that_does_not_end_is_not_waited_for(address, monkeypatch):
    monkeypatch.setattr(server, "SECONDS", 0.1)
    with address.call() as connection:
        connection.sendall(b"GET / HTTP/1.1\r\n")
        began = time.monotonic()
        for _ in range(100):  # it trickles
            try:
                connection.sendall(b"a: b\r\n")
            except OSError:
                break
            time.sleep(0.01)
        else:
            pytest.fail("it goes on for ever")
        assert time.monotonic() - began < server.LONGEST
        assert address.ask("/").status == 200


def test_a_client_that_reads_nothing_is_left(monkeypatch):
    """Neither does its stream fill the memory, nor does it keep its thread."""
    monkeypatch.setattr(server, "SECONDS", 0.2)
    sent = []

    def counted(after: str) -> Iterator[bytes]:
        for event in endless(after):
            sent.append(len(event))
            yield event

    site = Site(lambda: PAGE, events=counted)
    with served(lambda tell, ended: serve(site, "a test", tell, ended=ended)) as address:
        before = len(ours())
        with address.call() as silent:
            silent.sendall(address.request("/events"))
            wait_until(lambda: sent and len(ours()) == before)
        assert sum(sent) < 1 << 24
        assert address.ask("/").status == 200


def test_it_ends_although_clients_do_not(monkeypatch):
    monkeypatch.setattr(server, "SECONDS", 60.0)
    began = time.monotonic()
    with served(lambda tell, ended: serve(SITE, "a test", tell, ended=ended)) as address:
        connections = [address.call() for _ in range(3)]
        connections[0].sendall(b"GET / HT")
        connections[1].sendall(address.request("/events"))
        assert connections[1].recv(100)
    assert time.monotonic() - began < 30
    for connection in connections:
        connection.close()


def test_a_port_that_is_taken_is_told(address):
    with pytest.raises(DiagnosticError) as caught:
        serve(SITE, "a test", pytest.fail, port=address.port)
    (found,) = caught.value.diagnostics
    assert found.code == "E554"
    assert found.message == f"it cannot listen on 127.0.0.1:{address.port}: Address already in use"
    with pytest.raises(DiagnosticError, match="there is no such port"):
        serve(SITE, "a test", pytest.fail, port=70_000)


def test_windows_of_a_document_are_made_one_at_a_time():
    inside: list[int] = []

    def make(first: int, last: int) -> dict[str, object]:
        inside.append(1)
        time.sleep(0.01)
        assert len(inside) == 1
        inside.pop()
        return {"title": "t", "first": first, "last": last}

    with served(lambda tell, ended: serve_document(make, "a test", tell, ended=ended)) as address:
        assert '"last":4999' in address.ask("/").text
        threads = [threading.Thread(target=address.ask, args=(f"/window?first={n}&last={n}",)) for n in range(8)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert json.loads(address.ask("/window?first=5&last=6").text) == {"title": "t", "first": 5, "last": 6}
        assert address.ask("/events").status == 404
    assert not inside


PROGRAM = """
from llfsm_verify.extensions.view.server import Site, serve
serve(Site(lambda: "page"), "a test", lambda line: print(line, flush=True))
print("ended", flush=True)
"""


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it(number):
    program = subprocess.Popen(
        [sys.executable, "-c", PROGRAM], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert program.stdout is not None
    address = Address.of(program.stdout.readline())
    assert address.ask("/").text == "page"
    with address.call() as open_one:
        open_one.sendall(b"GET")
        os.kill(program.pid, number)
        said, errors = program.communicate(timeout=30)
    assert (said, errors, program.returncode) == ("ended\n", "", 0)
