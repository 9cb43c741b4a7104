"""A serial line, as a pseudo-terminal: lines both ways, noise, and a plug that is pulled."""

from __future__ import annotations

import json
import os
import tty
from pathlib import Path

import pytest

from llfsm_verify.diagnostics import DiagnosticError
from tests.runtime.ports.bench import bench, declared, lines_of

TEXT = """\
ports:
  board:
    kind: serial
    device: line
    baud: 57600
    inputs: [level]
    outputs: {level: seen}
    on_failure: safe
    safe: {level: -3}
"""


def test_lines_both_ways_and_a_plug_that_is_pulled(tmp_path: Path) -> None:
    device = tmp_path / "line"
    master, slave = os.openpty()
    tty.setraw(master)
    device.symlink_to(os.ttyname(slave))
    with bench(*declared(TEXT, tmp_path)) as made:
        os.close(slave)
        lines = lines_of(master, made.turn)
        assert json.loads(next(lines)) == {"seen": -1}
        os.write(master, b'\x00\xffnoise\n{"level": 9}\n{"level": 2}\r\n')
        assert json.loads(next(lines)) == {"seen": 2}
        counts = made.ports.counts["board"]
        assert (counts.malformed, counts.refused, counts.taken) == (1, 1, 1)
        os.close(master)
        made.until(made.has("level", -3))
        assert counts.failures == 1 and made.ports.failure is None

        master, slave = os.openpty()  # it is plugged in again, as another device
        tty.setraw(master)
        device.unlink()
        device.symlink_to(os.ttyname(slave))
        made.now += 1
        assert json.loads(next(lines_of(master, made.turn))) == {"seen": -3}
        os.write(master, b'{"level": 4}\n')
        made.until(made.has("level", 4))
        os.close(slave)
        made.end("stopped")
    os.close(master)


def test_a_line_that_is_there_for_others_or_not_at_all(tmp_path: Path) -> None:
    master, slave = os.openpty()
    (tmp_path / "line").symlink_to(os.ttyname(slave))
    other = TEXT.replace("board", "other").replace("[level]", "[far]").replace("level: -3", "far: 1")
    with bench(*declared(TEXT, tmp_path)), pytest.raises(DiagnosticError, match="cannot be opened"):
        bench(*declared(other, tmp_path)).__enter__()
    os.close(master)
    os.close(slave)
    (tmp_path / "line").unlink()
    with pytest.raises(DiagnosticError, match="No such file") as caught:
        bench(*declared(TEXT, tmp_path)).__enter__()
    assert [d.code for d in caught.value.diagnostics] == ["E495"]
