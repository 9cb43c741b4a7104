"""The switch: the only machine that writes the outputs that are routed, and the one that commands others."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator

from llfsm_verify.extensions.guards.reactions import begin, end
from llfsm_verify.extensions.guards.wanted import Names, Wanted, as_requested
from llfsm_verify.plug import NewMachine, NewState, StateActions


def switch_machine(
    names: Names, wanted: Wanted, *, taken_back: bool = False, chaos: Collection[str] = ()
) -> NewMachine:
    """The machine. `taken_back`: a monitor takes its alarm back. `chaos`: machines of which the switch does not ask
    what they do, for a proof. DiagnosticError: an expression is not valid."""
    requests = [f"{output} = {names.requests[output]};" for output in wanted.fallbacks]
    instead = [f"{output} = {as_requested(text, names.requests)};" for output, text in wanted.fallbacks.items()]
    until, leave = None, []
    if wanted.until is not None:
        until, leave = as_requested(wanted.until, names.requests), [*instead, *_again(names)]
    elif taken_back:
        until, leave = f"!{names.alarm}", requests
    memory = {} if until is None else names.memory
    if wanted.until is None and not wanted.reactions:
        choice = [f"if ({names.alarm}) {{", *_deeper(instead), "} else {", *_deeper(requests), "}"]
        states = [NewState("SWITCH", {"internal": choice}, stays=True)]
    else:
        begins: StateActions = {"internal": requests, "on_exit": [*instead, *begin(wanted.reactions, memory, chaos)]}
        states = [NewState("REQUESTED", begins, [(names.alarm, "INSTEAD")], brief=True)]
        if until is None:
            states.append(NewState("INSTEAD", {"internal": instead}, stays=True))
        else:
            ends: StateActions = {"internal": instead, "on_exit": [*leave, *end(wanted.reactions, memory)]}
            states.append(NewState("INSTEAD", ends, [(until, "REQUESTED")], brief=True))
    variables = {name: {"type": "bool"} for name in memory.values()}
    return NewMachine("Switch", states, variables=variables, comments=[*_comment(names, wanted)])


def _again(names: Names) -> Iterator[str]:
    """The monitors begin again. One that is not finished yet does not do so by a load alone."""
    yield f"{names.alarm} = false;"
    yield from (f"unload({monitor}); load({monitor});" for monitor in names.monitors)


def _comment(names: Names, wanted: Wanted) -> Iterator[str]:
    outputs = " and ".join(f"`{output}`" for output in wanted.fallbacks)
    if outputs:
        yield f"The requested value goes to {outputs}; when `{names.alarm}` is set, the fallback goes there."
    if wanted.reactions:
        commands = " and ".join(f"{each.kind} `{each.machine}`" for each in wanted.reactions)
        yield f"When `{names.alarm}` is set: {commands}."


def _deeper(lines: Iterable[str]) -> list[str]:
    return [f"  {line}" for line in lines]
