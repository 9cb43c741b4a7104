"""Compiled modules leave little where they are not used any more: a run that gets other machines compiles many."""

from __future__ import annotations

import subprocess
import sys

import pytest

COMPILE = """
import gc
from llfsm_verify.backends.native.machine_code import MachineCode
from llfsm_verify.runtime.live.generations import llvm_text

def pages():
    gc.collect()
    return int(open("/proc/self/statm").read().split()[1])

def compile(count):
    for _ in range(count):
        MachineCode(llvm_text, "thorough")

compile(20)
before = pages()
compile(60)
print(4 * (pages() - before))
"""


@pytest.mark.slow
def test_sixty_modules_leave_little() -> None:
    """They left 5 MB."""
    done = subprocess.run([sys.executable, "-c", COMPILE], capture_output=True, text=True, check=True)
    assert int(done.stdout) < 2500, done.stdout
