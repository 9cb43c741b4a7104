"""One ringlet of one machine, lowered (docs/semantics.md, One ringlet and Commands)."""

from __future__ import annotations

from functools import partial
from typing import Literal

from llfsm_verify.language.typed import Read, Statement
from llfsm_verify.program.program import (
    BOOL,
    Block,
    EventKind,
    Expr,
    If,
    Int,
    Let,
    Local,
    Sample,
    Set,
    Slot,
    Stmt,
    Switch,
)
from llfsm_verify.program.terms import FALSE, TRUE, const, disjunction, get, op
from llfsm_verify.semantics.canonical import canonical_block
from llfsm_verify.semantics.commands import (
    forget_inner,
    run_inner,
    suspend_inner,
    take_command,
    take_inner,
    unload_self,
)
from llfsm_verify.semantics.context import Context
from llfsm_verify.semantics.cycle import may_begin, next_turn, process_var
from llfsm_verify.semantics.expressions import Code
from llfsm_verify.semantics.letters import formula
from llfsm_verify.semantics.operators import operate
from llfsm_verify.semantics.recovery import recovered
from llfsm_verify.semantics.samples import after_entry_samples, cycle_samples, ringlet_samples
from llfsm_verify.semantics.statements import run
from llfsm_verify.semantics.storage import element_names
from llfsm_verify.semantics.vocabulary import FIRED, RAN, RESTART, SPENT, SUSPEND, Control, emit
from llfsm_verify.semantics.walk import input_reads


def lower_slot(context: Context, control: Control, slot: int) -> Slot:
    """The slot of one machine; `slot` is its index in the program."""
    profile = context.arrangement.profile
    commanded = context.affected(control.machine.name)
    prologue: list[Stmt] = [Set(RAN, None, const(slot + 1))]
    if control.var("ran") in context.variables:
        prologue.append(Set(control.var("ran"), None, TRUE))
    prologue += _begin_cycle(context, control)
    if control.pending and profile.commands == "next_turn":
        prologue += take_command(context, control)
    epilogue: list[Stmt] = []
    touched = [control.machine.name]
    if may_begin(context, control):
        touched += context.plants
        operated = {o.target for o in context.arrangement.operators if o.kind != "write"}
        if profile.commands == "end_of_ringlet":
            operated |= {inner for name in operated for inner in context.inside(name)}
        touched += sorted(operated - set(touched))
    if profile.commands == "end_of_ringlet":
        for name in (name for name in commanded if context.control(name).pending):
            epilogue += take_command(context, context.control(name))
        touched += [name for name in commanded if name not in touched]
    touched += [name for name in commanded if context.loads(name) and name not in touched]
    unloaded = unload_self(context, control)
    epilogue += unloaded
    if unloaded and profile.commands == "end_of_ringlet":
        epilogue += take_inner(context, control.machine.name)
    epilogue += next_turn(context, control)
    return Slot(
        machine=control.index,
        process=control.process,
        state=control.var("state"),
        prologue=tuple(prologue),
        blocks=tuple(
            recovered(context, control, _state_block(context, control, i)) for i in range(len(control.states))
        ),
        epilogue=tuple(epilogue),
        canonical=() if context.keep_all_bits else canonical_block(context, touched),
    )


# ---------------------------------------------------------------- where a cycle begins


def lower_surroundings(context: Context) -> Block:
    """The ringlets of the models of the surroundings, for the prologues of the slots that can begin a cycle."""
    body: list[Stmt] = []
    for control in context.plants.values():
        arms = [(i, _state_block(context, control, i)) for i in range(len(control.states))]
        body += (Switch(control.state, tuple(arms)),) if len(arms) > 1 else arms[0][1]
    return tuple(body)


def _begin_cycle(context: Context, control: Control) -> list[Stmt]:
    """Before the first ringlet of a cycle operators act, the models of the surroundings have theirs, and the inputs
    that may change once a cycle are brought up to date."""
    flag = process_var(context, control.process, "begins")
    if flag not in context.variables or not may_begin(context, control):
        return []
    body: list[Stmt] = [Set(flag, None, FALSE), *operate(context, control), *context.surroundings]
    for scalar in (s for s in context.inputs.values() if s.stored and s.choice):
        local = Local(f"in.{scalar.name}", scalar.type)
        body += [Sample(local, scalar.choice), Set(scalar.name, None, local)]
    body += cycle_samples(context, control)
    # The first machine of a process has its turn at the beginning of a cycle only.
    return body if control.position == 0 else [If(get(flag, BOOL), tuple(body))]


def entry_inputs(context: Context, control: Control) -> list[str]:
    """Under `snapshot: after_entry`: the input scalars that the machine's actions before the snapshot read."""
    names: set[str] = set()
    for state in control.states:
        for read in input_reads((state.on_entry, state.on_suspend, state.on_resume), context.input_variables):
            names |= {n for n, _ in element_names(read.variable.name, read.variable.type) if _under(n, read)}
    return [n for n in context.inputs if n in names and context.inputs[n].varies]


