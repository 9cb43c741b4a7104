"""Sweeps on a real scheduler of Dask with worker processes on loopback."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from llfsm_verify import DiagnosticError
from llfsm_verify.extensions.sweep.scheduling import opened
from llfsm_verify.extensions.sweep.worker import perform
from llfsm_verify.testing.conformance import scheduler_cases
from tests.extensions.cluster.calls import noted, slowly, squared
from tests.extensions.cluster.dask_cluster import DaskCluster
from tests.extensions.sweep.tasks import lasting, twelve
from tests.extensions.sweep.test_local import wait_until
from tests.outside import needs

pytestmark = [needs("distributed"), pytest.mark.filterwarnings("ignore")]


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Iterator[DaskCluster]:
    with DaskCluster(tmp_path_factory.mktemp("dask")) as cluster:
        cluster.start("one", "two")
        yield cluster


@pytest.fixture
def fresh(tmp_path: Path) -> Iterator[DaskCluster]:
    with DaskCluster(tmp_path) as cluster:
        yield cluster


def wrong(call: Callable[[], object]) -> tuple[str, str]:
    with pytest.raises(DiagnosticError) as caught:
        call()
    (found,) = caught.value.diagnostics
    assert found.hint
    return found.code, found.message


def kept(cluster: DaskCluster) -> Any:
    """The keys of all tasks that the scheduler knows."""
    from distributed import Client

    def keys(dask_scheduler: Any) -> list[str]:
        return list(dask_scheduler.tasks)

    with Client(cluster.address, set_as_default=False) as client:
        return client.run_on_scheduler(keys)


# -------------------------------------------------- addresses


@pytest.mark.parametrize(
    "address", ["tcp://here", "tcp://:8786", "tcp://a:port", "tls://a:99999", "tcp://a:1/b", "tcp"]
)
def test_what_is_no_address(address: str) -> None:
    code, message = wrong(lambda: opened(address))
    assert (code, message) == ("E604", f"`{address}` is not the address of a scheduler")


@pytest.mark.slow
def test_tls_without_certificates() -> None:
    with pytest.raises(DiagnosticError, match="E600") as caught:
        opened("tls://127.0.0.1:8786")
    assert "DASK_DISTRIBUTED__COMM__TLS__CA_FILE" in str(caught.value.diagnostics[0].hint)


@pytest.mark.slow
def test_a_scheduler_that_is_not_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("llfsm_verify.extensions.cluster.dask.ANSWER", 1.0)
    with socket.socket() as held:
        held.bind(("127.0.0.1", 0))  # and does not listen
        address = f"tcp://127.0.0.1:{held.getsockname()[1]}"
        code, message = wrong(lambda: opened(address))
    assert code == "E600" and message.startswith(f"no scheduler answers at {address}: ")


@pytest.mark.slow
def test_what_answers_is_something_else(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("llfsm_verify.extensions.cluster.dask.ANSWER", 1.0)
    with socket.create_server(("127.0.0.1", 0)) as silent:
        address = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        code, message = wrong(lambda: opened(address))
    assert (code, message) == ("E600", f"no scheduler answers at {address}: what answers is not a scheduler")


# -------------------------------------------------- tasks


@pytest.mark.slow
def test_outcomes_are_those_of_one_process(two: DaskCluster) -> None:
    tasks, found = twelve(), dict[str, object]()
    scheduler = opened(two.address)
    scheduler.run(iter(tasks), lambda task, outcome: found.update({task.key: lasting(outcome)}))
    scheduler.close()
    assert found == {task.key: lasting(perform(task)) for task in tasks}
    wait_until(lambda: kept(two) == [])


@pytest.mark.slow
def test_ctrl_c_ends_what_runs_and_what_waits(two: DaskCluster, tmp_path: Path) -> None:
    from llfsm_verify.extensions.cluster.dask import Cluster

    def three() -> Iterator[str]:
        yield from [str(tmp_path)] * 3
        wait_until(lambda: len(list(tmp_path.glob("*.begun"))) == 2)
        raise KeyboardInterrupt

    scheduler = Cluster(two.address)
    with pytest.raises(KeyboardInterrupt):
        scheduler.run(noted, three(), lambda *_: None)
    wait_until(lambda: kept(two) == [])
    wait_until(lambda: len(list(tmp_path.glob("*.interrupted"))) == 2)
    found: list[object] = []
    scheduler.run(squared, [3], lambda _, end: found.append(end))
    scheduler.close()
    assert found == [9]


@pytest.mark.long
def test_a_worker_that_dies_costs_nothing(fresh: DaskCluster) -> None:
    from llfsm_verify.extensions.cluster.dask import Cluster

    fresh.start("one", "two")
    scheduler, found = Cluster(fresh.address), dict[int, object]()

    def ended(task: int, end: object) -> None:
        found[task] = end
        if len(found) == 3:
            fresh.kill("one")

    scheduler.run(slowly, range(12), ended)
    scheduler.close()
    assert found == {number: number for number in range(12)}


@pytest.mark.long
def test_a_scheduler_that_dies_leaves_what_was_done(fresh: DaskCluster) -> None:
    from llfsm_verify.extensions.cluster.dask import Cluster

    fresh.start("one")
    scheduler, found = Cluster(fresh.address), dict[int, object]()

    def ended(task: int, end: object) -> None:
        found[task] = end
        if len(found) == 3:
            fresh.scheduler.kill()
            fresh.scheduler.wait()

    code, message = wrong(lambda: scheduler.run(slowly, range(12), ended))
    scheduler.close()
    assert code == "E603" and message.startswith(f"the scheduler at {fresh.address} is gone: ")
    assert 3 <= len(found) < 12 and all(task == end for task, end in found.items())


@pytest.mark.long
def test_the_suite_of_schedulers(fresh: DaskCluster) -> None:
    """The task that ends its process ends two workers, and their nannies start others."""
    fresh.start("one", "two", nanny=True)
    for case in scheduler_cases("tcp", fresh.address):
        assert case().wrong == ""


@pytest.mark.long
def test_where_all_workers_are_gone_the_sweep_ends(fresh: DaskCluster, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without nannies nobody starts others. What else the dead workers had to do is not lost with them."""
    from llfsm_verify.extensions.cluster.dask import Cluster
    from llfsm_verify.testing.conformance import schedulers

    monkeypatch.setattr("llfsm_verify.extensions.cluster.dask.WORKERS", 3.0)
    idle = ("E601", f"the scheduler at {fresh.address} has had no workers for 3 s")
    assert wrong(lambda: Cluster(fresh.address)) == idle
    fresh.start("one", "two")
    scheduler, found = Cluster(fresh.address), dict[int, object]()
    tasks = [-1, *range(5)]
    assert wrong(lambda: scheduler.run(schedulers.squared, tasks, lambda task, end: found.update({task: end}))) == idle
    scheduler.close()
    assert found == {task: task * task for task in found if task >= 0}


