"""Properties that compare records and arrays as wholes, element by element."""

from __future__ import annotations

import pytest

from llfsm_verify.arrangement import load_arrangement_text
from llfsm_verify.checking.verdict import Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.verification.verify import verify
from tests.warm import compiled_kernels

__all__ = ["compiled_kernels"]

TEXT = """\
types:
  Row: {record: {on: bool, items: {array: 0..3, size: 2}}}
whiteboard:
  a: {type: Row}
  b: {type: Row}
  grid: {type: {array: {array: 0..3, size: 2}, size: 2}}
machines:
  m:
    inline:
      machine: M
      states:
        - name: A
          on_entry: |
            a.items[1] = 3;
            b.items[1] = 1;
            grid[0][1] = 2;
            grid[1][1] = 2;
schedule: [m]
"""


@pytest.mark.parametrize(
    ("formula", "verdict"),
    [
        ("G a == b", Verdict.VIOLATED),
        ("F a != b", Verdict.HOLDS),
        ("G a.items == b.items", Verdict.VIOLATED),
        ("G grid[0] == grid[1]", Verdict.HOLDS),
        ("F grid[0] == a.items", Verdict.HOLDS),
        ("G grid[0] == a.items", Verdict.VIOLATED),
    ],
)
def test_every_element_counts(formula, verdict):
    [found] = verify(
        load_arrangement_text(TEXT), parse_properties([Source("p.ltl", formula)]), engine="explicit"
    ).properties
    assert found.verdict is verdict


INPUTS = """\
types:
  Row: {record: {on: bool, far: 0..3}}
whiteboard:
  pair: {type: {array: bool, size: 2}, role: input}
  one: {type: {array: 0..3, size: 1}, role: input}
  rows: {type: {array: Row, size: 2}, role: input}
  i: {type: 0..1, init: 1}
machines:
  m:
    inline:
      machine: M
      variables: {seen: {type: bool}, far: {type: 0..3}, only: {type: 0..3}}
      states:
        - name: A
          on_entry: |
            seen = pair[i];
            far = rows[i].far;
            only = one[i - 1];
schedule: [m]
"""


@pytest.mark.parametrize(
    ("formula", "verdict"),
    [
        ("X (m.seen <-> pair[1])", Verdict.HOLDS),
        ("X (m.seen <-> pair[0])", Verdict.VIOLATED),
        ("X m.far == rows[1].far", Verdict.HOLDS),
        ("X m.far == rows[0].far", Verdict.VIOLATED),
        ("X m.only == one[0]", Verdict.HOLDS),
    ],
)
def test_an_index_chooses_among_the_elements_of_an_input(formula, verdict):
    [found] = verify(
        load_arrangement_text(INPUTS), parse_properties([Source("p.ltl", formula)]), engine="explicit"
    ).properties
    assert found.verdict is verdict
