"""The process of one engine, seen from inside it and from the one that started it."""

from __future__ import annotations

import io
from types import SimpleNamespace

import pytest

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.verdict import Options
from llfsm_verify.diagnostics import Source
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.verification import differential as worker
from llfsm_verify.verification.differential import EACH_ENGINE, Job, Reply, _Worker, pack


def lights():
    arrangement = load_arrangement("models/traffic_lights/arrangement.yaml")
    return bind(arrangement, parse_properties([Source("p", "G !(ns@GREEN && ew@GREEN)")]))


def answered(monkeypatch: pytest.MonkeyPatch, check) -> Reply:
    monkeypatch.setattr(worker, "_end_with_the_caller", lambda: None)
    monkeypatch.setattr("llfsm_verify.verification.verify.checker", lambda _: check)
    return worker._answered(io.BytesIO(pack(Job("explicit", lights(), Options()))))


def test_an_error_is_told_with_the_place_that_raised_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def third() -> None:
        raise ValueError("no")

    def second(*_: object) -> None:
        third()

    found = answered(monkeypatch, second)
    line = third.__code__.co_firstlineno + 1
    assert found == Reply(None, failure=f"ValueError: no (third, line {line})")


def test_a_missing_module_is_told_by_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    def check(*_: object) -> None:
        raise ModuleNotFoundError("No module named 'z3'", name="z3")

    assert answered(monkeypatch, check) == Reply(None, missing="z3")


@pytest.mark.parametrize(("status", "ended"), [(None, ["kill"]), (0, [])])
def test_a_worker_that_is_stopped_is_killed_where_it_runs(status: int | None, ended: list[str]) -> None:
    one = _Worker(EACH_ENGINE[0], lights(), Options(), endless=False)
    one.stop()  # nothing has begun
    done: list[str] = []
    one._process = SimpleNamespace(  # type: ignore[assignment]
        poll=lambda: status, kill=lambda: done.append("kill"), send_signal=lambda _: done.append("interrupt")
    )
    one.stop()
    assert done == ended
    one.interrupt()
    assert done == [*ended, *(["interrupt"] if ended else [])]
    assert one.run(0.0) is None


def test_the_time_until_a_worker_has_begun_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Options] = []

    def check(_: object, options: Options) -> None:
        asked.append(options)

    monkeypatch.setattr(worker, "_end_with_the_caller", lambda: None)
    monkeypatch.setattr("llfsm_verify.verification.verify.checker", lambda _: check)
    monkeypatch.setattr(worker, "time", SimpleNamespace(monotonic=lambda: 107.0))
    for timeout in (10.0, 5.0):
        job = Job("explicit", lights(), Options(Limits(timeout=timeout)), begun=100.0)
        assert worker._answered(io.BytesIO(pack(job))) == Reply(None)
    assert [(o.limits.timeout, o.limits.whole) for o in asked] == [(3.0, 10.0), (0.0, 5.0)]
