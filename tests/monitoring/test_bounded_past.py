"""Monitors of the past with bounds, as automata, tables and machine code, by the definition of the operators."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.logic.bounds import TICK
from llfsm_verify.logic.formula import BOUNDED_PAST, Formula, apply, operators
from llfsm_verify.monitoring.lookup import walk_table
from llfsm_verify.monitoring.monitor import MonitorVerdict, monitor
from llfsm_verify.monitoring.native import CompiledMonitors
from llfsm_verify.testing.formulas import letters
from tests.automata.ltl.test_bounded_past import CLOCK, KEYS, ORDER, backwards, defined, mask, parsed, true_on
from tests.monitoring.test_monitor_kinds import TRUE, by_definition, words
from tests.quick import FRESH, each, examples, spread

TAILS = [frozenset(tail) for tail in ({TICK}, {"p", TICK}, {"q", TICK}, {"p", "q", TICK})]


@pytest.mark.slow
def test_every_kind_by_the_definition() -> None:
    seen: Counter[str] = Counter()

    def check(f: Formula, word: list[frozenset[str]]) -> None:
        seen.update(operators(f) & BOUNDED_PAST)
        always = apply("G", f)
        m = monitor(always, ORDER, clock=CLOCK) if operators(f) & BOUNDED_PAST else monitor(always, ORDER)
        table, compiled = walk_table(m), CompiledMonitors({"m": m}, ORDER)
        right = defined(f, word)
        state, number = 0, table.numbers[0]
        for i, letter in enumerate(word):
            bits = mask(letter)
            state, number = m.step(state, bits), table.step(number, bits)
            compiled.feed(compiled.pack([bits]))
            assert table.states[number] == state == compiled.states["m"]
            verdict = m.verdicts[state]
            seen[verdict.value] += 1
            if not all(right[: i + 1]):
                assert verdict is MonitorVerdict.FALSE
            elif verdict is not MonitorVerdict.NOT_YET:
                held = {true_on(always, word[: i + 1], [tail]) for tail in TAILS}
                assert held == {verdict is MonitorVerdict.TRUE}

    amount = settings(max_examples=10_000 if FRESH else 75, deadline=None)
    drawn = backwards(), st.lists(letters(ORDER), max_size=8)
    spread(check, amount, *drawn, until=each(seen, {*BOUNDED_PAST, "true", "false", "not yet"}))


@pytest.mark.slow
@given(backwards(timed=False), st.sampled_from(["G", "F", "X"]), words)
@settings(max_examples=examples(100), deadline=None)
def test_verdicts_come_as_early_as_can_be(f: Formula, around: str, word: list[frozenset[str]]) -> None:
    late = apply(around, f)
    assert monitor(late, KEYS).verdict(word) is by_definition(late, word, TRUE)


@pytest.mark.slow
def test_a_long_bound_is_a_table() -> None:
    m = monitor(parsed("G (q -> O[0:3000] p)"), KEYS)
    assert len(m.verdicts) == 3_002
    compiled = CompiledMonitors({"m": m}, KEYS)
    compiled.feed(compiled.pack([1, *[0] * 2_999, 2, 0]))
    assert not compiled.settled
    compiled.feed(compiled.pack([2]))
    assert compiled.settled == {"m": 3_003}
    with pytest.raises(AutomatonTooLarge, match="ticks of counters"):
        monitor(parsed("G (q -> O[0:30000] p)"), KEYS)
