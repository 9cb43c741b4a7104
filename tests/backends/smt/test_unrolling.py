"""Unrolled runs against the reference interpreter: after each number of steps, the same configurations and letters."""

from __future__ import annotations

from collections import Counter

import pytest
import z3
from hypothesis import HealthCheck, settings

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.backends.reference import Interpreter
from llfsm_verify.backends.smt.arithmetic import Arithmetic, BitVectors, Integers, Term
from llfsm_verify.backends.smt.relation import Terms, is_bounded
from llfsm_verify.backends.smt.unrolling import Point, Unrolling
from llfsm_verify.kripke.observing import observed_outputs
from llfsm_verify.program.program import BOOL, Program
from llfsm_verify.semantics.lowering import lower
from tests.backends.smt.test_relation import flat, lowered
from tests.quick import AtLeast, examples, many, spread

Seen = tuple[tuple[int, ...], frozenset[str] | None]
"""A configuration, and the letter shown there (None: none is)."""
STEPS, MOST = 5, 50


class TooManyError(Exception):
    pass


def expected(program: Program) -> tuple[list[set[Seen]], list[set[int]]]:
    """By the interpreter: what is seen after each number of steps (the first letter apart), and which faults happen."""
    layout, interpreter = Layout.of(program), Interpreter(program)
    names = list(observed_outputs(program))
    now = [(layout.decode(r), layout.decode_outputs(r)) for r in layout.initial(MOST)]
    points: list[set[Seen]] = [{(configuration(program, values), None) for values, _ in now}]
    faults: list[set[int]] = []
    for _ in range(STEPS):
        following = {}
        faults.append(set())
        for values, outputs in now:
            for count, (process, outcome) in enumerate(interpreter.successors(values, outputs)):
                if outcome.overflow or count > MOST:
                    raise TooManyError
                if outcome.fault is not None:
                    faults[-1].add(outcome.fault)
                    continue
                shown = program.observe == "ringlet" or process is None or outcome.outputs[program.cycle] == 1
                letter = frozenset(n for n, o in names if outcome.outputs[o]) if shown else None
                here = configuration(program, outcome.values)
                key = tuple(flat(program, outcome.values | outcome.outputs).values())
                following[key] = (here, letter, outcome)
        if len(following) > MOST:
            raise TooManyError
        now = [(o.values, o.outputs) for _, _, o in following.values()]
        points.append({(here, letter) for here, letter, _ in following.values()})
    return points, faults


def configuration(program: Program, values) -> tuple[int, ...]:
    inner = {v.name: values[v.name] for v in program.vars if not v.output}
    outputs = {v.name: v.init for v in program.vars if v.output}
    whole = flat(program, inner | outputs)
    return tuple(whole[key] for key in whole if key[0] in inner)


def unrolled(program: Program, arithmetic: Arithmetic) -> tuple[list[set[Seen]], list[set[int]]]:
    """The same by a solver that is asked for one run after the other."""
    run = Unrolling(Terms(program, arithmetic))
    points = [everything(run, run.points[0], program, first=True)]
    faults: list[set[int]] = []
    for _ in range(STEPS):
        before = run.begin()
        solver = z3.Solver()
        solver.add(*run.constraints)
        faults.append({n for n in range(len(program.faults)) if solver.check(before.fault(arithmetic, n)) == z3.sat})
        assert bool(faults[-1]) == (solver.check(before.fault(arithmetic)) == z3.sat)
        point = run.extend()
        points.append(everything(run, point, program, first=False))
    return points, faults


def everything(run: Unrolling, point: Point, program: Program, *, first: bool) -> set[Seen]:
    arithmetic = run.terms.arithmetic
    values = [point.values[key] for key, _, _ in run.terms.configuration]
    names = [] if first else [name for name, _ in observed_outputs(program)]
    shown = [Term(t, BOOL) for t in (point.observed, *(point.letter[name] for name in names))]
    solver = z3.Solver()
    solver.add(*run.constraints)
    found: set[Seen] = set()
    while solver.check() == z3.sat:
        model = solver.model()
        numbers = tuple(arithmetic.value(model, v) for v in values)
        letters = [] if first else [arithmetic.value(model, s) for s in shown]
        shows = bool(letters and letters[0])
        letter = frozenset(n for n, x in zip(names, letters[1:], strict=True) if x) if shows else None
        assert (numbers, letter) not in found or letter is None
        found.add((numbers, letter))
        same = [v.z3 == arithmetic.literal(x, v.type).z3 for v, x in zip(values, numbers, strict=True)]
        if not first:
            same += [s.z3 == bool(x) for s, x in zip(shown, letters, strict=True)]
        solver.add(z3.Not(z3.And(same)))
        assert len(found) <= 2 * MOST
    return found


def run(count: int, least: dict[str, int]) -> None:
    """Compare that many, and more until there are so many of each kind."""
    tally: Counter[str] = Counter()
    amount = settings(max_examples=count, deadline=None, suppress_health_check=list(HealthCheck))

    def checked(program: Program) -> None:
        try:
            wanted = expected(program)
        except TooManyError:
            tally["too many"] += 1
            return
        for arithmetic in (Integers(), *([BitVectors()] if is_bounded(program) else [])):
            assert unrolled(program, arithmetic) == wanted
            tally[arithmetic.name] += 1
        tally["several processes"] += len(program.processes) > 1
        tally["cycles"] += program.observe == "cycle"
        tally["faults"] += any(wanted[1])

    spread(checked, amount, lowered(), size=5, until=AtLeast(tally, least))


@pytest.mark.slow
def test_random_arrangements() -> None:
    run(examples(25), {"integers": 4})


@pytest.mark.long
def test_many_random_arrangements() -> None:
    run(many(400), {"integers": 1, "bit-vectors": 1, "cycles": 1})


def test_the_turn_is_known() -> None:
    """With one process and no machine that leaves, a step has one way, and control is not an unknown."""
    run = Unrolling(Terms(lower(load_arrangement("models/traffic_lights/arrangement.yaml"))))
    for _ in range(7):
        run.extend()
        assert len(run.points[-2].ways) == 1
    assert [p.ways[0].slot for p in run.points[:-1]] == [0, 1, 2, 0, 1, 2, 0]
    assert z3.is_true(run.points[0].observed)


def test_constants_are_named_by_their_step() -> None:
    run = Unrolling(Terms(lower(load_arrangement("models/traffic_lights/arrangement.yaml"))), "base")
    for _ in range(4):
        run.extend()
    choices = [term.z3.decl().name() for p in run.points for way in p.ways for term in way.choices.values()]
    assert choices == ["?car@base0:0", "?car@base3:0"]
    assert run.points[1].values["timer.$state", None].z3.decl().name() == "timer.$state@base1"
