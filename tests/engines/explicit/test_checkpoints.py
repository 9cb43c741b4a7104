"""A search that was saved and gone on with gives the result of one that was not."""

from __future__ import annotations

import errno
import json
import math
import os
import random
import signal
import subprocess
import sys
import threading
from hashlib import sha256
from pathlib import Path

import pytest

from benchmarks.ring import ring
from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.verdict import Options, Result
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source
from llfsm_verify.engines.explicit import checkpoints
from llfsm_verify.engines.explicit.checkpoints import CheckpointWarning
from llfsm_verify.engines.explicit.options import Checkpointing, ExplicitOptions
from llfsm_verify.kripke import checkpoint, sharing
from llfsm_verify.kripke.checkpoint import FORMAT, KIND, Reservation
from llfsm_verify.kripke.compiled import Kernels
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.verification.verify import verify
from tests.cli.running import llfsm
from tests.processes import wait_for_processor_time
from tests.quick import many

PROPERTIES = "never: G !(m0@ON && m1@ON && m2.n == 2)\nback: G (m0@ON -> F m0@OFF)\nalone: G !(m0@ON && m1@ON)"


def lines(text: str = PROPERTIES) -> PropertySet:
    return parse_properties([Source("ring.ltl", text)])


@pytest.fixture(scope="module")
def small() -> Arrangement:
    return load_arrangement_text(ring(4, 3))


def answers(result: Result) -> tuple[object, ...]:
    found = tuple((p.name, p.verdict, p.trace, p.notes) for p in result.properties)
    return result.complete, result.exploration.states, result.exploration.transitions, found, result.faults


def interrupted_often(arrangement: Arrangement, path: Path, step: int) -> tuple[Result, int]:
    """The result of a search that is ended again and again, each time after `step` more configurations."""
    most, pieces = 0, 0
    while True:
        most += step
        wanted = Options(
            Limits(max_states=most), True, own=(ExplicitOptions(checkpoint=Checkpointing(path, 1e9, resume=True)),)
        )
        result = verify(arrangement, lines(), wanted, engine="explicit")
        if result.complete:
            return result, pieces
        pieces += 1


@pytest.mark.slow
def test_a_search_in_pieces_gives_the_same_result(small: Arrangement, tmp_path: Path) -> None:
    whole = verify(small, lines(), Options(keep_all_bits=True), engine="explicit")
    result, pieces = interrupted_often(small, tmp_path / "ring.checkpoint", 1_500)
    assert pieces > 5
    assert answers(result) == answers(whole)


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
@pytest.mark.parametrize("call", [1, 7, 12, 15])
def test_ctrl_c_at_any_moment_is_followed_by_a_save(
    small: Arrangement, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, jobs: int, call: int
) -> None:
    """The signal comes while a kernel runs, at any of its calls: those that move the slots of a table among them."""
    for name, value in (("SMALLEST", 64), ("FEWEST", 64)):
        monkeypatch.setattr(sharing, name, value)
    kept = ExplicitOptions(jobs=jobs, checkpoint=Checkpointing(tmp_path / "ring.checkpoint", 1e9, resume=True))
    wanted, run, calls = Options(keep_all_bits=True, own=(kept,)), Kernels.run, iter(range(100))

    def interrupted(self: Kernels, name: str, block: int) -> int:
        code = run(self, name, block)
        if threading.current_thread() is threading.main_thread() and next(calls, None) == call:
            signal.raise_signal(signal.SIGINT)
        return code

    with monkeypatch.context() as patch:
        patch.setattr(Kernels, "run", interrupted)
        assert verify(small, lines(), wanted, engine="explicit").interrupted
    result = verify(small, lines(), wanted, engine="explicit")
    assert result.exploration.resumed_from is not None
    assert answers(result) == answers(verify(small, lines(), Options(keep_all_bits=True), engine="explicit"))


@pytest.mark.slow
def test_saving_all_the_time_changes_nothing(small: Arrangement, tmp_path: Path) -> None:
    whole = verify(small, lines(), Options(keep_all_bits=True), engine="explicit")
    path = tmp_path / "ring.checkpoint"
    assert answers(
        verify(
            small,
            lines(),
            Options(keep_all_bits=True, own=(ExplicitOptions(checkpoint=Checkpointing(path, 0.0)),)),
            engine="explicit",
        )
    ) == answers(whole)
    assert path.exists()
    resumed = verify(
        small,
        lines(),
        Options(keep_all_bits=True, own=(ExplicitOptions(checkpoint=Checkpointing(path, 1e9, resume=True)),)),
        engine="explicit",
    )
    assert answers(resumed) == answers(whole)


