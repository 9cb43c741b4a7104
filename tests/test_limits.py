"""Budgets: what each limit says and when, with a clock and a memory that a test turns by hand."""

from __future__ import annotations

import builtins
import io
import os
import resource
import sys
from collections.abc import Mapping
from contextvars import copy_context
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from llfsm_verify import limits
from llfsm_verify.limits import (
    LOOKS,
    TICKS,
    Budget,
    LimitReached,
    Limits,
    default_memory,
    endless_budget,
    memory_in_use,
    processors,
    reached,
    tick,
    ticking,
    unlimited,
)

MIB = 1 << 20


class Machine:
    """`seconds` on the clock and `used` bytes."""

    seconds = 1000.0
    used = 0


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch) -> Machine:
    made = Machine()
    monkeypatch.setattr(limits, "time", SimpleNamespace(monotonic=lambda: made.seconds))
    monkeypatch.setattr(limits, "memory_in_use", lambda: made.used)
    return made


def test_the_time_is_up_after_the_limit(machine: Machine) -> None:
    budget = Budget(Limits(timeout=2.5))
    assert (budget.seconds, budget.left) == (0.0, 2.5)
    machine.seconds += 2.5
    budget.check()
    assert (budget.seconds, budget.left) == (2.5, 0.0)
    machine.seconds += 0.5
    assert (budget.seconds, budget.left) == (3.0, 0.0)
    with pytest.raises(LimitReached, match=r"^the time limit of 2\.5 s was reached$"):
        budget.check()


def test_what_is_granted_counts_from_the_limit_however_often_and_late_it_is_granted(machine: Machine) -> None:
    budget = Budget(Limits(timeout=1.0))
    machine.seconds += 2
    assert budget.is_late
    budget.grant(2.0)
    budget.check()
    machine.seconds += 1
    budget.grant(2.0)
    budget.check_time()
    assert budget.left == 0.0
    machine.seconds += 0.25
    for check in (budget.check, budget.check_time):
        with pytest.raises(LimitReached, match=r"^the time limit of 1 s was reached$"):
            check()
    budget.grant(3.0)
    budget.check()
    budget.grant(0.0)
    with pytest.raises(LimitReached):
        budget.check()
    endless = Budget(Limits())
    endless.check_time()
    assert not endless.is_late


def test_the_limit_that_users_know_is_named(machine: Machine) -> None:
    part = Limits(timeout=60.0, memory=5, max_states=7).within(4.0)
    assert part == Limits(7, 5, 4.0, 60.0)
    assert part.within(1.0) == replace(part, timeout=1.0)
    budget = Budget(part.within(1.0))
    machine.seconds += 2
    with pytest.raises(LimitReached, match="the time limit of 60 s"):
        budget.check()


def test_memory_may_be_used_up_but_not_passed(machine: Machine) -> None:
    budget = Budget(Limits(memory=3000 * MIB))
    machine.used = 2999 * MIB
    budget.check()
    budget.check(MIB)
    for more, used in ((MIB + 1, machine.used), (0, 3000 * MIB + 1)):
        machine.used = used
        with pytest.raises(LimitReached, match=r"^the memory limit of 3,000 MiB was reached$"):
            budget.check(more)
    machine.used, machine.seconds = 1 << 60, machine.seconds + 1e9
    endless_budget().check()


