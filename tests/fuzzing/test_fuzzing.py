"""Mutated files end as documented, in an answer or in diagnostics; so do the cases in which something was found."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.fuzzing.case import case_of, kept_cases
from tests.fuzzing.readers import READERS, make
from tests.fuzzing.running import run_case
from tests.quick import many

KEPT = kept_cases()
QUICK = 3
"""Cases of each reader in the short test."""
LONG = {"traces", "certificates", "invariants", "checkpoints"}
"""Readers of files that commands have to write first."""


@pytest.mark.parametrize("name", sorted(KEPT))
def test_what_was_found_is_mended(name):
    outcome = run_case(KEPT[name])
    assert outcome.found is None, f"{outcome.found}\n{outcome.detail}"


@pytest.mark.slow
@pytest.mark.parametrize("reader", sorted(READERS.keys() - LONG))
def test_a_few_of_each_reader(reader):
    for number in range(QUICK):
        outcome = run_case(make(reader, 11, number))
        assert outcome.found is None, f"{reader} 11 {number}: {outcome.found}\n{outcome.detail}"


@pytest.mark.long
@pytest.mark.parametrize("share", range(3))
def test_many_of_each_reader(share):
    """A third of the readers in a process: it takes seconds to make what mutations start from."""
    readers = sorted(READERS)[share::3]
    chosen = [part for name in readers for part in ("--reader", name)]
    asked = [sys.executable, "-m", "tests.fuzzing", str(many(600) * len(readers)), "12", *chosen]
    done = subprocess.run(asked, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.long
def test_commands():
    readers = [part for name in sorted(READERS) for part in ("--reader", name)]
    asked = [sys.executable, "-m", "tests.fuzzing", str(many(40 * len(READERS))), "13", "--processes", *readers]
    done = subprocess.run(asked, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
def test_a_case_reads_back():
    for number in range(10):
        case = make("words", 3, number)
        assert case_of(case.to_json()) == case
