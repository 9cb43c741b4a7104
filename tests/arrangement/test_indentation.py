"""Tabs and wrong indentation are said to be that, with the place, whatever stands near them that could be quoted."""

from __future__ import annotations

import pytest

from llfsm_verify.arrangement.keys import VOCABULARY
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source
from llfsm_verify.yaml.compose import compose

TOP = "machines:\n  m:\n    inline:\n      machine: M\n      states:\n"

TABS = {
    "before a flow transition": "        - name: A\n          transitions:\n§\t    - {when: car, to: B}\n",
    "after a quoted guard": "        - name: A\n          transitions:\n            - when: '!car'\n§\t      to: B\n",
    "behind blanks": '        - name: A\n          transitions:\n            - when: "x: y"\n          §\t  to: B\n',
    "in a block": "        - name: A\n          on_entry: |\n§\t    car = true;\n",
}

LINES = {
    "a key to the left": (
        "        - name: A\n          on_entry: car = true;\n         §transitions: []\n",
        "less than line 7: by 9 spaces, not 10",
    ),
    "to behind when": (
        "        - name: A\n          transitions:\n            - when: car\n                §to: A\n",
        "more than line 8: by 16 spaces, not 14",
    ),
    "to before when": (
        "        - name: A\n          transitions:\n            - when: car\n             §to: A\n",
        "less than line 8: by 13 spaces, not 14",
    ),
    "an item to the left": ("        - name: A\n       §- name: B\n", "less than line 6: by 7 spaces, not 8"),
    "an item to the right": ("        - name: A\n          §- name: B\n", "more than line 6: by 10 spaces, not 8"),
    "an action behind its state": (
        "        - name: A\n            §on_entry: car = true;\n",
        "more than line 6: by 12 spaces, not 10",
    ),
    "a line of a block to the left": (
        "        - name: A\n          on_entry: |\n            a: 1;\n            x = 1;\n         §y = 1;\n",
        "less than line 7: by 9 spaces, not 10",
    ),
    "with a guard to be quoted near": (
        "        - name: A\n          transitions:\n            - when: '!x'\n             §to: A\n",
        "less than line 8: by 13 spaces, not 14",
    ),
}


def found(text: str, *, pure: bool) -> Diagnostic:
    with pytest.raises(DiagnosticError) as caught:
        compose(Source("a.yaml", (TOP + text).replace("§", "")), [], VOCABULARY, pure=pure)
    (diagnostic,) = caught.value.diagnostics
    assert diagnostic.span is not None
    assert diagnostic.span.start == (TOP + text).index("§")
    return diagnostic


@pytest.mark.parametrize("pure", [False, True], ids=["fast", "pure"])
@pytest.mark.parametrize("name", TABS)
def test_a_tab_is_said_to_be_one(name, pure):
    diagnostic = found(TABS[name], pure=pure)
    assert (diagnostic.code, diagnostic.message) == ("E010", "a tab cannot indent a line")
    assert diagnostic.hint is not None and "use spaces" in diagnostic.hint


@pytest.mark.parametrize("pure", [False, True], ids=["fast", "pure"])
@pytest.mark.parametrize("name", LINES)
def test_a_line_that_stands_beside_nothing(name, pure):
    text, says = LINES[name]
    diagnostic = found(text, pure=pure)
    assert (diagnostic.code, diagnostic.message) == ("E010", f"this line is indented {says}")
    assert diagnostic.hint is not None and says.rpartition(" ")[2] in diagnostic.hint


def test_a_guard_that_must_be_quoted_is_still_said_to_be_one():
    text = TOP + "        - name: A\n          transitions:\n            - when: a ? b : c\n              to: A\n"
    with pytest.raises(DiagnosticError) as caught:
        compose(Source("a.yaml", text), [], VOCABULARY)
    assert [d.code for d in caught.value.diagnostics] == ["E020"]
