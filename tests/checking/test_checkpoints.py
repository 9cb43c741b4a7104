"""A search that was saved and gone on with gives the result of one that was not."""

from __future__ import annotations

import json
import random
import subprocess
import sys
import time
from pathlib import Path

import pytest

from benchmarks.ring import ring
from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.verdict import Checkpointing, Limits, Options, Result
from llfsm_verify.checking.verify import verify
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.logic.properties import PropertySet, parse_properties

PROPERTIES = "never: G !(m0@ON && m1@ON && m2.n == 2)\nback: G (m0@ON -> F m0@OFF)\nalone: G !(m0@ON && m1@ON)"


def lines(text: str = PROPERTIES) -> PropertySet:
    return parse_properties([Source("ring.ltl", text)])


@pytest.fixture(scope="module")
def small() -> Arrangement:
    return load_arrangement_text(ring(4, 3))


def answers(result: Result) -> tuple[object, ...]:
    found = tuple((p.name, p.verdict, p.trace, p.notes) for p in result.properties)
    return result.complete, result.states, result.transitions, found, result.faults


def interrupted_often(arrangement: Arrangement, path: Path, step: int) -> tuple[Result, int]:
    """The result of a search that is ended again and again, each time after `step` more configurations."""
    most, pieces = 0, 0
    while True:
        most += step
        wanted = Options(Limits(max_states=most), True, checkpoint=Checkpointing(path, 1e9, resume=True))
        result = verify(arrangement, lines(), wanted)
        if result.complete:
            return result, pieces
        pieces += 1


def test_a_search_in_pieces_gives_the_same_result(small: Arrangement, tmp_path: Path) -> None:
    whole = verify(small, lines(), Options(keep_all_bits=True))
    result, pieces = interrupted_often(small, tmp_path / "ring.checkpoint", 1_500)
    assert pieces > 5
    assert answers(result) == answers(whole)


def test_saving_all_the_time_changes_nothing(small: Arrangement, tmp_path: Path) -> None:
    whole = verify(small, lines(), Options(keep_all_bits=True))
    path = tmp_path / "ring.checkpoint"
    assert answers(verify(small, lines(), Options(keep_all_bits=True, checkpoint=Checkpointing(path, 0.0)))) == answers(
        whole
    )
    assert path.exists()
    resumed = verify(small, lines(), Options(keep_all_bits=True, checkpoint=Checkpointing(path, 1e9, resume=True)))
    assert answers(resumed) == answers(whole)


def test_another_check_is_refused(small: Arrangement, tmp_path: Path) -> None:
    path = tmp_path / "ring.checkpoint"
    verify(small, lines(), Options(Limits(max_states=500), True, checkpoint=Checkpointing(path)))
    again = Checkpointing(path, resume=True)
    cases = (
        (load_arrangement_text(ring(3, 3)), lines(), True, "another arrangement"),
        (small, lines("never: G m0@ON"), True, "other properties"),
        (small, lines(), False, "other options"),
    )
    for arrangement, properties, keep, words in cases:
        with pytest.raises(DiagnosticError) as raised:
            verify(arrangement, properties, Options(keep_all_bits=keep, checkpoint=again))
        (found,) = raised.value.diagnostics
        assert found.code == "E414"
        assert words in found.message
    data = path.read_bytes()
    path.write_bytes(data.replace(b'"version": "', b'"version": "9', 1))
    with pytest.raises(DiagnosticError) as raised:
        verify(small, lines(), Options(keep_all_bits=True, checkpoint=again))
    assert "version" in raised.value.diagnostics[0].message


def test_a_damaged_file_is_refused(small: Arrangement, tmp_path: Path) -> None:
    path = tmp_path / "ring.checkpoint"
    again = Options(keep_all_bits=True, checkpoint=Checkpointing(path, resume=True))
    verify(small, lines(), Options(Limits(max_states=500), True, checkpoint=Checkpointing(path)))
    data = path.read_bytes()
    generator = random.Random(0)
    for _ in range(60):
        if generator.random() < 0.5:
            changed = data[: generator.randrange(len(data))]
        else:
            at = generator.randrange(len(data))
            changed = data[:at] + bytes([data[at] ^ 1 << generator.randrange(8)]) + data[at + 1 :]
        path.write_bytes(changed)
        with pytest.raises(DiagnosticError) as raised:
            verify(small, lines(), again)
        assert raised.value.diagnostics[0].code in ("E413", "E414")


def test_a_folder_that_does_not_exist_is_said_at_once(small: Arrangement, tmp_path: Path) -> None:
    with pytest.raises(DiagnosticError) as raised:
        verify(small, lines(), Options(checkpoint=Checkpointing(tmp_path / "no" / "file")))
    assert raised.value.diagnostics[0].code == "E413"


@pytest.mark.slow
def test_killed_a_hundred_times(tmp_path: Path) -> None:
    """`kill -9` at random moments; what is on disk is always a whole checkpoint, and leads to the same result."""
    arrangement, properties, path = tmp_path / "ring.yaml", tmp_path / "ring.ltl", tmp_path / "ring.checkpoint"
    arrangement.write_text(ring(5, 3))
    properties.write_text(PROPERTIES)
    command = [sys.executable, "-m", "llfsm_verify", "verify", str(arrangement), str(properties), "--keep-all-bits",
               "--format", "json"]  # fmt: skip
    whole = json.loads(subprocess.run(command, capture_output=True, text=True, check=False).stdout)
    saving = [*command, "--checkpoint", str(path), "--checkpoint-every", "0.01", "--resume"]
    generator, killed, saved = random.Random(1), 0, 0
    for _ in range(100):
        process = subprocess.Popen(saving, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(generator.uniform(0.3, 1.0))
        killed += process.poll() is None
        process.kill()
        process.wait()
        saved += path.exists()
        if generator.random() < 0.2:
            result = json.loads(subprocess.run(saving, capture_output=True, text=True, check=False).stdout)
            assert {**result, "seconds": 0} == {**whole, "seconds": 0}
            path.unlink(missing_ok=True)
    assert killed > 50
    assert saved > 30
