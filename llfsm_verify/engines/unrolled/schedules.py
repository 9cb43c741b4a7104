"""Runs that a solver gives, told to the executor."""

from __future__ import annotations

import z3

from llfsm_verify.backends.smt.unrolling import Unrolling
from llfsm_verify.checking.replay.confirm import Schedule
from llfsm_verify.program.moves import Move


def schedule_of(run: Unrolling, model: z3.ModelRef, steps: int, start: int | None = None) -> Schedule:
    """The first `steps` steps of a model of a run; `start`: the point that the loop comes back to."""
    program, arithmetic = run.terms.program, run.terms.arithmetic
    single = {c.name: c.type.low for c in program.choices if c.type.low == c.type.high}
    moves: list[Move] = []
    for point in run.points[:steps]:
        way = next(w for w in point.ways if z3.is_true(model.eval(w.when, model_completion=True)))
        chosen = {name: arithmetic.value(model, term) for name, term in way.choices.items()}
        moves.append(Move(way.process, single | chosen))
    free = [(v.name, arithmetic.value(model, run.points[0].values[v.name, None])) for v in program.vars if v.free]
    return Schedule(tuple(free), tuple(moves), None if start is None else start - 1)
