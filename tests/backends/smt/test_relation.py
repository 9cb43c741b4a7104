"""Steps as Z3 terms against the reference interpreter: what it computes is the only model of the relation."""

from __future__ import annotations

from collections import Counter

import pytest
import z3
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.backends.reference import Interpreter
from llfsm_verify.backends.smt.arithmetic import Arithmetic, BitVectors, Integers
from llfsm_verify.backends.smt.relation import NumberTooLarge, Relation, Terms, is_bounded
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.program.program import UNBOUNDED, Get, Int, Op, Program, Set
from llfsm_verify.program.symbolic import Key, scalars
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.testing.arrangements import arrangements
from llfsm_verify.testing.programs import programs
from llfsm_verify.testing.properties import atoms
from llfsm_verify.values import Value
from tests.backends.tiny import constant, tiny, variable
from tests.quick import AtLeast, examples, many, spread

CHECKS = [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much]


def flat(program: Program, values: dict[str, Value]) -> dict[Key, int]:
    """Values by scalar."""
    found: dict[Key, int] = {}
    for v in program.vars:
        for key, _ in scalars(v):
            value = values[v.name]
            found[key] = value if key[1] is None else value[key[1]]  # type: ignore[index, assignment]
    return found


class Checker:
    """Walks a program with the interpreter, and asks a solver for every step."""

    def __init__(self, program: Program, arithmetic: Arithmetic, tally: Counter[str]) -> None:
        self.program = program
        self.terms = Terms(program, arithmetic)
        self.relations: dict[int | None, Relation] = {i: self.terms.slot(i) for i in range(len(program.slots))}
        self.relations[None] = self.terms.stutter()
        self.tally = tally
        self.constants = {c.name for c in program.choices if c.type.low == c.type.high}

    def walk(self, numbers: list[int]) -> None:
        interpreter = Interpreter(self.program)
        values = {v.name: v.init for v in self.program.vars if not v.output}
        outputs = {v.name: v.init for v in self.program.vars if v.output}
        outputs[self.program.cycle] = 1
        chance = iter(numbers)
        for number in chance:
            enabled = interpreter.enabled(values)
            process = enabled[number % len(enabled)] if enabled else None
            outcome = interpreter.step(values, outputs, process, lambda c: c.type.low + next(chance, 0) % self.size(c))
            if outcome.overflow:
                self.tally["overflow"] += 1
                return
            fresh = process is None or self.program.observe == "ringlet" or outputs[self.program.cycle] == 1
            before = {v.name: v.init for v in self.program.vars if v.output} if fresh else dict(outputs)
            slot = None
            if process is not None:
                acting = self.program.processes[process]
                slot = acting.slots[values[acting.turn]]  # type: ignore[index]
            after = None if outcome.fault is not None else flat(self.program, outcome.values | outcome.outputs)
            self.check(slot, flat(self.program, values | before), dict(outcome.samples), after, outcome.fault)
            if outcome.fault is not None:
                return
            values, outputs = outcome.values, outcome.outputs

    def size(self, choice) -> int:
        return choice.type.high - choice.type.low + 1

    def check(
        self, slot: int | None, before: dict[Key, int], samples: dict[str, int], after: dict[Key, int] | None, fault
    ) -> None:
        terms, relation = self.terms, self.relations[slot]
        arithmetic = terms.arithmetic
        given = [(terms.before[key].z3, terms.literal(key, value).z3) for key, value in before.items()]
        for name, value in samples.items():
            if name not in relation.choices:
                assert name in self.constants  # nothing depends on a choice of one value
                continue
            choice = relation.choices[name]
            given.append((choice.z3, arithmetic.literal(value, choice.type).z3))
        # With what was not read left open, there is one result only.
        wanted = [relation.fault.z3 == arithmetic.literal(0 if fault is None else fault + 1, relation.fault.type).z3]
        if after is not None:
            for key, value in after.items():
                if key in relation.after:
                    wanted.append(relation.after[key].z3 == terms.literal(key, value).z3)
                else:
                    assert value == before[key], key
        different = z3.simplify(z3.substitute(z3.Not(z3.And(wanted)), *given))
        if not z3.is_false(different):
            self.tally["by the solver"] += 1
            solver = z3.Solver()
            solver.set("timeout", 5_000)
            solver.add(different, *(arithmetic.within(c) for n, c in relation.choices.items() if n not in samples))
            found = solver.check()
            assert found != z3.sat, (slot, before, samples, after, fault, solver.model())
            self.tally[f"by the solver: {found}"] += 1
        self.tally["fault" if fault is not None else "stutter" if slot is None else "step"] += 1


