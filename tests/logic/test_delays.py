"""Spot's delays in braces are refused with what to write instead; elsewhere `#` starts a comment."""

import re

import pytest

from llfsm_verify.diagnostics import DiagnosticError, Fragment, Source
from llfsm_verify.logic.properties import FEATURES, parse_properties
from llfsm_verify.logic.syntaxes import parse_in
from llfsm_verify.logic.word import Lasso, Times


def spot(text):
    return parse_in("spot", Fragment.whole(Source("t", text))).formula


@pytest.mark.parametrize(
    ("delay", "instead"),
    [
        ("##0", "a : b"),
        ("##1", "a ; b"),
        ("##02", "a ; [*1] ; b"),
        ("##[1..3]", "a ; [*0..2] ; b"),
        ("##[ 1 .. 3 ]", "a ; [*0..2] ; b"),
        ("##[2 to 2]", "a ; [*1] ; b"),
        ("##[,2]", "(a : b) | (a ; [*0..1] ; b)"),
        ("##[0:1]", "(a : b) | (a ; b)"),
        ("##[0:4]", "(a : b) | (a ; [*0..3] ; b)"),
        ("##[2:]", "a ; [*1..$] ; b"),
        ("##[+]", "a ; [*0..$] ; b"),
        ("##[*]", "(a : b) | (a ; [*0..$] ; b)"),
        ("##[x]", "a ; [*1] ; b"),
    ],
)
def test_delays(delay, instead):
    with pytest.raises(DiagnosticError) as raised:
        spot(f"c & {{a {delay} b}}!")
    (found,) = raised.value.diagnostics
    assert (found.code, found.span.column, found.span.text) == ("E351", 8, delay)
    written = re.match("write `([^`]*)`", found.hint)[1]
    assert written == instead
    spot(f"{{{written}}}!")  # Spot's reader takes it


def test_in_property_files_each_is_named_and_the_rest_is_read():
    text = "# syntax: spot\n{a##2 b}\nx: {a ##[1:2]\ny: G p\nz: {a ##0 b}[]->c\n"
    with pytest.raises(DiagnosticError) as raised:
        parse_properties([Source("t", text)], features=FEATURES)
    places = [(d.code, d.span.line, d.span.column) for d in raised.value.diagnostics]
    assert places == [("E351", 2, 3), ("E351", 3, 7), ("E351", 5, 7)]


@pytest.mark.parametrize("text", ["G a ##2", "{a;b}[]->c ##2 {", '{"a"}! # {a##2 b}', "# {a##2 b}\nG a"])
def test_comments(text):
    assert spot(text) == spot(text.split("#")[0].strip() or "G a")
    (found,) = parse_properties([Source("t", "# syntax: spot\n" + text)], features=FEATURES)
    assert "#" not in found.text


def test_a_word_without_delays_has_no_times():
    with pytest.raises(ValueError, match="needs the delays between letters"):
        Times(Lasso((frozenset(),), 0))


def test_a_character_that_cannot_be_printed_is_named_by_its_number():
    with pytest.raises(DiagnosticError, match=r"a formula cannot have the character U\+0007"):
        parse_properties([Source("test", "G a \x07 b")])
