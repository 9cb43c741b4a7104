"""Machine code that an earlier run has kept does what compiled code does; damaged or other code is not used."""

from __future__ import annotations

import os
import signal
import subprocess
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings

from llfsm_verify import kept
from llfsm_verify.backends.native import machine_code
from llfsm_verify.backends.native.executor import Effort, NativeProgram, StepCode
from llfsm_verify.limits import Budget, LimitReached, Limits, unlimited
from llfsm_verify.program.program import Program
from llfsm_verify.testing.programs import programs
from tests.quick import examples

SAME_FOLDER = [HealthCheck.function_scoped_fixture, HealthCheck.too_slow]


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(kept.FOLDER, str(tmp_path / "cache"))
    monkeypatch.setattr(machine_code, "WORTH_KEEPING", 0.0)
    return tmp_path / "cache"


def run_of(program: Program, effort: Effort) -> object:
    """All edges from the first record, and where a random run leads."""
    native = NativeProgram(program, effort=effort)
    first = native.layout.first()
    edges = [edge for edge, _ in zip(native.successors(first), range(200), strict=False)]
    return edges, native.run(first, 50, mode="random", seed=7)


@pytest.mark.slow
@pytest.mark.parametrize("effort", ["quick", "full"])
@settings(max_examples=examples(15), deadline=None, suppress_health_check=SAME_FOLDER)
@given(program=programs())
def test_kept_machine_code_does_the_same(cache: Path, effort: Effort, program: Program) -> None:
    made = run_of(program, effort)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(machine_code, "_compiled", lambda *_: pytest.fail("compiled again"))
        assert run_of(program, effort) == made
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(machine_code, "WORTH_KEEPING", float("inf"))
        patched.setattr(machine_code, "_loaded", lambda *_: pytest.fail("loaded"))
        assert run_of(program, effort) == made


TEXT = """
define i32 @step(ptr %r, ptr %c, i64 %p) {{ ret i32 {value} }}
define i64 @run(ptr %r, i64 %n, i64 %s, ptr %c) {{ ret i64 0 }}
define i64 @expand(ptr %r, i64 %n, ptr %b, i64 %e, ptr %c) {{ ret i64 0 }}
"""


def step(value: int, effort: Effort = "quick") -> int:
    code = StepCode(lambda: TEXT.format(value=value), effort)  # the code lives as long as this object
    return code.step(0, 0, 0)


def test_damaged_or_renamed_machine_code_is_compiled_again(cache: Path) -> None:
    assert step(3) == 3
    (file,) = cache.iterdir()
    whole = file.read_bytes()
    for data in (b"", whole[:-1], whole[:50] + bytes([whole[50] ^ 1]) + whole[51:]):
        file.write_bytes(data)
        assert step(3) == 3
        assert file.read_bytes() == whole
    assert step(4) == 4
    (other,) = set(cache.iterdir()) - {file}
    other.replace(file)
    assert step(3) == 3


def test_machine_code_is_named_after_all_that_decides_it(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = {machine_code._path(*case) for case in (("a", "quick"), ("a", "full"), ("b", "quick"))}
    about = machine_code._compiler()
    for i in range(len(about)):
        monkeypatch.setattr(machine_code, "_compiler", lambda i=i: (*about[:i], "another", *about[i + 1 :]))
        names.add(machine_code._path("a", "quick"))
    assert len(names) == 3 + len(about)


def test_code_kept_under_a_name_is_loaded_without_its_text(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = StepCode(lambda: TEXT.format(value=3), "quick", "three")
    found = StepCode(lambda: pytest.fail("written again"), "quick", "three")
    assert (found.step(0, 0, 0), found.lines) == (3, made.lines) == (3, TEXT.count("\n"))
    for name, effort in (("four", "quick"), ("three", "full")):
        other = StepCode(lambda: TEXT.format(value=4), effort, name)
        assert other.step(0, 0, 0) == 4


def test_the_newest_are_left(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine_code, "MOST_KEPT", 2)
    kept.keep(cache / "kernel-1.o", b"")
    for age in (3, 2, 1):
        assert step(age) == age
        for file in cache.glob("program-*"):
            at = file.stat().st_mtime - 100
            os.utime(file, (at, at))
    assert len(list(cache.glob("program-*"))) == 2
    monkeypatch.setattr(machine_code, "_compiled", lambda *_: pytest.fail("compiled again"))
    assert (step(2), step(1)) == (2, 1)
    assert (cache / "kernel-1.o").exists()


def test_small_modules_are_not_kept(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine_code, "WORTH_KEEPING", 0.1)
    assert step(5) == 5
    assert not cache.exists()


@pytest.mark.slow
@pytest.mark.parametrize("effort", ["quick", "full"])
@settings(max_examples=examples(3), deadline=None, suppress_health_check=SAME_FOLDER)
@given(program=programs())
def test_another_process_compiles_the_same_where_there_is_a_time_limit(
    cache: Path, effort: Effort, program: Program
) -> None:
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(machine_code, "WORTH_KEEPING", float("inf"))
        patched.setattr(machine_code, "WORTH_A_PROCESS", 0.0)
        made = run_of(program, effort)
        patched.setattr(machine_code, "_compiled", lambda *_: pytest.fail("compiled here"))
        with Budget(Limits(timeout=1e9)):
            assert run_of(program, effort) == made
        with unlimited(), pytest.raises(pytest.fail.Exception, match="compiled here"):
            run_of(program, effort)


@pytest.mark.slow
def test_the_process_that_compiles_is_ended_where_the_time_is_over(monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[subprocess.Popen[bytes]] = []

    class Noted(subprocess.Popen[bytes]):
        def __init__(self, *args: object, **kwargs: object) -> None:
            super().__init__(*args, **kwargs)  # type: ignore[call-overload]
            begun.append(self)

    def over() -> None:
        raise LimitReached("the time is over")

    monkeypatch.setattr(subprocess, "Popen", Noted)
    monkeypatch.setattr(machine_code, "LOOK_SECONDS", 0.0)
    with pytest.raises(LimitReached, match="over"):
        machine_code.compiled_apart(TEXT.format(value=1), "quick", over)
    (process,) = begun
    assert process.returncode == -signal.SIGKILL


@pytest.mark.slow
def test_a_module_that_is_wrong_is_our_mistake() -> None:
    with pytest.raises(RuntimeError, match="compiling to machine code failed"):
        machine_code.compiled_apart("no module", "quick", lambda: None)
