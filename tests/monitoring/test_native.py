"""Compiled monitors step as the automata that they are made of."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.logic.formula import apply, atom, conjunction, disjunction, negation
from llfsm_verify.monitoring.lookup import MonitorTooLarge, walk_table
from llfsm_verify.monitoring.monitor import Monitor, MonitorEdge, MonitorVerdict, monitor
from llfsm_verify.monitoring.native import CompiledMonitors
from llfsm_verify.testing.formulas import formulas
from tests.quick import examples

KEYS = ("p", "q", "r")


def walked(m, word):
    """The states of a monitor along a word."""
    states = [0]
    for letter in word:
        states.append(m.step(states[-1], letter))
    return states


def is_settled(m, state):
    return all(edge.target == state for edge in m.edges[state])


@given(formulas(KEYS, max_leaves=8), st.lists(st.integers(0, 7), max_size=12))
@settings(max_examples=examples(100))
def test_tables_step_as_the_monitor(f, word):
    m = monitor(f, KEYS)
    table = walk_table(m)
    number = table.numbers[0]
    for letter, state in zip(word, walked(m, word)[1:], strict=True):
        number = table.step(number, letter)
        assert table.states[number] == state
        assert (number >= table.settled) == is_settled(m, state)


@given(st.lists(formulas(KEYS, max_leaves=6), min_size=1, max_size=4), st.lists(st.integers(0, 7), max_size=30))
@settings(max_examples=examples(15))
def test_compiled_monitors_step_as_the_automata(fs, word):
    monitors = {f"f{i}": monitor(f, KEYS) for i, f in enumerate(fs)}
    compiled = CompiledMonitors(monitors, ("z", *KEYS))
    paths = {name: walked(m, word) for name, m in monitors.items()}
    assert compiled.feed(compiled.pack([letter << 1 for letter in word])) == len(word)
    assert compiled.states == {name: path[-1] for name, path in paths.items()}
    firsts = {
        name: next((i for i, state in enumerate(path) if is_settled(monitors[name], state)), None)
        for name, path in paths.items()
    }
    assert compiled.settled == {name: i for name, i in firsts.items() if i is not None}


def test_stopping_at_a_verdict_and_going_on():
    compiled = CompiledMonitors({"p": monitor(apply("G", atom("p"))), "q": monitor(apply("G", atom("q")))})
    letters = compiled.pack([0b11, 0b01, 0b11, 0b00, 0b11])
    assert compiled.feed(letters, stop=True) == 2
    assert compiled.settled == {"q": 2}
    assert compiled.feed(letters[2 * 8 :], stop=True) == 2
    assert compiled.settled == {"q": 2, "p": 4}
    compiled.reset()
    assert compiled.settled == {} and compiled.states == {"p": 0, "q": 0}
    assert compiled.feed(letters) == 5


@pytest.mark.slow
def test_letters_of_many_words_are_read_in_stages():
    keys = [f"p{i}" for i in range(150)]
    far = apply("G", apply("implies", atom("p3"), apply("X", disjunction([atom("p70"), atom("p149")]))))
    wide = apply("U", conjunction(map(atom, keys[::5])), conjunction(map(negation, map(atom, keys[1::7]))))
    monitors = {"far": monitor(far, keys), "wide": monitor(wide, keys)}
    compiled = CompiledMonitors(monitors, keys)
    assert compiled.letter_words == 3
    assert len(walk_table(monitors["wide"]).stages) > 2
    source = random.Random(7)
    full = sum(1 << i for i in range(0, 150, 5))
    for _ in range(20):
        word = [full | source.getrandbits(150) & ~(1 << 3) for _ in range(4)]
        word += [source.getrandbits(150) for _ in range(3)]
        compiled.reset()
        compiled.feed(compiled.pack(word))
        assert compiled.states == {name: walked(m, word)[-1] for name, m in monitors.items()}


@pytest.mark.slow
def test_what_cannot_be_compiled_is_refused():
    m = monitor(apply("G", atom("p")))
    with pytest.raises(ValueError, match="letters do not show p"):
        CompiledMonitors({"m": m}, ["q"])
    with pytest.raises(ValueError, match="8 bytes"):
        CompiledMonitors({"m": m}).feed(b"123")
    pairs = tuple(MonitorEdge(1 << i | 1 << 20 + i, 0, 1) for i in range(20))
    rest = tuple(MonitorEdge(0, 1 << i | 1 << 20 + i, 0) for i in range(20))
    large = Monitor(
        tuple(map(str, range(40))), (MonitorVerdict.NOT_YET, MonitorVerdict.FALSE), (pairs + rest, ()), (False, False)
    )
    with pytest.raises(MonitorTooLarge):
        walk_table(large)


def test_a_monitor_without_atoms():
    compiled = CompiledMonitors({"valid": monitor(apply("or", atom("p"), negation(atom("p"))))})
    assert compiled.settled == {"valid": 0}
    assert compiled.feed(bytes(80)) == 10
