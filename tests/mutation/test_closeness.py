"""Which slow tests are tried on a mutant first."""

from __future__ import annotations

from tests.mutation.trying import _closeness


def test_tests_in_the_same_folders_come_first():
    files = [
        "tests/api/test_running.py",
        "tests/runtime/live/test_loop.py",
        "tests/runtime/swapping/test_update_check.py",
        "tests/runtime/swapping/test_hot_swap.py",
        "tests/runtime/whiteboard/test_audit.py",
    ]
    mutated = "llfsm_verify/runtime/swapping/check_process.py"
    ranked = sorted(files, key=lambda name: -_closeness(name, mutated))
    assert ranked[:2] == ["tests/runtime/swapping/test_update_check.py", "tests/runtime/swapping/test_hot_swap.py"]
    assert ranked[-1] == "tests/api/test_running.py"
