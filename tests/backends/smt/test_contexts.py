"""Terms that are dropped on another thread, while this one makes others."""

from __future__ import annotations

import subprocess
import sys

import pytest

PROGRAM = """
import gc, threading
import llfsm_verify.backends.smt
import z3
from llfsm_verify.backends.smt import tolerant

def make(context, rounds):
    x = z3.Int("x", context)
    for _ in range(rounds):
        for i in range(50):
            terms = [x * i + i, x > i]
            terms.append(terms)  # a circle, which only the collector finds
            del terms

over = threading.Event()
def collect():
    while not over.is_set():
        gc.collect()
collector = threading.Thread(target=collect)
collector.start()
for context in (z3.main_ctx(), tolerant(z3.Context())):
    make(context, 60)
over.set()
collector.join()
print("done")
"""


@pytest.mark.slow
def test_terms_may_be_dropped_on_any_thread() -> None:
    """Without the context's tolerance this ends in a segmentation fault."""
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "done\n"), done
