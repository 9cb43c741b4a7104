"""What was sampled: hidden variables for `sampled(x)`, `m.sampled(x)` and `m.read(x)`, only where atoms ask for them.

What a ringlet samples is fixed when its command has taken effect: the inputs that the guards, `internal` and `on_exit`
of its state mention, those of `on_entry` where it is due, and those of an `on_suspend` or `on_resume` that is due; an
array or record is sampled whole. With `snapshot: after_entry` the sample also has what `on_entry`, `on_suspend` and
`on_resume` of all states mention; with `snapshot: cycle` the first ringlet of a cycle samples everything, for all; with
`snapshot: none` every evaluated read is a sample of its own.

A condition over one input is held as its truth, so that wide inputs keep their classes of values (`program.labelling`);
any other use holds the value.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from llfsm_verify.language import types as lt
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import (
    Binary,
    Conditional,
    Edge,
    Expression,
    Literal,
    Read,
    Sampled,
    Sampling,
    Unary,
)
from llfsm_verify.language.types import digits_of
from llfsm_verify.program.program import BOOL, Expr, Get, If, Local, Origin, Sample, Set, Stmt, Var
from llfsm_verify.program.terms import FALSE, TRUE, const, disjunction, get, op
from llfsm_verify.program.trees import constant_of
from llfsm_verify.semantics.context import Context
from llfsm_verify.semantics.vocabulary import Control, Held, InputScalar, Key, Samples
from llfsm_verify.semantics.walk import elements, input_reads

Lower = Callable[[Expression, Callable[[Sampled], list[Expr]]], Expr]
"""The pure expression of a formula over samples, given what each of them is (`letters.formula`)."""


def value_name(machine: str, scalar: str) -> str:
    """The hidden variable that holds the value of a scalar of an input as it was sampled last."""
    return f"{machine or '$any'}.$sampled.{scalar}"


def read_name(machine: str, source: str) -> str:
    """The output that tells whether the step's ringlet was the machine's and sampled the input."""
    return f"{machine}.$read.{source}"


def key_of(e: Expression) -> Key | None:
    """What a condition over samples says, wherever it stands; None: it is about something else too."""
    match e:
        case Sampled():
            return (e.machine, *scalars_of(e))
        case Literal():
            return ("", e.value, digits_of(e.type))
        case Unary():
            parts = [key_of(e.operand)]
        case Binary():
            parts = [key_of(e.left), key_of(e.right)]
        case Conditional():
            parts = [key_of(e.condition), key_of(e.then), key_of(e.otherwise)]
        case _:
            return None
    return None if None in parts else (getattr(e, "op", "?"), *parts)


def scalars_of(sample: Sampled) -> list[str]:
    """The scalars of an input that `sampled(…)` shows."""
    return elements(Read(sample.variable, sample.path, sample.type, sample.span))


# ---------------------------------------------------------------- what is asked


def wanted_samples(context: Context, atoms: Sequence[Expression]) -> Samples:
    """What to hold for the atoms, which are typed expressions (others ask for nothing)."""
    if context.arrangement.profile.snapshot == "cycle":
        return Samples(readers=_readers(atoms))  # the stored input is what all of them sampled
    held: dict[tuple[str, str], Held] = {}
    truths: dict[Key, str] = {}
    for part in (p for a in atoms for p in _parts(context, a)):
        if isinstance(part, Sampled):
            for scalar in scalars_of(part):
                name = value_name(part.machine, scalar)
                held.setdefault((name, ""), Held(part.machine, part.variable.name, name, part, (scalar,)))
            continue
        key = key_of(part)
        if key is not None and key not in truths:
            samples = list(of_kind(part, Sampled))
            truths[key] = name = f"$held.{len(truths)}"
            scalars = tuple(dict.fromkeys(n for s in samples for n in scalars_of(s)))
            held[name, "truth"] = Held(samples[0].machine, samples[0].variable.name, name, part, scalars)
    return Samples(tuple(held.values()), truths, _readers(atoms))


def _readers(atoms: Sequence[Expression]) -> tuple[tuple[str, str], ...]:
    return tuple(dict.fromkeys((s.machine, s.variable.name) for a in atoms for s in of_kind(a, Sampling)))


def _parts(context: Context, e: Expression) -> Iterator[Expression]:
    """The largest conditions over samples of one input, and the samples outside these."""
    logical = isinstance(e, (Unary, Binary, Conditional)) and isinstance(e.type, lt.BoolType)
    if isinstance(e, Sampled) or (logical and _over_one(context, e)):
        yield e
    elif isinstance(e, Unary):
        yield from _parts(context, e.operand)
    elif isinstance(e, Binary):
        yield from _parts(context, e.left)
        yield from _parts(context, e.right)
    elif isinstance(e, Conditional):
        for part in (e.condition, e.then, e.otherwise):
            yield from _parts(context, part)
    elif isinstance(e, Edge):
        yield from _parts(context, e.operand)


def _over_one(context: Context, e: Expression) -> bool:
    """Whether nothing but samples of one input by one machine (of one scalar, where each read is a sample) decides."""
    found: set[tuple[str, str]] = set()
    scalars: set[str] = set()
    stack: list[Expression] = [e]
    while stack:
        match stack.pop():
            case Sampled() as sample:
                found.add((sample.machine, sample.variable.name))
                scalars |= set(scalars_of(sample))
            case Unary(_, operand):
                stack.append(operand)
            case Binary(_, left, right):
                stack += [left, right]
            case Conditional(condition, then, otherwise):
                stack += [condition, then, otherwise]
            case Literal():
                pass
            case _:
                return False
    separate = context.arrangement.profile.snapshot == "none" and len(scalars) > 1
    return len(found) == 1 and not separate


# ---------------------------------------------------------------- what a ringlet samples


def declare_samples(context: Context, lower: Lower) -> None:
    """The hidden variables, with what they hold before the first sample: the input's `init`."""
    for held in context.samples.held:
        if isinstance(held.value, Sampled):
            scalar = context.inputs[held.scalars[0]]
            origin = Origin("control", held.machine, scalar.labels)
            context.add(Var(held.variable, scalar.type, scalar.init, origin))
        else:
            first = lower(held.value, lambda s: [const(context.inputs[n].init) for n in scalars_of(s)])
            about = " ".join(held.value.span.text.split())
            origin = Origin("control", held.machine, about=about)
            context.add(Var(held.variable, BOOL, constant_of(first), origin))
    for machine, source in context.samples.readers:
        context.control_var(read_name(machine, source), BOOL, 0, machine, output=True)


