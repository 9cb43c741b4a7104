"""`llfsm sweep`, `llfsm_verify.sweep` and `check.sweep`, as users call them."""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

import llfsm_verify as lv
from llfsm_verify.extensions.sweep import local
from llfsm_verify.extensions.sweep.command import _Watched
from llfsm_verify.plug import StatusLine
from tests.cli.running import llfsm
from tests.extensions.sweep.counting import written
from tests.outside import load, needs

TEXT = "arrangements: [a.yaml]\nproperties: [q.ltl]\nconstants: {LIMIT: [2, 5]}\noptions: {engine: explicit}\n"


@pytest.mark.slow
def test_rows_are_kept_and_not_checked_again(tmp_path: Path) -> None:
    path = written(tmp_path, TEXT)
    first = llfsm("sweep", str(path), "--jobs", "1")
    results = tmp_path / "SWEEP.results.jsonl"
    assert first.returncode == 0 and f"rows saved: {results}" in first.stderr and "already" not in first.stderr
    assert "2 combinations: holds 2" in first.stdout
    kept = results.read_text()
    again = llfsm("sweep", str(path))
    assert (again.returncode, again.stdout) == (0, first.stdout) and results.read_text() == kept
    assert f"2 of 2 rows were in {results} already" in again.stderr


@pytest.mark.parametrize(
    ("options", "code", "said"),
    [
        (["--jobs", "0"], 2, "--jobs: '0' is not a whole number from 1"),
        (["--format", "xml"], 2, "--format"),
        (["--scheduler", "amqp://localhost:1"], 2, "--scheduler: there is no scheduler `amqp`"),
        (["--scheduler", "127.0.0.1:8786"], 2, "for one of Dask write tcp://127.0.0.1:8786"),
        (["--scheduler", "localhost"], 2, "for one of Dask write tcp://localhost:8786"),
        (["--scheduler", "node7:9000"], 2, "for one of Dask write tcp://node7:9000"),
        (["--scheduler", "dask"], 2, "--scheduler: there is no scheduler `dask`"),
        (["--scheduler", "tcp://localhost:8786", "--jobs", "2"], 2, "leave out --jobs"),
        (["--memory", "3"], 2, "has no unit"),
        (["--timeout", "-1"], 2, "positive"),
        (["-o", "x.csv"], 2, "write `--format csv > x.csv` for a file"),
        (["--results", "."], 3, "error[E596]"),
    ],
)
def test_wrong_usage(options: list[str], code: int, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written(tmp_path, TEXT)
    monkeypatch.chdir(tmp_path)
    found = llfsm("sweep", "SWEEP.yaml", *options)
    assert found.returncode == code and said in found.stderr, found


def test_a_wrong_sweep_is_exit_code_3(tmp_path: Path) -> None:
    found = llfsm("sweep", str(written(tmp_path, TEXT.replace("LIMIT", "LIMITS"))))
    assert found.returncode == 3 and "error[E591]: no machine of a.yaml has a constant `LIMITS`" in found.stderr
    assert not (tmp_path / "SWEEP.results.jsonl").exists()
    assert llfsm("sweep", str(tmp_path / "none.yaml")).returncode == 3


def test_files_in_each_others_place_are_one_mistake(tmp_path: Path) -> None:
    path = written(tmp_path, TEXT)
    for command, file, said in (
        ("lint", path, "call `llfsm sweep"),
        ("sweep", tmp_path / "a.yaml", "name it in a sweep"),
    ):
        found = llfsm(command, str(file))
        assert found.returncode == 3 and found.stderr.count("error[") == found.stderr.count("error[E019]") == 1
        assert said in found.stderr


@pytest.mark.parametrize("name", [".", "..", "/"])
def test_a_folder_is_no_sweep(name: str) -> None:
    found = llfsm("sweep", name)
    assert found.returncode == 3 and "error[E003]: this is a directory" in found.stderr, found


@pytest.mark.slow
def test_what_may_be_meant_otherwise_is_said_once(tmp_path: Path) -> None:
    path = written(tmp_path, TEXT.replace("q.ltl", "p.ltl"), p_ltl="few: n <= 5\n")
    found = llfsm("sweep", str(path), "--jobs", "1", "--format", "csv")
    assert found.stderr.count("warning[W302]") == 1 and found.stdout.count("\n") == 3


@pytest.mark.slow
def test_limits_of_the_command_are_those_of_each_check(tmp_path: Path) -> None:
    found = llfsm("sweep", str(written(tmp_path, TEXT)), "--timeout", "1e-6", "--jobs", "1", "--format", "json")
    data = json.loads(found.stdout)
    assert found.returncode == data["exit_code"] == 4 and {row["state"] for row in data["rows"]} == {"timeout"}
    assert (
        llfsm("sweep", str(tmp_path / "SWEEP.yaml"), "--jobs", "1").returncode == 0
    )  # with other limits, another check


def test_other_commands_do_not_stumble_over_it(tmp_path: Path) -> None:
    written(tmp_path, TEXT)
    checked = llfsm("check", str(tmp_path))
    assert "SWEEP" not in checked.stdout + checked.stderr and checked.returncode == 0, checked
    found = llfsm("lint", str(tmp_path / "SWEEP.yaml"))
    assert found.returncode == 3 and "E0" in found.stderr


def test_progress_has_a_rate_and_the_time_left() -> None:
    watched = _Watched(StatusLine(), Path("r"))
    watched.began(SimpleNamespace(combinations=[None] * 100), 20, [])  # type: ignore[arg-type]
    watched._started = time.monotonic() - 10
    for _ in range(40):
        watched.ended(None)  # type: ignore[arg-type]
    assert re.fullmatch(r"60 of 100 rows, [34]\.\d/s, about (9|10) s to go", watched.text())


@pytest.mark.slow
def test_ctrl_c_keeps_what_is_known(tmp_path: Path) -> None:
    """The whole command in a process of its own, interrupted after some rows; then it goes on."""
    values = "initial: {n: {from: 0, to: 20}, left.count: {from: 0, to: 9}}\n"
    path = written(tmp_path, f"arrangements: [a.yaml]\nproperties: [p.ltl]\n{values}")
    command = [sys.executable, "-m", "llfsm_verify", "sweep", str(path), "--jobs", "1"]
    results = tmp_path / "SWEEP.results.jsonl"
    done = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ})
    while done.poll() is None and not (results.exists() and results.read_text().count("\n") > 3):
        time.sleep(0.01)
    done.send_signal(signal.SIGINT)
    out, said = done.communicate(timeout=300)
    assert done.returncode == 130, (out, said)
    known = results.read_text().count("\n") - 1
    assert 3 <= known < 210 and f"{known} of 210 combinations" in out
    assert f"ended after {known} of 210 rows; to go on: llfsm sweep {path} --results {results}" in said
    lines = results.read_text().splitlines()[1:]
    assert all(json.loads(line)["state"] == "done" for line in lines)


