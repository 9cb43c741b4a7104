"""Compiled, explained and brute force by the definition agree, and so does tiny-datalog, on all valuations."""

from __future__ import annotations

from collections import Counter
from random import Random, SystemRandom

import pytest

from llfsm_verify.diagnostics import Source
from llfsm_verify.knowledge.compiled import compiled
from llfsm_verify.knowledge.explaining import MOST, Fate, explained
from llfsm_verify.knowledge.reading import read_theory
from llfsm_verify.knowledge.tables import tables, undecided, valuation
from llfsm_verify.knowledge.theory import Literal, Theory
from llfsm_verify.report.knowledge import Explained, report
from tests import outside
from tests.knowledge.theories import DEFEATER, Plain, Tags, opposite, random_theory, tags
from tests.quick import FRESH, each, many

NUMBER = many(2000)
SEEDS = range(NUMBER) if not FRESH else [SystemRandom().getrandbits(48) for _ in range(NUMBER)]
KINDS = ("team", "ambiguous", "a defeater blocks", "a defeater is beaten", "both", "neither", "several levels")


@pytest.mark.slow
def test_random_theories_by_the_definition() -> None:
    tally: Counter[str] = Counter()
    for seed in SEEDS:
        random = Random(seed)
        plain = random_theory(random)
        text = plain.text(random)
        theory = read_theory(Source("random.d", text))
        known = [tags(plain, v) for v in plain.valuations()]
        for row, tag in enumerate(known):
            assert not tag.proved & tag.not_proved
            tally.update(_kinds(plain, tag, list(plain.valuations())[row]))
        for atom in plain.atoms():
            for literal in (Literal(atom), Literal(atom, False)):
                _agree(plain, theory, literal, known, f"{seed}: {literal} of\n{text}")
    assert each(tally, KINDS)(), tally


def _agree(plain: Plain, theory: Theory, literal: Literal, known: list[Tags], about: str) -> None:
    expected = [str(literal) in tag.proved for tag in known]
    assert [str(literal) not in tag.not_proved for tag in known] == expected, about
    part = compiled(theory, literal)
    ((first, rows, (column,)),) = tables([part], plain.inputs)
    assert (first, rows) == (0, len(known))
    assert [bool(column >> row & 1) for row in range(rows)] == expected, about
    said = undecided(theory, literal)
    assert said.looked
    sides = [sum(str(side) in tag.proved for side in (literal, literal.complement)) for tag in known]
    for found, number in ((said.neither, 0), (said.both, 2)):
        if number not in sides:
            assert found is None, about
        else:
            first = valuation(plain.inputs, sides.index(number))
            assert found is not None and found.items() <= first.items(), about
            assert not any(value for name, value in first.items() if name not in found), about
    for row, values in enumerate(plain.valuations()):
        assert valuation(plain.inputs, row) == values
        why = explained(theory, literal, {name: True for name, value in values.items() if value})
        assert why.proved == expected[row] and why.valuation == values, about
        for decision in why.decisions:
            assert decision.proved == (decision.atom in known[row].proved), about
            assert decision.refuted == (f"~{decision.atom}" in known[row].proved), about
            for fate in decision.fates:
                _fate_fits(theory, fate, known[row], about)


def _fate_fits(theory: Theory, fate: Fate, tag: Tags, about: str) -> None:
    rule = theory.rules[fate.rule]
    applies = tag.proved >= {str(b) for b in rule.body}
    assert applies == (fate.outcome != "idle"), about
    assert {str(b) for b in fate.missing} == {str(b) for b in rule.body} - tag.proved, about
    if fate.outcome == "wins":
        assert rule.proves and str(rule.head) in tag.proved, about
        beaten = {weak for strong, weak in theory.superior if tag.proved >= {str(b) for b in theory.rules[strong].body}}
        assert not fate.by or (str(rule.head) not in tag.strict and beaten >= {fate.rule, *fate.by}), about
    if fate.outcome in ("beaten", "blocked"):
        assert fate.by and all(theory.rules[n].head == rule.head.complement for n in fate.by), about
        assert all(tag.proved >= {str(b) for b in theory.rules[n].body} for n in fate.by), about
    if fate.outcome == "beaten":
        assert all((n, fate.rule) in theory.superior and theory.rules[n].proves for n in fate.by), about
    if fate.outcome == "blocked":
        assert str(rule.head) not in tag.proved, about
    if fate.outcome == "blocks":
        assert not rule.proves and str(rule.head.complement) not in tag.proved - tag.strict, about


def _kinds(plain: Plain, tag: Tags, values: dict[str, bool]) -> set[str]:
    found = set()
    applying = [r for r in plain.rules if tag.proved >= set(r.body)]
    for literal in {r.head for r in plain.rules}:
        team = [r for r in applying if r.head == literal and r.arrow != DEFEATER]
        attackers = [r for r in applying if r.head == opposite(literal)]
        if literal in tag.proved - tag.strict and attackers:
            if not any(all((t.label, s.label) in plain.beats for s in attackers) for t in team):
                found.add("team")
            if any(s.arrow == DEFEATER for s in attackers):
                found.add("a defeater is beaten")
        if {literal, opposite(literal)} <= tag.proved:
            found.add("both")
        if team and not {literal, opposite(literal)} & tag.proved:
            found.add("neither")
            if any({literal, opposite(literal)} & set(r.body) for r in plain.rules):
                found.add("ambiguous")
        if any(r.head.startswith("p1") and "p0" in r.body for r in applying):
            found.add("several levels")
    without = Plain(plain.inputs, tuple(r for r in plain.rules if r.arrow != DEFEATER), plain.beats)
    if any(r.arrow == DEFEATER for r in applying) and tags(without, values).proved != tag.proved:
        found.add("a defeater blocks")
    return found


@pytest.mark.slow
@outside.needs("tiny-datalog")
def test_random_theories_by_tiny_datalog() -> None:
    defeasible = outside.load("tiny-datalog", "tiny_datalog.defeasible")
    compared = 0
    for seed in SEEDS:
        plain = random_theory(Random(seed))
        theory = read_theory(Source("random.d", plain.text()))
        literals = [Literal(atom, positive) for atom in plain.atoms() for positive in (True, False)]
        ((_, _, columns),) = tables([compiled(theory, literal) for literal in literals], plain.inputs)
        rules = [f"{r.label}: {', '.join(r.body)} {r.arrow} {r.head}." for r in plain.rules]
        rules += [f"{one} > {other}." for one, other in plain.beats]
        for row, values in enumerate(plain.valuations()):
            facts = [f"{name if value else opposite(name)}." for name, value in values.items()]
            found = defeasible.Theory.parse("\n".join(facts + rules)).conclusions()
            assert not found["undecided"]
            proved = {name for name, _ in found["+∂"]}
            ours = {str(literal) for literal, column in zip(literals, columns, strict=True) if column >> row & 1}
            assert ours == proved - {name for name in proved if name.removeprefix("~") in plain.inputs}, (seed, values)
            compared += 1
    assert compared >= 2 * NUMBER


def test_of_many_causes_the_first_ones_are_named() -> None:
    rules = "".join(f"A{i}: a => q. B{i}: a => ~q.\n" for i in range(2000))
    theory = read_theory(Source("wide.d", f'input {{a}}.\n{rules}output {{b q, "q"}}.'))
    explanation = explained(theory, Literal("q"), {"a": True})
    assert {len(fate.by) for fate in explanation.decisions[-1].fates} == {MOST}
    lines = report(Explained(theory, (explanation,))).splitlines()
    assert lines[-1].endswith("is blocked by A0, A1, A2, A3, A4, A5, A6, A7 and others")
