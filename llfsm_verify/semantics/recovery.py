"""Machines that a fault unloads (`on_fault: unload`): their ringlet has no effect, and the cycle goes on."""

from __future__ import annotations

from llfsm_verify.program.program import Block, Fault, Get, If, Let, Local, Set, Stmt, Var
from llfsm_verify.program.terms import FALSE, TRUE, const, op
from llfsm_verify.program.trees import statements, stop_at_faults
from llfsm_verify.semantics.context import Context
from llfsm_verify.semantics.cycle import process_var
from llfsm_verify.semantics.vocabulary import FIRED, Control, emit


def recovered(context: Context, control: Control, block: Block) -> Block:
    """The ringlet in one state of a machine that a fault unloads, which is left to what follows the ringlet.

    What the ringlet stores is put back, but for what is the machine's own, which unloading sets back, and for what it
    has sampled and shown to the letter.
    """
    if control.machine.on_fault == "end" or not any(isinstance(s, Fault) for s in statements(block)):
        return block
    before: list[Stmt] = []
    back: list[Stmt] = []
    for variable in _restored(context, control, block):
        for index in range(variable.length) if variable.length is not None else (None,):
            place = None if index is None else const(index)
            local = Local(f"before.{variable.name}" + ("" if index is None else f".{index}"), variable.type)
            before.append(Let(local, _value(variable, index)))
            back.append(Set(variable.name, place, local))
    flags = [name for name in context.variables if name.startswith(control.var("fired."))]
    flags += [control.var("unloads"), process_var(context, control.process, "accepting")]
    back += [Set(name, None, FALSE) for name in flags if name in context.variables]
    back += [Set(name, None, const(0)) for name in (FIRED, control.var("pending")) if name in context.variables]
    stopped = control.flag("faulted")

    def fails(fault: Fault) -> Stmt:
        told = emit(control, "faulted", const(fault.fault)), Set(control.var("faulted"), None, TRUE)
        if context.probes is None:
            return If(fault.when, told)
        from llfsm_verify.semantics.probes import Probe

        site = list(context.faults)[fault.fault]
        probe = Probe("fault", control.machine.name, site.span, number=fault.fault)
        return If(fault.when, (*told, context.probes.tell(probe, 1)), (context.probes.tell(probe, 0),))

    return (*before, *stop_at_faults(block, op("not", stopped), fails), If(stopped, tuple(back)))


def _restored(context: Context, control: Control, block: Block) -> list[Var]:
    """The variables that a block stores to, but the machine's own, those about samples, and outputs that are no
    commands which wait for the ringlet's end."""
    stored = {s.var for s in statements(block) if isinstance(s, Set)}
    stored -= {held.variable for held in context.samples.held}
    others = (v for v in context.variables.values() if v.name in stored and v.origin.machine != control.machine.name)
    return [v for v in others if not v.output or v.name.endswith(".$pending")]


def _value(variable: Var, index: int | None) -> Get:
    return Get(variable.name, None if index is None else const(index), variable.type)