# -------------------------------------------------- versions

WITHOUT = """
import importlib.abc, importlib.metadata, sys

class Blocked(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] == "llfsm_verify":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Blocked())
found = importlib.metadata.Distribution.from_name.__func__
def from_name(cls, name):
    if name == "llfsm-verify":
        raise importlib.metadata.PackageNotFoundError(name)
    return found(cls, name)
importlib.metadata.Distribution.from_name = classmethod(from_name)
"""
"""A `sitecustomize` with which Python has no llfsm-verify."""


def with_version(folder: Path, number: str) -> dict[str, str]:
    """An environment in which llfsm-verify has this version."""
    metadata = folder / "site" / f"llfsm_verify-{number}.dist-info" / "METADATA"
    metadata.parent.mkdir(parents=True)
    metadata.write_text(f"Metadata-Version: 2.1\nName: llfsm-verify\nVersion: {number}\n")
    return {"PYTHONPATH": str(folder / "site")}


def without_package(folder: Path) -> dict[str, str]:
    (folder / "site").mkdir()
    (folder / "site" / "sitecustomize.py").write_text(WITHOUT)
    return {"PYTHONPATH": str(folder / "site")}


@pytest.mark.long
@pytest.mark.parametrize(("make", "says"), [(lambda f: with_version(f, "0.0.9"), "has"), (without_package, "has no")])
def test_a_worker_that_is_another_version_is_named(
    make: Callable[[Path], dict[str, str]], says: str, fresh: DaskCluster, tmp_path: Path
) -> None:
    from llfsm_verify.extensions.cluster.dask import Cluster

    fresh.start("one")
    scheduler, found = Cluster(fresh.address), list[object]()

    def ended(task: int, end: object) -> None:
        found.append(end)
        if len(found) == 2:  # and another one comes
            fresh.start("other", environment=make(tmp_path))

    code, message = wrong(lambda: scheduler.run(slowly, range(1000), ended))
    scheduler.close()
    again, said = wrong(lambda: Cluster(fresh.address))
    assert code == again == "E602" and message == said and f" {says} llfsm-verify" in message
    assert message.startswith("the worker tcp://127.0.0.1:") and message.endswith(", and here is 0.1.0")
    assert len(found) < 100
