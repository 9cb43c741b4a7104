"""Sets of states in which some simulate others: what is kept of them."""

from __future__ import annotations

import pytest

from llfsm_verify.automata.omega.subsets import maximal


@pytest.mark.parametrize(
    ("members", "above", "kept"),
    [
        (0b11, [0, 0], 0b11),
        (0b11, [0b10, 0], 0b10),
        (0b11, [0, 0b01], 0b01),
        (0b11, [0b10, 0b01], 0b01),  # of two that simulate each other the lower one
        (0b111, [0b110, 0b101, 0b011], 0b001),
        (0b111, [0b100, 0b100, 0], 0b100),
        (0b111, [0b010, 0b001, 0], 0b101),
        (0b10, [0b10, 0b01], 0b10),  # who simulates it is not there
    ],
)
def test_what_another_member_simulates_is_left_out(members: int, above: list[int], kept: int) -> None:
    assert maximal(members, above) == kept
