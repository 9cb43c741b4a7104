from __future__ import annotations

import sys
from pathlib import Path

import pytest

from tests.cli.running import llfsm

PRESSED = "G !m@OPEN"


def stdout(result) -> str:
    return result.stdout.str()


@pytest.fixture
def trace(project) -> Path:
    """A counterexample as `--save-traces` saves it."""
    assert llfsm("verify", "arrangement.yaml", "-p", f"shut: {PRESSED}", "--save-traces", "traces").returncode == 1
    return project.path / "traces/shut.trace.yaml"


def replace(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def test_a_known_failure_passes_until_it_is_gone(project, trace):
    result = project.runpytest_inprocess("-v", "-W", "error", "--strict-config")
    result.assert_outcomes(passed=1)
    assert "traces/shut.trace.yaml::replay PASSED" in stdout(result)
    replace(project.path / "door.machine.yaml", "when: button", "when: button && not button")
    result = project.runpytest_inprocess()
    result.assert_outcomes(failed=1)
    assert "the failure does not happen any more" in stdout(result) and "--llfsm-update" in stdout(result)


def test_a_failure_that_must_not_happen_fails_until_it_is_mended(project, trace):
    replace(trace, "expect: violated", "expect: holds")
    result = project.runpytest_inprocess()
    result.assert_outcomes(failed=1)
    assert "traces/shut.trace.yaml: the failure still happens" in stdout(result)
    assert "→ OPEN when button" in stdout(result) and "llfsm_verify/" not in stdout(result)
    replace(project.path / "door.machine.yaml", "when: button", "when: button && not button")
    project.runpytest_inprocess().assert_outcomes(passed=1)


@pytest.mark.slow
def test_a_mend_that_reads_another_input_is_run_with_each_of_its_values(project, trace):
    replace(trace, "expect: violated", "expect: holds")
    replace(project.path / "door.machine.yaml", "when: button", "when: button && not locked")
    assert "whatever constant value" not in stdout(project.runpytest_inprocess())
    project.runpytest_inprocess().assert_outcomes(failed=1)  # unlocked, the door still opens
    replace(project.path / "door.machine.yaml", "not locked", "locked && not locked")
    project.runpytest_inprocess().assert_outcomes(passed=1)
    done = llfsm("replay", "-q", str(trace))
    assert done.returncode == 0 and "whatever constant value `locked` has" in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("button: true", "button: perhaps", "neither true nor false"),
        ("free: {}", "free: {mode: 3}", "does not fit any more"),
        ("shut", "shut: :", "error[E0"),
        ("G !m@OPEN", "G !m@OPN", "did you mean `OPEN`?"),
        ("../arrangement.yaml", "../gone.yaml", "there is no such file"),
    ],
)
def test_what_does_not_fit_fails(project, trace, old, new, says):
    for expect in ("violated", "holds"):
        if expect == "holds":
            replace(trace, "expect: violated", "expect: holds")
        else:
            replace(trace, old, new)
        for options in ((), ("--llfsm-update",)):
            before = trace.read_bytes()
            result = project.runpytest_inprocess(*options)
            result.assert_outcomes(failed=1)
            assert says in stdout(result) and "llfsm_verify/" not in stdout(result) and trace.read_bytes() == before


@pytest.mark.slow
def test_update_rewrites_what_is_expected_and_nothing_else(project, trace):
    # Line ends, a byte order mark, quotes, comments and order are the user's.
    text = trace.read_text().replace("expect: violated", "# why\nexpect:  'violated'   # ours")
    changed = ("\ufeff" + text.replace("\n", "\r\n")).encode()
    trace.write_bytes(changed)
    project.runpytest_inprocess("--llfsm-update").assert_outcomes(passed=1)
    assert trace.read_bytes() == changed
    digest = next(line.split()[1] for line in text.splitlines() if line.startswith("digest"))
    replace(project.path / "door.machine.yaml", "when: button", "when: button && not button")
    result = project.runpytest_inprocess("--llfsm-update")
    result.assert_outcomes(passed=1)
    assert "updated traces/shut.trace.yaml: expect: violated → holds" in stdout(result)
    now = trace.read_bytes()
    new_digest = next(line.split()[1] for line in now.decode().splitlines() if line.startswith("digest"))
    assert now == changed.replace(b"'violated'", b"'holds'").replace(digest.encode(), new_digest.encode())
    assert new_digest != digest
    project.runpytest_inprocess().assert_outcomes(passed=1)
    assert llfsm("replay", str(trace)).returncode == 0


def test_an_anchor_is_not_rewritten(project, trace):
    replace(trace, "expect: violated", "expect: &e violated")
    replace(project.path / "door.machine.yaml", "when: button", "when: button && not button")
    result = project.runpytest_inprocess("--llfsm-update")
    result.assert_outcomes(failed=1)
    assert "error[E463]" in stdout(result)