@pytest.mark.slow
def test_violations_too_long_to_be_saved_are_found_again(
    small: Arrangement, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "ring.checkpoint"
    limited = Options(Limits(max_states=2_500), True, own=(ExplicitOptions(checkpoint=Checkpointing(path)),))
    verify(small, lines(), limited, engine="explicit")
    assert b'"violations": [[[' in path.read_bytes()
    monkeypatch.setattr(checkpoints, "LONGEST_WALKS", 0)
    verify(small, lines(), limited, engine="explicit")
    assert b'"violations": [null, null, null]' in path.read_bytes()
    resumed = verify(
        small,
        lines(),
        Options(keep_all_bits=True, own=(ExplicitOptions(checkpoint=Checkpointing(path, 1e9, resume=True)),)),
        engine="explicit",
    )
    whole = verify(small, lines(), Options(keep_all_bits=True), engine="explicit")
    assert resumed.exploration.resumed_from == str(path)
    assert [p.verdict for p in resumed.properties] == [p.verdict for p in whole.properties]


def test_another_check_is_refused(small: Arrangement, tmp_path: Path) -> None:
    path = tmp_path / "ring.checkpoint"
    verify(
        small,
        lines(),
        Options(Limits(max_states=500), True, own=(ExplicitOptions(checkpoint=Checkpointing(path)),)),
        engine="explicit",
    )
    again = Checkpointing(path, resume=True)
    cases = (
        (load_arrangement_text(ring(3, 3)), lines(), True, "another arrangement"),
        (small, lines("never: G m0@ON"), True, "other properties"),
        (small, lines(), False, "other options"),
    )
    for arrangement, properties, keep, words in cases:
        with pytest.raises(DiagnosticError) as raised:
            verify(
                arrangement,
                properties,
                Options(keep_all_bits=keep, own=(ExplicitOptions(checkpoint=again),)),
                engine="explicit",
            )
        (found,) = raised.value.diagnostics
        assert found.code == "E414"
        assert words in found.message
    data = path.read_bytes()
    path.write_bytes(data.replace(b'"version": "', b'"version": "9', 1))
    with pytest.raises(DiagnosticError) as raised:
        verify(small, lines(), Options(keep_all_bits=True, own=(ExplicitOptions(checkpoint=again),)), engine="explicit")
    assert "version" in raised.value.diagnostics[0].message


@pytest.mark.slow
def test_a_damaged_file_is_refused(small: Arrangement, tmp_path: Path) -> None:
    path = tmp_path / "ring.checkpoint"
    again = Options(keep_all_bits=True, own=(ExplicitOptions(checkpoint=Checkpointing(path, resume=True)),))
    verify(
        small,
        lines(),
        Options(Limits(max_states=500), True, own=(ExplicitOptions(checkpoint=Checkpointing(path)),)),
        engine="explicit",
    )
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
            verify(small, lines(), again, engine="explicit")
        assert raised.value.diagnostics[0].code in ("E413", "E414")


def test_a_folder_that_does_not_exist_is_said_at_once(small: Arrangement, tmp_path: Path) -> None:
    with pytest.raises(DiagnosticError) as raised:
        verify(
            small,
            lines(),
            Options(own=(ExplicitOptions(checkpoint=Checkpointing(tmp_path / "no" / "file")),)),
            engine="explicit",
        )
    assert raised.value.diagnostics[0].code == "E413"


@pytest.mark.long
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="the system tells no processor times of processes")
def test_killed_many_times(tmp_path: Path) -> None:
    """`kill -9` at random moments; what is on disk is always a whole checkpoint, and leads to the same result."""
    arrangement, properties, path = tmp_path / "ring.yaml", tmp_path / "ring.ltl", tmp_path / "ring.checkpoint"
    arrangement.write_text(ring(5, 3))
    properties.write_text(PROPERTIES)
    command = [sys.executable, "-m", "llfsm_verify", "verify", str(arrangement), str(properties), "--keep-all-bits",
               "--format", "json"]  # fmt: skip
    subprocess.run(command, capture_output=True, check=False)  # compiles the kernels
    before = os.times()
    whole = json.loads(subprocess.run(command, capture_output=True, text=True, check=False).stdout)
    after = os.times()
    seconds = after.children_user + after.children_system - before.children_user - before.children_system
    saving = [*command, "--checkpoint", str(path), "--checkpoint-every", "0.01", "--resume"]
    generator, killed, saved = random.Random(1), 0, 0
    rounds = max(8, many(100))
    for _ in range(rounds):
        process = subprocess.Popen(saving, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        wait_for_processor_time(process, generator.uniform(0.6, 1.3) * seconds)
        killed += process.poll() is None
        process.kill()
        process.wait()
        left = {p.name for p in tmp_path.iterdir()} - {arrangement.name, properties.name, path.name}
        assert left <= {path.name + ".tmp"}
        saved += path.exists() and path.stat().st_size > 0
        if generator.random() < 0.2:
            result = json.loads(subprocess.run(saving, capture_output=True, text=True, check=False).stdout)
            assert {**result, "seconds": 0, "resumed_from": None} == {**whole, "seconds": 0}
            assert {p.name for p in tmp_path.iterdir()} <= {arrangement.name, properties.name, path.name}
            path.unlink(missing_ok=True)
    assert min(killed, saved) > 0, (killed, saved)


# -------------------------------------------------- what must not be lost


def refused(arrangement: Arrangement, path: Path) -> Diagnostic:
    with pytest.raises(DiagnosticError) as raised:
        verify(
            arrangement,
            lines(),
            Options(keep_all_bits=True, own=(ExplicitOptions(checkpoint=Checkpointing(path)),)),
            engine="explicit",
        )
    (found,) = raised.value.diagnostics
    return found


@pytest.mark.slow
def test_only_checkpoints_and_empty_files_are_replaced(small: Arrangement, tmp_path: Path) -> None:
    path = tmp_path / "thesis.txt"
    path.write_text("years of work")
    assert refused(small, path).code == "E415"
    assert path.read_text() == "years of work"
    (tmp_path / "link").symlink_to(path)
    assert refused(small, tmp_path / "link").code == "E415"
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    for other in (tmp_path / "pipe", tmp_path / "folder", Path("/dev/null")):
        assert refused(small, other).code == "E415"
    (tmp_path / "new.tmp").write_text("notes of mine")
    assert refused(small, tmp_path / "new").code == "E415"
    assert (tmp_path / "new.tmp").read_text() == "notes of mine"
    assert not (tmp_path / "new").exists()
    path.write_text("")
    result = verify(
        small,
        lines(),
        Options(keep_all_bits=True, own=(ExplicitOptions(checkpoint=Checkpointing(path, 0.0)),)),
        engine="explicit",
    )
    assert result.complete
    assert path.read_bytes().startswith(KIND)
    path.write_bytes(KIND + b"0\nof an earlier version")
    assert verify(
        small,
        lines(),
        Options(keep_all_bits=True, own=(ExplicitOptions(checkpoint=Checkpointing(path, 0.0)),)),
        engine="explicit",
    ).complete
    assert path.read_bytes().startswith(FORMAT)


def test_a_link_is_kept(small: Arrangement, tmp_path: Path) -> None:
    (tmp_path / "deep").mkdir()
    link, path = tmp_path / "link", tmp_path / "deep" / "file"
    link.symlink_to(path)
    verify(
        small,
        lines(),
        Options(keep_all_bits=True, own=(ExplicitOptions(checkpoint=Checkpointing(link, 0.0)),)),
        engine="explicit",
    )
    assert link.is_symlink()
    assert path.read_bytes().startswith(FORMAT)


@pytest.mark.slow
def test_left_overs_of_a_killed_run_are_used_up(small: Arrangement, tmp_path: Path) -> None:
    path, new = tmp_path / "file", tmp_path / "file.tmp"
    for left in (b"", FORMAT[:5], FORMAT + b"{}"):
        new.write_bytes(left)
        path.write_bytes(b"")
        resume = Checkpointing(path, 0.0, resume=True)
        assert verify(
            small, lines(), Options(keep_all_bits=True, own=(ExplicitOptions(checkpoint=resume),)), engine="explicit"
        ).complete
        assert [p.name for p in tmp_path.iterdir()] == ["file"]
        path.unlink()


def test_nothing_is_left_where_nothing_was_saved(tmp_path: Path) -> None:
    place = Reservation(tmp_path / "file")
    assert [p.name for p in tmp_path.iterdir()] == ["file"]
    place.release()
    assert not list(tmp_path.iterdir())


HOLDING = (
    "import sys; from pathlib import Path; from llfsm_verify.kripke.checkpoint import Reservation; "
    "place = Reservation(Path(sys.argv[1])); place.save({}, []) if sys.argv[2:] else None; print('held', flush=True); "
    "sys.stdin.read()"
)


@pytest.mark.slow
@pytest.mark.parametrize("saved", [(), ("saved",)])
def test_two_processes_do_not_share_a_file(small: Arrangement, tmp_path: Path, saved: tuple[str, ...]) -> None:
    path = tmp_path / "file"
    command = [sys.executable, "-c", HOLDING, str(path), *saved]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "held\n"
        found = refused(small, path)
        assert found.code == "E413"
        assert "another search" in found.message
        other.kill()
    assert verify(
        small,
        lines(),
        Options(keep_all_bits=True, own=(ExplicitOptions(checkpoint=Checkpointing(path, 0.0)),)),
        engine="explicit",
    ).complete


def test_a_file_put_in_its_place_meanwhile_stays(tmp_path: Path) -> None:
    place = Reservation(tmp_path / "file")
    (tmp_path / "other").write_text("mine")
    (tmp_path / "other").rename(tmp_path / "file")
    with pytest.raises(OSError, match="another file"):
        place.save({}, [])
    place.release()
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("file", "mine")]


