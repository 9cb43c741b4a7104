"""The garbage collector is paused where it is said, goes on where it ran before, and leaves alone what lasts."""

from __future__ import annotations

import gc
import subprocess
import sys
import weakref
from collections.abc import Iterator

import pytest

from llfsm_verify import collector
from llfsm_verify.collector import paused_collector


def test_it_goes_on_after_the_outermost_pause() -> None:
    assert gc.isenabled()
    with paused_collector():
        assert not gc.isenabled()
        with paused_collector():
            pass
        assert not gc.isenabled()
    assert gc.isenabled()


def test_it_goes_on_after_a_mistake() -> None:
    @paused_collector()
    def wrong() -> None:
        assert not gc.isenabled()
        raise ValueError("wrong")

    for _ in range(2):
        with pytest.raises(ValueError, match="wrong"):
            wrong()
        assert gc.isenabled()


@pytest.fixture
def own_threshold() -> Iterator[None]:
    before = gc.get_threshold()
    gc.set_threshold(10_000, 20, 100)
    yield
    gc.set_threshold(*before)
    gc.unfreeze()


def frozen_by(objects: int, *, lasting: bool) -> int:
    gc.collect()
    before = gc.get_freeze_count()
    with paused_collector(lasting=lasting):
        built = [[number] for number in range(objects)]
        assert not gc.isenabled()
    assert gc.isenabled() and len(built) == objects
    return gc.get_freeze_count() - before


def test_a_process_with_more_to_do_leaves_nothing_alone(own_threshold: None) -> None:
    assert frozen_by(20_000, lasting=True) == 0


def test_a_process_with_one_task_leaves_alone_what_is_large_and_lasts(
    own_threshold: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(collector, "_one_task", [True])
    assert frozen_by(20_000, lasting=False) == 0
    assert frozen_by(1_000, lasting=True) == 0
    assert frozen_by(20_000, lasting=True) > 20_000


def test_a_process_that_goes_on_leaves_nothing_alone_any_more(
    own_threshold: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(collector, "_one_task", [True])
    assert frozen_by(20_000, lasting=True) > 20_000
    collector.do_more_tasks()
    assert gc.get_freeze_count() == 0
    assert frozen_by(20_000, lasting=True) == 0


def test_everything_is_collected_also_what_was_left_alone(own_threshold: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(collector, "_one_task", [True])

    class Circle:
        pass

    circle = Circle()
    circle.itself = circle
    gone = weakref.ref(circle)
    assert frozen_by(20_000, lasting=True) > 20_000
    del circle
    gc.collect()
    assert gone() is not None
    collector.collect_everything()
    assert gone() is None


def test_what_frees_everything_does_not_touch_what_a_caller_has_frozen(own_threshold: None) -> None:
    gc.freeze()
    collector.collect_everything()
    collector.do_more_tasks()
    assert gc.get_freeze_count() > 1_000


def test_nothing_is_looked_through_at_the_end_of_a_process_with_one_task() -> None:
    script = (
        "import atexit, gc\n"
        "from llfsm_verify.collector import do_one_task\n"
        "atexit.register(lambda: print(gc.get_freeze_count() > 1000))\n"
        "do_one_task()\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "True\n"