@pytest.mark.slow
def test_the_run_that_fails_a_check_is_saved_once_and_fails_by_itself(project):
    project.makepyfile(f"def test_shut(check):\n    check.holds({PRESSED!r})\n")
    result = project.runpytest_inprocess("--llfsm-save", "traces")
    assert "trace saved: traces/test_shut.trace.yaml" in stdout(result)
    project.makeini("[pytest]\nllfsm_save = traces\n")
    result = project.runpytest_inprocess()
    result.assert_outcomes(failed=2)
    assert "trace saved before: traces/test_shut.trace.yaml" in stdout(result)
    assert [path.name for path in (project.path / "traces").iterdir()] == ["test_shut.trace.yaml"]
    # Another failure of the same check is another file.
    machine = project.path / "door.machine.yaml"
    old = machine.read_text()
    machine.write_text(old.replace("when: button", "when: not button"))
    project.runpytest_inprocess().assert_outcomes(failed=1, passed=1)
    assert (project.path / "traces/test_shut-2.trace.yaml").exists()
    machine.write_text(old.replace("when: button", "when: button && not button"))
    project.runpytest_inprocess().assert_outcomes(passed=3)


@pytest.mark.slow
def test_equal_names_of_different_failures_are_different_files(project):
    for folder, formula in (("one", PRESSED), ("two", "G m@SHUT")):
        project.mkdir(folder).joinpath(f"test_{folder}.py").write_text(
            f"def test_it(check):\n    check.holds({formula!r})\n"
        )
    project.runpytest_inprocess("--llfsm-save", "../traces").assert_outcomes(failed=2)
    names = sorted(path.name for path in (project.path / "traces").iterdir())
    assert names == ["test_it-2.trace.yaml", "test_it.trace.yaml"]


def test_a_failure_that_is_expected_is_not_saved(project):
    known = f"(check):\n    check.holds({PRESSED!r})\n"
    project.makepyfile(
        f"import pytest\n@pytest.mark.xfail(reason='known')\ndef test_known{known}"
        f"@pytest.mark.xfail(False, reason='not here')\ndef test_elsewhere{known}"
    )
    project.runpytest_inprocess("--llfsm-save", "traces").assert_outcomes(xfailed=1, failed=1)
    # A saved run would fail by itself, and nobody has marked it.
    assert [path.name for path in (project.path / "traces").iterdir()] == ["test_elsewhere.trace.yaml"]


def test_traces_that_cannot_be_saved_are_told(project):
    project.makepyfile(f"def test_shut(check):\n    check.holds({PRESSED!r})\n")
    project.path.joinpath("traces").write_text("no folder")
    result = project.runpytest_inprocess("--llfsm-save", "traces")
    assert "error[E405]" in stdout(result) and "test_shut is violated" in stdout(result)


def test_collecting_reads_no_file(project, trace):
    trace.write_text("no trace at all")
    project.path.joinpath("other.yaml").write_text("no trace either")
    result = project.runpytest_inprocess("--collect-only", "-q")
    assert "traces/shut.trace.yaml::replay" in stdout(result) and "1 test collected" in stdout(result)
    project.runpytest_inprocess("-k", "shut").assert_outcomes(failed=1)
    project.runpytest_inprocess("--lf", "-p", "no:terminal")


def test_nothing_of_ours_is_collected_as_a_trace():
    tracked = {
        path for root in ("llfsm_verify", "models", "docs", "examples") for path in Path(root).rglob("*.trace.yaml")
    }
    assert not tracked


@pytest.mark.long
def test_workers_share_the_tests(project, trace, monkeypatch):
    replace(trace, "expect: violated", "expect: holds")
    project.makepyfile(
        "import pytest\n@pytest.mark.parametrize('n', range(4))\n"
        f"def test_shut(check, n):\n    check.holds({PRESSED!r})\n"
    )
    monkeypatch.setenv("PYTHONPATH", str(Path(sys.modules["llfsm_verify"].__file__).parents[1]))
    options = ("-p", "xdist.plugin", "-n", "2", "--llfsm-save", "traces")
    result = project.runpytest_subprocess(*options, "-W", "error")
    result.assert_outcomes(failed=5)
    assert stdout(result).count("→ OPEN when button") == 5 and stdout(result).count("trace saved: traces/") == 4
    replace(project.path / "door.machine.yaml", "when: button", "when: button && not button")
    result = project.runpytest_subprocess(*options, "--llfsm-update")
    result.assert_outcomes(passed=9)
    assert stdout(result).count("updated traces/") == 5
