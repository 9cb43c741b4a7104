"""Files that files name: what is no regular file is not waited for, and what is not one of ours is not shown."""

from __future__ import annotations

import json
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path

import pytest

from llfsm_verify.certificate import canonical, main
from tests.cli.running import FAULTY, LIGHTS, Done, llfsm

BOTH = "both: G !(ns@GREEN && ew@GREEN)"
SPECIAL = ("pipe", "socket", "folder", "/dev/zero", "/dev/tty", "/proc/kmsg", "/proc/self/mem")


@contextmanager
def special(folder: Path, name: str) -> Iterator[str]:
    """Something that is not a regular file with a size; skipped where this system does not have it."""
    path = folder / name
    if name == "pipe":
        os.mkfifo(path)
    elif name == "folder":
        path.mkdir()
    elif name == "socket":
        with socket.socket(socket.AF_UNIX) as server:
            here = Path.cwd()
            os.chdir(folder)  # names of sockets are short
            try:
                server.bind(name)
            finally:
                os.chdir(here)
            yield str(path)
        return
    elif not os.path.lexists(name):
        pytest.skip(f"this system has no {name}")
    yield str(path)


def arrangement(folder: Path, file: str) -> str:
    path = folder / "a.yaml"
    path.write_text(f"machines:\n  m: {{file: '{file}'}}\nschedule: [m]\n")
    return str(path)


def automaton(folder: Path, file: str) -> tuple[str, str]:
    path = folder / "p.ltl"
    path.write_text(f'automaton never bad: "{file}"\n')
    return LIGHTS, str(path)


def trace(folder: Path, file: str) -> str:
    """A trace of the traffic lights that names another arrangement."""
    assert llfsm("verify", FAULTY, "-q", "-p", BOTH, "--save-traces", str(folder)).returncode == 1
    path = folder / "both.trace.yaml"
    lines = [f"arrangement: {file}" if x.startswith("arrangement:") else x for x in path.read_text().splitlines()]
    path.write_text("\n".join(lines) + "\n")
    return str(path)


def asked(kind: str, folder: Path, file: str) -> tuple[Done, str]:
    """What is said where `file` is named, and what a diagnostic about its name begins with."""
    if kind == "machine":
        path = arrangement(folder, file)
        return llfsm("verify", path, "-q"), f"{path}:2:13: "
    if kind == "automaton":
        words = automaton(folder, file)
        return llfsm("verify", *words, "-q"), f"{words[1]}:1:22: "
    path = trace(folder, file)
    return llfsm("replay", path), f"{path}:3:14: "


@pytest.mark.parametrize("name", SPECIAL)
@pytest.mark.parametrize("kind", ["machine", "automaton", "trace"])
def test_nothing_special_is_waited_for(kind: str, name: str, tmp_path: Path) -> None:
    with special(tmp_path, name) as file:
        done, place = asked(kind, tmp_path, file)
    if Path(file).is_file():  # of /proc: it has no size, so it counts as empty
        assert done.returncode == 3 and (
            "the file is empty" in done.stderr or "is not a file of automata" in done.stderr
        )
    else:
        assert done.returncode == 3 and done.stderr.startswith(f"{place}error[E"), done.stderr
        assert "a file is expected" in done.stderr or "this is a directory" in done.stderr


@pytest.mark.parametrize("name", SPECIAL)
def test_a_certificate_waits_for_no_input(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], certified: dict[str, object]
) -> None:
    with special(tmp_path, name) as file:
        inputs = certified["inputs"]
        assert isinstance(inputs, list)
        inputs = [[file, *inputs[0][1:]], *inputs[1:]]
        digests = {**certified["digests"], "inputs": sha256(canonical(inputs).encode()).hexdigest()}  # type: ignore[dict-item]
        path = tmp_path / "c.json"
        path.write_text(canonical({**certified, "inputs": inputs, "digests": digests}) + "\n")
        assert main([str(path)]) == 1
    said = capsys.readouterr().out
    assert said.startswith("rejected: ")
    assert name.startswith("/proc") or said == "rejected: an input is not a regular file\n"


@pytest.fixture(scope="module")
def certified(tmp_path_factory: pytest.TempPathFactory) -> dict[str, object]:
    path = tmp_path_factory.mktemp("certificate") / "c.json"
    assert llfsm("verify", LIGHTS, "-q", "-p", BOTH, "--certificate", str(path)).returncode == 0
    found = json.loads(path.read_text())
    assert isinstance(found, dict)
    return found


