"""The file of a recording: every change is found, and why it ends where it does is what happened."""

from __future__ import annotations

import errno
import os
import random
import signal
from collections import Counter
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.runtime.live import control
from llfsm_verify.runtime.live.frame import COMMITTED, ENDING, ENDINGS
from llfsm_verify.runtime.live.loop import LiveCode, Loop
from llfsm_verify.runtime.live.run import Run
from llfsm_verify.runtime.live.supervised import Supervised
from llfsm_verify.runtime.recording import file
from llfsm_verify.runtime.recording.file import GOES_ON, HEAD, KILLED, PAGE, Recorder, Recording, Turn
from llfsm_verify.runtime.recording.replay import replay
from llfsm_verify.runtime.whiteboard.shared import Shared
from tests.quick import FRESH
from tests.runtime.live.runs import code_of, pids, recorded, turns_of
from tests.runtime.live.test_loop import LAMP
from tests.runtime.recording.forging import begin_of, entries_of, sealed

OLD = Path(__file__).parent / "format_1.recording"


@pytest.fixture(scope="module")
def code() -> LiveCode:
    return code_of(build_arrangement(LAMP))


def outcome(path: Path) -> tuple[list[Turn], str | None]:
    """The turns, and why the last one of the run is not there: of files that are not read, the code of the error."""
    try:
        with Recording(path) as recording:
            turns = list(recording)
            return turns, "damaged" if recording.damaged else recording.lost
    except DiagnosticError as error:
        return [], error.diagnostics[0].code


def open_end(path: Path, code: LiveCode, turns: int) -> None:
    """What is left where all processes of a run were killed after so many turns."""
    loop = Loop(code)
    with closing(Recorder(path, {}, loop)):
        if turns >= 0:
            loop.begin(0)
            assert loop.go(turns) == control.DONE


def mutants(data: bytes, begin: int) -> Iterator[bytes]:
    """Each byte changed, left out and doubled, and each part at the end missing; of the long header only some."""
    draw = random.Random(None if FRESH else 5)
    places = [*(range(begin) if FRESH else draw.sample(range(begin), 60)), *range(begin, len(data))]
    for at in places:
        others = range(1, 256) if FRESH and at >= begin else (draw.choice((1, 0x80)), draw.randrange(2, 128))
        for other in others:
            yield data[:at] + bytes([data[at] ^ other]) + data[at + 1 :]
        yield data[:at]
        yield data[:at] + data[at + 1 :]
        yield data[:at] + data[at : at + 1] + data[at:]