@pytest.mark.slow
def test_sigterm_leaves_no_folder(tmp_path: Path, request: pytest.FixtureRequest) -> None:
    values = "{n: {from: 0, to: 20}, left.count: {from: 0, to: 9}, right.count: {from: 0, to: 4}}"
    path = written(tmp_path, f"arrangements: [a.yaml]\ninitial: {values}\n")
    temporary = Path(tempfile.mkdtemp(prefix="t"))  # short: names of sockets have at most 107 characters
    request.addfinalizer(lambda: shutil.rmtree(temporary, ignore_errors=True))
    command = [sys.executable, "-m", "llfsm_verify", "sweep", str(path), "--jobs", "1"]
    results = tmp_path / "SWEEP.results.jsonl"
    done = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"TMPDIR": str(temporary)},
    )
    while done.poll() is None and not (results.exists() and results.read_text().count("\n") > 3):
        time.sleep(0.01)
    done.send_signal(signal.SIGTERM)
    out, said = done.communicate(timeout=300)
    known = results.read_text().count("\n") - 1
    assert done.returncode == 128 + signal.SIGTERM, (known, out[-300:], said)
    assert 3 <= known < 1050 and f"{known} of 1,050 combinations" in out
    assert f"ended after {known} of 1,050 rows; to go on: llfsm sweep {path} --results {results}" in said
    assert not list(temporary.iterdir())


def test_a_system_that_starts_no_process_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))

    monkeypatch.setattr(local, "ProcessPoolExecutor", refuse)
    found = llfsm("sweep", str(written(tmp_path, TEXT)))
    assert found.returncode == 3 and "error[E598]: no process can be started: Too many open files" in found.stderr
    assert "ended after 0 of 2 rows; to go on: " in found.stderr


