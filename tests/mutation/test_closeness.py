"""Which slow tests are tried on a mutant first."""

from __future__ import annotations

from tests.mutation.trying import _closeness


def test_tests_in_the_same_folders_come_first():
    files = ["tests/api/test_running.py", "tests/runtime/live/test_loop.py", "tests/runtime/loading/test_checking.py",
             "tests/runtime/loading/test_loading.py", "tests/runtime/test_audit.py"]  # fmt: skip
    mutated = "llfsm_verify/runtime/loading/checking.py"
    ranked = sorted(files, key=lambda name: -_closeness(name, mutated))
    assert ranked[:2] == ["tests/runtime/loading/test_checking.py", "tests/runtime/loading/test_loading.py"]
    assert ranked[-1] == "tests/api/test_running.py"
