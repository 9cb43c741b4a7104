"""The one walk over typed trees: everything once, from left to right, and nothing of what is only named there."""

from __future__ import annotations

from fractions import Fraction

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.language.trees import nodes, of_kind
from llfsm_verify.language.typed import After, Assign, Index, Literal, Read, Variable
from llfsm_verify.report.drawing.extract import whiteboard_uses

TEXT = """
name: walk
cycle_ms: 10
whiteboard:
  a: {type: 0..3, init: 0}
  b: {type: 0..3, init: 0}
  c: {type: 0..3, init: 0}
  list: {type: {array: 0..3, size: 4}}
machines:
  m:
    inline:
      machine: M
      states:
        - name: S
          on_entry: "list[a] = b; c += 1;"
          transitions: [{when: "after_ms(20) && a > 2 && after_ms(30)", to: S}]
schedule: [m]
"""


def test_nodes_come_from_left_to_right_each_once() -> None:
    (state,) = load_arrangement_text(TEXT).machine("m").states
    first, second = state.on_entry
    reads = [read.variable.name for read in of_kind(state.on_entry, Read)]
    assert reads == ["list", "a", "b", "c"]
    assert [*of_kind(state.on_entry, Assign)] == [first, second]
    assert [a.bound for a in of_kind(state.transitions[0].guard, After)] == [Fraction(20), Fraction(30)]
    assert len([*of_kind(first, Index)]) == 1
    assert not [*of_kind(state.on_entry, Variable)]
    assert [n.value for n in nodes(second) if isinstance(n, Literal)] == [1]


def test_what_is_only_written_is_not_read() -> None:
    machine = load_arrangement_text(TEXT).machine("m")
    assert whiteboard_uses(machine) == (frozenset({"a", "b", "c"}), frozenset({"list", "c"}))
