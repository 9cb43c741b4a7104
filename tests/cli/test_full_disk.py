"""Disks that are full and folders that are read-only: each command says so, replaces nothing and leaves nothing."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.running import FAULTY, LIGHTS

pytestmark = pytest.mark.slow
BOTH = ("-p", "both: G !(ns@GREEN && ew@GREEN)")
COMMANDS = {
    "certificate": (("verify", FAULTY, "-q", *BOTH, "--certificate", "{}/c.json"), "E450"),
    "traces": (("verify", FAULTY, "-q", *BOTH, "--save-traces", "{}"), "E405"),
    "new traces": (("verify", FAULTY, "-q", *BOTH, "--save-traces", "{}/traces"), "E405"),
    "structure": (("kripke", FAULTY, "-o", "{}/x.json"), "E422"),
    "drawing": (("draw", FAULTY, "-o", "{}/x.dot"), "E407"),
    "query": (("query", FAULTY, "ns@GREEN", "--save", "{}/q.yaml"), "E405"),
    "init": (("init", "{}/there", "--name", "crossing"), "E462"),
    "checkpoint": (("verify", FAULTY, "-q", "--checkpoint", "{}/c.ckpt"), "E413"),
}
SCRIPT = """
import json, os, sys
from llfsm_verify.cli import main
folder, commands = sys.argv[1], json.loads(sys.argv[2])
for name, words in commands.items():
    process = os.fork()
    if process == 0:
        sys.stdout = open(1, "w", closefd=False)
        os.write(2, f"== {name}\\n".encode())
        os._exit(main([word.format(folder) for word in words]))
    code = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
    files = sorted(os.path.join(at, file) for at, _, files in os.walk(folder) for file in files)
    os.write(2, f"left: {files}\\n== {code}\\n".encode())
"""


def in_a_namespace(mounting: str, folder: Path) -> dict[str, tuple[str, int]]:
    """What each command says, and its exit code, where `mounting` (of a shell) has changed the folder `$1`."""
    import json

    script = f'mount --make-rprivate / && {mounting} && shift && exec "$@"'
    inside = ["unshare", "-m", "sh", "-c", script, "sh", str(folder)]
    try:
        mounted = subprocess.run([*inside, "true"], capture_output=True, check=False).returncode == 0
    except FileNotFoundError:  # there is no unshare
        mounted = False
    if not mounted:
        pytest.skip("nothing can be mounted here: that needs root, and a container that allows it")
    commands = json.dumps({name: words for name, (words, _) in COMMANDS.items()})
    done = subprocess.run(
        [*inside, sys.executable, "-c", SCRIPT, str(folder), commands],
        capture_output=True,
        text=True,
        check=False,
        env=dict(os.environ),
    )
    assert done.returncode == 0, done.stderr
    pieces = done.stderr.split("== ")[1:]
    heads = [piece.partition("\n") for piece in pieces[::2]]
    return {name: (said, int(code)) for (name, _, said), code in zip(heads, pieces[1::2], strict=True)}


def test_a_read_only_folder(tmp_path: Path) -> None:
    old = tmp_path / "both.trace.yaml"
    old.write_text("trace: 1\n")
    found = in_a_namespace('mount --bind "$1" "$1" && mount -o remount,bind,ro "$1"', tmp_path)
    assert found.keys() == COMMANDS.keys()
    for name, (_, code) in COMMANDS.items():
        said, exit_code = found[name]
        assert exit_code == 3 and f"error[{code}]" in said and "Read-only file system" in said, (name, said)
    assert [path.name for path in tmp_path.iterdir()] == [old.name] and old.read_text() == "trace: 1\n"


def test_a_full_disk(tmp_path: Path) -> None:
    """Nothing is left of 64 KiB; names of files can still be made."""
    fill = 'mount -t tmpfs -o size=64k none "$1" && { cat /dev/zero > "$1/rest" 2>/dev/null; true; }'
    found = in_a_namespace(fill, tmp_path)
    for name, (_, code) in COMMANDS.items():
        said, exit_code = found[name]
        if (
            name == "checkpoint"
        ):  # nothing is saved so early; a save that fails is a warning (tests/cli/test_checkpoint.py)
            assert exit_code == 0, said
        else:
            assert exit_code == 3 and f"error[{code}]" in said and "No space left on device" in said, (name, said)
            assert said.endswith(f"left: {[str(tmp_path / 'rest')]}\n"), (name, said)


@pytest.mark.long
def test_a_cache_that_cannot_be_made(tmp_path: Path) -> None:
    """Also as root: a folder cannot be below a file."""
    (tmp_path / "file").write_text("")
    done = subprocess.run(
        [sys.executable, "-m", "llfsm_verify", "verify", LIGHTS, "-q"],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "LLFSM_CACHE": str(tmp_path / "file" / "below")},
    )
    assert done.returncode == 0 and "compiled for this run only" in done.stderr and "Not a directory" in done.stderr
