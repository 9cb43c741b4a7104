"""Mutants of a toy package: fatal ones are killed, also by tests that start processes, and equivalent ones survive."""

from __future__ import annotations

import pytest

from tests.mutation import __main__ as program
from tests.mutation.operators import mutants
from tests.mutation.recording import record
from tests.mutation.sampling import sample
from tests.mutation.scratch import Project, copy_of
from tests.mutation.trying import Outcome, Trial

pytestmark = pytest.mark.long

SOURCE = """\
LIMIT = 3


def larger(a, b):
    return a if a > b else b


def count(n):
    i = 0
    while i < n:
        i += 1
    return i


def said():
    return "said"


def never():
    return 7


def little():
    return LIMIT - 1


def largest(n):
    return max(range(n))


def child():
    return 5
"""
TESTS = {
    "test_larger.py": """\
from toy.values import larger


def test_larger():
    assert larger(1, 2) == 2 and larger(2, 1) == 2
""",
    "test_count.py": """\
import pytest
from toy.values import count


def test_nothing_to_count():
    assert count(0) == 0


@pytest.mark.slow
def test_many():
    assert count(5) == 5
""",
    "test_started.py": """\
import os, subprocess, sys


def test_a_process_says_it(tmp_path):
    code = "from toy.values import said; print(said())"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout == "said\\n"


def test_a_child_counts():
    from toy.values import child
    pid = os.fork()
    if not pid:
        os._exit(child())
    assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 5


def test_wrong_in_itself():
    assert False
""",
    "test_largest.py": """\
import pytest
from toy.values import count, largest


def test_nothing():
    assert count(0) == 0


@pytest.mark.long
def test_largest():
    assert largest(9) == 8
""",
    "test_little.py": """\
from toy.values import little


def test_little():
    assert little() == 2
""",
}


@pytest.fixture(scope="module")
def toy(tmp_path_factory):
    """The project, its recording and a copy to try mutants in."""
    root = tmp_path_factory.mktemp("toy").resolve()
    files = {"toy/__init__.py": "", "toy/values.py": SOURCE, "pyproject.toml": PYTEST}
    files |= {f"tests/{name}": text for name, text in TESTS.items()}
    for name, text in files.items():
        (root / name).parent.mkdir(exist_ok=True)
        (root / name).write_text(text)
    (root / "tests" / "mutation").symlink_to(program.ROOT / "tests" / "mutation")
    project = Project(root, "toy", left_out=("tests/mutation",))
    said = []
    recording = record(project, root / ".mutants", 1, said.append)
    return project, recording, said


PYTEST = """\
[tool.pytest.ini_options]
testpaths = ["tests"]
pythonpath = ["."]
addopts = "--import-mode=importlib"
markers = ["slow: slow", "long: long"]
"""


def outcome(toy, before, after):
    """What becomes of the mutant of one line."""
    project, recording, _ = toy
    source = (project.root / "toy/values.py").read_bytes()
    [mutant] = [m for m in mutants("toy/values.py", source) if (m.before, m.after) == (before, after)]
    [(_, found)] = program.try_all(project, recording, [mutant], 1, lambda *_: None)
    assert (project.root / "toy/values.py").read_bytes() == source
    return found


def test_what_is_recorded(toy):
    project, recording, _ = toy
    lines = recording.tests_by_line(project.root / "toy/values.py")
    assert lines[5] == {"tests/test_larger.py::test_larger"}
    assert lines[16] == {"tests/test_started.py::test_a_process_says_it"}
    assert not lines.get(20)
    assert set(recording.failed) == {"tests/test_started.py::test_wrong_in_itself"}
    assert lines[32] == {"tests/test_started.py::test_a_child_counts"}  # in a process that ends by os._exit
    assert lines[11] == recording.slow == {"tests/test_count.py::test_many"}
    assert not lines.get(28)  # which a long test alone runs


def test_a_fatal_mutant_is_killed(toy):
    found = outcome(toy, "return a if a > b else b", "return None")
    assert (found.verdict, found.test) == ("quick", "tests/test_larger.py::test_larger")


