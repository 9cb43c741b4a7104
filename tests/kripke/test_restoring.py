"""Each thing that a saved exploration could say wrongly, and kernels would believe, is refused by itself."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import pytest

from benchmarks.ring import ring
from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import Source
from llfsm_verify.kripke.checkpoint import Section, Unusable
from llfsm_verify.kripke.compiled import kernels
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.kripke.graph import NO_PREFIX
from llfsm_verify.kripke.kernels.chain_blocks import MAX_CHAIN
from llfsm_verify.kripke.memory import Region, VectorSet
from llfsm_verify.limits import Budget, endless_budget
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.program.program import Program
from llfsm_verify.semantics.lowering import lower
from tests.kripke.test_chains import relay
from tests.kripke.test_vectors import vector_of

KEYS, PARENTS, FIRST, TARGETS, LABELS, LETTERS, WORDS = range(7)
KINDS = ("Q", "I", "q", "I", "I", "Q", "Q")
EPSILON = 0xFFFFFFFF


@dataclass(frozen=True, slots=True)
class Saved:
    """What an exploration has saved: numbers, and sections as arrays that tests change."""

    program: Program
    chains: bool
    edges: bool
    numbers: dict[str, object]
    sections: list[array[int]]

    def count(self, name: str) -> int:
        number = self.numbers[name]
        assert isinstance(number, int)
        return number

    def restored(self) -> Explorer:
        def read(sections: Sequence[Section], _: Budget) -> None:
            for (region, size), part in zip(sections, self.sections, strict=True):
                assert size == len(part.tobytes())
                region.write(part.tobytes())

        explorer = Explorer(self.program, endless_budget(), chains=self.chains, with_edges=self.edges)
        explorer.restore(self.numbers, read)
        return explorer


def saved(text: str, *, chains: bool = False, edges: bool = True) -> Saved:
    arrangement = load_arrangement_text(text, "test.yaml")
    lines = parse_properties([Source("test.ltl", "p: G !(m0@ON && m1@ON)" if "m0" in text and not chains else "")])
    program = lower(arrangement, bind(arrangement, lines).atoms)
    explorer = Explorer(program, endless_budget(), chains=chains, with_edges=edges)
    explorer.explore(60)
    assert explorer.finish_batch(10)
    numbers, sections = explorer.saved()
    parts = [array(kind, region.read(0, size)) for kind, (region, size) in zip(KINDS, sections, strict=False)]
    found = Saved(program, chains, edges, {**numbers.header()}, parts)
    assert 0 < found.count("expanded") < found.count("nodes")
    found.restored().close()
    return found


@pytest.fixture
def plain() -> Saved:
    return saved(ring(3, 3))


@pytest.fixture
def cycles() -> Saved:
    return saved(ring(3, 3) + "\nobserve: cycle\n")


@pytest.fixture
def chained() -> Saved:
    return saved(relay(5, 2, reads=True), chains=True)


def refused(found: Saved) -> None:
    with pytest.raises(Unusable):
        found.restored()


def put(section: int, place: int, value: int) -> Callable[[Saved], None]:
    def change(found: Saved) -> None:
        assert found.sections[section][place] != value
        found.sections[section][place] = value

    return change


def number(name: str, value: object) -> Callable[[Saved], None]:
    def change(found: Saved) -> None:
        found.numbers[name] = value

    return change


def too_many(section: int, name: str) -> Callable[[Saved], None]:
    """The last entry of a section is the number of something of which there are so many."""

    def change(found: Saved) -> None:
        found.sections[section][-1] = found.count(name)

    return change


def repeated(section: int) -> Callable[[Saved], None]:
    def change(found: Saved) -> None:
        found.sections[section][-1] = found.sections[section][-2]

    return change


def with_another_root(found: Saved) -> None:
    found.sections[KEYS][0] = next(iter(set(found.sections[KEYS][1:])))


def out_of_its_type(found: Saved) -> None:
    """A counter modulo 3 takes two bits."""
    layout = Explorer(found.program, endless_budget()).layout
    field = next(f for f in layout.fields.values() if f.high - f.low == 2 and not f.output)
    word, shift = field.place(0)
    found.sections[KEYS][-found_words(found) + word] |= 3 << shift


def beside_all_variables(found: Saved) -> None:
    found.sections[KEYS][-found_words(found)] |= 1 << 63


def found_words(found: Saved) -> int:
    return len(found.sections[KEYS]) // found.count("nodes")


def out_of_order(found: Saved) -> None:
    parents = found.sections[PARENTS]
    assert parents[-1] > parents[-2] or parents[-1] > 0
    parents[-1] = 0


def its_own_parent(found: Saved) -> None:
    """The first node after the roots; the parents stay in order."""
    parents = found.sections[PARENTS]
    place = next(i for i in range(1, len(parents)) if parents[i] < i)
    parents[place:] = array("I", [max(p, place) for p in parents[place:]])


def not_expanded_parent(found: Saved) -> None:
    found.sections[PARENTS][-1] = found.count("expanded")


def backwards(found: Saved) -> None:
    first = found.sections[FIRST]
    first[2] = first[1] - 1


@pytest.mark.parametrize(
    "change",
    [
        with_another_root, out_of_its_type, beside_all_variables, repeated(KEYS), out_of_order, its_own_parent,
        not_expanded_parent, put(PARENTS, 0, 1), put(FIRST, 0, 1), put(FIRST, -1, 0), put(FIRST, 1, -1), backwards,
        too_many(TARGETS, "nodes"), too_many(LABELS, "letters"), put(LABELS, -1, EPSILON), repeated(LETTERS),
        put(LETTERS, -1, 1 << 63),
    ],
)  # fmt: skip
def test_memory(plain: Saved, change: Callable[[Saved], None]) -> None:
    change(plain)
    refused(plain)


@pytest.mark.parametrize(
    "change",
    [
        number("transitions", 1 << 50), number("level_end", 0), number("level_end", 1 << 20), number("depth", 1 << 20),
        number("overflow", 1 << 20), number("overflow", -2), number("faults", [0]), number("faults", None),
        number("depth", -1), number("depth", True), number("depth", 0.0), number("depth", None), number("more", 1),
        number("words", -1), number("letters", 1 << 33), number("expanded", 1 << 20),
    ],
)  # fmt: skip
def test_numbers(plain: Saved, change: Callable[[Saved], None]) -> None:
    change(plain)
    refused(plain)


def test_fewer_nodes_than_roots(plain: Saved) -> None:
    plain.numbers.update(dict.fromkeys(("nodes", "expanded", "edges", "transitions", "level_end", "depth"), 0))
    plain.sections[:5] = [array("Q"), array("I"), array("q", [0]), array("I"), array("I")]
    refused(plain)


def test_words_without_chains(plain: Saved) -> None:
    plain.numbers["words"] = 1
    refused(plain)


def test_edges_where_none_are_stored() -> None:
    found = saved(ring(3, 3), edges=False)
    found.numbers["edges"] = 1
    found.sections[TARGETS] = found.sections[LABELS] = array("I", [0])
    refused(found)


@pytest.mark.parametrize("silent", [True, False])
def test_silent_edges_lead_into_cycles_and_no_others_do(cycles: Saved, silent: bool) -> None:
    labels = cycles.sections[LABELS]
    place = next(i for i, label in enumerate(labels) if (label == EPSILON) == silent)
    labels[place] = 0 if silent else EPSILON
    refused(cycles)


def test_letters_of_whole_cycles(cycles: Saved) -> None:
    labels = cycles.sections[LABELS]
    labels[next(i for i, label in enumerate(labels) if label != EPSILON)] = cycles.count("letters")
    refused(cycles)


def test_outputs_in_the_middle_of_cycles(cycles: Saved) -> None:
    cycles.sections[KEYS][-1] |= 1 << 63
    refused(cycles)


@pytest.mark.parametrize(
    "change",
    [
        too_many(LABELS, "words"), repeated(WORDS), put(WORDS, 0, 0), put(WORDS, -1, 5 | 1 << 40),
        put(WORDS, -1, NO_PREFIX << 32 | 1 << 20),
    ],
)  # fmt: skip
def test_chains(chained: Saved, change: Callable[[Saved], None]) -> None:
    change(chained)
    refused(chained)


@pytest.mark.parametrize("length", [MAX_CHAIN, MAX_CHAIN + 1])
def test_the_length_of_words(chained: Saved, length: int) -> None:
    words = [NO_PREFIX << 32, *(i << 32 for i in range(length - 1))]
    labels = chained.sections[LABELS]
    chained.sections[LABELS] = array("I", [min(label, length - 1) for label in labels])
    chained.sections[WORDS] = array("Q", words)
    chained.numbers["words"] = length
    if length > MAX_CHAIN:
        refused(chained)
    else:
        chained.restored().close()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("hashes", "good"),
    [
        pytest.param([i * 0x9E3779B97F4A7C15 % (1 << 64) for i in range(20_000)], True, id="spread out"),
        pytest.param(list(range(20_000)), False, id="all in one slot"),
        pytest.param([*(i << 50 for i in range(10_000)), 5 << 50], False, id="two are equal"),
    ],
)
def test_sets_that_were_read(hashes: list[int], good: bool) -> None:
    keys = Region(1)
    keys.write(array("Q", map(vector_of, hashes)).tobytes())
    made = VectorSet(kernels(), 1, keys)
    assert made.restore(len(hashes)) is good
    made.close()
