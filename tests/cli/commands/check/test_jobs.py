"""`llfsm check --jobs N`: what is printed, and in which order, does not depend on N."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from random import Random

import pytest

from benchmarks.ring import ring
from tests.cli.running import COUNTER, LIGHTS, llfsm
from tests.processes import wait_for_processor_time
from tests.quick import examples, many

LATE = re.compile(r"^\S+: after .*\n", re.MULTILINE)
"""A verdict that is said early, where the machine is slow."""
FILES = {
    "holds": ring(2, 3),
    "faults": COUNTER,
    "broken": "machines: {m: {file: gone.machine.yaml}}\nschedule: [m]\n",
    "no yaml": "machines: {m: [\n",
    "unknown key": ring(2, 2) + "shedule: []\n",
    "warned": ring(2, 2).replace("rs: {go: {", "rs: {u: machine, go: {").replace("rs: {go: go", "rs: {u: m0, go: go"),
    "latin": "machines: {}\n# caf\u00e9\n",
}  # fmt: skip
ENDLESS = "p: G !(" + " && ".join(f"m{i}.n == 8" for i in range(9)) + ")\n"
"""Of the arrangement ring(9, 9): nobody waits for its verdict."""
LINES = ("p: G !(m0@ON && m1@ON)", "q: G F m0@ON", "r: G (m0@ON -> m0.n == 1)", "s: G m7@ON", "t: G (", "u: G true")


def folder(rng: Random, path: Path) -> None:
    """Some arrangements, also broken ones, most with properties."""
    for number in range(rng.randint(2, 7)):
        kind = rng.choice(list(FILES))
        below = path / rng.choice(("a", "b", "b/c"))
        below.mkdir(parents=True, exist_ok=True)
        encoding = "latin-1" if kind == "latin" else "utf-8"
        (below / f"f{number}.yaml").write_text(FILES[kind], encoding)
        if rng.random() < 0.8:
            (below / f"f{number}.ltl").write_text("\n".join(rng.sample(LINES, rng.randint(1, 2))))


def same(seed: int, path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path.mkdir()
    folder(Random(seed), path)
    monkeypatch.chdir(path)
    quiet = ["-q"] if seed % 3 == 0 else []
    done = [llfsm("check", "--jobs", str(jobs), *quiet) for jobs in (1, 2, 3)]
    told = [(each.returncode, each.stdout, LATE.sub("", each.stderr)) for each in done]
    assert told[1:] == told[:1] * 2
    assert told[0][1] or told[0][2] or quiet


@pytest.mark.slow
def test_random_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for seed in range(examples(12)):
        same(seed, tmp_path / str(seed), monkeypatch)


@pytest.mark.long
def test_many_random_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for seed in range(100, 100 + many(400)):
        same(seed, tmp_path / str(seed), monkeypatch)


@pytest.fixture
def three(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name in "abc":
        (tmp_path / f"{name}.yaml").write_text(ring(2, 3))
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.slow
def test_one_that_is_killed_is_one_failure(three: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from llfsm_verify.cli.commands.check import run as module

    real = module.verify

    def verify(arrangement, properties, options):
        if arrangement.path == "b.yaml":
            sys.stderr.write("half a line")
            os.kill(os.getpid(), signal.SIGKILL)
        return real(arrangement, properties, options)

    monkeypatch.setattr(module, "verify", verify)
    done = llfsm("check", "--jobs", "2")
    assert done.returncode == 4
    assert [line.split()[1] for line in done.stdout.splitlines()] == ["a.yaml:", "c.yaml:"]
    assert "b.yaml: error[E429]: the check was ended by the signal 9" in done.stderr
    assert "  hint: where memory is short, `--jobs 1` checks one arrangement at a time" in done.stderr


@pytest.mark.slow
def test_the_memory_is_shared(three: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from llfsm_verify.cli.commands.check import run as module
    from llfsm_verify.limits import default_memory

    real = module.verify

    def verify(arrangement, properties, options):
        sys.stderr.write(f"{options.limits.memory} {options.own[0].jobs}\n")
        return real(arrangement, properties, options)

    monkeypatch.setattr(module, "verify", verify)
    assert llfsm("check", "--jobs", "3").stderr.split() == [str(default_memory() // 3), "1"] * 3
    assert llfsm("check", "a.yaml", "--jobs", "3").stderr.split() == ["None", "3"]


def test_one_arrangement_needs_no_fork(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused() -> int:
        raise AssertionError

    monkeypatch.setattr(os, "fork", refused)
    assert llfsm("check", LIGHTS, "--jobs", "3").returncode == 0


@pytest.mark.parametrize(
    ("jobs", "said"), [("0", "'0' is not a whole number from 1"), ("9999", "9999 is more than 256")]
)
def test_wrong_numbers(jobs: str, said: str) -> None:
    done = llfsm("check", "--jobs", jobs)
    assert done.returncode == 2 and f"--jobs: {said}" in done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2, 3])
def test_an_interrupt_ends_all(jobs: int, tmp_path: Path) -> None:
    """What is known by then is said, and no process is left."""
    for name in "abc":
        (tmp_path / f"{name}.yaml").write_text(ring(9, 9))
        (tmp_path / f"{name}.ltl").write_text(ENDLESS)
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    command = [sys.executable, "-m", "llfsm_verify", "check", "--jobs", str(jobs), str(tmp_path)]
    process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if jobs == 1:
        wait_for_processor_time(process, 2.0)
    else:
        while process.poll() is None and len(_children(process.pid)) < min(jobs, 3):
            time.sleep(0.01)
        time.sleep(0.1)
    children = _children(process.pid)
    process.send_signal(signal.SIGINT)
    out, _ = process.communicate()
    assert process.returncode == 130, out
    assert len(out.split("fails  ")) <= jobs + 1
    assert not any(Path(f"/proc/{child}").exists() for child in children)


@pytest.mark.slow
def test_forks_end_with_the_parent(tmp_path: Path) -> None:
    for name in "ab":
        (tmp_path / f"{name}.yaml").write_text(ring(9, 9))
        (tmp_path / f"{name}.ltl").write_text(ENDLESS)
    process = subprocess.Popen([sys.executable, "-m", "llfsm_verify", "check", "--jobs", "2", str(tmp_path)])
    while process.poll() is None and len(_children(process.pid)) < 2:
        time.sleep(0.01)
    children = _children(process.pid)
    process.kill()
    process.wait()
    while any(_runs(child) for child in children):
        time.sleep(0.01)
    assert len(children) == 2


@pytest.mark.slow
@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&- >&- 2>&-"])
def test_streams_may_be_closed(closed: str, tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / f"{name}.yaml").write_text(ring(2, 3))
    command = ["sh", "-c", f'exec "$@" {closed}', "sh", sys.executable, "-m", "llfsm_verify", "check", "--jobs", "2"]
    done = subprocess.run([*command, "a.yaml", "b.yaml"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.count("holds")) == (0, 2 if closed == "2>&-" else 0), done


def _children(process: int) -> list[int]:
    found = Path(f"/proc/{process}/task/{process}/children")
    return [int(each) for each in found.read_text().split()] if found.exists() else []


def _runs(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