# ---------------------------------------------------------------- from Python


@pytest.mark.slow
def test_rows_from_python(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path, TEXT)
    rows = lv.sweep(path, jobs=1)
    assert [row.values["LIMIT"] for row in rows] == [2, 5] == [row.values["LIMIT"] for row in rows.rows]
    assert rows.exit_code == 0 and len(rows) == 2 and rows[1].verdict == "holds"
    assert dict(rows[0].verdicts) == {"other": "holds", "faults": "holds"}
    assert str(rows).endswith("2 combinations: holds 2\n") and repr(rows) == "<Rows 2 combinations: holds 2>"
    assert not (tmp_path / "SWEEP.results.jsonl").exists()
    monkeypatch.chdir(tmp_path)
    data = {"arrangements": "a.yaml", "properties": ["q.ltl"], "constants": {"LIMIT": [2, 5]},
            "options": {"engine": "explicit"}}  # fmt: skip
    same = lv.sweep(data, jobs=1, results="r.jsonl")
    assert [row.key for row in same] == [row.key for row in rows] and (tmp_path / "r.jsonl").is_file()


@pytest.mark.parametrize(
    ("wrong", "kind"),
    [
        ({"timeout": -1}, ValueError), ({"memory": "3"}, ValueError), ({"jobs": 0}, ValueError),
        ({"jobs": 1.5}, ValueError), ({"scheduler": "amqp://x"}, ValueError), ({"scheduler": 8786}, ValueError),
        ({"jobs": 2, "scheduler": "tcp://localhost:8786"}, ValueError), ({"scheduler": "localhost"}, ValueError),
    ],
)  # fmt: skip
def test_wrong_arguments(wrong: dict[str, object], kind: type[Exception], tmp_path: Path) -> None:
    with pytest.raises(kind):
        lv.sweep(written(tmp_path, TEXT), **wrong)  # type: ignore[arg-type]


def test_a_model_is_no_sweep(tmp_path: Path) -> None:
    written(tmp_path)
    with pytest.raises(TypeError, match="a sweep is the path of a file or a mapping of its shape, not <"):
        lv.sweep(lv.load(tmp_path / "a.yaml"))  # type: ignore[arg-type]


@pytest.mark.slow
def test_a_data_frame(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = lv.sweep(written(tmp_path, TEXT), jobs=1)
    monkeypatch.setitem(sys.modules, "pandas", SimpleNamespace(DataFrame=list))
    found = rows.frame()
    assert [each["LIMIT"] for each in found] == [2, 5] and {each["other"] for each in found} == {"holds"}
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ModuleNotFoundError, match=r"frame needs pandas, .*llfsm-verify\[pandas\]"):
        rows.frame()


@needs("pandas")
def test_a_data_frame_of_pandas(tmp_path: Path) -> None:
    pandas = load("pandas")
    frame = lv.sweep(written(tmp_path, TEXT), jobs=1).frame()
    assert isinstance(frame, pandas.DataFrame) and list(frame["LIMIT"]) == [2, 5]


# ---------------------------------------------------------------- in tests


@pytest.mark.slow
def test_check_sweep(pytester: pytest.Pytester) -> None:
    folder = pytester.path
    written(folder, TEXT)
    (folder / "MORE.yaml").write_text(TEXT.replace("q.ltl", "p.ltl").replace("[a.yaml]", "[a.yaml, b/faulty.yaml]"))
    pytester.makepyfile("""
        def test_good(check):
            assert len(check.sweep("SWEEP.yaml", jobs=1)) == 2

        def test_bad(check):
            check.sweep("MORE.yaml", jobs=1)

        def test_both(check):
            check.sweep("MORE.yaml", jobs=1, violated=["a.yaml", "b/faulty.yaml"])

        def test_not_violated(check):
            check.sweep("SWEEP.yaml", jobs=1, violated=["a.yaml"])
    """)
    found = pytester.runpytest_inprocess("-p", "no:cacheprovider")
    found.assert_outcomes(passed=2, failed=2)
    found.stdout.fnmatch_lines([
        "*row 1 is violated: arrangement = a.yaml, LIMIT = 2, properties = p.ltl", "*asked at *test_check_sweep.py:5",
        "*In all rows: *", "*row*arrangement*LIMIT*", "*no row of a.yaml is violated, and one was expected to be",
    ])  # fmt: skip
