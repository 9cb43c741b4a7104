"""A transition file as an arrangement: one machine, whose words stand where the file has theirs."""

from __future__ import annotations

from pathlib import Path

from llfsm_verify import DiagnosticError
from llfsm_verify.extensions.crops.transitions import (
    ANSWERS,
    COUNT,
    MACHINE,
    NONE,
    OUTCOME,
    PAUSED,
    TICKET,
    TROUBLES,
    Stage,
    Transitions,
    read,
)
from llfsm_verify.plug import (
    UNREADABLE,
    ArrangementDraft,
    Draft,
    GivenArrangement,
    InstanceDraft,
    MachineDraft,
    MappingNode,
    ProcessDraft,
    Reading,
    Scalar,
    Sequence,
    Span,
    StateDraft,
    TransitionDraft,
    VariableDraft,
    WhiteboardDraft,
    compose,
    implied,
    opened,
)

CYCLE_MS = 10
"""The thesis: about 100 times a second."""
COMMANDS = ("enter", "suspend", "resume")


def read_transition_file(given: GivenArrangement) -> Draft:
    """The draft of the arrangement; DiagnosticError: there is no such file."""
    source, data = opened(given)
    reading = Reading(Path())
    reading.add_source(source, data)
    try:
        root = compose(source, reading.diagnostics, reading.vocabulary)
    except DiagnosticError as error:
        reading.diagnostics = list(error.diagnostics)
        return reading.draft(UNREADABLE, source.name)
    found = read(reading, source, root)
    return reading.draft(UNREADABLE if found is None else _arrangement(found, root.span), source.name)


def _arrangement(found: Transitions, whole: Span) -> ArrangementDraft:
    top = Span(whole.source, whole.start, whole.start + 1)

    def word(text: object) -> Scalar:
        return implied(str(text), top)

    def listed(*texts: str) -> Sequence:
        return Sequence(tuple(map(word, texts)), top)

    tickets = word(f"0..{found.tickets - 1}")
    machine = MachineDraft(
        name=word("StateMachine"),
        variables=(VariableDraft(word(TICKET), tickets, word(len(found.stages))),),
        states=(*(_state(found, stage) for stage in found.stages), *_ends(found), _paused(found, top)),
        states_at=top,
        initial=word(found.states[found.begins]),
        suspend=word(PAUSED),
    )
    return ArrangementDraft(
        name=MACHINE if found.source.name.startswith("<") else Path(found.source.name).name.split(".")[0] or MACHINE,
        span=top,
        machines=(InstanceDraft(word(MACHINE), machine),),
        processes=(ProcessDraft(None, listed(MACHINE)),),
        types=((word("Outcome"), listed(NONE, *found.values.values())),),
        whiteboard=(
            WhiteboardDraft(word(OUTCOME), word("Outcome"), role=word("input")),
            WhiteboardDraft(word(ANSWERS), tickets, role=word("input")),
        ),
        cycle_ms=word(CYCLE_MS),
        operators=MappingNode(tuple((word(kind), listed(MACHINE)) for kind in COMMANDS), top),
    )


def _state(found: Transitions, stage: Stage) -> StateDraft:
    """An outcome ends the stay in a state. Where it leads to the same state, which is not entered again, another stay
    begins at once."""
    label, at, size = stage.label.text, stage.label.span, found.remainders
    number = found.labels[label]
    enter, leave = _next(found, number), f"{TICKET} = {TICKET} / {size} * {size} + {size - 1};"
    name = found.states[label]
    told = [move.outcome for move in stage.moves.values()]
    outcomes = [*told, *(implied(text, stage.at) for text in TROUBLES if text not in stage.moves)]
    targets = [found.target(label, outcome.text) for outcome in outcomes]
    places = [*(move.target.span for move in stage.moves.values()), *[stage.at] * (len(outcomes) - len(told))]
    transitions = tuple(
        TransitionDraft(
            implied(f"{ANSWERS} == {TICKET} && {OUTCOME} == {found.values[outcome.text]}", outcome.span),
            implied(found.states[target or ""], place),
        )
        for outcome, target, place in zip(outcomes, targets, places, strict=True)
    )
    if label in targets:
        leave = f"if (self@{name}) {enter} else {leave}"
    return StateDraft(
        implied(name, at),
        actions={"on_entry": implied(enter, at), "on_exit": implied(leave, at)},
        transitions=transitions,
    )


def _next(found: Transitions, number: int) -> str:
    """The action that makes the next ticket, of the label with this number; after the last: of none."""
    return f"{TICKET} = ({TICKET} / {found.remainders} + 1) % {COUNT} * {found.remainders} + {number};"


def _ends(found: Transitions) -> list[StateDraft]:
    """A state without transitions for each final outcome, where the file first names it."""
    moves = [move for stage in found.stages for move in stage.moves.values()]
    places = {move.target.text: move.target.span for move in reversed(moves)}
    return [StateDraft(implied(found.states[end], places.get(end, found.stages[0].at))) for end in found.ends]


def _paused(found: Transitions, top: Span) -> StateDraft:
    """What is answered before a pause does not count after it."""
    action = implied(_next(found, len(found.stages)), top)
    return StateDraft(implied(PAUSED, top), actions={"on_entry": action}, stays=implied("true", top))
