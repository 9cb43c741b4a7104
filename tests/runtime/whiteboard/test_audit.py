"""Audit logs: every change but one at the end is seen, and that one too where the last hash was kept."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.runtime.whiteboard import audit
from llfsm_verify.runtime.whiteboard.audit import BEGUN, ENDED, AuditLog, verify
from tests.cli.running import llfsm
from tests.quick import examples


def written(path: Path, entries: int = 4) -> list[bytes]:
    log = AuditLog(path, lambda: datetime(2026, 1, 2, tzinfo=UTC))
    log.note(BEGUN, {"pid": 1})
    for number in range(entries - 2):
        log.note("command", {"kind": "write", "value": f"é{number}\n\u2028", "frame": number})
    log.note(ENDED, {})
    log.close()
    return path.read_bytes().splitlines(keepends=True)


def codes(path: Path) -> list[str]:
    with pytest.raises(DiagnosticError) as caught:
        verify(path)
    return [d.code for d in caught.value.diagnostics]


def test_a_log_goes_on_where_it_ended(tmp_path: Path) -> None:
    path = tmp_path / "log"
    lines = written(path)
    assert len(lines) == 4 and verify(path).entries == 4 and not verify(path).open
    assert json.loads(lines[1])["value"] == "é0\n\u2028"
    written(path)
    found = verify(path)
    assert found.entries == 8 and not found.open
    log = AuditLog(path)
    assert log.last == found.last
    log.note(BEGUN, {})
    with pytest.raises(DiagnosticError, match="another run writes it"):
        AuditLog(path)
    log.close()
    assert verify(path).open


@given(st.data())
@settings(max_examples=examples(80), deadline=None)
def test_every_change_is_seen(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    path = tmp_path_factory.mktemp("log") / "log"
    lines = written(path, 5)
    last = verify(path).last
    changed = list(lines)
    at = data.draw(st.integers(0, len(lines) - 1))
    how = data.draw(st.sampled_from(("byte", "drop", "twice", "swap", "cut")))
    if how == "byte":
        place = data.draw(st.integers(0, len(lines[at]) - 1))
        other = data.draw(st.integers(0, 255).filter(lambda b: b != lines[at][place]))
        changed[at] = lines[at][:place] + bytes([other]) + lines[at][place + 1 :]
    elif how == "drop":
        del changed[at]
    elif how == "twice":
        changed.insert(at, lines[at])
    elif how == "swap":
        to = data.draw(st.integers(0, len(lines) - 1).filter(lambda n: n != at))
        changed[at], changed[to] = changed[to], changed[at]
    else:
        changed = [b"".join(lines)[: data.draw(st.integers(0, len(b"".join(lines)) - 1))]]
    path.write_bytes(b"".join(changed))
    if whole(path):
        assert verify(path).last != last
    else:
        assert codes(path) == ["E501"]
        if path.stat().st_size:
            with pytest.raises(DiagnosticError):
                AuditLog(path)


def whole(path: Path) -> bool:
    try:
        verify(path)
    except DiagnosticError:
        return False
    return True


def test_what_is_no_log(tmp_path: Path) -> None:
    path = tmp_path / "log"
    for text in ("x\n", "[]\n", '{"after": 1}\n', "[" * 5000 + "\n", '{"what": "a", "after": "0"}\n', "\xff"):
        path.write_text(text, encoding="latin-1")
        assert codes(path) == ["E501"]
    (tmp_path / "link").symlink_to(path)
    os.mkfifo(tmp_path / "pipe")
    for place in (tmp_path / "link", tmp_path / "pipe", tmp_path, tmp_path / "no" / "log"):
        with pytest.raises(DiagnosticError, match="E500"):
            AuditLog(place)
    assert codes(tmp_path / "pipe") == ["E500"]
    path.write_text("")  # as it was before the first run, or after all lines were removed
    assert codes(path) == ["E501"]
    AuditLog(path).close()


def test_a_log_that_cannot_be_written_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = AuditLog(tmp_path / "log")
    log.note(BEGUN, {})
    before = log.last

    def full(descriptor: int, data: bytes) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(audit.os, "write", full)
    log.note("command", {})
    monkeypatch.undo()
    log.note("command", {})
    assert log.failure == "No space left on device" and log.last == before
    log.close()
    assert verify(tmp_path / "log").entries == 1


RUN = (
    "run",
    "models/komodo_region/arrangement.yaml",
    "--simulate",
    "--rate",
    "0",
    "--for",
    "1s",
    "--whiteboard",
    "full",
)
FULL = """
import os, sys
from llfsm_verify.cli import main
left = int(sys.argv[1])
def full(descriptor):
    global left
    left -= 1
    if left < 0:
        raise OSError(28, os.strerror(28))
