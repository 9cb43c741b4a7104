"""What a property sees of a step: atoms over configurations, inputs and what the step did, and fairness."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Span
from llfsm_verify.language import types as lt
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import (
    AtState,
    Binary,
    Conditional,
    Edge,
    Expression,
    Field,
    Index,
    LetIn,
    Literal,
    Observe,
    Query,
    Read,
    ReadLocal,
    Sampled,
    Sampling,
    Unary,
)
from llfsm_verify.program.program import (
    BOOL,
    INT64_MAX,
    INT64_MIN,
    Atom,
    Block,
    Const,
    Expr,
    Fairness,
    Get,
    If,
    Int,
    Let,
    Local,
    Origin,
    Sample,
    Set,
    Stmt,
    Var,
)
from llfsm_verify.program.terms import FALSE, TRUE, TooWideError, conjunction, const, disjunction, get, ite, op
from llfsm_verify.program.trees import constant_of, distinct_nodes, rebuilt, spelt_out
from llfsm_verify.semantics.context import Context
from llfsm_verify.semantics.cycle import in_turn
from llfsm_verify.semantics.numbers import binary, choose, sides, too_wide, unary
from llfsm_verify.semantics.queries import at_state, process_ended, query, while_loaded
from llfsm_verify.semantics.samples import key_of, read_name, scalars_of, value_name
from llfsm_verify.semantics.storage import leaves, machine_type
from llfsm_verify.semantics.vocabulary import CYCLE, FIRST, KNOWN, RAN
from llfsm_verify.semantics.walk import constant_index, elements


@dataclass(frozen=True, slots=True)
class TimePasses:
    """Whether a cycle's time passes between a letter and the next: the step completed a cycle, or the arrangement has
    ended (time goes on, by a cycle a letter). For arrangements of one process, the only ones with one time."""


@dataclass(frozen=True, slots=True)
class Observed:
    """A state formula under the name that properties know it by."""

    name: str
    expression: Expression | TimePasses


def mentioned_inputs(context: Context, atoms: Sequence[Observed]) -> frozenset[str]:
    """The scalars of unstored inputs that atoms mention."""
    names: set[str] = set()
    for atom in atoms:
        for read in of_kind(atom.expression, Read):
            if read.variable.name in context.input_variables:
                names |= set(elements(read))
    return frozenset(n for n in names if not context.inputs[n].stored)


def finished_wanted(atoms: Sequence[Observed]) -> frozenset[str]:
    return frozenset(o.machine for a in atoms for o in of_kind(a.expression, Observe) if o.kind == "finished")


def entered_wanted(atoms: Sequence[Observed]) -> frozenset[str]:
    """The machines of which atoms ask whether `on_entry` of the present state has run."""
    return frozenset(o.machine for a in atoms for o in of_kind(a.expression, Observe) if o.kind == "entered")


def declare_observations(context: Context, atoms: Sequence[Observed]) -> None:
    """The outputs that atoms read, beside those every step has."""
    for atom in atoms:
        for o in of_kind(atom.expression, Observe):
            name = f"{o.machine}.$fired.{o.state}.{o.transition}" if o.kind == "fired" else f"{o.machine}.$ran"
            if o.kind == "ran" and context.arrangement.observe != "cycle":
                continue
            if o.kind in ("ran", "fired") and name not in context.variables:
                context.control_var(name, BOOL, 0, o.machine, output=True)
    if context.tracks_samples:
        for scalar_name in sorted(context.mentioned):
            scalar = context.inputs[scalar_name]
            context.control_var(f"{scalar_name}.$sampled", BOOL, 0, output=True)
            origin = Origin("output", "", scalar.labels)
            context.add(Var(f"{scalar_name}.$value", scalar.type, scalar.type.low, origin, output=True))


def lower_atoms(context: Context, atoms: Sequence[Observed]) -> tuple[Atom, ...]:
    """Declare one output per atom and lower its formula."""
    result = []
    for number, atom in enumerate(atoms):
        output = f"$atom.{number}"
        context.control_var(output, BOOL, 0, output=True)
        value = formula(context, atom.expression)
        context.shown.append(Set(output, None, value))
        result.append(Atom(atom.name, output, spelt_out(value, context.spelt)))
    return tuple(result)


def letter_block(context: Context, fairness: list[Stmt]) -> Block:
    """Sample what the letter shows of the inputs, then set the outputs of atoms and fairness."""
    body: list[Stmt] = []
    for name in sorted(context.mentioned):
        body += _shown_input(context, name)
    body += context.known
    body += [statement for edge in context.edges for statement in edge]
    if FIRST in context.variables:
        body.append(Set(FIRST, None, FALSE))
    return tuple(body + context.shown + fairness)


def _shown_input(context: Context, name: str) -> list[Stmt]:
    scalar = context.inputs[name]
    local = Local(f"input:{name}", scalar.type)
    if not context.tracks_samples:
        return [Sample(local, scalar.choice)]
    free: Block = (Sample(local, context.letter_choice(scalar)),)
    known: Block = (Let(local, get(f"{name}.$value", scalar.type)),)
    return [If(get(f"{name}.$sampled", BOOL), known, free)]


# ---------------------------------------------------------------- formulas


Samples = Callable[[Sampled], list[Expr]]
"""The scalars of an input as they were sampled."""


def formula(context: Context, e: Expression | TimePasses, samples: Samples | None = None) -> Expr:
    """A pure expression for a typed state formula; nothing in it can fault (the atom checker sees to that).

    `samples`: of a sample that is just taken; None: the formula stands in a letter, and hidden variables tell.
    Raises DiagnosticError (E193) where what is calculated may leave 128 bits.
    """
    if isinstance(e, TimePasses):
        return disjunction([get(CYCLE, BOOL), process_ended(context, 0)])
    try:
        return _formula(context, e, samples)
    except TooWideError:
        raise too_wide(e.span) from None


def _formula(context: Context, e: Expression, samples: Samples | None) -> Expr:
    if samples is None and isinstance(e, (Unary, Binary, Conditional)):
        key = key_of(e) if context.samples.truths else None
        if key is not None and key in context.samples.truths:
            return get(context.samples.truths[key], BOOL)
    if isinstance(e, Literal):
        return Const(int(e.value), BOOL) if isinstance(e.type, lt.BoolType) else const(int(e.value))
    if isinstance(e, (Read, Sampled)):
        (value,) = _scalars(context, e, samples)
        return value
    if isinstance(e, Unary):
        return unary(e, formula(context, e.operand, samples))
    if isinstance(e, Binary):
        if isinstance(e.left, (Read, Sampled)) and isinstance(e.left.type, (lt.ArrayType, lt.RecordType)):
            assert isinstance(e.right, (Read, Sampled))
            pairs = zip(_scalars(context, e.left, samples), _scalars(context, e.right, samples), strict=True)
            same = conjunction([op("eq", a, b) for a, b in pairs])
            return same if e.op == "eq" else op("not", same)
        return binary(e, formula(context, e.left, samples), formula(context, e.right, samples))
    if isinstance(e, Conditional):
        condition = formula(context, e.condition, samples)
        return choose(condition, *sides(e, formula(context, e.then, samples), formula(context, e.otherwise, samples)))
    if isinstance(e, LetIn):
        for local, defined in e.definitions:
            context.defined[local.key] = _known(context, defined)
        return formula(context, e.value)
    if isinstance(e, ReadLocal):
        return context.defined[e.local.key]
    if isinstance(e, AtState):
        return at_state(context, e.machine, e.state)
    if isinstance(e, Query):
        return query(context, e.kind, e.machine)
    if isinstance(e, Observe):
        return _observe(context, e)
    if isinstance(e, Sampling):
        return get(read_name(e.machine, e.variable.name), BOOL)
    if isinstance(e, Edge):
        return _edge(context, e)
    raise AssertionError(f"a property cannot ask {e}")


def _known(context: Context, e: Expression) -> Expr:
    """A definition of what theories say, which the letter makes once."""
    if id(e) not in context.found:
        value = formula(context, e)
        if not isinstance(value, (Const, Local)):
            local = Local(f"{KNOWN}{len(context.known)}", value.type)
            context.known.append(Let(local, value))
            context.spelt[local.name] = spelt_out(value, context.spelt)
            value = local
        context.found[id(e)] = value
    return context.found[id(e)]


def _scalars(context: Context, e: Expression, samples: Samples | None) -> list[Expr]:
    """The values of a variable, of a part of it, or of a sample."""
    if isinstance(e, Read):
        return _read(context, e)
    assert isinstance(e, Sampled)
    if samples is not None:
        return samples(e)
    if context.arrangement.profile.snapshot == "cycle":
        return [_input_value(context, name) for name in scalars_of(e)]
    return [get(value_name(e.machine, name), context.inputs[name].type) for name in scalars_of(e)]


# ---------------------------------------------------------------- edges: this letter and the one before


def _edge(context: Context, e: Edge) -> Expr:
    """An output that the letter sets; a hidden variable keeps the operand for the next letter."""
    composite = isinstance(e.operand, (Read, Sampled)) and isinstance(e.operand.type, (lt.ArrayType, lt.RecordType))
    now = _scalars(context, e.operand, None) if composite else [formula(context, e.operand)]
    shown = f"$edge.{len(context.edges)}"
    context.control_var(shown, BOOL, 0, output=True)
    differs: list[Expr] = []
    keep: list[Stmt] = []
    for value in now:
        stored, before = _before(context, value, e.operand.span)
        if e.kind == "rose":
            differs.append(op("and", value, op("not", before)))
        elif e.kind == "fell":
            differs.append(op("and", op("not", value), before))
        else:
            differs.append(op("ne", value, before))
        keep.append(Set(stored, None, value))
    context.edges.append((Set(shown, None, disjunction(differs)), *keep))
    return get(shown, BOOL)


def _before(context: Context, value: Expr, span: Span) -> tuple[str, Expr]:
    """The hidden variable that holds `value` for the next letter, and what it was in the letter before. `span`: what
    it is of."""
    about = " ".join(span.text.split())
    name = f"$before.{sum(n.startswith('$before.') for n in context.variables)}"
    first = rebuilt(spelt_out(value, context.spelt), lambda node: _first(context, node))
    varies = any(isinstance(node, Get) for node in distinct_nodes(first))
    start = None if varies else constant_of(first)
    if isinstance(value.type, Int) and value.type.high - value.type.low >> 64:
        message = f"`{about}` may have values that 64 bits do not hold, and no letter keeps more"
        raise DiagnosticError(Diagnostic("E193", message, span, hint="ask for the variables that it is made of"))
    low, high = (value.type.low, value.type.high) if isinstance(value.type, Int) else (INT64_MIN, INT64_MAX)
    known = start is not None and low <= start <= high
    if start is None or not known:
        start = value.type.low if isinstance(value.type, Int) else 0
    context.add(Var(name, value.type, start, Origin("control", about=about)))
    before: Expr = get(name, value.type)
    if not known:  # an input that keeps the value that it starts with, or a value that ends the first step
        if FIRST not in context.variables:
            context.control_var(FIRST, BOOL, 1)
        before = ite(get(FIRST, BOOL), first, before)
    return name, before


def _first(context: Context, node: Expr) -> Expr | None:
    """What stands in the first letter for a variable, an output or an input."""
    if isinstance(node, Get):
        variable = context.variables[node.var]
        if variable.free:
            return None
        if isinstance(variable.init, int):
            return const(variable.init)
        assert isinstance(node.index, Const)
        return const(variable.init[node.index.value])
    if isinstance(node, Local):
        return const(context.inputs[node.name.removeprefix("input:")].init)
    return None


def _read(context: Context, read: Read) -> list[Expr]:
    if read.variable.name in context.input_variables:
        return [_input_value(context, name) for name in elements(read)]
    suffix, flat, kind = "", 0, read.variable.type
    for step in read.path:
        if isinstance(step, Field):
            assert isinstance(kind, lt.RecordType)
            suffix, kind = f"{suffix}.{step.name}", kind.fields[step.index][1]
        else:
            assert isinstance(kind, lt.ArrayType)
            flat, kind = flat * step.size + constant_index(step), kind.element
    indexed = any(isinstance(s, Index) for s in read.path)
    result: list[Expr] = []
    for leaf in leaves(kind):
        name, t = read.variable.name + suffix + leaf.suffix, machine_type(leaf.type)
        if leaf.length is not None:
            result += [Get(name, const(flat * leaf.length + i), t) for i in range(leaf.length)]
        else:
            result.append(Get(name, const(flat) if indexed else None, t))
    return result


def _input_value(context: Context, name: str) -> Expr:
    scalar = context.inputs[name]
    return get(name, scalar.type) if scalar.stored else Local(f"input:{name}", scalar.type)


def _observe(context: Context, e: Observe) -> Expr:
    if e.kind == "cycle":
        return get(CYCLE, BOOL)
    control = context.control(e.machine)
    finished = control.var("finished")
    if e.kind == "suspended":
        return query(context, "suspended", e.machine)
    if e.kind == "fired":
        return get(f"{e.machine}.$fired.{e.state}.{e.transition}", BOOL)
    if e.kind == "ran":
        return ran(context, e.machine)
    if e.kind == "finished":
        return get(finished, BOOL) if finished in context.variables else FALSE
    if e.kind == "entered":
        return while_loaded(control, control.flag("entered"))
    if e.kind == "loaded":
        return control.flag("loaded") if control.absents else TRUE
    name = control.var(e.kind)  # `faulted` or `refused`
    return get(name, BOOL) if name in context.variables else FALSE


def ran(context: Context, machine: str) -> Expr:
    """The last step was the machine's ringlet (under `observe: cycle`: it took a turn in the last cycle)."""
    if context.arrangement.observe == "cycle":
        return get(f"{machine}.$ran", BOOL)
    slot = list(context.controls).index(machine) + 1
    return op("eq", get(RAN, context.variables[RAN].type), const(slot))


