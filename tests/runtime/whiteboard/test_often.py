"""Inputs that a process posts again and again are posted in memory that it was lent, and mean the same."""

from __future__ import annotations

from contextlib import closing
from random import Random

import pytest

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.runtime.whiteboard import client
from llfsm_verify.runtime.whiteboard.client import PostRefused, Whiteboard, WhiteboardError
from tests.runtime.whiteboard.test_server import KINDS, boards, served, tidy  # noqa: F401 - fixtures

INPUTS = {"level": range(-3, 5), "mode": ("LOW", "HIGH"), "speed": ("0.25", "-1.00"), "go": (False, True)}


@pytest.mark.parametrize("seed", range(3))
def test_posts_mean_the_same_in_whatever_memory(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(client, "OFTEN", 3)
    random, lent = Random(seed), 0
    with served(build_arrangement(KINDS)), closing(Whiteboard("board")) as board:
        expected: dict[str, object] = {}
        for _ in range(25):
            names = random.choice([["level"], ["level", "mode"], ["speed"], ["mode", "speed"]])
            for _ in range(random.randrange(1, 8)):
                values = {name: random.choice(INPUTS[name]) for name in names}
                board.post(**values)  # type: ignore[arg-type]
                expected |= values
                lent += board._writer is not None
            with pytest.raises(PostRefused):
                board.post(**dict.fromkeys(names, "nonsense"))
            while any(str(board.get(name)) != str(value) for name, value in expected.items()):
                pass
        assert lent > 2
        with closing(Whiteboard("board")) as other, pytest.raises(PostRefused):
            other.post(level=1)


def test_a_lost_server_is_told_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(client, "OFTEN", 1)
    with served(build_arrangement(KINDS)):
        board = Whiteboard("board")
        while board._writer is None:
            board.post(level=1)
    with closing(board), pytest.raises(WhiteboardError, match="gone"):
        board.post(level=1)
