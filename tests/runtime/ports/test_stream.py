"""Lines of JSON through pipes: what comes is posted, what changes is written, and nobody is waited for."""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from decimal import Decimal
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.runtime.ports import ports as ports_of_run
from llfsm_verify.runtime.ports.line_port import MOST_BYTES, LineReader, Malformed, decode, encode
from llfsm_verify.runtime.ports.port import PortSpec
from tests.quick import examples
from tests.runtime.ports.bench import Bench, bench, declared, lines_of

INPUTS = ("go", "level", "large", "far", "mode", "speed")
OUTPUTS = {"kept": "large", "seen": "far", "now": "mode", "drive": "speed"}
VALUES = st.fixed_dictionaries(
    {
        "large": st.integers(0, (1 << 64) - 1),
        "far": st.integers(-(1 << 63), (1 << 63) - 1),
        "mode": st.sampled_from(("LOW", "HIGH")),
        "speed": st.integers(-100, 100).map(lambda n: Decimal(n) / 100),
    }
)


class Pipes:
    """Both pipes of a stream: what the world writes to, and what it reads from."""

    def __init__(self) -> None:
        self.theirs_in, self.to_port = os.pipe()
        fcntl.fcntl(self.to_port, fcntl.F_SETPIPE_SZ, 1 << 18)
        self.from_port, self.theirs_out = os.pipe()

    def write(self, text: str | bytes) -> None:
        data = text.encode() if isinstance(text, str) else text
        while data:
            data = data[os.write(self.to_port, data) :]

    def close(self) -> None:
        for descriptor in (self.theirs_in, self.to_port, self.from_port, self.theirs_out):
            if descriptor >= 0:
                os.close(descriptor)

    def hang_up(self) -> None:
        """The world writes no more; the port has a descriptor of its own."""
        os.close(self.to_port)
        os.close(self.theirs_in)
        self.to_port = self.theirs_in = -1


@contextmanager
def piped(folder: Path, more: str = "on_failure: stale") -> Iterator[tuple[Pipes, Bench]]:
    pipes = Pipes()
    names = ", ".join(f"{slot}: {field}" for slot, field in OUTPUTS.items())
    text = (
        f"ports: {{world: {{kind: stream, read: {pipes.theirs_in}, write: {pipes.theirs_out}, "
        f"inputs: [{', '.join(INPUTS)}], outputs: {{{names}}}, {more}}}}}\n"
    )
    try:
        with bench(*declared(text, folder)) as made:
            yield pipes, made
    finally:
        pipes.close()