# ---------------------------------------------------------------- fairness


def lower_fairness(context: Context) -> tuple[tuple[Fairness, ...], list[Stmt]]:
    """Every live process goes on, and untimed clocks do not stay below a bound forever while their machine runs."""
    conditions: list[Fairness] = []
    statements: list[Stmt] = []

    def output(name: str, value: Expr) -> str:
        context.control_var(name, BOOL, 0, output=True)
        statements.append(Set(name, None, value))
        return name

    several = len(context.arrangement.processes) > 1
    fair = context.arrangement.fairness == "processes"
    if several and fair:
        for index, process in enumerate(context.arrangement.processes):
            steps = [ran(context, name) for name in process.schedule]
            goal = output(f"$fair.{process.name}", disjunction([*steps, process_ended(context, index)]))
            conditions.append(Fairness(f"process {process.name} goes on", None, goal))
    for control in context.every_control:
        if control.var("age") not in context.variables:
            continue
        machine = control.machine.name
        left = op("not", in_turn(control))
        timely = get(control.var("timely"), BOOL)
        goal = output(f"$fair.{machine}.age", disjunction([timely, left, process_ended(context, control.process)]))
        premise = output(f"$runs.{machine}", ran(context, machine)) if several and not fair else None
        conditions.append(Fairness(f"time passes for {machine}", premise, goal))
    return tuple(conditions), statements