@pytest.mark.slow
@pytest.mark.parametrize("how", ["whole", "killed"])
def test_every_change_is_found_or_changes_nothing(
    how: str, code: LiveCode, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(file, "WINDOW", PAGE)
    path, other = tmp_path / "r", tmp_path / "other"
    if how == "whole":
        recorded(code, path, 6, 5)
    else:
        open_end(path, code, 6)
    found, why = outcome(path)
    data = path.read_bytes()
    begin = begin_of(data)
    with Recording(path) as recording:
        end = begin + recording._used
    tally: Counter[str] = Counter()
    for changed in mutants(data[:end], begin - HEAD):
        other.write_bytes(changed + data[end:])
        turns, reason = outcome(other)
        assert turns == found[: len(turns)], "no frame is another one"
        if reason in ("damaged", "E481"):
            tally[reason] += 1
        elif turns == found:
            assert reason == why
            tally["the same"] += 1
        else:  # `used` may be one entry behind where a process was killed, so this is what a kill can leave
            assert (how, turns, reason) == ("killed", found[:-1], KILLED)
            tally["one frame less"] += 1
    assert tally["E481"] > 50 and tally["damaged"] > 300 and tally["one frame less"] <= 5, tally


@pytest.mark.slow
def test_an_edited_time_is_found_unless_all_is_written_anew(code: LiveCode, tmp_path: Path) -> None:
    path = tmp_path / "r"
    recorded(code, path, 6, 5)
    data, entries, found = path.read_bytes(), entries_of(path), turns_of(path)
    head = data[: begin_of(data) - HEAD]
    assert sealed(head, entries) == data
    assert entries[3][:6] == bytes([0, 1, 2, 1, 2, 1]), "nothing prescribed, number, cycle, and then the time"
    edited = entries[3][:6] + bytes([entries[3][6] ^ 2]) + entries[3][7:]
    path.write_bytes(data.replace(entries[3], edited))
    assert outcome(path) == (found[:3], "damaged")
    path.write_bytes(sealed(head, [*entries[:3], edited, *entries[4:]]))
    turns, why = outcome(path)
    assert why is None and [t.frame[COMMITTED] for t in turns] != [t.frame[COMMITTED] for t in found]
    assert list(replay(code, turns)) == turns
    path.write_bytes(sealed(head, entries[:-1]))
    assert outcome(path) == (found[:-1], "damaged"), "a recording that was closed has its last frame"


@pytest.mark.slow
def test_what_is_appended_to_a_whole_recording_is_found(code: LiveCode, tmp_path: Path) -> None:
    path = tmp_path / "r"
    recorded(code, path, 6, 5)
    data, found = path.read_bytes(), turns_of(path)
    path.write_bytes(data + b"\0" * PAGE + b"x")
    assert outcome(path) == (found, "damaged")
    path.write_bytes(data + b"\0" * PAGE)  # reserved, and not given back by a supervisor that was killed
    assert outcome(path) == (found, None)


@pytest.mark.slow
def test_format_1_is_read_with_a_note(tmp_path: Path) -> None:
    with Recording(OLD) as recording:
        assert "has no checksums" in recording.notes[0] and len(list(recording)) == 14 and recording.damaged is None
    data = OLD.read_bytes()
    (tmp_path / "r").write_bytes(data[:-1])
    assert outcome(tmp_path / "r")[1] == "damaged"
    (tmp_path / "r").write_bytes(data[:PAGE] + bytes(8))
    assert outcome(tmp_path / "r") == ([], KILLED)


@pytest.mark.slow
@pytest.mark.parametrize("turns", [-1, 0, 5])
def test_a_run_that_was_killed(turns: int, code: LiveCode, tmp_path: Path) -> None:
    """Before its first frame, and after it."""
    open_end(tmp_path / "r", code, turns)
    found, why = outcome(tmp_path / "r")
    assert why == KILLED and len(found) == turns + 1 and list(replay(code, found)) == found
    with (tmp_path / "r").open("r+b") as written:
        written.truncate(begin_of((tmp_path / "r").read_bytes()))
    assert outcome(tmp_path / "r")[1] == "damaged", "what was reserved for it is missing"


@pytest.mark.slow
def test_entries_that_are_not_counted(code: LiveCode, tmp_path: Path) -> None:
    """A process that is killed has written one more at most than it has counted."""
    path = tmp_path / "r"
    open_end(path, code, 5)
    data, found = path.read_bytes(), outcome(path)[0]
    begin = begin_of(data)
    with Recording(path) as recording:
        ends, frame, check, at = list[int](), [0] * recording.words, recording._first, begin
        for _ in found:
            _, check, at = file._entry(data, at, frame, check)
            ends.append(at - begin)
    for number, why in ((5, KILLED), (4, "damaged"), (1, "damaged")):
        path.write_bytes(data[: begin - HEAD] + ends[number - 1].to_bytes(8, "little") + data[begin - HEAD + 8 :])
        assert outcome(path) == (found[:number], why)


@pytest.mark.slow
def test_a_run_that_goes_on(code: LiveCode, tmp_path: Path) -> None:
    loop, path = Loop(code), tmp_path / "r"
    with closing(Recorder(path, {}, loop)):
        assert outcome(path) == ([], GOES_ON)
        loop.begin(0)
        with Recording(path) as recording:
            assert loop.go(5) == control.DONE
            assert len(list(recording)) == 1 and recording.lost == GOES_ON and recording.damaged is None
    assert outcome(path)[1] == KILLED


class Full:
    """A disk that has no room after so many reservations."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, left: int) -> None:
        self.left, allocate = left, os.posix_fallocate

        def reserve(descriptor: int, offset: int, length: int) -> None:
            self.left -= 1
            if self.left < 0:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            allocate(descriptor, offset, length)

        monkeypatch.setattr(file, "WINDOW", PAGE)
        monkeypatch.setattr(os, "posix_fallocate", reserve)


@pytest.mark.slow
@pytest.mark.parametrize("supervised", [False, True])
def test_a_full_disk_is_not_a_kill(
    supervised: bool, code: LiveCode, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    loop = Loop(code)
    loop.limit(5000)
    Full(monkeypatch, 3)
    with closing(Shared("full", loop)) as shared:
        recorder = Recorder(tmp_path / "r", {}, loop)
        run = Supervised(loop, shared, recorder, together=True) if supervised else Run(loop, recorder)
        with run:
            run.start()
            assert run.wait()
    report = run.report
    assert report.ending == "stopped" and report.frames == 5002 and 1 < report.recorded < 5000
    found, why = outcome(tmp_path / "r")
    assert len(found) == report.recorded and report.unrecorded == os.strerror(errno.ENOSPC)
    assert why == f"the file could not grow ({report.unrecorded})"
    data = (tmp_path / "r").read_bytes()
    place = begin_of(data) - HEAD
    (tmp_path / "r").write_bytes(data[:place] + (100).to_bytes(8, "little") + data[place + 8 :])
    assert outcome(tmp_path / "r")[1] == "damaged"


@pytest.mark.slow
def test_a_loop_that_is_killed_before_its_first_frame(code: LiveCode, tmp_path: Path) -> None:
    loop = Loop(code)
    with closing(Shared("early", loop)) as shared:
        recorder = Recorder(tmp_path / "r", {}, loop)
        with Supervised(loop, shared, recorder, together=True) as run:
            os.kill(pids(run)[0], signal.SIGKILL)
            assert run.wait() and run.report.ending == "died" and run.report.cycles == 0
    found, why = outcome(tmp_path / "r")
    assert [ENDINGS[turn.frame[ENDING]] for turn in found] == ["died"] and why is None
    assert list(replay(code, found)) == found