def update(context: Context, machine: str, source: str, values: dict[str, Expr], lower: Lower) -> list[Stmt]:
    """What follows a sample of the scalars `values` of the input `source` by `machine`."""
    body: list[Stmt] = []
    for held in context.samples.of(machine, source):
        if not set(held.scalars) <= set(values):
            continue
        if isinstance(held.value, Sampled):
            body.append(Set(held.variable, None, values[held.scalars[0]]))
        else:
            body.append(Set(held.variable, None, lower(held.value, lambda s: [values[n] for n in scalars_of(s)])))
    if (machine, source) in context.samples.readers:
        body.append(Set(read_name(machine, source), None, TRUE))
    return body


def ringlet_samples(context: Context, control: Control, index: int, lower: Lower) -> list[Stmt]:
    """With `snapshot: ringlet`, where the block of state number `index` begins: the sample of what atoms ask for."""
    if context.arrangement.profile.snapshot != "ringlet":
        return []
    out: list[Stmt] = []
    for source in context.samples.concern(control.machine.name):
        condition = _is_sampled(context, control, index, source)
        if condition != FALSE:
            body = tuple(_take(context, control, source, lower))
            out += body if condition == TRUE else [If(condition, body)]
    return out


def after_entry_samples(context: Context, control: Control, index: int, lower: Lower) -> list[Stmt]:
    """With `snapshot: after_entry`, after `on_entry`."""
    state, states = control.states[index], control.states
    early = tuple((s.on_entry, s.on_suspend, s.on_resume) for s in states)
    out: list[Stmt] = []
    for source in context.samples.concern(control.machine.name):
        if _mentions((state.transitions, state.internal, state.on_exit, early), source):
            out += _take(context, control, source, lower)
    return out


def cycle_samples(context: Context, control: Control) -> list[Stmt]:
    """With `snapshot: cycle`, where the inputs are sampled by the first ringlet of a cycle."""
    if context.arrangement.profile.snapshot != "cycle":
        return []
    return [Set(read_name(m, x), None, TRUE) for m, x in context.samples.readers if m == control.machine.name]


def _mentions(root: object, source: str) -> bool:
    return bool(input_reads(root, frozenset({source})))


def _is_sampled(context: Context, control: Control, index: int, source: str) -> Expr:
    """Whether the input is in the sample of a ringlet in this state."""
    state = control.states[index]
    if _mentions((state.transitions, state.internal, state.on_exit), source):
        return TRUE
    due: list[Expr] = [TRUE] if _mentions(state.on_entry, source) else []
    if control.previous and control.suspend is not None and not due:
        previous: Get = get(control.var("previous"), context.variables[control.var("previous")].type)
        if index == control.suspend:
            left = [i for i, s in enumerate(control.states) if i != index and _mentions(s.on_suspend, source)]
            due += [op("eq", previous, const(i + 1)) for i in left]
        elif _mentions((control.states[control.suspend].on_resume, state.on_resume), source):
            due.append(op("eq", previous, const(control.suspend + 1)))
    return op("and", op("not", control.flag("entered")), disjunction(due)) if due else FALSE


def _take(context: Context, control: Control, source: str, lower: Lower) -> list[Stmt]:
    """Sample the scalars of an input that are needed, and what follows."""
    machine = control.machine.name
    needed = {n for h in context.samples.of(machine, source) for n in h.scalars}
    body: list[Stmt] = []
    values: dict[str, Expr] = {}
    for scalar in (context.inputs[n] for n in context.inputs if n in needed):
        values[scalar.name] = _value(scalar, body)
    return [*body, *update(context, machine, source, values, lower)]


def _value(scalar: InputScalar, body: list[Stmt]) -> Expr:
    if scalar.stored:
        return get(scalar.name, scalar.type)
    local = Local(f"sampled:{scalar.name}", scalar.type)
    body.append(Sample(local, scalar.choice))
    return local