def test_without_limits_only_the_memory_of_the_machine_counts(
    machine: Machine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(limits, "_physical_memory", lambda: 1000)
    assert default_memory() == 800
    budget = Budget(Limits())
    machine.seconds += 1e9
    machine.used = 800
    budget.check()
    assert budget.left is None and (budget.max_states, budget.max_steps) == (None, None)
    machine.used = 801
    with pytest.raises(LimitReached):
        budget.check()


def test_time_is_looked_at_often_and_memory_now_and_then(machine: Machine) -> None:
    pulses: list[int] = []
    budget = Budget(Limits(timeout=1.0, memory=10), lambda: pulses.append(budget._ticks))
    for _ in range(2 * TICKS):
        budget.tick()
    assert pulses == [TICKS, 2 * TICKS]
    machine.used = 11
    for _ in range(TICKS - 1):
        budget.tick()
    with pytest.raises(LimitReached, match="memory"):
        budget.tick()
    machine.used = 0
    machine.seconds += 2
    for _ in range(LOOKS - 1):
        budget.tick()
    with pytest.raises(LimitReached, match="time"):
        budget.tick()


def test_part_of_the_work_has_the_same_clock_and_limits_of_its_own(machine: Machine) -> None:
    whole = Budget(Limits(max_states=100, max_steps=1000, timeout=5.0))
    machine.seconds += 1
    with whole:
        part = whole.narrowed(3, 4)
        assert (part.max_states, part.max_steps, part.seconds, part.left) == (3, 4, 1.0, 4.0)
        with part:
            assert counted(part, 2 * LOOKS)
        assert counted(whole, 2 * LOOKS)
    assert (whole.max_states, whole.max_steps) == (100, 1000)


def counted(budget: Budget, calls: int) -> bool:
    """Whether `tick` asks this budget."""
    before = budget._ticks
    for _ in range(calls):
        tick()
    return budget._ticks == before + calls


def test_the_innermost_budget_is_asked() -> None:
    outer, inner = endless_budget(), endless_budget()
    tick()
    with outer:
        assert counted(outer, 3)
        with inner, inner:
            assert counted(inner, 3) and counted(inner, 1)
            assert not counted(outer, 1)
            assert copy_context().run(counted, inner, 2)
            with unlimited():
                assert not counted(inner, 1) and not counted(outer, 1)
            assert counted(inner, 1)
        assert counted(outer, 1)
    assert not counted(outer, 1)


def test_what_listens_is_told_of_each_tick_and_may_stop_the_work() -> None:
    calls: list[str] = []
    with endless_budget() as budget:
        with ticking(lambda: calls.append("outer")), ticking(lambda: calls.append("inner")):
            assert counted(budget, 1)
        assert calls == ["inner", "outer"]

        def stop() -> None:
            raise LimitReached("enough")

        with pytest.raises(LimitReached, match="enough"), ticking(stop):
            tick()
        assert counted(budget, 1) and len(calls) == 2


def test_a_number_in_a_limit_is_grouped() -> None:
    assert reached(1000000, "configurations") == "the limit of 1,000,000 configurations was reached"


def test_the_memory_in_use_is_what_is_resident(monkeypatch: pytest.MonkeyPatch) -> None:
    def opened(name: str, *_: object) -> io.BytesIO:
        assert name == "/proc/self/statm"
        return io.BytesIO(b"5000 123 40 1 0 700 0\n")

    monkeypatch.setattr(builtins, "open", opened)
    monkeypatch.setattr(os, "sysconf", {"SC_PAGE_SIZE": 4096}.get)
    assert memory_in_use() == 123 * 4096


@pytest.mark.parametrize(("platform", "factor"), [("darwin", 1), ("linux", 1024)])
def test_where_there_is_no_proc_the_peak_is_taken(platform: str, factor: int, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object, **__: object) -> None:
        raise FileNotFoundError

    monkeypatch.setattr(builtins, "open", refused)
    monkeypatch.setattr(sys, "platform", platform)
    monkeypatch.setattr(resource, "getrusage", lambda who: SimpleNamespace(ru_maxrss=5000))
    assert memory_in_use() == 5000 * factor


@pytest.mark.parametrize(
    ("said", "expected"), [("1000\n", 1000), ("max\n", 4096 * 77), (f"{1 << 70}\n", 4096 * 77), (None, 4096 * 77)]
)
def test_a_container_may_have_less_memory(said: str | None, expected: int, monkeypatch: pytest.MonkeyPatch) -> None:
    def opened(name: str, encoding: str) -> io.TextIOWrapper:
        if said is None:
            raise FileNotFoundError
        assert name == "/sys/fs/cgroup/memory.max"
        return io.TextIOWrapper(io.BytesIO(said.encode()), encoding)

    sizes = {"SC_PAGE_SIZE": 4096, "SC_PHYS_PAGES": 77}
    monkeypatch.setattr(os, "sysconf", lambda name: sizes[name])
    monkeypatch.setattr(builtins, "open", opened)
    assert limits._physical_memory() == expected


GROUP = "4:memory:/other\n0::/jobs/one\n"


@pytest.mark.parametrize(
    ("own", "quotas", "expected"),
    [
        (GROUP, {}, 8),
        (None, {".": "100000 100000"}, 8),  # no cgroups
        ("4:memory:/other\n", {".": "100000 100000"}, 8),  # only those of the first version
        (GROUP, {"jobs/one": "max 100000", "jobs": "max 100000", ".": "max 100000"}, 8),
        (GROUP, {"jobs/one": "300000 100000"}, 3),
        (GROUP, {"jobs/one": "250000 100000", "jobs": "600000 100000"}, 3),
        (GROUP, {"jobs/one": "800000 100000", "jobs": "200000 100000"}, 2),
        (GROUP, {"jobs/one": "1000 100000"}, 1),
        (GROUP, {"jobs/one": "9900000 100000"}, 8),
        (GROUP, {"jobs/one": "broken"}, 8),
        ("0::/\n", {".": "150000 100000", "jobs": "100000 100000"}, 2),
    ],
)
def test_processors_are_those_of_the_affinity_and_of_the_quotas(
    own: str | None, quotas: Mapping[str, str], expected: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {process, *range(8)}, raising=False)
    for name, text in quotas.items():
        (tmp_path / "groups" / name).mkdir(parents=True, exist_ok=True)
        (tmp_path / "groups" / name / "cpu.max").write_text(text + "\n")
    if own is not None:
        (tmp_path / "own").write_text(own)
    assert processors(tmp_path / "groups", tmp_path / "own") == expected


def test_there_are_no_more_processors_than_jobs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "platform", "darwin")
    monkeypatch.setattr(os, "cpu_count", lambda: 1000)
    assert processors(tmp_path, tmp_path / "own") == limits.MOST_JOBS
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert processors(tmp_path, tmp_path / "own") == 1
