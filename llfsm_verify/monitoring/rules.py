"""Rules that follow from the text of a machine: where it begins, what may come after each state, what it outputs there.

They say what the machine promises, as properties that another machine in its place can be held to (the wish of the
paper on run-time verification with LLFSMs). They hold of the machine itself, whatever the others do: a rule that
depends on what others write is left out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from llfsm_verify.arrangement.model import Arrangement, Machine, State
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import Assign, Literal, Read, Statement
from llfsm_verify.language.types import scalar_text


@dataclass(frozen=True, slots=True)
class Rule:
    """A line of a property file."""

    name: str
    formula: str

    @property
    def line(self) -> str:
        return f"{self.name}: {self.formula}"


def rules_of(arrangement: Arrangement, name: str) -> list[Rule]:
    """The rules of a machine. KeyError: there is no such machine."""
    machine = arrangement.machine(name)
    return [*_begins(machine), *_order(arrangement, machine), *_outputs(arrangement, machine)]


def _begins(machine: Machine) -> Iterator[Rule]:
    if not machine.loaded:
        yield Rule(f"{machine.name}_begins", f"!{machine.name}.loaded")
    elif not machine.suspended:
        yield Rule(f"{machine.name}_begins", f"{machine.name}@{machine.states[machine.initial].name}")
    elif machine.suspend is not None:
        yield Rule(f"{machine.name}_begins", f"{machine.name}@{machine.states[machine.suspend].name}")


def _order(arrangement: Arrangement, machine: Machine) -> Iterator[Rule]:
    """After each state: itself, the targets of its transitions, and where commands may have brought the machine."""
    received = _received(arrangement, machine)
    puts_aside = bool(received & {"suspend", "load_suspended"}) or machine.suspended
    if "enter" in received or (puts_aside and machine.suspend is None):
        return  # any state may come, or its suspend state has no name in properties
    for number, state in enumerate(machine.states):
        if number == machine.suspend and received & {"resume"}:
            continue  # it goes back to wherever it was
        after = {number, *(t.target for t in state.transitions)}
        if puts_aside and machine.suspend is not None:
            after |= {machine.suspend, *(t.target for t in machine.states[machine.suspend].transitions)}
        if received & {"restart", "load", "load_suspended"}:
            # In one cycle it may be commanded before and after its own turn.
            after |= {machine.initial, *(t.target for t in machine.states[machine.initial].transitions)}
        if received & {"resume"}:
            after |= {t.target for other in after for t in machine.states[other].transitions}
        if after == set(range(len(machine.states))):
            continue
        where = _places(machine, sorted(after))
        gone = f" || !{machine.name}.loaded" if "unload" in received or machine.on_fault == "unload" else ""
        yield Rule(f"{machine.name}_after_{state.name}", f"G ({machine.name}@{state.name} -> X ({where}{gone}))")


def _places(machine: Machine, numbers: list[int]) -> str:
    names = [machine.states[number].name for number in numbers]
    return f"{machine.name}@{names[0]}" if len(names) == 1 else f"{machine.name}@{{{', '.join(names)}}}"


def _received(arrangement: Arrangement, machine: Machine) -> set[str]:
    """The kinds of commands that others, and the machine itself, may give it."""
    given = {c.kind for other in arrangement.machines for c in other.commands() if c.machine == machine.name}
    operated = {o.kind for o in arrangement.operators if o.target == machine.name and o.kind != "write"}
    nested = {"suspend", "restart", "resume"} if machine.nested else set()
    return {*given, *operated, *nested}


def _outputs(arrangement: Arrangement, machine: Machine) -> Iterator[Rule]:
    """The constants that the entry of a state leaves in variables of the whiteboard, where nothing else writes them."""
    operated = {o.target for o in arrangement.operators if o.kind == "write"}
    others = {name for other in arrangement.texts if other is not machine for name, _ in other.writes()}
    always = {n for s in machine.states for kind in (s.on_suspend, s.on_resume, s.internal) for n in _written(kind)}
    if machine.suspend is not None and "resume" in _received(arrangement, machine):
        aside = machine.states[machine.suspend]  # a machine that is resumed does not enter its state again
        always |= {*_written(aside.on_entry), *_written(aside.on_exit)}
    for state in machine.states:
        # A self-transition runs `on_exit` and does not enter the state again.
        changed = operated | others | always | set(_written(state.on_exit))
        at = " && ".join(f"{n} == {text}" for n, text in _left(state) if n not in changed)
        if at:
            entered = f"{machine.name}.entered({state.name})"
            yield Rule(f"{machine.name}_in_{state.name}", f"G ({entered} -> {at})")


def _left(state: State) -> Iterator[tuple[str, str]]:
    """What `on_entry` leaves in variables, as far as it is a constant on every path."""
    last: dict[str, Statement] = {}
    for statement in state.on_entry:
        last |= dict.fromkeys(_written((statement,)), statement)
    for name, statement in last.items():
        if (
            isinstance(statement, Assign)
            and statement.op is None
            and isinstance(statement.target, Read)
            and not statement.target.path
            and isinstance(statement.value, Literal)
        ):
            yield name, scalar_text(statement.value.value, statement.value.type)


def _written(statements: tuple[Statement, ...]) -> Iterator[str]:
    for node in of_kind(statements, Assign):
        if isinstance(node.target, Read) and node.target.variable.scope == "whiteboard":
            yield node.target.variable.name