NUMBERS = st.lists(st.integers(0, 1 << 20), min_size=4, max_size=14)


def both(program: Program, numbers: list[int], tally: Counter[str]) -> None:
    Checker(program, Integers(), tally).walk(numbers)
    if is_bounded(program):
        Checker(program, BitVectors(), tally).walk(numbers)
        tally["bounded"] += 1


@st.composite
def lowered(draw: st.DrawFn) -> Program:
    """A random arrangement with a few atoms as a step program."""
    document = draw(arrangements())
    arrangement = build_arrangement(document)
    shown = draw(st.lists(atoms(arrangement), max_size=3, unique=True))
    text = "\n".join(f"p{i}: G ({atom})" for i, atom in enumerate(shown))
    bound = bind(arrangement, parse_properties([Source("p.ltl", text)]))
    return lower(arrangement, bound.atoms, keep_all_bits=draw(st.booleans()))


def run(count: int, strategy: st.SearchStrategy[Program], **least: int) -> Counter[str]:
    """Compare that many, and more until there are so many of each kind."""
    tally: Counter[str] = Counter()
    met = AtLeast(tally, {"step": count + 1, "bounded": count // 4 + 1, **least})
    amount = settings(max_examples=count, deadline=None, suppress_health_check=CHECKS)
    spread(lambda program, numbers: both(program, numbers, tally), amount, strategy, NUMBERS, size=5, until=met)
    # A question that the solver could not answer within its time is not a check.
    assert tally["by the solver: unknown"] == 0
    return tally


@pytest.mark.slow
def test_random_programs() -> None:
    run(examples(60), programs(), fault=1)


@pytest.mark.slow
def test_random_arrangements() -> None:
    run(examples(60), lowered())


@pytest.mark.long
def test_many_random_programs() -> None:
    run(many(1_200), programs(), stutter=1, fault=6)


@pytest.mark.long
def test_many_random_arrangements() -> None:
    run(many(1_200), lowered(), stutter=1, fault=1)


def test_numbers_without_bounds_are_no_bit_vectors() -> None:
    program = tiny((Set("x", None, Op("add", (Get("x", None, UNBOUNDED), constant(1)), UNBOUNDED)),),
                   (variable("x", UNBOUNDED),))  # fmt: skip
    assert not is_bounded(program)
    with pytest.raises(ValueError, match="without bounds"):
        Terms(program, BitVectors())
    assert Terms(program).arithmetic.name == "integers"


def test_a_step_whose_numbers_may_be_too_large_has_no_terms(monkeypatch: pytest.MonkeyPatch) -> None:
    x = Get("x", None, UNBOUNDED)
    program = tiny((Set("x", None, Op("mul", (x, x), UNBOUNDED)),), (variable("x", UNBOUNDED),))
    assert Terms(program).slot(0).grown({("x", None): 3})["x", None] == 6
    monkeypatch.setattr("llfsm_verify.backends.smt.relation.MAX_BITS", 127)  # those of an unknown number are 64
    with pytest.raises(NumberTooLarge):
        Terms(program).slot(0)


def test_any_element_of_an_array_is_read() -> None:
    """The relation is evaluated for each index: `x` becomes that element."""
    number = Int(0, 9)
    element = Get("a", Get("i", None, Int(0, 3)), number)
    program = tiny(
        (Set("x", None, element),),
        (variable("a", number, (5, 7, 2, 9)), variable("i", Int(0, 3)), variable("x", number)),
    )
    terms = Terms(program)
    after = terms.slot(0).after["x", None].z3
    values = {("a", i): v for i, v in enumerate((5, 7, 2, 9))}

    def read(index: int) -> int:
        given = [(terms.before[k].z3, terms.literal(k, v).z3) for k, v in {**values, ("i", None): index}.items()]
        return z3.simplify(z3.substitute(after, *given)).as_long()

    assert [read(i) for i in range(4)] == [5, 7, 2, 9]
