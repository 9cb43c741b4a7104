"""The cone of influence: what is left out of examples, and that random programs lose nothing an observer could see."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import TypeVar

import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement import build_arrangement, load_arrangement_text
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.native.executor import OVERFLOW, NativeProgram
from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.backends.reference import Interpreter, Outcome, evaluate
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.language.atoms import PropertyScope, check_atom
from llfsm_verify.program.program import (
    BOOL,
    UNBOUNDED,
    Atom,
    Block,
    Const,
    Expr,
    Fairness,
    Get,
    If,
    Input,
    Int,
    Ite,
    Let,
    Local,
    Op,
    Origin,
    Program,
    Set,
    Switch,
    Var,
)
from llfsm_verify.semantics.letters import Observed
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.testing.arrangements import Document, arrangements
from llfsm_verify.testing.programs import programs
from llfsm_verify.testing.properties import atoms
from llfsm_verify.transforms.cone import Cone, Value, cone
from tests.backends.tiny import constant, tiny, variable
from tests.quick import FRESH, AtLeast, examples, many, spread

LARGEST = 40
"""Records of the full program that are expanded."""
WAYS = 200
"""Successors of one record, beyond which it is not compared."""

T = TypeVar("T")
Step = tuple[int, int, bytes]
"""Process, status, and the projected record after the step (empty unless the status is 0)."""


def lowered(arrangement: Arrangement, texts: Sequence[str], *, keep_all_bits: bool = True) -> Program:
    scope = PropertyScope.of(arrangement)
    observed = [Observed(t, check_atom(Fragment.whole(Source("<atom>", t)), scope)) for t in texts]
    return lower(arrangement, observed, keep_all_bits=keep_all_bits)


# ---------------------------------------------------------------- what is left out of examples

LAMP = """
name: example
whiteboard:
  go:  {type: bool, init: false, role: input}
  dim: {type: 0..3, init: 0, role: input}
  count: {type: 0..99, init: 0}
  light: {type: bool, init: false}
machines:
  timer:
    inline:
      machine: Timer
      variables: {n: {type: 0..9, init: 0}}
      states:
        - {name: IDLE, internal: "n = (n + 1) % 10;", transitions: [{when: go, to: BUSY}]}
        - {name: BUSY, on_entry: "light = !light;", transitions: [{when: not go, to: IDLE}]}
  lamp:
    inline:
      machine: Lamp
      states:
        - {name: DARK, transitions: [{when: light && dim > 0, to: LIT}]}
        - {name: LIT, on_entry: "count = (count + 1) % 100;", transitions: [{when: not light, to: DARK}]}
