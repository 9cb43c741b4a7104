"""Translation, classes and monitors against recorded facts about formulas of the literature.

The file holds formulas in Spot's syntax with a word each that it accepts and rejects, and its class in the hierarchy of
Manna and Pnueli (S safety, G guarantee, B both, O obligation, R recurrence, P persistence, T reactivity).
"""

import csv
import re
from functools import cache

import pytest

from llfsm_verify.automata.ltl.classes import classify
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.automata.omega.products import accepts, disjoint
from llfsm_verify.automata.safety import safety
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.logic.formula import FALSE, TRUE, apply, atom, negation
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.parsing.formulas import parse_formula
from llfsm_verify.monitoring.monitor import MonitorVerdict, monitor
from tests.outside import FACTS, needs


def rows():
    if not FACTS.is_file():
        return []
    with FACTS.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file, delimiter="\t"))


ROWS = rows()
SHARES = [8, pytest.param(1, marks=pytest.mark.long)]
"""Every so many rows: some in each run of the tests, all in the long one."""


# ---------------------------------------------------------------- Spot's syntax, as far as the file uses it


def split(text):
    """Words and signs; `GFp0` is three words, `0` and `1` are constants."""
    for word in re.findall(r"[A-Za-z_]\w*|\d|<->|->|\[\]|<>|&&?|\|\|?|\S", text):
        prefix = re.match(r"[GFX]+", word)
        if prefix is None or len(word) == 1:
            yield {"0": "false", "1": "true", "&": "&&", "|": "||", "[]": "G", "<>": "F"}.get(word, word)
        else:
            yield from prefix.group()
            if word[prefix.end() :]:
                yield word[prefix.end() :]


BINDING = {"->": 1, "<->": 1, "||": 2, "xor": 3, "&&": 4, "U": 5, "W": 5, "R": 5, "M": 5}
NAMES = {"->": "implies", "<->": "iff", "||": "or", "&&": "and"}


def read(words):
    """A parser of its own (Spot's levels; the file has no chain that would tell the groupings apart)."""

    def expression(level):
        left = operand()
        while words and BINDING.get(words[0], 0) >= level:
            sign = words.pop(0)
            right = expression(BINDING[sign] + (sign in ("||", "&&", "xor")))
            left = apply(NAMES.get(sign, sign), left, right)
        return left

    def operand():
        word = words.pop(0)
        if word == "(":
            inside = expression(1)
            assert words.pop(0) == ")"
            return inside
        if word == "!":
            return negation(operand())
        if word in "GFX":
            return apply(word, operand())
        return {"true": TRUE, "false": FALSE}.get(word) or atom(word)

    formula = expression(1)
    assert not words
    return formula


def word(text):
    """Stem and loop of ``p0; cycle{!p0 & p1; 1}``; atoms not named are false."""
    stem, loop = text.split("cycle{")
    parts = [s.split(";") if s.strip("; ") else [] for s in (stem.rstrip("; "), loop.rstrip("}"))]
    return [[frozenset(re.findall(r"(?<![!\w])[a-z]\w*", letter)) for letter in part] for part in parts]


# ---------------------------------------------------------------- the facts


@cache
def formula_of(text):
    return read(list(split(text)))


@cache
def automaton_of(text, **options):
    return translate(formula_of(text), **options)


@pytest.mark.slow
@needs("shared")
def test_our_parser_reads_them_alike():
    for row in ROWS:
        words = list(split(row["formula"]))
        expected = read(list(words))
        assert parse_formula(Fragment.whole(Source("facts", " ".join(words)))).formula is expected, row["formula"]


@pytest.mark.slow
@needs("shared")
@pytest.mark.parametrize("share", SHARES)
def test_words(share):
    for row in ROWS[::share]:
        f = formula_of(row["formula"])
        automaton = automaton_of(row["formula"])
        plain = automaton_of(row["formula"], generalised=False)
        opposite = automaton_of(row["formula"], negate=True)
        assert (automaton.is_empty, opposite.is_empty) == (not row["accepted_word"], not row["rejected_word"])
        for text, expected in ((row["accepted_word"], True), (row["rejected_word"], False)):
            if text:
                stem, loop = word(text)
                assert evaluate(f, stem, loop) is expected, row
                assert accepts(automaton, stem, loop) is expected, row
                assert accepts(plain, stem, loop) is expected, row
                assert accepts(opposite, stem, loop) is not expected, row


@pytest.mark.slow
@needs("shared")
@pytest.mark.parametrize("share", SHARES)
def test_automata_and_their_negations_are_disjoint(share):
    for row in ROWS[::share]:
        opposite = automaton_of(row["formula"], negate=True)
        assert disjoint(automaton_of(row["formula"]), opposite), row
        assert disjoint(automaton_of(row["formula"], generalised=False), opposite), row


@needs("shared")
@pytest.mark.slow
def test_sizes():
    """At most 1.05 times the states of the recorded automata; an empty automaton is recorded with one state."""
    for column, options in (("tgba_s", {}), ("ba_s", {"generalised": False})):
        expected = sum(int(row[column]) for row in ROWS)
        found = sum(max(1, len(automaton_of(row["formula"], **options).edges)) for row in ROWS)
        assert found <= 1.05 * expected


@pytest.mark.slow
@needs("shared")
@pytest.mark.parametrize("share", SHARES)
def test_classes(share):
    for row in ROWS[::share]:
        f = formula_of(row["formula"])
        assert classify(f) == row["mp_class"], row["formula"]


@pytest.mark.slow
@needs("shared")
@pytest.mark.parametrize("share", SHARES)
def test_safety(share):
    for row in ROWS[::share]:
        found = safety(formula_of(row["formula"]))
        assert found.exact, row["formula"]
        assert found.holds is (row["mp_class"] in "SB"), row["formula"]


@needs("shared")
@pytest.mark.parametrize("share", SHARES)
def test_monitors(share):
    """The recorded monitors have no states for the bad prefixes; ours of safety properties have one for all of them."""
    for row in ROWS[::share]:
        if row["mp_class"] in "SB" and row["accepted_word"]:
            verdicts = monitor(formula_of(row["formula"])).verdicts
            assert sum(v is not MonitorVerdict.FALSE for v in verdicts) == int(row["monitor_s"]), row["formula"]
