"""Automata in certificates: what was asked of them is written, all of it, and in one order."""

from __future__ import annotations

import random
from itertools import product

import pytest

from llfsm_verify.analysis.certificates import written
from llfsm_verify.analysis.certificates.written import MonitorAutomaton, Shelf
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.ltl.translation import monitor_of
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.limits import LimitReached
from llfsm_verify.logic.formula import Formula
from llfsm_verify.logic.parsing.formulas import parse_formula

ATOMS = ("p", "q", "r")
BITS = {"r": 1, "p": 3, "q": 4}
"""Other atoms lie between them."""


def parsed(text: str) -> Formula:
    return parse_formula(Fragment.whole(Source("t", text))).formula


def letter(*true: str) -> int:
    return sum(1 << BITS[atom] for atom in true)


class Counter:
    """Counts to 3, in twos or ones as a letter says; nothing can be done with `r`. `asked` is what it was asked."""

    relevant = 7
    acceptance_sets = 2

    def __init__(self, *, empty: bool = False) -> None:
        self.is_empty = empty
        self.asked: list[tuple[int, int]] = []

    def __call__(self, state: int, letter: int) -> tuple[tuple[int, int], ...]:
        self.asked.append((state, letter & self.relevant))
        if letter & 4:
            return ()
        return tuple((step, (state + step) % 4) for step in (1, 2) if letter & step)


def shelf_with(made: object, about: str = "what it is about") -> Shelf:
    shelf = Shelf(BITS)
    assert shelf.place("it", about, ATOMS, lambda: made) == 0
    return shelf


def test_what_was_asked_is_written_in_one_order() -> None:
    questions = [(state, given) for state in range(4) for given in range(8)]
    texts = set()
    for seed in range(5):
        random.Random(seed).shuffle(questions)
        made = Counter()
        shelf = shelf_with(made)
        for state, given in [*questions, *questions]:
            assert shelf.reader(0).automaton(state, given | 8) == Counter()(state, given)
        assert sorted(made.asked) == sorted(questions), "each is asked once"
        (document,) = shelf.document()
        texts.add(repr(document))
    assert len(texts) == 1
    assert document["about"] == "what it is about"
    assert document["atoms"] == [3, 4, 1] and document["sets"] == 2
    assert document["complete"] is True and document["bad"] == []
    for state, row in enumerate(document["edges"]):
        assert all(not positive & negative and positive | negative == 7 for positive, negative, _, _ in row)
        for given in range(8):
            moves = tuple((acceptance, target) for positive, _, target, acceptance in row if positive == given)
            assert moves == (Counter()(state, given) or ((0, None),))


def test_states_that_were_reached_and_not_asked_have_rows_without_moves() -> None:
    shelf = shelf_with(Counter())
    assert shelf.document()[0]["edges"] == [[]]
    shelf.reader(0).automaton(0, 2)
    assert shelf.document()[0]["edges"] == [[[2, 5, 2, 2]], [], []]


def test_an_empty_automaton_has_no_rows() -> None:
    shelf = shelf_with(Counter(empty=True))
    assert shelf.document()[0]["edges"] == []


def test_an_automaton_is_made_once() -> None:
    shelf = shelf_with(Counter())
    assert shelf.place("it", "again", ATOMS, lambda: pytest.fail("made again")) == 0
    assert shelf.place("another", "another", ("q",), Counter) == 1
    assert [a["about"] for a in shelf.document()] == ["what it is about", "another"]
    assert [a["atoms"] for a in shelf.document()] == [[3, 4, 1], [4]]
    assert shelf.reader(1).project(letter("q", "r")) == 1


@pytest.mark.parametrize("text", ["G !p", "p -> X !q", "G (p -> X (q && X r))", "!p W q", "G F p"])
def test_the_rows_of_a_monitor_know_its_bad_prefixes(text: str) -> None:
    monitor = monitor_of(parsed(text), ATOMS)
    shelf = shelf_with(MonitorAutomaton(monitor, len(ATOMS)))
    letters = [letter(*(a for a, held in zip(ATOMS, row, strict=True) if held)) for row in product((0, 1), repeat=3)]
    shelf.widen(letters)
    (document,) = shelf.document()
    assert document["bad"] == ([] if shelf.bad(0) is None else [shelf.bad(0)])
    assert (document["bad"] == []) == (text == "G F p")
    for word in product(range(8), repeat=3):
        here, there = 0, monitor.initial()
        for given in word:
            there = None if there is None else monitor.step(there, given)
            ways = [(t, k) for p, n, t, k in document["edges"][here] if p & ~given == 0 and n & given == 0]
            assert len(ways) == 1
            here, accepting = ways[0]
            assert (here in document["bad"]) == (there is None) == bool(accepting)


def test_monitors_are_asked_for_all_letters_as_far_as_there_is_room(monkeypatch: pytest.MonkeyPatch) -> None:
    text, letters = "G (p -> X (q && X (q && X q)))", [letter(), letter("p"), letter("q"), letter("r")]

    def rows(most: int) -> int:
        monkeypatch.setattr(written, "MOST_ROWS", most)
        monitor = MonitorAutomaton(monitor_of(parsed(text), ATOMS), len(ATOMS))
        shelf = shelf_with(monitor)
        shelf.widen([*letters, *letters])
        return sum(len(row) for i, row in enumerate(shelf.document()[0]["edges"]) if i != shelf.bad(0))

    assert [rows(most) for most in (3, 4, 7, 8, 11)] == [0, 4, 4, 8, 8]


@pytest.mark.parametrize("stop", [AutomatonTooLarge("states", 7), LimitReached("it took too long")])
def test_a_monitor_that_grows_too_large_is_written_as_far_as_it_is_known(stop: Exception) -> None:
    class Growing:
        def initial(self) -> int:
            return 0

        def step(self, state: int, letter: int) -> int:
            if state == 2:
                raise stop
            return state + 1

    shelf = shelf_with(MonitorAutomaton(Growing(), len(ATOMS)))
    shelf.place("behind", "another", ATOMS, lambda: MonitorAutomaton(monitor_of(parsed("G !p"), ATOMS), len(ATOMS)))
    shelf.widen([letter()])
    assert [a["edges"] for a in shelf.document()] == [[[[0, 7, 1, 0]], [[0, 7, 2, 0]], []], [[[0, 7, 0, 0]]]]
