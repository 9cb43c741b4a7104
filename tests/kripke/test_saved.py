"""What a saved exploration says of itself is looked at before it is used."""

from __future__ import annotations

import pytest

from llfsm_verify.kripke.checkpoint import Unusable, need, whole


def test_what_is_damaged_says_so() -> None:
    need(True)
    with pytest.raises(Unusable, match=r"^it is damaged$"):
        need(False)
    assert whole(3, 0, 3) == 3
    for value in (4, -1, True, "3", None, 3.0):
        with pytest.raises(Unusable, match=r"^it is damaged$"):
            whole(value, 0, 3)
