"""What lint need not explore: variables on which no probe depends, where they can have many values."""

from __future__ import annotations

import math

from llfsm_verify.kripke.labels.sizes import WIDE
from llfsm_verify.program.program import Program, Unbounded, Var
from llfsm_verify.semantics.probes import DEAD
from llfsm_verify.transforms.cone import Cone, cone
from llfsm_verify.transforms.probing import Probed


def worthwhile_cone(probed: Probed) -> Cone | None:
    """The part of a probed program that its probes depend on; None: what is not in it is small, and may be explored.

    A sensor's value that is stored and never read is the usual case: nothing is told apart by its 65,536 values. What
    is asked of machines that starve (their states, whether they finished, whether their processes ended) stays in it.
    """
    found = cone(probed.program, _asked(probed.program))
    kept = {v.name for v in found.program.vars}
    gone = [v for v in probed.program.vars if not v.output and v.name not in kept]
    return found if any(map(_is_wide, gone)) else None


def _is_wide(v: Var) -> bool:
    if isinstance(v.type, Unbounded):
        return True
    values = v.type.high - v.type.low + 1
    return math.prod([values] * (1 if v.length is None else v.length)) > WIDE


def _asked(program: Program) -> set[str]:
    """The variables that questions about graphs read."""
    names = {DEAD, *(p.ended for p in program.processes if p.ended is not None)}
    names |= {f"{m.name}.{part}" for m in program.machines for part in ("$state", "$finished", "$loaded")}
    return names & {v.name for v in program.vars}
