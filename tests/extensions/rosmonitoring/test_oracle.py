"""Verdicts for ROSMonitoring, asked for by the client that its monitors have, and held against logs on a file."""

from __future__ import annotations

import csv
import json
import random
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
import websocket

from tests.cli.running import llfsm
from tests.extensions.rosmonitoring.examples import DOOR, NOT_HERE

pytestmark = pytest.mark.slow

SAFE, SOON = "safe: G (open -> speed <= 5)", "soon: G (open -> F[<=1s] speed == 0)"
SPEED = '{column: "cmd_vel:twist.linear.x", scale: 10}'
MAPPING = f'columns: {{open: "door:data", speed: {SPEED}}}\ntime: time\n'
COLUMNS = "columns: {open: open, speed: {column: speed, scale: 10}}\ntime: time\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name, text in (("door.yaml", DOOR), ("m.yaml", MAPPING), ("columns.yaml", COLUMNS)):
        (tmp_path / name).write_text(text)
    return tmp_path


@contextmanager
def served(*words: str, notes: Sequence[str] = (), end: signal.Signals = signal.SIGTERM) -> Iterator[str]:
    """The address of a server that ends well when a signal comes, and has said this."""
    command = [sys.executable, "-m", "llfsm_verify", "monitor", "--arrangement", "door.yaml", "--mapping", "m.yaml"]
    with subprocess.Popen(
        [*command, "--serve", "0", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        told = process.stdout.readline()
        assert re.fullmatch(r"listening on ws://127\.0\.0\.1:\d+\n", told), told
        try:
            yield told.split()[-1]
        finally:
            process.send_signal(end)
        said = process.communicate(timeout=60)
        assert (process.returncode, *said) == (0, "".join(f"note: {note}\n" for note in notes), "")


@contextmanager
def connected(address: str) -> Iterator[Any]:
    client = websocket.create_connection(address, timeout=60)
    try:
        yield client
    finally:
        client.shutdown()  # without waiting for the other side


def asked(client: Any, *messages: object) -> list[dict[str, object]]:
    """What comes back for each: an event, or a text as it is."""
    answers = []
    for message in messages:
        client.send(message if isinstance(message, str) else json.dumps(message))
        answers.append(json.loads(client.recv()))
    return answers


def door(time: float, data: object) -> dict[str, object]:
    return {"topic": "door", "time": time, "data": data}


def moves(time: float, speed: float) -> dict[str, object]:
    return {"topic": "cmd_vel", "time": time, "twist": {"linear": {"x": speed, "y": 0.0}}}


def random_events(seed: int) -> list[dict[str, object]]:
    draw = random.Random(seed)
    events, time = [], 0.0
    for _ in range(40):
        time = round(time + draw.choice([0.0, 0.1, 0.2, 0.7]), 1)
        events.append(
            door(time, draw.random() < 0.3) if draw.random() < 0.5 else moves(time, draw.choice([0, 0.5, 0.6]))
        )
    return events


def rows_of(events: Sequence[dict[str, object]]) -> list[tuple[object, object, object]]:
    """The letters as one would write them into a table: from where both topics have spoken."""
    rows: list[tuple[object, object, object]] = []
    opened: object = None
    speed: object = None
    for event in events:
        if event["topic"] == "door":
            opened = json.dumps(event["data"])
        else:
            speed = event["twist"]["linear"]["x"]  # type: ignore[index]
        if opened is not None and speed is not None:
            rows.append((event["time"], opened, speed))
    return rows


def by_log(line: str, rows: Sequence[tuple[object, object, object]]) -> str:
    """What `llfsm check-recording` says of them: violated, satisfied or undecided."""
    with Path("log.csv").open("w", newline="") as file:
        csv.writer(file).writerows([("time", "open", "speed"), *rows])
    words = ("--arrangement", "door.yaml", "--mapping", "columns.yaml", "-p", line)
    return llfsm("check-recording", "log.csv", *words).stdout.split()[0]


@pytest.mark.parametrize("line", [SAFE, SOON, "opens: F (open && speed == 0)"])
def test_each_verdict_is_that_of_the_log_so_far(folder: Path, line: str) -> None:
    words = {"violated": "false", "satisfied": "true", "undecided": "unknown"}
    seen = set()
    with served(line) as address:
        for seed in range(4):
            events = random_events(seed)
            with connected(address) as client:
                answers = asked(client, *events)
            verdicts = [str(answer["verdict"]) for answer in answers]
            assert [{k: v for k, v in answer.items() if k not in ("verdict", "spec")} for answer in answers] == events
            turns = [i for i in range(1, 41) if i == 40 or verdicts[i] != verdicts[i - 1]]
            for sent in {1, *turns, *(turn + 1 for turn in turns if turn < 40)}:
                rows = rows_of(events[:sent])
                assert verdicts[sent - 1] == (words[by_log(line, rows)] if rows else "unknown"), (seed, sent)
            seen |= set(verdicts)
    assert len(seen) == 2


def test_a_filter_goes_on_as_if_refused_messages_had_not_been_sent(folder: Path) -> None:
    refused = 0
    with served(SAFE, "--filter") as filtering, served(SAFE) as plain:
        for seed in range(3):
            events = random_events(seed)
            with connected(filtering) as client:
                answers = asked(client, *events)
            passed = [event for event, a in zip(events, answers, strict=True) if a["verdict"] != "currently_false"]
            assert all(answer["spec"] == "G (open -> speed <= 5)" for answer in answers if "spec" in answer)
            with connected(plain) as client:
                assert [answer["verdict"] for answer in asked(client, *passed)] == ["unknown"] * len(passed)
            refused += len(events) - len(passed)
    assert refused


WRONG = [
    ("{", "Expecting property name"),
    ('{"topic": "door", "time": 1e400, "data": true}', "column `time`"),
    ('{"topic": "door", "time": 2, "data": ' + "9" * 5000 + "}", "4300 digits"),
    ('{"topic": "cmd_vel", "time": 2, "twist": {"linear": {"x": 99999999999999999999}}}', "`speed`"),
    ('{"topic": "cmd_vel", "time": 2, "twist": {"linear": {"x": 1e400}}}', "`speed`"),
    ('{"topic": "cmd_vel", "time": 2, "twist": {"linear": {"x": 1e999999999999999999}}}', "`1E+999999999999999999`"),
    ('{"topic": "door", "time": 2, "data": "\\ud800"}', "column `door:data`"),
    ("[]", "a JSON object with a `topic` or a `service`"),
    ('{"topic": 3}', "a JSON object with a `topic` or a `service`"),
    ('{"data": 3}', "a JSON object with a `topic` or a `service`"),
    ("[" * 100_000, "recursion"),
    ('{"topic": "door", "time": 2, "data": 7}', "column `door:data` (`open`): `7` is neither true nor false"),
    ('{"topic": "door", "time": 2}', "column `door:data` (`open`): the cell has no value"),
    ('{"topic": "cmd_vel", "time": 2, "twist": {"linear": {"x": 0.55}}}', "`0.55` is not a whole number"),
    ('{"topic": "cmd_vel", "time": 2, "twist": {"linear": {"x": NaN}}}', "the cell has no value"),
    ('{"topic": "door", "data": true}', "column `time`: the row has no time"),
    ('{"topic": "door", "time": 0.5, "data": true}', "the time falls from 1 to 0.5"),
]


def test_what_cannot_be_read_is_answered_and_changes_nothing(folder: Path) -> None:
    with served(SAFE) as address, connected(address) as client, connected(address) as other, connected(address):
        asked(client, door(0, True), moves(1, 0.5))  # a third one says nothing, and holds up nobody
        for message, told in WRONG:
            (answer,) = asked(client, message)
            assert answer["verdict"] == "unknown" and told in str(answer["error"]), answer
        client.send_binary(json.dumps(moves(1, 0.2)).encode())
        assert json.loads(client.recv()) == {**moves(1, 0.2), "verdict": "unknown"}
        assert [a["verdict"] for a in asked(client, moves(2, 0.6), door(3, False))] == ["false", "false"]
        assert [a["verdict"] for a in asked(other, moves(2, 0.6), door(3, False))] == ["unknown"] * 2  # its own monitor
        with suppress(websocket.WebSocketException, OSError):  # the server may hang up before all of it is there
            other.send("x" * (1 << 21))
            assert other.recv() == ""
        assert asked(client, door(4, False))[0]["verdict"] == "false"


def test_an_answer_has_the_message_as_it_was_written(folder: Path) -> None:
    """Also what Python would write otherwise: long decimals, infinity, half a surrogate, keys in their order."""
    words = '"topic" : "door", "time": 1, "data": true, "z": [0.12345678901234567890, 1e400, "\\ud800", "\u00e4"]'
    with served(SAFE) as address, connected(address) as client:
        for sent in (f"{{{words}}}", f" {{ {words}\n}} "):
            client.send(sent)
            assert client.recv() == f'{{{words}, "verdict": "unknown"}}'
        client.send("{}")
        assert json.loads(client.recv()).keys() == {"verdict", "error"}


def test_a_topic_without_a_column_is_said_once(folder: Path) -> None:
    notes = [f"no column is of the topic `/{name}`: the mapping has cmd_vel, door" for name in ("scan", "odom")]
    with served(SAFE, notes=notes) as address:
        for _ in range(2):
            with connected(address) as client:
                answers = asked(client, *({"topic": f"/{name}", "time": 1} for name in ("scan", "odom", "scan")))
                assert [answer["verdict"] for answer in answers] == ["unknown"] * 3


def test_pages_of_the_world_are_refused_and_wrong_handshakes_harm_nobody(folder: Path) -> None:
    """A browser lets any page call this computer, and says where the page is from."""
    note = "a page from `http://evil.example` was refused, and so are all that are not from this computer"
    with served(SAFE, notes=[note], end=signal.SIGINT) as address, connected(address) as client:
        for origin in ("http://evil.example", "null", "http://localhost.evil.example", "http://127.0.0.1@evil.example"):
            with pytest.raises(websocket.WebSocketBadStatusException, match="403"):
                websocket.create_connection(address, origin=origin, timeout=60)
        host, port = address.removeprefix("ws://").split(":")
        half = socket.create_connection((host, int(port)), timeout=60)  # it says half of what it should, and stays
        half.sendall(b"GET / HTTP/1.1\r\nHost: ")
        for garbage in (b"\x00" * 5000 + b"\r\n\r\n", b"GET / HTTP/1.1\r\n\r\n", b"POST / HTTP/1.1\r\n\r\n"):
            with socket.create_connection((host, int(port)), timeout=60) as wrong:
                wrong.sendall(garbage)
                with suppress(OSError):
                    while wrong.recv(4096):
                        pass
        others = [websocket.create_connection(address, origin="http://localhost:80", timeout=60) for _ in range(50)]
        others[0].sock.sendall(b"\x81\xfe\xff")  # half a frame
        for other in [client, *others[1:]]:
            assert asked(other, door(1, True))[0]["verdict"] == "unknown"
    half.close()
    for other in others:
        other.shutdown()


def test_one_topic_is_the_letters_and_services_are_topics(folder: Path) -> None:
    (folder / "m.yaml").write_text('topic: door\ncolumns: {open: data, speed: "go:request.speed"}\n')
    with served(SAFE) as address, connected(address) as client:
        asks = [{"service": "go", "time": 1, "request": {"speed": speed}} for speed in (2, 9)]
        answers = asked(client, {"topic": "door", "data": True}, *asks, {"topic": "door", "data": True})
        assert [answer["verdict"] for answer in answers] == ["unknown", "unknown", "unknown", "false"]


@pytest.mark.parametrize(
    ("words", "code", "told"),
    [
        (("--serve", "8080", "--host", NOT_HERE), 3, "error[E550]: it cannot listen on 192.0.2.1:8080: "),
        (("--serve", "8080", "--host", "no.such.host.invalid"), 3, "error[E550]"),
        (("--serve", "70000"), 2, "--serve needs a port up to 65535"),
        (("--filter",), 2, "they need --serve PORT"),
        (("--serve", "0", "--as", "dot"), 2, "leave out --as and --output"),
    ],
)
def test_what_cannot_be_served_is_said(folder: Path, words: tuple[str, ...], code: int, told: str) -> None:
    done = llfsm("monitor", SAFE, "--arrangement", "door.yaml", "--mapping", "m.yaml", *words)
    assert (done.returncode, done.stdout) == (code, "") and told in done.stderr
    assert llfsm("monitor", SAFE, "--serve", "0").returncode == 2