SECRETS = {
    "passwd": "root:x:0:0:hunter2:/root:/bin/bash\nmachine:x:1:1:hunter2:/home:/bin/sh\n",
    "key": "-----BEGIN PRIVATE KEY-----\nhunter2\n-----END PRIVATE KEY-----\n",
    "arrow": "hunter2 -> secret\n",
    "formula": "G hunter2\n",
    "settings": "database:\n  password: hunter2\n  machine: hunter2\n",
    "json": '{"password": "hunter2", "state": 3}\n',
    "netrc": "machine example.com login me password hunter2\n",
    "list": "- hunter2\n",
    "word": "hunter2",
    "tag": "!!hunter2 x\n",
    "alias": "*hunter2\n",
    "control": "hunter2\x07\n",
    "twice": "hunter2: 1\nhunter2: 2\n",
}


@pytest.mark.parametrize("text", SECRETS.values(), ids=SECRETS)
@pytest.mark.parametrize("kind", ["machine", "automaton", "trace"])
def test_a_file_that_is_not_one_of_ours_is_not_shown(kind: str, text: str, tmp_path: Path) -> None:
    (tmp_path / "secret").write_text(text)
    done, place = asked(kind, tmp_path, str(tmp_path / "secret"))
    assert done.returncode == 3 and done.stderr.startswith(f"{place}error[E"), done.stderr
    assert "hunter2" not in done.stdout + done.stderr and done.stderr.count("error[") == 1


@pytest.mark.parametrize("kind", ["machine", "automaton", "trace"])
def test_no_byte_is_told_of_what_is_not_text(kind: str, tmp_path: Path) -> None:
    (tmp_path / "secret").write_bytes(b"\xca\xfe\xba\xbe")
    done, place = asked(kind, tmp_path, str(tmp_path / "secret"))
    assert done.returncode == 3 and done.stderr.startswith(f"{place}error[E")
    assert "this is not UTF-8 text" in done.stderr and "0xca" not in done.stderr.lower()


@pytest.mark.parametrize("form", ["json", "junit", "sarif"])
def test_no_format_shows_it(form: str, tmp_path: Path) -> None:
    (tmp_path / "secret").write_text(SECRETS["passwd"])
    done = llfsm("verify", arrangement(tmp_path, "secret"), "--format", form)
    assert done.returncode == 3 and "hunter2" not in done.stdout + done.stderr


MACHINE = "machine: M\nstates:\n  - {name: A, transitions: [{when: 'true', to: A}]}\n"


@pytest.mark.parametrize(
    ("old", "new", "shown"),
    [
        ("machine:", "machin:", "machin: M"),
        ("machine:", "Machine:", "Machine: M"),
        ("states:", "stats:", "stats:"),
        ("name: A,", "name A,", "name A,"),
        ("to: A", "to: B", "to: B"),
        ("M\n", "[M\n", "machine: [M"),
    ],
)
def test_the_line_of_a_mistake_in_a_machine_is_shown(old: str, new: str, shown: str, tmp_path: Path) -> None:
    assert MACHINE.count(old)
    (tmp_path / "m.machine.yaml").write_text(MACHINE.replace(old, new))
    done = llfsm("verify", arrangement(tmp_path, "m.machine.yaml"), "-q")
    assert done.returncode == 3 and shown in done.stderr and f"{tmp_path}/m.machine.yaml:" in done.stderr


@pytest.mark.parametrize("text", ['{"machine": "M", "states": [{"nam": "A"}]}', "{machine: M,\n states: [{nam: A}]}"])
def test_the_line_of_a_mistake_in_a_machine_in_flow_style_is_shown(text: str, tmp_path: Path) -> None:
    (tmp_path / "m.json").write_text(text)
    done = llfsm("verify", arrangement(tmp_path, "m.json"), "-q")
    assert (
        done.returncode == 3 and "| " in done.stderr and "nam" in done.stderr and f"{tmp_path}/m.json:" in done.stderr
    )


def test_the_line_of_a_mistake_in_an_automaton_is_shown(tmp_path: Path) -> None:
    (tmp_path / "x.hoa").write_text("/* mine */ HOA: v1\nStates: many\n")
    done = llfsm("verify", *automaton(tmp_path, "x.hoa"), "-q")
    assert done.returncode == 3 and "Stat" in done.stderr and f"{tmp_path}/x.hoa:2:" in done.stderr


def test_a_pipe_on_the_command_line_is_read(tmp_path: Path) -> None:
    """Also with a certificate, which is made of what was read and opens the pipe no second time."""
    from concurrent.futures import ThreadPoolExecutor

    pipe, certificate = tmp_path / "pipe.ltl", tmp_path / "c.json"
    os.mkfifo(pipe)
    with ThreadPoolExecutor() as pool:
        written = pool.submit(pipe.write_text, BOTH)
        done = llfsm("verify", LIGHTS, str(pipe), "-q", "--certificate", str(certificate))
        written.result(60)
    assert done.returncode == 0 and certificate.is_file()
