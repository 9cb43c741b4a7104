"""Guards evaluated by themselves: what each would be at its point of the ringlet, whatever those before it are."""

from __future__ import annotations

from llfsm_verify.language.typed import Literal
from llfsm_verify.program.dependence import uses
from llfsm_verify.program.program import Block, Const, Expr, Fault
from llfsm_verify.program.terms import op
from llfsm_verify.program.trees import expressions, statements
from llfsm_verify.semantics.expressions import Code
from llfsm_verify.semantics.probes import Probe, Probes
from llfsm_verify.semantics.walk import input_reads


def guards_alone(code: Code, index: int) -> None:
    """Where guards alone are probed: tell what those of state `index` are, and which of them are true together.

    Guards that can fault or leave 64 bits are passed over, and those that sample inputs anew wherever they read them.
    """
    probes = code.context.probes
    if probes is None or not probes.wide or not code.control.scheduled:
        return
    machine, transitions = code.control.machine.name, code.control.states[index].transitions
    values: dict[int, Expr] = {}
    for number, transition in enumerate(transitions):
        if isinstance(transition.guard, Literal):
            continue
        evaluated = _evaluated(code, index, number, probes)
        if evaluated is not None:
            block, values[number] = evaluated
            code.out += block
            probe = Probe("alone", machine, transition.span, index, number)
            code.out += probes.watch(probe, values[number], transition.guard)
    for number, value in values.items():
        for later, other in values.items():
            if number < later and not isinstance(value, Const) and not isinstance(other, Const):
                probe = Probe("both", machine, transitions[later].span, index, number, later)
                code.branch(op("and", value, other), (probes.tell(probe, 1),))


def _evaluated(code: Code, index: int, number: int, probes: Probes) -> tuple[Block, Expr] | None:
    """What must be done to evaluate a guard, and its value; None: it is passed over."""
    context, guard = code.context, code.control.states[index].transitions[number].guard
    if context.arrangement.profile.snapshot == "none" and input_reads(guard, context.input_variables):
        return None
    inner = code.inner()
    probes.muted = True
    try:
        value = inner.let(inner.expr(guard))
    finally:
        probes.muted = False
    block = tuple(inner.out)
    for s in statements(block):
        if isinstance(s, Fault) or uses(*expressions(s)).fails:
            return None
    return None if uses(value).fails else (block, value)
