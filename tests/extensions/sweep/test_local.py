"""Processes of this machine: tasks end as in one process, a crash costs one task, and nothing stays behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from llfsm_verify.extensions.sweep.local import Processes, processors
from llfsm_verify.extensions.sweep.scheduling import Performing, opened
from llfsm_verify.extensions.sweep.task import Outcome, Task
from llfsm_verify.extensions.sweep.worker import perform
from llfsm_verify.plug import LostTask, Unregistered
from tests.extensions.sweep.tasks import counter_task, deserted, lasting, process_of, stuck, twelve

ROOT = Path(__file__).parents[3]


def outcomes(address: str | None, tasks: list[Task]) -> dict[str, Outcome]:
    found: dict[str, Outcome] = {}
    scheduler = opened(address, 2)
    try:
        scheduler.run(iter(tasks), lambda task, outcome: found.update({task.key: outcome}))
    finally:
        scheduler.close()
    return found


def is_there(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    state = Path(f"/proc/{process}/stat")
    return not (state.exists() and state.read_text().rpartition(")")[2].split()[0] == "Z")


def wait_until(done: Callable[[], bool]) -> None:
    ends = time.monotonic() + 60
    while not done():
        assert time.monotonic() < ends
        time.sleep(0.02)


@pytest.mark.slow
def test_outcomes_are_those_of_one_process() -> None:
    tasks = twelve()
    found = outcomes(None, tasks)
    assert {key: lasting(each) for key, each in found.items()} == {t.key: lasting(perform(t)) for t in tasks}


def test_a_scheduler_that_is_not_there_is_said_with_those_that_are() -> None:
    with pytest.raises(Unregistered, match=r"there is no scheduler `udp`; there are: .*processes"):
        opened("udp://here:1")
    assert processors() >= 1


@pytest.mark.slow
def test_only_the_guilty_task_is_lost(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    tasks = [f"{'end' if number in (3, 11) else 'go on'} {number}" for number in range(16)]
    found: dict[str, object] = {}
    scheduler = Processes("", 2)
    scheduler.run(deserted, tasks, lambda task, end: found.update({task: end}))
    lost = {task for task, end in found.items() if isinstance(end, LostTask)}
    assert lost == {"end 3", "end 11"} and sorted(found) == sorted(tasks)
    scheduler.run(deserted, ["again"], lambda task, end: found.update({task: end}))
    assert found["again"] == "again" and any(tmp_path.iterdir())
    scheduler.close()
    assert not any(tmp_path.iterdir())


@pytest.mark.slow
def test_a_task_that_is_stuck_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("llfsm_verify.extensions.sweep.scheduling.guarded", stuck)
    monkeypatch.setattr("llfsm_verify.extensions.sweep.worker.GRACE", (1.0, 0.3))
    outcome = outcomes(None, [counter_task(3, timeout=0.1)])["3"]
    assert (outcome.state, outcome.result) == ("timeout", None)
    assert outcome.message == "the time limit of 0.1 s was reached, and the check did not end by itself"


@pytest.mark.slow
def test_a_lost_task_is_a_killed_one() -> None:
    class Losing:
        def run(self, call: object, tasks: list[Task], ended: Callable[[Task, object], None]) -> None:
            for task in tasks:
                ended(task, LostTask("gone", 0.2))

        def close(self) -> None: ...

    found: list[Outcome] = []
    tasks = [counter_task(3), counter_task(3, timeout=0.1)]
    Performing(Losing()).run(tasks, lambda _, outcome: found.append(outcome))  # type: ignore[arg-type]
    assert [(each.state, each.message) for each in found] == [("killed", "gone")] * 2


@pytest.mark.slow
def test_processes_begin_anew_now_and_then() -> None:
    scheduler, found = Processes("", 2), list[object]()
    scheduler.renewed = 3
    scheduler.run(process_of, [0.0] * 20, lambda _, process: found.append(process))
    scheduler.close()
    assert len(found) == 20 and len(set(found)) >= 3
    assert max(found.count(process) for process in set(found)) <= 6


@pytest.mark.slow
def test_an_interrupt_keeps_what_is_done_and_ends_what_is_not() -> None:
    scheduler, found = Processes("", 2), list[object]()

    def tasks() -> Iterator[float]:
        yield from [0.0, 0.0, 1000.0, 1000.0]
        while True:
            yield 1000.0

    def ended(_: float, process: object) -> None:
        found.append(process)
        if len(found) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        scheduler.run(process_of, tasks(), ended)
    scheduler.close()
    assert len(found) == 2
    wait_until(lambda: not any(is_there(process) for process in found if isinstance(process, int)))


PROGRAM = """
import sys
from llfsm_verify.extensions.sweep.local import Processes
from tests.extensions.sweep.tasks import process_of

scheduler = Processes("", 2)
print(scheduler._folder.name, flush=True)
try:
    scheduler.run(process_of, [0.3, 0.3, *[1000.0] * 50], lambda _, process: print(process, flush=True))
except KeyboardInterrupt:
    scheduler.close()
    print("interrupted", flush=True)
    sys.exit(130)
"""
"""Without a guard of `__main__`: processes do not import it."""


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_processes_end_with_the_program(number: signal.Signals, tmp_path: Path) -> None:
    script = tmp_path / "program.py"
    script.write_text(PROGRAM)
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(tmp_path)}
    with subprocess.Popen(
        [sys.executable, script], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True,
    ) as program:  # fmt: skip
        assert program.stdout is not None and program.stderr is not None
        folder = Path(program.stdout.readline().strip())
        workers = [int(program.stdout.readline()), int(program.stdout.readline())]
        assert folder.is_dir()
        if number == signal.SIGINT:
            os.killpg(program.pid, number)  # as a terminal does
        else:
            program.kill()
        wait_until(lambda: not any(map(is_there, workers)))
        wait_until(lambda: not folder.exists())
        said, errors = program.communicate(timeout=60)
    if number == signal.SIGINT:
        assert (program.returncode, said) == (130, "interrupted\n")
        assert "Traceback" not in errors