def _under(element: str, read: Read) -> bool:
    """Conservative: every element of the variable."""
    return element.startswith(read.variable.name)


# ---------------------------------------------------------------- the block of a state


def _state_block(context: Context, control: Control, index: int) -> Block:
    state = control.states[index]
    code = Code(context, control, index)
    out = code.out
    if control.scheduled:
        out.append(Set(SPENT, None, const(index)))
    if context.probes is not None and control.scheduled:
        from llfsm_verify.semantics.probes import Probe

        out += context.probes.watch(Probe("spent", control.machine.name, state.span, index), TRUE)
    if control.scheduled:
        out += ringlet_samples(context, control, index, partial(formula, context))
    needs_fresh = bool(control.bounds[index]) or "age" in _kinds(context, control)
    if needs_fresh:
        fresh = code.local("fresh", BOOL)
        out.append(Let(fresh, op("not", control.flag("entered"))))
        code.fresh = fresh
    out.append(If(op("not", control.flag("entered")), _entry(context, control, index, code)))
    _snapshot_after_entry(context, control, index, code)
    _let_time_pass(context, control, index, code)
    done = _guards(control, index, code)
    if state.transitions:
        _fire(context, control, index, code, done)
        _finished_flag(context, control, code, False)
        _not_accepting(context, control, code)
    else:
        _act(control, index, state.internal, "internal", code)
        if state.stays:
            _finished_flag(context, control, code, False)
            _not_accepting(context, control, code)
        else:
            out.append(emit(control, "accept", const(index)))
            _accept(context, control, index, code)
    return tuple(out)


def _kinds(context: Context, control: Control) -> set[str]:
    return {k for k in ("age", "clock") if control.var(k) in context.variables}


def _entry(context: Context, control: Control, index: int, outer: Code) -> Block:
    state = control.states[index]
    code = outer.inner()
    code.entering = True
    code.fresh = FALSE
    _due(context, control, index, code)
    for clock in sorted(_kinds(context, control)):
        code.out.append(Set(control.var(clock), None, const(0)))
    code.clock_state = index
    code.fresh = TRUE
    code.out.append(emit(control, "entry", const(index)))
    run(code, state.on_entry)
    code.out.append(Set(control.var("entered"), None, TRUE))
    code.out += run_inner(context, control, index)
    return tuple(code.out)


def _due(context: Context, control: Control, index: int, code: Code) -> None:
    """on_suspend of the state left, or on_resume of the suspend state and of this one."""
    if not control.previous or control.suspend is None:
        return
    previous = get(control.var("previous"), Int(0, len(control.states)))
    if index == control.suspend:
        cases = []
        for i, left in enumerate(control.states):
            if i != index:
                inner = code.inner()
                inner.clock_state = i
                _pass_before(context, control, inner, left.on_suspend)
                _act(control, i, left.on_suspend, "on_suspend", inner)
                cases.append((i + 1, tuple(inner.out)))
        code.out.append(Switch(previous, tuple(cases)))
    else:
        inner = code.inner()
        inner.clock_state = control.suspend
        resumed = control.states[control.suspend].on_resume, control.states[index].on_resume
        _pass_before(context, control, inner, resumed[0] or resumed[1])
        _act(control, control.suspend, resumed[0], "on_resume", inner)
        _act(control, index, resumed[1], "on_resume", inner)
        code.out.append(If(op("eq", previous, const(control.suspend + 1)), tuple(inner.out)))
    code.out.append(Set(control.var("previous"), None, const(0)))


def _pass_before(context: Context, control: Control, code: Code, actions: tuple[Statement, ...]) -> None:
    """Before due actions with text the clock of the state left may go on (those without are forgotten as dead)."""
    if control.due_reads_clock and actions:
        _let_time_pass(context, control, code.clock_state, code)


def _act(control: Control, number: int, statements: tuple[Statement, ...], kind: EventKind, code: Code) -> None:
    code.out.append(emit(control, kind, const(number)))
    if statements and code.context.probes is not None and control.scheduled:
        from llfsm_verify.semantics.probes import ACTIONS, Probe

        span = control.states[number].span
        probe = Probe("action", control.machine.name, span, number, ACTIONS.index(kind))
        code.out += code.context.probes.watch(probe, TRUE)
    run(code, statements)


def _snapshot_after_entry(context: Context, control: Control, index: int, code: Code) -> None:
    if context.arrangement.profile.snapshot != "after_entry" or not control.scheduled:
        return
    for name in entry_inputs(context, control):
        value = code.read_input(context.inputs[name])
        code.out.append(Set(f"{control.machine.name}.$seen.{name}", None, value))
    code.out += after_entry_samples(context, control, index, partial(formula, context))