schedule: [timer, lamp]
"""


def of(text: str, *atoms: str) -> Cone:
    return cone(lowered(load_arrangement_text(text), atoms))


def configurations(program: Program) -> int:
    native = NativeProgram(program, effort="quick")
    return len({r[: native.layout.configuration_bytes] for r in reached(native)})


@pytest.mark.slow
def test_a_counter_that_nobody_reads_is_left_out() -> None:
    found = of(LAMP, "lamp@LIT")
    assert found.left_out == ("count", "timer.n")
    assert {c.input for c in found.program.choices} == {"go", "dim"}
    assert configurations(found.full) > 10 * configurations(found.program)


def test_a_machine_that_nobody_asks_for_is_left_out_with_its_inputs() -> None:
    found = of(LAMP, "light")
    assert found.left_out == ("count", "timer.n", "lamp", "dim")
    assert [c.input for c in found.program.choices] == ["go"]
    assert [i.name for i in found.program.inputs] == ["go"]
    native = NativeProgram(found.program)
    (start,) = native.layout.initial()
    (after,) = {e.record for e in native.successors(start) if not e.samples[0][1]}
    assert len(list(native.successors(after))) == 1  # lamp's turn reads nothing


def test_without_properties_only_turns_are_left() -> None:
    found = of(LAMP)
    assert found.left_out == ("count", "light", "timer.n", "timer", "lamp", "go", "dim")
    assert configurations(found.program) == 2


def test_what_an_atom_reads_stays_and_so_do_inputs_it_mentions() -> None:
    assert of(LAMP, "timer.n == 3").left_out == ("count", "light", "lamp", "dim")
    assert of(LAMP, "dim == 2").left_out == ("count", "light", "timer.n", "timer", "lamp", "go")
    assert of(LAMP, "count == 5 && timer.n == 0").left_out == ()


def test_what_a_fault_depends_on_stays() -> None:
    faulty = LAMP.replace("n = (n + 1) % 10;", "n = n + 1;")
    found = of(faulty)
    assert found.left_out == ("count", "light", "lamp", "dim")
    assert found.program.faults == found.full.faults != ()
    divided = LAMP.replace("count = (count + 1) % 100;", "light = light && 7 / dim > 1;")
    assert of(divided).left_out == ("count", "timer.n")


def test_what_can_leave_64_bits_stays() -> None:
    growing = LAMP.replace("count: {type: 0..99, init: 0}", "count: {type: int, init: 0}")
    assert of(growing).left_out == ("timer.n",)
    assert of(growing.replace("(count + 1) % 100", "3")).left_out == (
        "count", "light", "timer.n", "timer", "lamp", "go", "dim",
    )  # fmt: skip


def test_a_store_that_can_leave_64_bits_stays() -> None:
    """Of a type without a sign, whose largest values `int` does not hold."""
    top = 2**64 - 1
    large = Var("large", Int(0, top), top, Origin("machine"))
    kept = Var("kept", UNBOUNDED, 0, Origin("machine"))
    program = small((Set("kept", None, Get("large", None, Int(0, top))),), large, kept)
    same_program(program, Tally())
    assert cone(program).left_out == ()


def test_free_initial_values_that_nobody_reads_make_no_initial_configurations() -> None:
    held = LAMP.replace("dim: {type: 0..3, init: 0, role: input}", "dim: {type: 0..3, role: input, changes: never}")
    found = of(held, "light")
    assert "dim" in found.left_out
    assert Layout.of(found.full).initial_count() == 4
    assert Layout.of(found.program).initial_count() == 1
    assert Layout.of(of(held, "lamp@LIT").program).initial_count() == 4


def test_an_input_held_for_a_cycle_is_sampled_only_for_those_who_read_it() -> None:
    held = LAMP.replace("dim: {type: 0..3, init: 0, role: input}", "dim: {type: 0..3, role: input, changes: cycle}")
    assert [c.name for c in of(held, "lamp@LIT").program.choices] == ["go", "dim"]
    assert [c.name for c in of(held, "light").program.choices] == ["go"]


def test_a_machine_that_can_end_the_arrangement_stays() -> None:
    ending = LAMP.replace("transitions: [{when: not go, to: IDLE}]", "internal: ''").replace(
        "transitions: [{when: not light, to: DARK}]", "internal: ''"
    )
    assert of(ending).left_out == ("count", "timer.n")


def test_commands_make_the_one_who_gives_them_relevant() -> None:
    commanding = (
        LAMP.replace("light = !light;", "suspend(lamp);").replace("light &&", "").replace("not light", "dim == 0")
    )
    assert of(commanding, "lamp@LIT").left_out == ("count", "light", "timer.n")
    assert of(commanding, "timer@BUSY").left_out == ("count", "light", "timer.n", "lamp", "dim")


def test_ages_stay_for_their_fairness() -> None:
    untimed = "timing: untimed\n" + LAMP.replace("light && dim > 0", "after(1)")
    assert of(untimed, "timer@BUSY").left_out == ("count", "timer.n")
    assert len(of(untimed, "timer@BUSY").program.fairness) == 1


def test_arrays_are_named_as_they_are_written() -> None:
    text = LAMP.replace(
        "  light:", "  row: {type: {array: 0..2, size: 4}}\n  pairs: {type: {array: Pair, size: 2}}\n  light:"
    )
    text = text.replace("whiteboard:", "types: {Pair: {record: {x: 0..2, f: bool}}}\nwhiteboard:")
    text = text.replace("n = (n + 1) % 10;", "row[0] = 1; pairs[1].x = row[n % 4]; n = (n + 1) % 10;")
    assert of(text, "lamp@LIT").left_out == ("count", "row", "pairs[*].x", "pairs[*].f", "timer.n")
    assert of(text, "pairs[0].x == 1").left_out == ("count", "pairs[*].f", "light", "lamp", "dim")


def test_a_walk_is_taken_back() -> None:
    found = of(LAMP, "light")
    full, part = NativeProgram(found.full), NativeProgram(found.program)
    record, here = full.layout.first(), part.layout.first()
    assert found.start(part.layout.decode(here)) == full.layout.decode(record)
    assert found.extend({"go": 1}) == {"go": 1, "dim": 0}
    lights = []
    for go in (1, 0, 1, 0, 0, 1, 1, 1, 1):
        record = full.step(record, 0, found.extend({"go": go})).record
        here = part.step(here, 0, {"go": go}).record
        assert part.layout.decode(here) == found.project(full.layout.decode(record))
        lights.append(part.layout.decode_outputs(here)["$atom.0"])
        assert lights[-1] == full.layout.decode_outputs(record)["$atom.0"]
    assert set(lights) == {0, 1}


# ---------------------------------------------------------------- exactness


class Tally:
    """How much has been compared, so that a test can ask that it was not nothing."""

    def __init__(self) -> None:
        self.seen: Counter[str] = Counter()


@dataclass
class Pair:
    """A program and its cone, both compiled, and how records of the one become records of the other."""

    cone: Cone
    full: NativeProgram
    part: NativeProgram

    @staticmethod
    def of(program: Program) -> Pair:
        found = cone(program)
        return Pair(found, NativeProgram(found.full, effort="quick"), NativeProgram(found.program, effort="quick"))

    def project(self, record: bytes) -> bytes:
        layout, outputs = self.part.layout, self.full.layout.decode_outputs(record)
        kept = {v.name: outputs[v.name] for v in self.cone.program.vars if v.output}
        return layout.encode(self.cone.project(self.full.layout.decode(record))) + layout.encode_outputs(kept)


def roots(native: NativeProgram) -> set[bytes]:
    return set(native.layout.initial(4096))


def same_program(program: Program, tally: Tally) -> None:
    """Projection is a bisimulation that keeps processes, letters, faults and overflows, and walks can be taken back."""
    pair = Pair.of(program)
    assert pair.cone.program.faults == program.faults
    assert pair.cone.program.atoms == program.atoms
    assert pair.cone.program.fairness == program.fairness
    begin = roots(pair.full)
    assert {pair.project(r) for r in begin} == roots(pair.part)
    first_letters(pair, begin)
    known, todo = set(begin), sorted(begin)
    complete = True
    expanded = 0
    while todo:
        if expanded == LARGEST:
            complete = False
            break
        record = todo.pop(0)
        expanded += 1
        edges = list(islice(pair.full.successors(record), WAYS + 1))
        if len(edges) > WAYS:
            complete = False
            continue
        steps = {(e.process, e.status, b"" if e.status else pair.project(e.record)) for e in edges}
        taken_back(pair, record, steps, tally)
        for edge in edges:
            following = resting(pair.full, edge.record)
            if edge.status == 0 and following not in known:
                known.add(following)
                todo.append(following)
            tally.seen["faults"] += edge.status > 0
            tally.seen["overflows"] += edge.status == OVERFLOW
    if complete:
        tally.seen["complete"] += 1
        assert {pair.project(r) for r in known} == reached(pair.part)
    tally.seen["programs"] += 1
    tally.seen["smaller"] += bool(pair.cone.left_out)
    before, after = (sum(f.bits * f.elements for f in n.layout.fields.values() if not f.output)
                     for n in (pair.full, pair.part))  # fmt: skip
    assert after <= max(before, 1)
    tally.seen["fewer bits"] += after < before


def taken_back(pair: Pair, record: bytes, steps: set[Step], tally: Tally) -> None:
    """The steps from the projection of `record` are `steps`, by both executors; each extends to a step of the full
    program from `record`."""
    here, names = pair.project(record), [c.name for c in pair.cone.program.choices]
    found: set[Step] = set()
    for edge in pair.part.successors(here):
        after = b"" if edge.status else edge.record
        found.add((edge.process, edge.status, after))
        process = None if edge.process < 0 else edge.process
        choices = pair.cone.extend({names[i]: value for i, value in edge.samples})
        full = pair.full.step(record, process, choices)
        assert full.status == edge.status
        assert full.status or pair.project(full.record) == after
        tally.seen["steps"] += 1
    assert found == steps
    assert pair.part.enabled(here) == pair.full.enabled(record)
    assert reference_steps(pair, here) == steps


def reference_steps(pair: Pair, record: bytes) -> set[Step]:
    layout, interpreter = pair.part.layout, Interpreter(pair.cone.program)
    found: set[Step] = set()
    for process, outcome in interpreter.successors(layout.decode(record), layout.decode_outputs(record)):
        status = status_of(outcome)
        after = b"" if status else layout.encode(outcome.values) + layout.encode_outputs(outcome.outputs)
        found.add((-1 if process is None else process, status, after))
    return found


def status_of(outcome: Outcome) -> int:
    if outcome.overflow:
        return OVERFLOW
    return 0 if outcome.fault is None else 1 + outcome.fault


def reached(native: NativeProgram) -> set[bytes]:
    known = roots(native)
    todo = list(known)
    while todo:
        for edge in native.successors(todo.pop()):
            following = resting(native, edge.record)
            if edge.status == 0 and following not in known:
                known.add(following)
                todo.append(following)
    return known


def resting(native: NativeProgram, record: bytes) -> bytes:
    """The record with the outputs that its next step begins with, unless it is inside an observed cycle."""
    if native.program.observe == "cycle":
        return record
    layout = native.layout
    return record[: layout.configuration_bytes] + layout.encode_outputs(layout.initial_outputs())


def first_letters(pair: Pair, records: set[bytes]) -> None:
    for record in records:
        values = pair.full.layout.decode(record)
        assert letter(pair.cone.program, pair.cone.project(values)) == letter(pair.cone.full, values)
        begin = pair.cone.start(pair.cone.project(values))
        assert pair.cone.project(begin) == pair.cone.project(values)
        assert pair.full.layout.encode(begin) in {r[: pair.full.layout.configuration_bytes] for r in records}


def letter(program: Program, values: dict[str, Value]) -> list[int | None]:
    seen = values | {v.name: v.init for v in program.vars if v.output}
    inputs = {f"input:{i.name}": i.init for i in program.inputs}
    found: list[int | None] = []
    for a in program.atoms:
        try:
            found.append(evaluate(a.expression, seen, inputs))
        except OverflowError:
            found.append(None)
    return found


# ---------------------------------------------------------------- small programs

DIGIT = Int(0, 3)
SEEN = Var("seen", BOOL, 0, Origin("output"), output=True)
"""An output that fairness asks for."""


def small(body: Block, *variables: Var) -> Program:
    return tiny(body, (SEEN, *variables), fairness=(Fairness("fair", None, "seen"),))


def digit(name: str) -> Get:
    return Get(name, None, DIGIT)


def following(name: str) -> Set:
    return Set(name, None, Op("wrap", (Op("add", (digit(name), constant(1)), Int(1, 4)),), DIGIT))


def test_a_case_with_nothing_left_still_keeps_its_value_from_the_default() -> None:
    never: Block = (Set("rest", None, constant(1)),)
    shown: Block = (Set("seen", None, Const(1, BOOL)),)
    body: Block = (following("k"), Switch(digit("k"), ((0, never), (2, shown), (3, never)), shown))
    program = small(body, variable("k", DIGIT), variable("rest", DIGIT))
    same_program(program, Tally())
    assert cone(program).left_out == ("rest",)
    plain = small((*body[:1], Switch(digit("k"), ((0, never), (2, shown)), never)), *program.vars[4:])
    same_program(plain, Tally())
    (left,) = [s for s in cone(plain).program.slots[0].blocks[0] if isinstance(s, Switch)]
    assert left == Switch(digit("k"), ((2, shown),))


def test_a_decision_with_nothing_left_inside_can_still_leave_64_bits() -> None:
    large = Get("large", None, UNBOUNDED)
    grown = Op("mul", (large, constant(1 << 40)), UNBOUNDED)
    rest: Block = (Set("rest", None, constant(1)),)
    for decision in (
        If(Op("gt", (grown, constant(0)), BOOL), rest),
        Switch(grown, ((1, rest),)),
        Let(Local("unread", UNBOUNDED), grown),
        Set("other", None, Op("wrap", (grown,), DIGIT)),
    ):
        start = Set(
            "large", None, Ite(Op("gt", (large, constant(8)), BOOL), large, Const(1 << 30, UNBOUNDED), UNBOUNDED)
        )
        unseen = variable("other", DIGIT), variable("rest", DIGIT)
        program = small((decision, start), variable("large", UNBOUNDED, 1), *unseen)
        tally = Tally()
        same_program(program, tally)
        assert tally.seen["overflows"] == 1
        assert "rest" in cone(program).left_out


def test_the_index_of_a_store_is_relevant() -> None:
    shown = Set("seen", None, Op("eq", (Get("row", constant(2), DIGIT), constant(1)), BOOL))
    program = small((following("k"), Set("row", digit("k"), constant(1)), shown), variable("k", DIGIT),
                    variable("row", DIGIT, (0, 0, 0, 0)))  # fmt: skip
    same_program(program, Tally())
    assert cone(program).left_out == ()


def test_two_slots_that_share_a_block_keep_what_selects_it() -> None:
    shared: Block = (Set("seen", None, Const(1, BOOL)),)
    program = small(shared, variable("other", BOOL), variable("turns", Int(0, 1)))
    slot = program.slots[0]
    twice = replace(
        program,
        slots=(slot, replace(slot, machine=0, state="other", blocks=((), shared))),
        processes=(replace(program.processes[0], slots=(0, 1), turn="turns", epilogue=(
            Set("cycle", None, Get("turns", None, Int(0, 1))),
            Set("turns", None, Op("sub", (constant(1), Get("turns", None, Int(0, 1))), Int(0, 1))),
        )),),
    )  # fmt: skip
    same_program(twice, Tally())
    assert {"state", "other"} <= {v.name for v in cone(twice).program.vars}


@pytest.mark.slow
def test_depth_and_emptiness_are_no_crash() -> None:
    block: Block = (Set("seen", None, Get("k", None, BOOL)), Set("rest", None, constant(0)))
    for _ in range(20_000):
        block = (If(Const(1, BOOL), block),)
    found = cone(small(block, variable("k", BOOL), variable("rest", DIGIT)))
    assert found.left_out == ("rest",)
    nothing = cone(tiny((Set("rest", None, constant(1)),), (variable("rest", DIGIT),)))
    assert nothing.left_out == ("m", "rest")
    assert Layout.of(nothing.program).words == 1  # packed configurations are never empty
    same_program(nothing.full, Tally())


def test_the_first_letter_needs_what_only_it_reads() -> None:
    inputs = tuple(Input(name, DIGIT, 3) for name in ("read", "unread"))
    both = Op("eq", (digit("k"), Local("input:read", DIGIT)), BOOL)
    body: Block = (Set("rest", None, constant(2)),)
    program = tiny(body, (SEEN, variable("k", DIGIT, 3), variable("rest", DIGIT)), inputs=inputs,
                   atoms=(Atom("a", "seen", both),))  # fmt: skip
    found = cone(program).program
    assert [i.name for i in found.inputs] == ["read"]
    assert "k" in {v.name for v in found.vars}
    same_program(program, Tally())


# ---------------------------------------------------------------- random programs

CHECKS = [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large, HealthCheck.large_base_example]


@st.composite
def observed(draw: st.DrawFn) -> tuple[Document, tuple[str, ...], bool]:
    """An arrangement, the atoms of its properties (often none), and whether all bits are kept."""
    document = draw(arrangements())
    chosen = draw(st.lists(atoms(build_arrangement(document)), max_size=3, unique=True))
    return document, tuple(chosen), draw(st.booleans())


@st.composite
def watched(draw: st.DrawFn) -> Program:
    """A random step program, some of whose outputs are atoms or asked for by fairness."""
    program = draw(programs())
    outputs = [v.name for v in program.vars if v.output and v.type == BOOL and v.length is None]
    inputs = tuple(Input(c.input, c.type, c.type.high) for c in program.choices)
    first: list[Expr] = [Local(f"input:{i.name}", i.type) for i in inputs]
    first += [Get(v.name, None, v.type) for v in program.vars if v.length is None and not v.output]
    shown = tuple(Atom(name, name, draw(st.sampled_from(first))) for name in outputs if draw(st.booleans()))
    fair = tuple(Fairness(name, None, name) for name in outputs if draw(st.booleans()))
    return replace(program, inputs=inputs, atoms=shown, fairness=fair)


def run(count: int, strategy: st.SearchStrategy[T], check: Callable[[T], None], tally: Tally, **least: int) -> None:
    """Check that many, and more until there are so many of each kind."""
    phases = (Phase.explicit, Phase.generate, Phase.shrink)
    amount = settings(max_examples=count, deadline=None, suppress_health_check=CHECKS, phases=phases)
    met = AtLeast(tally.seen, {kind.replace("_", " "): number for kind, number in least.items()})
    spread(check, amount, strategy, until=met)


def random_arrangements(count: int, **least: int) -> Tally:
    tally = Tally()

    def check(drawn: tuple[Document, tuple[str, ...], bool]) -> None:
        document, texts, keep_all_bits = drawn
        same_program(lowered(build_arrangement(document), texts, keep_all_bits=keep_all_bits), tally)

    third = count // 3
    run(count, observed(), check, tally, programs=count, smaller=third, fewer_bits=third, complete=third, **least)
    return tally


def random_programs(count: int, **least: int) -> Tally:
    tally = Tally()
    run(
        count, watched(), lambda program: same_program(program, tally), tally,
        programs=count, fewer_bits=count // 4, **least,
    )  # fmt: skip
    return tally


@pytest.mark.slow
def test_random_arrangements() -> None:
    random_arrangements(examples(60))


@pytest.mark.slow
def test_random_programs() -> None:
    random_programs(examples(60))


@pytest.mark.long
def test_many_random_arrangements() -> None:
    seen = random_arrangements(many(2_000), faults=1).seen
    assert seen["overflows"] > 0 or not FRESH  # they are rare


@pytest.mark.long
def test_many_random_programs() -> None:
    seen = random_programs(many(1000), faults=1).seen
    assert seen["overflows"] > 0 or not FRESH
