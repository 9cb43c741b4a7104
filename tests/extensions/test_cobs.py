"""Frames on a serial line against another implementation of COBS and another CRC, with noise between them."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import threading
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.extensions.serial import cobs
from llfsm_verify.runtime.ports.line_port import MOST_BYTES, Malformed
from tests.outside import load, needs
from tests.quick import examples
from tests.runtime.ports.bench import bench, declared

BYTES = st.one_of(
    st.binary(max_size=30),
    st.lists(st.sampled_from([b"\0", b"a", b"\xff", b"b" * 253, b"c" * 254, b"d" * 255]), max_size=5).map(b"".join),
)
TEXT = (
    "ports: {board: {kind: serial, device: line, format: cobs, inputs: [far], outputs: {far: seen}, on_failure: stale}}"
)


def crc(data: bytes) -> int:
    """Bit by bit."""
    state = 0xFFFF
    for byte in data:
        for bit in range(7, -1, -1):
            high = state >> 15 ^ byte >> bit & 1
            state = state << 1 & 0xFFFF ^ (0x1021 if high else 0)
    return state


def framed(text: bytes) -> bytes:
    made: bytes = load("cobs", "cobs.cobs").encode(text + crc(text).to_bytes(2, "big"))
    return made + b"\0"


def read(stream: bytes) -> list[bytes | None]:
    """The text of each frame that ends in a stream; None: it is none."""
    other = load("cobs", "cobs.cobs")
    found: list[bytes | None] = []
    for frame in filter(None, stream.split(b"\0")[:-1]):
        try:
            data = other.decode(frame)
        except other.DecodeError:
            found.append(None)
            continue
        found.append(data[:-2] if len(data) > 1 and crc(data) == 0 else None)
    return found


def test_the_checksum_is_that_of_the_catalogue() -> None:
    assert crc(b"123456789") == 0x29B1
    assert cobs.Cobs().pack(b"123456789\n") == b"\0" + cobs.stuff(b"123456789\x29\xb1") + b"\0"


@needs("cobs")
@settings(max_examples=examples(300), deadline=None)
@given(BYTES)
def test_frames_are_those_of_the_other_implementation(data: bytes) -> None:
    other = load("cobs", "cobs.cobs")
    assert cobs.stuff(data) == other.encode(data) and cobs.unstuff(other.encode(data)) == data
    assert read(cobs.Cobs().pack(data)) == [data.rstrip(b"\n")]
    garbage = data.replace(b"\0", b"\1")
    try:
        expected = other.decode(garbage)
    except other.DecodeError:
        with pytest.raises(Malformed):
            cobs.unstuff(garbage)
    else:
        assert cobs.unstuff(garbage) == expected


@contextmanager
def wire(folder: Path) -> Iterator[tuple[int, int]]:
    """Both ends of a serial line; the path of one is `line` in the folder."""
    master, slave = os.openpty()
    tty.setraw(master)
    (folder / "line").symlink_to(os.ttyname(slave))
    try:
        yield master, slave
    finally:
        os.close(master)
        os.close(slave)


def noisy(random: Random, number: int) -> bytes:
    """A frame, and what a bad line makes of it."""
    more = random.choice(["", "\0" * 5, "x" * random.randrange(300)])
    text = json.dumps({"far": number, "more": more}).encode()
    frame = framed(text)
    match random.randrange(6):
        case 0:
            at = random.randrange(len(frame) - 1)
            return frame[:at] + bytes([frame[at] ^ 1 << random.randrange(8)]) + frame[at + 1 :]
        case 1:
            return frame[random.randrange(1, len(frame) - 2) :]
        case 2:
            return random.randbytes(random.randrange(1, 40)) + frame
        case 3:
            return b"\0\0" + frame[: random.randrange(1, len(frame))] + b"\0" + frame
        case _:
            return frame


@needs("cobs")
@pytest.mark.slow
def test_a_port_takes_whole_frames_and_nothing_else(tmp_path: Path) -> None:
    random = Random(7)
    with wire(tmp_path) as (master, _), bench(*declared(TEXT, tmp_path)) as made:
        counts, sent, seen = made.ports.counts["board"], b"", b""
        os.set_blocking(master, False)
        for number in range(1, 120):
            piece = noisy(random, number)
            sent += piece
            os.write(master, piece)
            texts = read(sent)
            good = [json.loads(text)["far"] for text in texts if text is not None]
            while counts.taken + counts.malformed < len(texts):
                made.turn()
            assert counts.taken == len(good) and counts.refused == 0
            made.until(made.has("far", good[-1] if good else 0))
        assert 40 < counts.taken < len(texts) - 20
        while not (told := [text for text in read(seen) if text]) or json.loads(told[-1])["seen"] != good[-1]:
            made.turn()
            try:
                seen += os.read(master, 1 << 16)
            except BlockingIOError:
                continue
        assert None not in read(seen)
        before = counts.malformed
        for at in range(0, MOST_BYTES + 2000, 1000):
            os.write(master, b"\7" * 1000)
            while counts.malformed == before and at > MOST_BYTES:
                made.turn()
            made.turn()
        os.write(master, b"\0" + framed(b'{"far": -5}'))
        made.until(made.has("far", -5))
        assert counts.malformed == before + 1
        assert "port board: a frame has another checksum" in made.said


@needs("cobs")
@settings(max_examples=examples(60), deadline=None)
@given(st.randoms(use_true_random=False), st.integers(1, 60))
def test_frames_are_found_wherever_the_stream_is_cut(random: Random, piece: int) -> None:
    stream = b"".join(noisy(random, number) for number in range(random.randrange(1, 12)))
    bridge = cobs.Bridge()
    lines = b"".join(bridge.lined(stream[at : at + piece]) for at in range(0, len(stream), piece)).splitlines()
    texts = read(stream)
    first = next((number for number, text in enumerate(texts) if text is not None), len(texts))
    assert [None if b'"say"' in line else line for line in lines] == texts[first:]


@needs("cobs")
@pytest.mark.slow
def test_a_program_makes_lines_of_frames_and_frames_of_lines(tmp_path: Path) -> None:
    ours, theirs = socket.socketpair()
    with wire(tmp_path) as (master, slave), ours, theirs:
        os.close(os.dup(slave))
        command = [sys.executable, "-m", "llfsm_verify.extensions.serial.cobs", str(tmp_path / "line"), "9600"]
        with subprocess.Popen(command, stdin=theirs, stdout=theirs) as child:
            theirs.close()
            ours.sendall(b'{"hello": 1}\n{"values": {"a": "\xc3\xa4"}}\n')
            seen = b""
            while seen.count(b"\0") < 4:
                seen += os.read(master, 100)
            assert read(seen) == [b'{"hello": 1}', '{"values": {"a": "ä"}}'.encode()]
            os.write(master, b"noise" + framed(b'{"lost": 1}') + framed(b'{\n"hello": 1}'))
            os.write(master, b"\3\3noise\0" + framed(b'{"values": {}}'))
            lines = b""
            while lines.count(b"\n") < 3:
                lines += ours.recv(1000)
            assert lines.splitlines()[::2] == [b'{ "hello": 1}', b'{"values": {}}']
            assert set(json.loads(lines.splitlines()[1])) == {"say"}
            ours.close()
            assert child.wait() == 0


@needs("cobs")
@pytest.mark.slow
def test_a_board_speaks_the_protocol_of_programs(tmp_path: Path) -> None:
    """It is a thread with the other implementation, and noise before each of its frames."""
    run = f"[{sys.executable}, -m, llfsm_verify.extensions.serial.cobs, {tmp_path / 'line'}]"
    text = TEXT.replace("serial, device: line, format: cobs", f"process, run: {run}").replace(
        "far: seen", "far: out.seen"
    )
    told: list[dict[str, object]] = []
    with wire(tmp_path) as (master, _):

        def board() -> None:
            seen = b""
            while not (told and "end" in told[-1]):
                seen += os.read(master, 100)
                heard = [json.loads(frame) for frame in read(seen) if frame]
                for line in heard[len(told) :]:
                    answer = {"hello": 1} if "hello" in line else {"values": {"far": 7}}
                    os.write(master, b"\1\2noise\0" + framed(json.dumps(answer).encode()))
                told[:] = heard

        thread = threading.Thread(target=board)
        thread.start()
        with bench(*declared(text, tmp_path)) as made:
            made.until(made.has("far", 7))
            made.until(lambda: any("values" in line and line["values"] == {"out": {"seen": 7}} for line in told))
            made.end("stopped")
        thread.join()
    assert told[0]["port"] == "board" and told[-1] == {"end": "stopped"}
    assert made.said == ["port board: a frame is cut short"]


def test_a_device_that_is_not_there_is_said(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert cobs.main(str(tmp_path / "line")) == 1
    assert "No such file" in capfd.readouterr().err