def _let_time_pass(context: Context, control: Control, index: int, code: Code) -> None:
    """Untimed: a turn may raise the machine's age to any value, unless its clock restarted in this ringlet."""
    if "age" not in _kinds(context, control):
        return
    age, timely = control.var("age"), control.var("timely")
    bounds = control.bounds[index]
    if not bounds:
        code.out.append(Set(timely, None, TRUE))
        return
    kind = context.variables[age].type
    raised = code.temporary(Int(0, len(bounds)))
    inner: list[Stmt] = [
        Sample(raised, f"{control.machine.name}.{control.states[index].name}.age"),
        Set(age, None, op("max", get(age, kind), raised)),
    ]
    code.branch(op("not", code.fresh), tuple(inner))
    on_time = op("or", code.fresh, op("ge", get(age, kind), const(len(bounds))))
    code.branch(on_time, (Set(timely, None, TRUE),))


def _guards(control: Control, index: int, code: Code) -> Local:
    """Evaluate the guards in order up to the first that holds; the local is 1 + its number, or 0."""
    transitions = control.states[index].transitions
    done = code.local("done", Int(0, len(transitions)))
    if not transitions:
        if control.scheduled:
            code.out.append(Set(FIRED, None, const(0)))
        return done
    if code.context.probes is not None:
        from llfsm_verify.semantics.guards_alone import guards_alone

        guards_alone(code, index)
    code.out.append(Let(done, const(0)))
    for number, transition in enumerate(transitions):
        inner = code.inner()
        guard = inner.guard(transition.guard, index, number)
        inner.out.append(emit(control, "guard", const(index), const(number), guard))
        inner.out += _probe(code, "guard", index, number, guard)
        inner.branch(guard, (Let(done, const(number + 1)),))
        if number == 0:
            code.out += inner.out
        else:
            code.out.append(If(op("eq", done, const(0)), tuple(inner.out)))
    if control.scheduled:
        code.out.append(Set(FIRED, None, done))
    return done


def _fire(context: Context, control: Control, index: int, code: Code, done: Local) -> None:
    """Take the transition: the target becomes the current state, then this state's on_exit runs; else `internal`."""
    state = control.states[index]
    arms = []
    for number, transition in enumerate(state.transitions):
        target = transition.target
        arm: list[Stmt] = [Set(control.var("state"), None, const(target))]
        if target != index:
            arm.append(Set(control.var("entered"), None, FALSE))
            if control.previous and control.suspend in (index, target):
                arm.append(Set(control.var("previous"), None, const(index + 1)))
            arm += suspend_inner(context, control, index)
            arm += forget_inner(context, control) if index == control.suspend else []
        arm += _fired_output(context, control, index, number)
        arm += _probe(code, "fired", index, number, TRUE)
        arms.append((number + 1, tuple(arm)))
    leaving = code.inner()
    leaving.out.append(Switch(done, tuple(arms)))
    _act(control, index, state.on_exit, "exit", leaving)
    if context.arrangement.profile.self_transition_restarts_clock:
        again = [op("eq", done, const(i + 1)) for i, t in enumerate(state.transitions) if t.target == index]
        restart: list[Stmt] = [Set(control.var(k), None, const(0)) for k in sorted(_kinds(context, control))]
        if "age" in _kinds(context, control):
            restart.append(Set(control.var("timely"), None, TRUE))
        leaving.branch(disjunction(list(again)), tuple(restart))
    staying = code.inner()
    _act(control, index, state.internal, "internal", staying)
    code.out.append(If(op("ne", done, const(0)), tuple(leaving.out), tuple(staying.out)))


def _probe(code: Code, kind: Literal["guard", "fired"], index: int, number: int, value: Expr) -> Block:
    if code.context.probes is None or not code.control.scheduled:
        return ()
    from llfsm_verify.semantics.probes import Probe

    transition = code.control.states[index].transitions[number]
    probe = Probe(kind, code.control.machine.name, transition.span, index, number)
    return code.context.probes.watch(probe, value, transition.guard)


def _fired_output(context: Context, control: Control, index: int, number: int) -> list[Stmt]:
    name = f"{control.machine.name}.$fired.{index}.{number}"
    return [Set(name, None, TRUE)] if name in context.variables else []


def _finished_flag(context: Context, control: Control, code: Code, value: bool) -> None:
    """Under `finished: keep` a machine is finished as long as it accepts on its turns."""
    name = control.var("finished")
    if control.keeps and name in context.variables:
        code.out.append(Set(name, None, TRUE if value else FALSE))


def _not_accepting(context: Context, control: Control, code: Code) -> None:
    name = process_var(context, control.process, "accepting")
    if name in context.variables and control.scheduled:
        code.out.append(Set(name, None, FALSE))


def _accept(context: Context, control: Control, index: int, code: Code) -> None:
    """Nothing fired in a state without transitions: the machine is finished, unless suspended or about to move."""
    if index != control.suspend and control.var("done") in context.variables:
        code.out.append(Set(control.var("done"), None, TRUE))
    name = control.var("finished")
    if name not in context.variables:
        return
    if index == control.suspend:
        _finished_flag(context, control, code, False)
        return
    waits: Expr = FALSE
    if control.pending:
        waits = op("or", op("eq", control.waiting, const(SUSPEND)), op("eq", control.waiting, const(RESTART)))
    code.out.append(Set(name, None, op("not", waits)))