def test_values_of_all_types_go_in_and_come_out(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Read back by another reader of JSON, with numbers as they are written."""
    with piped(tmp_path_factory.mktemp("ports")) as (pipes, made):
        lines = lines_of(pipes.from_port, made.turn)
        assert json.loads(next(lines), parse_float=Decimal) == {"large": 0, "far": 0, "mode": "LOW", "speed": 0}

        @settings(max_examples=examples(60), deadline=None)
        @given(VALUES)
        def there_and_back(values: dict[str, object]) -> None:
            shown = {k: float(v) if isinstance(v, Decimal) else v for k, v in values.items()}
            before = [made.value(slot) for slot in OUTPUTS]
            pipes.write(json.dumps({"go": True, **shown}) + "\n")
            if before == [values[field] for field in OUTPUTS.values()]:
                made.turn()
            else:
                assert json.loads(next(lines), parse_float=Decimal) == values
            assert [made.value(slot) for slot in OUTPUTS] == [values[field] for field in OUTPUTS.values()]

        there_and_back()
        assert made.ports.counts["world"].refused == 0 and made.said == []


def test_what_is_no_message_is_counted_and_said_once(tmp_path: Path) -> None:
    with piped(tmp_path) as (pipes, made):
        bad = [
            b"x",
            b"[1]",
            b'"go"',
            b"{",
            b"\xff",
            b"[" * 60_000,
            b'{"go": NaN}',
            b'{"come": 1}',
            b"y" * (MOST_BYTES + 1),
        ]
        refused = ['"go": 1', '"go": null', '"go": [true]', '"level": 5', '"level": 1e1', '"level": true', '"mode": 0']
        for piece in (*bad, *(f'{{{field}, "large": {n}}}'.encode() for n, field in enumerate(refused, 1))):
            pipes.write(piece + b"\n")
            made.turn()
        pipes.write('{"level": 3}\n\n  \n')
        made.until(made.has("level", 3))
        counts = made.ports.counts["world"]
        assert counts.malformed == len(bad) and counts.refused == len(refused)
        assert made.value("large") == len(refused), "the other values of a message are taken"
        assert counts.taken == len(refused) + 1
        told = " ".join(made.said)
        assert len(made.said) == len(set(made.said)) == 6
        for words in (
            "is not JSON",
            "not an object",
            "not UTF-8",
            "none of the fields",
            "longer than",
            "a value is refused: go",
        ):
            assert words in told


@given(st.lists(st.binary(max_size=12), max_size=6), st.lists(st.integers(0, 80), max_size=8), st.integers(1, 8))
@settings(max_examples=examples(100), deadline=None)
def test_lines_are_the_same_however_they_are_cut(lines: list[bytes], cuts: list[int], most: int) -> None:
    data = b"".join(line.replace(b"\n", b"") + b"\n" for line in lines)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("llfsm_verify.runtime.ports.line_port.MOST_BYTES", most)
        places = sorted({0, len(data), *(c for c in cuts if c <= len(data))})
        reader = LineReader()
        found = [line for a, b in pairwise(places) for line in reader.lines(data[a:b])]
        assert found == [line if len(line) <= most else None for line in data.split(b"\n")[:-1]]
        assert not reader.restart()


def test_decimals_are_exact() -> None:
    assert encode({"a": Decimal("-0.10"), "b": True, "c": "RED", "d": 1 << 63}) == (
        b'{"a": -0.10, "b": true, "c": "RED", "d": 9223372036854775808}\n'
    )
    assert decode(b'{"a": 0.1000000000000000001}') == {"a": "0.1000000000000000001"}
    with pytest.raises(Malformed):
        decode(b'{"a": ' + b"9" * 5000 + b"}")


@pytest.mark.parametrize(
    ("more", "level", "said"),
    [
        ("on_failure: stale", 2, "the writer has closed it: `go`, `level`"),
        ("on_failure: safe, safe: {go: false, level: -3}", -3, "get their safe values"),
        ("on_failure: stop", 2, None),
    ],
)
def test_a_writer_that_closes(more: str, level: int, said: str | None, tmp_path: Path) -> None:
    read, write = os.pipe()
    text = f"ports: {{world: {{kind: stream, read: {read}, inputs: [go, level], timeout: 1h, {more}}}}}\n"
    with bench(*declared(text, tmp_path)) as made:
        os.write(write, b'{"level": 2}\n{"level"')
        made.until(made.has("level", 2))
        os.close(write)
        made.until(lambda: made.ports.counts["world"].failures == 2)
        made.turn()
        counts = made.ports.counts["world"]
        assert made.value("level") == level and counts.malformed == 1
        assert (made.ports.failure is None) == (said is not None)
        assert said is None or said in made.said[-1]
        assert said is not None or made.ports.failure == "port world: the writer has closed it: `go`, `level` failed"
    os.close(read)


def test_an_input_without_messages_fails_alone_and_recovers(tmp_path: Path) -> None:
    with piped(
        tmp_path, "on_failure: safe, timeout: 2s, safe: {go: true, level: 4, large: 9, far: 1, mode: HIGH, speed: 1}"
    ) as (
        pipes,
        made,
    ):
        counts = made.ports.counts["world"]
        made.now = 1.5
        pipes.write('{"level": 1}\n')
        made.until(made.has("level", 1))
        made.now = 1.999
        made.turn()
        assert counts.failures == 0 and made.value("large") == 0
        made.now = 2.0
        made.turn()
        assert counts.failures == 5 and (made.value("large"), made.value("level")) == (9, 1)
        made.now = 3.4
        pipes.write('{"level": 2}\n')
        made.until(made.has("level", 2))
        made.now = 5.3
        made.turn()
        assert counts.failures == 5
        made.now = 5.4
        made.turn()
        assert counts.failures == 6 and made.value("level") == 4
        pipes.write('{"large": 3, "level": 0}\n')
        made.until(made.has("large", 3))
        made.now = 7.4
        made.turn()
        assert counts.failures == 8 and made.value("large") == 9
        assert len(made.said) == 1, "each kind of thing is said once"


def test_a_named_pipe_whose_writers_come_and_go(tmp_path: Path) -> None:
    path = tmp_path / "pipe"
    os.mkfifo(path)
    text = "ports: {world: {kind: stream, read: pipe, inputs: [level], on_failure: safe, safe: {level: -3}}}\n"
    with bench(*declared(text, tmp_path)) as made:
        made.turn()
        assert made.ports.counts["world"].failures == 0, "nobody has come yet"
        for number in (1, 2, 3):
            with path.open("w") as writer:
                writer.write(f'{{"level": {number}}}\n')
                writer.flush()
                made.until(made.has("level", number))
            made.until(made.has("level", -3))
            assert made.ports.counts["world"].failures == number
        path.unlink()
        made.turn()
        assert made.ports.counts["world"].taken == 3


def test_with_a_time_out_writers_may_come_and_go(tmp_path: Path) -> None:
    path = tmp_path / "pipe"
    os.mkfifo(path)
    text = "ports: {world: {kind: stream, read: pipe, inputs: [level], on_failure: stop, timeout: 1s}}\n"
    with bench(*declared(text, tmp_path)) as made:
        for number in (1, 2):
            with path.open("w") as writer:
                writer.write(f'{{"level": {number}}}\n')
            made.until(made.has("level", number))
            made.turn()
        assert made.ports.failure is None
        made.now = 1.0
        made.turn()
        assert made.ports.failure == "port world: no message for 1 s: `level` failed"


@pytest.mark.slow
def test_a_full_pipe_holds_nobody_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ports_of_run, "FINISHING", 0.01)
    with piped(tmp_path) as (pipes, made):
        counts = made.ports.counts["world"]
        written = 0
        while counts.unsent < 3:
            written += 1
            made.board.posts.post({"go": True, "large": written})
            made.loop.go(1)
            made.ports.serve(0)
        assert counts.sent < written and made.said == [
            "port world: an output is not written: it is not read as fast as it changes"
        ]
        last = ""
        for line in lines_of(pipes.from_port, made.turn):  # whole lines, and the newest is not lost
            last = line
            if json.loads(last)["large"] == written:
                break
        assert counts.sent + counts.unsent == written and json.loads(last)["large"] == written
        while counts.unsent < 6:
            written += 1
            made.board.posts.post({"large": written})
            made.loop.go(1)
            made.ports.serve(0)
        made.end("stopped")
        assert counts.unsent == 7 and made.said[-1].endswith("the run has ended before it was read")


def test_who_begins_to_read_a_named_pipe_gets_the_newest(tmp_path: Path) -> None:
    path = tmp_path / "pipe"
    os.mkfifo(path)
    text = "ports: {world: {kind: stream, write: pipe, outputs: {large: n}}}\n"
    with bench(*declared(text, tmp_path)) as made:
        made.turn()
        made.board.posts.post({"large": 7})
        made.until(lambda: made.ports.counts["world"].unsent == 1)
        for _ in range(2):  # the second has not seen what the first was told
            reader = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
            assert next(lines_of(reader, made.turn)) == '{"n": 7}'
            os.close(reader)
            made.board.posts.post({"large": 8})
            made.until(made.has("large", 8))
            made.turn()
            made.board.posts.post({"large": 7})
            made.until(made.has("large", 7))
            made.turn()
        assert made.said == ["port world: an output is not written: nobody reads it"]


def test_who_stops_reading_a_descriptor_is_gone(tmp_path: Path) -> None:
    read, write = os.pipe()
    with bench(*declared(f"ports: {{world: {{kind: stream, write: {write}, outputs: [large]}}}}\n", tmp_path)) as made:
        os.close(read)
        made.until(lambda: made.ports.counts["world"].unsent == 1)
        made.board.posts.post({"large": 8})
        made.until(lambda: made.ports.counts["world"].unsent == 2)
        assert made.said == ["port world: an output is not written: nobody reads it"]
    os.close(write)


@pytest.mark.parametrize(
    ("ending", "more"), [("ended", []), ("stopped", [{"n": 5, "s": "HIGH"}]), ("died", [{"n": 5, "s": "HIGH"}])]
)
def test_the_last_frame_and_safe_values_are_written(ending: str, more: list[object], tmp_path: Path) -> None:
    read, write = os.pipe()
    safe = "safe: {now: HIGH, large: 5}"
    text = f"ports: {{w: {{kind: stream, write: {write}, outputs: {{large: n, now: s}}, {safe}}}}}\n"
    specs: tuple[PortSpec, ...] = declared(text, tmp_path)
    os.set_blocking(read, False)
    with bench(*specs) as made:
        made.turn()
        made.board.posts.post({"large": 3})
        made.loop.go(1)  # and nobody looks before the end
        made.end(ending)
    os.close(write)
    written = [json.loads(line) for line in os.read(read, 1 << 16).splitlines()]
    assert written == [{"n": 3, "s": "LOW"}, *more]
    os.close(read)


@pytest.mark.parametrize(
    "what", ["read: nothing, inputs: [go], on_failure: stale", "write: ., outputs: [go]", "write: 999, outputs: [go]"]
)
def test_what_cannot_be_opened(what: str, tmp_path: Path) -> None:
    with (
        pytest.raises(DiagnosticError) as caught,
        bench(*declared(f"ports: {{w: {{kind: stream, {what}}}}}\n", tmp_path)),
    ):
        pass
    assert [d.code for d in caught.value.diagnostics] == ["E495"]
