"""Memory that the operating system refuses is a limit like any other, and what is there stays."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.ring import ring
from llfsm_verify.kripke.memory import OutOfMemory, Region
from llfsm_verify.limits import LimitReached

TOO_MUCH = (1 << 47) - (1 << 30)
"""Bytes: all that a process can address, so that also a system that promises everything refuses."""


def test_a_region_that_cannot_grow_keeps_what_it_has() -> None:
    region = Region(1)
    region.write(b"here")
    size, address = region.size, region.address
    with pytest.raises(OutOfMemory, match="the operating system gives no more memory"):
        region.grow(TOO_MUCH)
    assert (region.size, region.address, region.read(0, 4)) == (size, address, b"here")
    region.close()


def test_a_region_that_cannot_be_made() -> None:
    with pytest.raises(LimitReached, match="operating system"):
        Region(TOO_MUCH)
    with pytest.raises(MemoryError):
        Region(TOO_MUCH)


LIMITED = (
    "import resource, sys; from llfsm_verify.cli import main; "
    "resource.setrlimit(resource.RLIMIT_AS, (int(sys.argv[1]),) * 2); sys.exit(main(['verify', *sys.argv[2:]]))"
)


@pytest.mark.slow
def test_a_search_that_gets_no_more_memory_is_unknown(tmp_path: Path) -> None:
    (tmp_path / "ring.yaml").write_text(ring(7, 3))
    warm = [sys.executable, "-m", "llfsm_verify", "verify", str(tmp_path / "ring.yaml"), "--max-states", "9"]
    subprocess.run(warm, capture_output=True, check=False)  # numba needs memory of its own to compile
    command = [sys.executable, "-c", LIMITED, str(500 << 20), str(tmp_path / "ring.yaml"), "--keep-all-bits",
               "--chains", "off", "--cone", "off", "--engine", "explicit"]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 4, done.stderr
    assert "the operating system gives no more memory" in done.stdout
    assert "holds" not in done.stdout
    assert done.stderr == ""
