"""A structure that cannot be written to the end leaves nothing behind, and the files before it as they were."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from llfsm_verify.cli.commands.kripke import run as writing
from llfsm_verify.cli.io import progress
from tests.cli.running import LIGHTS, llfsm
from tests.processes import ended, wait_for_text_below

# A structure that never ends.
SCRIPT = """
import sys, time
from llfsm_verify.cli import main
from llfsm_verify.extensions.graphs import aut

def portions(_):
    yield "des (0, 0, 1)\\n" * 100_000
    while True:
        time.sleep(0.01)
        yield ""

aut.aut = portions
sys.exit(main())
"""


def breaks(monkeypatch: pytest.MonkeyPatch, limit: str) -> None:
    """From the first portion written on, the memory or the time is used up."""

    def portions(_):
        yield "des (0, 0, 1)\n"
        if limit == "memory":
            monkeypatch.setattr("llfsm_verify.limits.memory_in_use", lambda: 1 << 60)
        else:
            monkeypatch.setattr("llfsm_verify.limits.Budget.seconds", 1e9)
        yield "one\n"
        yield "another\n"

    monkeypatch.setattr("llfsm_verify.extensions.graphs.aut.aut", portions)


@pytest.mark.parametrize(("limit", "words"), [("memory", ()), ("time", ("--timeout", "1000"))])
def test_a_limit_while_writing(tmp_path, monkeypatch, limit, words):
    target = tmp_path / "x.aut"
    target.write_text("precious")
    breaks(monkeypatch, limit)
    done = llfsm("kripke", LIGHTS, "-o", str(target), *words)
    assert done.returncode == 4 and f"nothing was written: the {limit} limit" in done.stderr
    assert target.read_text() == "precious" and [p.name for p in tmp_path.iterdir()] == ["x.aut"]


def test_a_limit_while_writing_to_standard_output(monkeypatch):
    breaks(monkeypatch, "memory")
    done = llfsm("kripke", LIGHTS, "--format", "aut")
    assert done.returncode == 4 and "breaks off: the memory limit" in done.stderr and done.stdout.startswith("des")
    assert "another" not in done.stdout


def test_a_part_may_take_longer_to_write_than_to_find(tmp_path, monkeypatch):
    target = tmp_path / "x.aut"
    breaks(monkeypatch, "time")
    words = ("--max-states", "40", "--timeout", "1000", "--partial")
    assert llfsm("kripke", LIGHTS, "-o", str(target), *words).returncode == 4
    assert target.read_text().endswith("another\n")


@pytest.mark.slow
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGINT, 130)])
def test_a_signal_while_writing(tmp_path, number, code):
    out = tmp_path / "out"
    out.mkdir()
    command = [sys.executable, "-c", SCRIPT, "kripke", LIGHTS, "-o", str(out / "x.aut")]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    wait_for_text_below(out, process)  # an empty file is there before, to see whether one can be
    assert [p.name for p in out.iterdir()] == [f".x.aut.{process.pid}"]
    process.send_signal(number)
    _, errors = ended(process)
    assert process.returncode == code and "Traceback" not in errors
    assert list(out.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "command", [("kripke", LIGHTS, "--format", "aut"), ("draw", LIGHTS, "--format", "dot")], ids=["kripke", "draw"]
)
def test_a_pipe_is_written_and_stays_one(tmp_path, command):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with ThreadPoolExecutor() as pool:
        read = pool.submit(pipe.read_text)
        done = llfsm(*command, "-o", str(pipe))
        assert done.returncode == 0 and read.result() == llfsm(*command).stdout
    assert pipe.is_fifo() and list(tmp_path.iterdir()) == [pipe]


def test_a_link_stays_one(tmp_path):
    (tmp_path / "link.aut").symlink_to(tmp_path / "x.aut")
    assert llfsm("kripke", LIGHTS, "-o", str(tmp_path / "link.aut")).returncode == 0
    assert (tmp_path / "link.aut").is_symlink() and (tmp_path / "x.aut").is_file()


def test_handlers_are_put_back():
    before = signal.getsignal(signal.SIGTERM)
    assert llfsm("kripke", LIGHTS, "-o", "/dev/null/x.json").returncode == 3
    assert signal.getsignal(signal.SIGTERM) is before


def test_a_reader_who_has_gone_ends_the_writing():
    script = (
        "import sys\nfrom llfsm_verify.cli.commands.kripke.run import write\n"
        "made = []\n"
        "def pieces():\n"
        "    for i in range(10_000):\n"
        "        made.append(i)\n"
        "        yield 'x' * 4096\n"
        "write(pieces(), None)\n"
        "print(len(made), file=sys.stderr)\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert process.stdout is not None and process.stderr is not None
    process.stdout.read(10)
    process.stdout.close()
    assert int(process.stderr.read()) < 1000
    assert process.wait(60) == 0
    process.stderr.close()


def test_a_terminal_sees_how_much_is_written(tmp_path, monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setattr(progress, "PATIENCE", 0)
    monkeypatch.setattr(progress, "INTERVAL", 0)
    monkeypatch.setenv("TERM", "xterm")
    writing.write(("x" * (1 << 20) for _ in range(5)), str(tmp_path / "x.json"))
    assert "writing" in terminal.getvalue() and "MiB" in terminal.getvalue()


def test_a_mistake_of_ours_is_not_said_to_be_the_disk(tmp_path):
    def portions():
        yield "one\n"
        raise ValueError("ours")

    with pytest.raises(ValueError, match="ours"):
        writing.write(portions(), str(tmp_path / "a.aut"))
    assert list(tmp_path.iterdir()) == []
