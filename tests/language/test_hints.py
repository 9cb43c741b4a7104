"""Hints say what can stand in that place."""

from __future__ import annotations

import pytest

from llfsm_verify.arrangement import load_arrangement_text
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.language.scope import did_you_mean
from llfsm_verify.logic.properties import parse_properties

TEXT = """
name: t
types: {Order: [OPEN, CLOSE]}
whiteboard: {open: {type: bool}, order: {type: Order}, button: {type: bool, role: input}}
machines:
  m: {inline: {machine: M, states: [{name: A, on_entry: open = true;, transitions: [{when: button, to: A}]}]}}
schedule: [m]
"""


def hint_of(text: str, *properties: str) -> tuple[str, str | None]:
    with pytest.raises(DiagnosticError) as caught:
        bind(load_arrangement_text(text), parse_properties([Source("p", "\n".join(properties))]))
    (found,) = caught.value.diagnostics
    return found.code, found.hint


def test_of_names_that_differ_in_case_the_closest_counts() -> None:
    assert did_you_mean("opn", ["open", "OPEN"]) == "did you mean `open`?"
    assert did_you_mean("opn", ["OPEN", "open"]) == "did you mean `open`?"
    assert did_you_mean("OPN", ["open", "OPEN"]) == "did you mean `OPEN`?"


@pytest.mark.parametrize(
    ("action", "hint"),
    [
        ("opn = true;", "did you mean `open`?"),
        ("OPN = true;", "did you mean `open`?"),  # a value of an enumeration cannot be assigned to
        ("butto = true;", "known here: `open`, `order`"),  # nor can an input
        ("order = OPN;", "did you mean `OPEN`?"),
    ],
)
def test_of_what_is_assigned_to(action: str, hint: str) -> None:
    assert hint_of(TEXT.replace("open = true;", action)) == ("E110", hint)


@pytest.mark.parametrize(
    ("atom", "code", "hint"),
    [
        ("m.fired", "E117", "write `m.fired(STATE, 0)`"),
        ("m.fired(A)", "E117", "write `m.fired(STATE, 0)`"),
        ("m.read", "E117", "write `m.read(x)`, where `x` is an input"),
        ("m.sampled", "E117", "write `m.sampled(x)`, where `x` is an input"),
        ("fired(A, 0)", "E113", "write `m.fired(STATE, 0)`"),
        ("m.fired(A, 7)", "E146", "it has one, number 0"),
        (
            "m.foo",
            "E110",
            "known here: `ran`, `entered`, `suspended`, `loaded`, `finished`, `fired`, `sampled`, `read`",
        ),
    ],
)
def test_of_what_properties_ask(atom: str, code: str, hint: str) -> None:
    assert hint_of(TEXT, f"x: G ({atom} -> true)") == (code, hint)


def test_of_a_declaration_without_its_key() -> None:
    assert hint_of(TEXT.replace("{type: Order}", "Order")) == ("E030", "write `order: {type: Order}`")
    machine = TEXT.replace("machine: M,", "machine: M, variables: {n: uint8},")
    assert hint_of(machine) == ("E030", "write `n: {type: uint8}`")
