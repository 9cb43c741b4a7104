"""What is wrong with a state machine before it runs: labels, outcomes, and whether an end can be reached."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from difflib import get_close_matches

from llfsm_verify import Diagnostic
from llfsm_verify.extensions.crops.codes import ENDLESS, LABEL, TARGET, UNDECLARED, UNMAPPED
from llfsm_verify.extensions.crops.states import State
from llfsm_verify.extensions.crops.transitions import LIKENESS, TROUBLES, Meant, Stage, Transitions, near
from llfsm_verify.plug import Span

LISTED = 20
"""Labels that a message names."""


def problems(
    found: Transitions, ends: Collection[str], states: Mapping[str, State], initial: str | None
) -> Iterator[Diagnostic]:
    """Everything wrong with a machine that has these final outcomes and states. `initial`: where it begins."""
    yield from _targets(found, ends)
    yield from _labels(found, states, initial)
    given = {stage.label.text: states[stage.label.text] for stage in found.stages if stage.label.text in states}
    for label, state in given.items():
        yield from _outcomes(found[label], state)
    if len(given) == len(found.stages):
        yield from _endless(found, given, ends)


def surprises(found: Transitions) -> Iterator[str]:
    """What a machine may come to that its file does not say."""
    silent: dict[tuple[str, ...], list[str]] = {}
    for label in found.labels:
        missing = tuple(f"`{trouble}`" for trouble in TROUBLES if found[label].target(trouble) is None)
        if missing:
            silent.setdefault(missing, []).append(f"`{label}`")
    for missing, labels in silent.items():
        what = "it ends" if len(missing) == 1 else "they end"
        of = ", ".join(labels[:LISTED]) + (f" and {len(labels) - LISTED} more" if len(labels) > LISTED else "")
        yield f"there is no transition for {' and '.join(missing)} of {of}: {what} the state machine"


def _targets(found: Transitions, ends: Collection[str]) -> Iterator[Diagnostic]:
    known, last = Meant(found, (*found.labels, *ends)), set(ends)
    for stage in found.stages:
        for move in stage.moves.values():
            target = move.target.text
            if target not in found.labels and target not in last:
                message = f"`{target[:60]}` is neither a label nor an outcome of the state machine"
                hint = known.by(target) or f"write a label, or `StateMachine([…, {target[:60]!r}])`"
                yield Diagnostic(TARGET, message, move.target.span, hint=hint)
    for end in ends:
        if end in found.labels:
            message = f"`{end[:60]}` is a label, and an outcome of the state machine"
            yield Diagnostic(TARGET, message, found[end].label.span, hint="give one of them another name")


def _labels(found: Transitions, states: Mapping[str, State], initial: str | None) -> Iterator[Diagnostic]:
    named = [(f"`add({label!r}, …)`", label) for label in states]
    for what, label in [*named, *([] if initial is None else [(f"`execute({initial!r})`", initial)])]:
        if label not in found.labels:
            yield _unknown(found, what, label)
    for stage in found.stages:
        label = stage.label.text
        if label not in states:
            message = f"the state `{label[:60]}` has nothing that is executed"
            yield Diagnostic(LABEL, message, stage.label.span, hint=f"call `add({label!r}, STATE)`")


def _unknown(found: Transitions, what: str, label: str) -> Diagnostic:
    message = f"{what} names no label of the transition file"
    close = get_close_matches(label[:100], found.labels, 1, LIKENESS)
    if close:
        return Diagnostic(LABEL, message, found[close[0]].label.span, hint=f"write `{close[0]}`")
    listed = ", ".join(f"`{name}`" for name in list(found.labels)[:LISTED])
    return Diagnostic(LABEL, message, hint=f"the labels are {listed}", file=found.source.name)


def outcomes_of(state: State) -> Collection[str]:
    """What a state says that it may give, in its order; empty: it says nothing, or no texts."""
    said: object = state.outcomes
    if isinstance(said, str) or not isinstance(said, Iterable):
        return ()
    listed = dict.fromkeys(each if isinstance(each, str) else None for each in said)
    return () if None in listed else tuple(str.__str__(each) for each in listed if each is not None)


def _outcomes(stage: Stage, state: State) -> Iterator[Diagnostic]:
    label, what, outcomes = stage.label.text[:60], type(state).__name__, outcomes_of(state)
    if not outcomes:
        message = f"the state `{label}` does not say what it may give: {what} has no `outcomes`, or not a list of texts"
        example = tuple(stage.moves)[:3]
        yield Diagnostic(UNDECLARED, message, stage.label.span, hint=f"write `outcomes = {example}` in the class")
        return
    rest = [text for text in stage.moves if text not in set(outcomes)]
    for outcome in outcomes:
        if outcome not in stage.moves and outcome not in TROUBLES:
            message = f"the state `{label}` may give `{outcome[:60]}`, for which it has no transition"
            unused = f"{what} never gives {', '.join(f'`{text}`' for text in rest)}" if rest else None
            hint = near(outcome, rest) or f"write `{outcome[:60]}: STATE` here"
            yield Diagnostic(UNMAPPED, message, _before(stage.at), (unused,) if unused else (), hint)


def _endless(found: Transitions, states: Mapping[str, State], ends: Collection[str]) -> Iterator[Diagnostic]:
    """States from which no outcome that a state may give leads to an end, one after the other."""
    before: dict[str, list[str]] = {}
    for label, state in states.items():
        for outcome in outcomes_of(state):
            before.setdefault(found[label].target(outcome) or "", []).append(label)
    good, left = set(ends), list(ends)
    while left:
        more = set(before.get(left.pop(), ())) - good
        good |= more
        left += more
    for stage in found.stages:
        if stage.label.text not in good:
            message = f"from `{stage.label.text[:60]}`, the state machine never comes to an end"
            hint = "write a transition that leads to one of its outcomes: " + ", ".join(f"`{end}`" for end in ends)
            yield Diagnostic(ENDLESS, message, stage.label.span, hint=hint)


def _before(span: Span) -> Span:
    """The line where transitions are listed, up to its end."""
    text = span.source.text
    end = text.find("\n", span.start)
    return Span(span.source, span.start, max(span.start + 1, min(span.end, len(text) if end < 0 else end)))
