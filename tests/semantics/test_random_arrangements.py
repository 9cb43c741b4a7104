"""Random arrangements: the lowering against the page, dead bits against all bits, machine code against plain Python."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from itertools import islice

import pytest
from hypothesis import HealthCheck, Phase, settings

from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.native.executor import OVERFLOW, NativeProgram
from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.backends.reference import Interpreter, Outcome
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.language.atoms import PropertyScope, check_atom
from llfsm_verify.language.typed import Expression, Variable
from llfsm_verify.language.types import BoolType, RangeType
from llfsm_verify.program.program import Program
from llfsm_verify.semantics.letters import Observed
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.testing.arrangements import Document, arrangements
from llfsm_verify.testing.properties import state_formulas
from tests.oracle.direct import Direct
from tests.oracle.lockstep import MAX_WAYS, Lockstep, same_words
from tests.quick import FRESH, examples, many, spread

CONFIGURATIONS = 20
"""Of each arrangement, breadth first."""


def run(count: int, check: Callable[[Document], None]) -> None:
    """Check that many random arrangements; a failure is shrunk and shows the document."""
    quiet = [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.large_base_example]
    phases = (Phase.explicit, Phase.reuse, Phase.generate, Phase.shrink)
    chosen = settings(max_examples=count, deadline=None, suppress_health_check=quiet, phases=phases)

    spread(check, chosen, arrangements())


def formulas(arrangement: Arrangement, most: int) -> dict[str, Expression]:
    """About `most` state formulas, spread over everything in the arrangement."""
    scope = PropertyScope.of(arrangement)
    texts = state_formulas(arrangement)
    share = len(texts) // most + 1
    texts = texts[int(arrangement.digest[:8], 16) % share :: share]  # another part each time
    return {text: check_atom(Fragment.whole(Source("<atom>", text)), scope) for text in texts}


def lowered(arrangement: Arrangement, atoms: dict[str, Expression], *, all_bits: bool = True) -> Program:
    return lower(arrangement, [Observed(n, e) for n, e in atoms.items()], keep_all_bits=all_bits)


def follows_the_page(document: Document) -> None:
    arrangement = build_arrangement(document)
    atoms = formulas(arrangement, 10)
    Lockstep(arrangement, lowered(arrangement, atoms), Direct(arrangement, atoms)).walk(CONFIGURATIONS)


def with_second(document: Document) -> Document | None:
    """The document with two plants, of which one writes an input that was free so far; None: it cannot have them."""
    board = document["whiteboard"]
    assert isinstance(board, dict)
    inputs = [w.variable for w in build_arrangement(document).whiteboard if w.role == "input" and not w.driven]
    free = [v for v in inputs if isinstance(v.type, BoolType | RangeType) and "changes" not in board[v.name]]
    plants = [document["environment"]] if "environment" in document else []
    while len(plants) < 2 and free and "schedule" in document:
        plants.append({"inline": follower(free.pop(), f"Plant{len(plants)}")})
    if len(plants) < 2:
        return None
    order = {"first": plants[0], "second": plants[1]}
    return {**document, "environment": order if len(board) % 2 else dict(reversed(order.items()))}


def follower(variable: Variable, name: str) -> Document:
    """A plant that writes one input."""
    word, kind = variable.name, variable.type
    low, high = ("false", "true") if not isinstance(kind, RangeType) else (str(kind.low), str(kind.high))
    states = [
        {"name": "A", "internal": f"{word} = choose({low}, {high});",
         "transitions": [{"when": f"{word} == {low}", "to": "B"}]},
        {"name": "B", "on_entry": "k = choose(0..1);", "internal": f"if (k == 0) {word} = {high};",
         "transitions": [{"when": f"{word} == {high}", "to": "A"}]},
    ]  # fmt: skip
    return {"machine": name, "variables": {"k": {"type": "0..1"}}, "states": states}


class SecondPlant:
    """Compares arrangements with several plants, and counts them."""

    def __init__(self) -> None:
        self.seen = 0

    def __call__(self, document: Document) -> None:
        both = with_second(document)
        if both is not None:
            follows_the_page(both)
            self.seen += 1


def keeps_its_words(document: Document) -> None:
    arrangement = build_arrangement(document)
    for most in (20, 4):
        atoms = formulas(arrangement, most)
        same_words(lowered(arrangement, atoms), lowered(arrangement, atoms, all_bits=False), CONFIGURATIONS)


class NativeCheck:
    """Compares every step from the first configurations of programs, and counts what it has seen."""

    def __init__(self, configurations: int = CONFIGURATIONS) -> None:
        self.configurations = configurations
        self.seen: Counter[str] = Counter()

    def __call__(self, document: Document) -> None:
        arrangement = build_arrangement(document)
        all_bits = len(arrangement.machines) % 2 == 0
        program = lowered(arrangement, formulas(arrangement, 6), all_bits=all_bits)
        self.compare(program, NativeProgram(program, events=True))
        self.seen["arrangements"] += 1

    def compare(self, program: Program, native: NativeProgram) -> None:
        reference, layout = Interpreter(program), Layout.of(program)
        records = layout.initial(4096)
        known = set(records)
        for record in records:  # grows
            values, outputs = layout.decode(record), layout.decode_outputs(record)
            edges = islice(native.successors(record), MAX_WAYS)
            for process, outcome in islice(reference.successors(values, outputs), MAX_WAYS):
                after = layout.encode(outcome.values) + layout.encode_outputs(outcome.outputs)
                status = OVERFLOW if outcome.overflow else 0 if outcome.fault is None else outcome.fault + 1
                samples = tuple((self._number(program, n), v) for n, v in outcome.samples)
                result = native.step(record, process, dict(outcome.samples))
                assert (result.status, result.record) == (status, after)
                assert (result.samples, result.read) == (samples, outcome.read)
                assert result.events == outcome.events
                edge = next(edges)
                number = -1 if process is None else process
                assert (edge.process, edge.status, edge.samples) == (number, status, samples)
                if status == 0:
                    assert edge.record == after
                self._count(outcome)
                if status == 0 and after not in known and len(known) < self.configurations:
                    known.add(after)
                    records.append(after)
            if len(records) <= self.configurations:
                assert next(edges, None) is None or self._more(reference, record, layout)

    def _number(self, program: Program, name: str) -> int:
        return next(i for i, c in enumerate(program.choices) if c.name == name)

    def _more(self, reference: Interpreter, record: bytes, layout: Layout) -> bool:
        """Whether there are more steps from `record` than were compared."""
        ways = reference.successors(layout.decode(record), layout.decode_outputs(record))
        return next(islice(ways, MAX_WAYS, None), None) is not None

    def _count(self, outcome: Outcome) -> None:
        self.seen["steps"] += 1
        self.seen["faults"] += outcome.fault is not None
        self.seen["overflows"] += outcome.overflow


@pytest.mark.slow
def test_lowering_follows_the_page() -> None:
    run(examples(40), follows_the_page)


@pytest.mark.long
def test_several_plants_follow_the_page() -> None:
    check = SecondPlant()
    run(many(200), check)
    assert check.seen or not FRESH


@pytest.mark.slow
def test_dead_bits_do_not_show() -> None:
    run(examples(25), keeps_its_words)


@pytest.mark.slow
def test_native_equals_reference() -> None:
    run(examples(100), NativeCheck(10))


@pytest.mark.long
def test_lowering_follows_the_page_in_many_arrangements() -> None:
    run(many(1000), follows_the_page)


@pytest.mark.long
def test_dead_bits_do_not_show_in_many_arrangements() -> None:
    run(many(400), keeps_its_words)


@pytest.mark.long
def test_native_equals_reference_in_many_arrangements() -> None:
    check = NativeCheck(10)
    run(many(2000), check)
    assert check.seen["arrangements"] >= many(2000)
    assert check.seen["faults"] > 0
    assert check.seen["overflows"] > 0 or not FRESH  # they are rare
