"""The garbage collector is paused where it is said, and goes on where it ran before."""

from __future__ import annotations

import gc

import pytest

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