def test_an_equivalent_mutant_survives(toy):
    assert outcome(toy, "return a if a > b else b", "return a if a >= b else b").verdict == "survived"


def test_what_no_test_runs_survives(toy):
    found = outcome(toy, "return 7", "return 8")
    assert (found.verdict, found.of) == ("survived", 0)


def test_processes_that_tests_start_run_the_mutant(toy):
    assert outcome(toy, 'return "said"', 'return "said~"').verdict == "quick"


def test_forked_processes_run_the_mutant(toy):
    assert outcome(toy, "return 5", "return 6").verdict == "quick"


def test_a_slow_test_kills_what_quick_ones_do_not(toy):
    found = outcome(toy, "i += 1", "i += 2")
    assert (found.verdict, found.test) == ("slow", "tests/test_count.py::test_many")


def test_a_long_test_counts_among_the_slow_ones(toy):
    found = outcome(toy, "return max(range(n))", "return min(range(n))")
    assert (found.verdict, found.test) == ("slow", "tests/test_largest.py::test_largest")


def test_a_loop_without_end_is_ended_by_its_limit(toy, monkeypatch):
    monkeypatch.setattr("tests.mutation.trying.SLACK", 0.5)
    monkeypatch.setattr("tests.mutation.trying.FACTOR", 1)
    found = outcome(toy, "i += 1", "i -= 1")
    assert (found.verdict, found.test) == ("limit", "tests/test_count.py::test_many")


def test_a_constant_of_the_module_is_tried_with_the_tests_of_its_file(toy):
    found = outcome(toy, "LIMIT = 3", "LIMIT = 4")
    assert (found.verdict, found.test) == ("quick", "tests/test_little.py::test_little")


def test_a_changed_test_file_alone_is_recorded_again(toy):
    project, recording, said = toy
    said.clear()
    assert record(project, project.root / ".mutants", 1, said.append) == recording and not said
    path = project.root / "tests/test_larger.py"
    path.write_text(path.read_text() + "\n\ndef test_more():\n    assert larger(2, 2) == 2\n")
    renewed = record(project, project.root / ".mutants", 1, said.append)
    assert "1 of 5 test files" in said[0]
    assert set(renewed.seconds) - set(recording.seconds) == {"tests/test_larger.py::test_more"}


def test_the_sample_is_the_seeds(toy):
    project, *_ = toy
    assert sample(project, 9, 1) == sample(project, 9, 1) != sample(project, 9, 2)
    assert len(sample(project, 9, 1)) == 9


def test_a_test_that_fails_without_a_mutant_kills_nothing(toy, tmp_path):
    project, recording, _ = toy
    trial = Trial(project, recording, copy_of(project, tmp_path), tmp_path / "runs")
    right, wrong = "tests/test_larger.py::test_larger", "tests/test_started.py::test_wrong_in_itself"
    killers = [Outcome("quick", wrong), Outcome("quick", right), Outcome("slow", "tests/test_count.py::test_many")]
    assert program.failing_without_mutant(trial, killers) == {wrong}


def test_the_report_leaves_known_mutants_out_of_the_share(toy):
    project, *_ = toy
    found = mutants("toy/values.py", (project.root / "toy/values.py").read_bytes())
    results = [(found[0], Outcome("quick")), (found[1], Outcome("survived", of=3)), (found[2], Outcome("limit"))]
    text = program.report(results, [found[3]])
    assert "2 of 3 mutants that are not known to be equivalent were killed: 66.7 %" in text
    assert f"toy/values.py:{found[1].line} survived" in text and f"  - {found[1].before}" in text


def test_reasons_are_found_by_content(tmp_path):
    path = tmp_path / "equivalent.yaml"
    path.write_text("- {file: toy/values.py, in: said, before: return 'x', after: return None, reason: for one}\n")
    assert program.equivalent(path) == {("toy/values.py", "said", "return 'x'", "return None"): "for one"}
