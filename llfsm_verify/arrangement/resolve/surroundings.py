"""The model of the surroundings: what it may have, and which inputs it alone writes."""

from __future__ import annotations

from dataclasses import replace

from llfsm_verify.arrangement.model import Machine, WhiteboardVariable
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import Assign, Read
from llfsm_verify.yaml.fields import Report


def resolve_surroundings(
    report: Report, machine: Machine, whiteboard: tuple[WhiteboardVariable, ...]
) -> tuple[Machine, tuple[WhiteboardVariable, ...]]:
    """The model of the surroundings as a machine that is never suspended and never finishes, and the whiteboard with
    the inputs that it writes marked."""
    for state in machine.states:
        if state.on_suspend or state.on_resume:
            message = "the model of the surroundings is never suspended, so `on_suspend` and `on_resume` never run"
            report.error("E087", message, state.span, "remove them")
    targets = [a.target for s in machine.states for a in of_kind(s, Assign)]
    written = {t.variable.name for t in targets if isinstance(t, Read)}
    inputs = {w.variable.name for w in whiteboard if w.role == "input"}
    for entry in whiteboard:
        if entry.changes != "step" and entry.variable.name in written:
            message = f"the model of the surroundings writes `{entry.variable.name}`, so `changes` has no meaning"
            report.error("E088", message, entry.variable.span, f"remove `changes: {entry.changes}`")
    for read in (r for s in machine.states for r in of_kind(s, Read)):
        name = read.variable.name
        if name in inputs and name not in written:
            message = f"the model of the surroundings reads `{name}`, an input that it does not write"
            report.error("E156", message, read.span, f"write it too: `{name} = choose(…);`")
    states = tuple(replace(s, stays=not s.transitions) for s in machine.states)
    marked = tuple(replace(w, driven=w.role == "input" and w.variable.name in written) for w in whiteboard)
    return replace(machine, states=states, suspend=None, model=True), marked