os.fdatasync = full
sys.exit(main(sys.argv[2:]))
"""


@pytest.mark.slow
def test_a_run_whose_log_is_full_says_so(tmp_path: Path) -> None:
    """From the beginning it does not run; later its exit code is 1."""
    log, recording = tmp_path / "log", tmp_path / "r"
    words = [*RUN, "--audit", str(log), "--record", str(recording)]

    def run(lines: int) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-c", FULL, str(lines), *words]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    done = run(0)
    assert done.returncode == 3 and "E500" in done.stderr and "No space left on device" in done.stderr
    assert not log.exists() and not recording.exists()
    done = run(1)
    assert done.returncode == 1, done.stderr
    assert done.stdout.endswith(f"last line {verify(log).last}; it ended before the run: No space left on device\n")
    assert verify(log).entries == 1 and verify(log).open
    recording.unlink()
    done = run(2)
    assert done.returncode == 0 and done.stdout.endswith(f"last line {verify(log).last}\n")
    ended = json.loads(log.read_bytes().splitlines()[-1])
    assert ended["recordings"] == {str(recording): hashlib.sha256(recording.read_bytes()).hexdigest()}


def test_the_command(tmp_path: Path) -> None:
    path = tmp_path / "log"
    lines = written(path)
    done = llfsm("audit", "verify", str(path))
    assert done.returncode == 0 and "as it was written, 4 entries" in done.stdout
    last = verify(path).last
    assert llfsm("audit", "verify", str(path), "--last", last).returncode == 0
    path.write_bytes(b"".join(lines[:-1]))
    done = llfsm("audit", "verify", str(path))
    assert done.returncode == 0 and done.stdout.endswith("the last run in it has no end\n")
    assert llfsm("audit", "verify", str(path), "--last", last).returncode == 1
    assert llfsm("audit", "verify", str(path), "--last", "zz").returncode == 2
    path.write_bytes(lines[0] + lines[2])
    done = llfsm("audit", "verify", str(path))
    assert done.returncode == 1 and "E501" in done.stderr and "line 1 was changed, or lines between" in done.stderr
    assert llfsm("audit", "verify", str(tmp_path / "none")).returncode == 3


@pytest.mark.parametrize("how", ["removed", "shortened", "longer"])
def test_a_log_that_somebody_else_changes_is_not_gone_on_with(tmp_path: Path, how: str) -> None:
    path = tmp_path / "log"
    lines = written(path)
    log = AuditLog(path)
    if how == "removed":
        path.unlink()
    else:
        path.write_bytes(b"".join(lines[:-1] if how == "shortened" else [*lines, b"{}\n"]))
    log.note("command", {})
    assert log.failure == "somebody else has changed or removed it"
    log.close()
    assert how == "removed" or len(path.read_bytes().splitlines()) == (3 if how == "shortened" else 5)


def test_half_a_line_is_taken_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "log"
    written(path)
    log = AuditLog(path)
    write = os.write
    monkeypatch.setattr(os, "write", lambda file, data: write(file, data[:20]))
    log.note("command", {})
    monkeypatch.undo()
    assert log.failure == "no space left on device"
    log.close()
    assert verify(path).last == log.last
    log = AuditLog(path)
    log.note("command", {"value": "x" * audit.MOST_LINE})
    assert log.failure == "an entry is too long"
    log.close()
    assert verify(path).last == log.last


def test_lines_that_are_missing_at_the_beginning(tmp_path: Path) -> None:
    path = tmp_path / "log"
    path.write_bytes(b"".join(written(path)[1:]))
    with pytest.raises(DiagnosticError, match="lines before it are missing"):
        verify(path)
