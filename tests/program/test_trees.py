"""Walks over expressions."""

from __future__ import annotations

from llfsm_verify.program.program import Get, Int
from llfsm_verify.program.terms import const, op
from llfsm_verify.program.trees import distinct_nodes, nodes


def test_a_part_that_stands_in_several_places_is_met_once_in_the_same_order() -> None:
    x, y = Get("x", None, Int(0, 9)), Get("y", None, Int(0, 9))
    total = op("add", x, y)
    for _ in range(12):
        total = op("add", total, op("min", total, const(3)))
    walked = list(distinct_nodes(total))
    assert walked == list({id(node): node for node in nodes(total)}.values())
    assert len(walked) < 60
    assert sum(1 for _ in nodes(total)) > 4_000