@pytest.mark.slow
def test_what_cannot_be_saved_is_a_warning_and_tried_again(
    small: Arrangement, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = verify(small, lines(), Options(keep_all_bits=True), engine="explicit")
    tries = 0

    def full(*_: object) -> None:
        nonlocal tries
        tries += 1
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(checkpoint, "write", full)
    monkeypatch.setattr(checkpoints, "SHARE", math.inf)  # however long a try took, the next comes with the next report
    path = tmp_path / "file"
    with pytest.warns(CheckpointWarning, match=r"W402.*No space left on device; nothing has been saved") as told:
        result = verify(
            small,
            lines(),
            Options(keep_all_bits=True, own=(ExplicitOptions(checkpoint=Checkpointing(path, 0.0)),)),
            engine="explicit",
        )
    assert answers(result) == answers(whole)
    assert tries > 1
    assert len(told) == 1
    assert not (tmp_path / "file.tmp").exists()


@pytest.mark.long
@pytest.mark.parametrize(
    ("key", "value"),
    [("target", "x"), ("numbers", 5), ("numbers", {}), ("numbers", [1, 2, "x"]), ("violations", []),
     ("violations", [7, None, None]), ("violations", [[[0], [None], "x"], None, None]),
     ("violations", [[[], [], None]] * 3),
     ("violations", [[[0, 1, 0], [0, 0], 1], None, None]), ("violations", [[[10**9], [], None], None, None]),
     ("search", None), ("search", "chains")],
)  # fmt: skip
def test_a_header_of_another_shape_is_refused_also_without_assertions(
    small: Arrangement, tmp_path: Path, key: str, value: object
) -> None:
    path, model, properties = tmp_path / "file", tmp_path / "ring.yaml", tmp_path / "ring.ltl"
    model.write_text(ring(4, 3))
    properties.write_text(PROPERTIES)
    with_file = ["verify", str(model), str(properties), "--keep-all-bits", "--checkpoint", str(path)]
    assert llfsm(*with_file, "--max-states", "500").returncode == 1
    first, line, rest = path.read_bytes().split(b"\n", 2)
    data = first + b"\n" + json.dumps({**json.loads(line), key: value}).encode() + b"\n" + rest[: -checkpoint.DIGEST]
    path.write_bytes(data + sha256(data).digest())
    command = [sys.executable, "-O", "-m", "llfsm_verify", *with_file, "--resume"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr.count("error[E413]")) == (3, 1), done.stderr
