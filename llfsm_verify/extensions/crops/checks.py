"""What is wrong with a state machine before it runs: labels, outcomes, and whether an end can be reached."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from difflib import get_close_matches

from llfsm_verify import Diagnostic
from llfsm_verify.extensions.crops.codes import ENDLESS, LABEL, TARGET, UNDECLARED, UNMAPPED
from llfsm_verify.extensions.crops.states import State
from llfsm_verify.extensions.crops.transitions import LIKENESS, TROUBLES, Stage, Transitions, near
from llfsm_verify.plug import Span


def problems(
    found: Transitions, ends: Collection[str], states: Mapping[str, State], initial: str | None
) -> Iterator[Diagnostic]:
    """Everything wrong with a machine that has these final outcomes and states. `initial`: where it begins."""
    yield from _targets(found, ends)
    yield from _labels(found, states, initial)
    given = {}
    for stage in found.stages:
        if stage.label.text in states:
            outcomes = tuple(states[stage.label.text].outcomes)
            given[stage.label.text] = outcomes
            yield from _outcomes(stage, outcomes, states[stage.label.text])
    if given.keys() == set(found.labels):
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
        yield f"there is no transition for {' and '.join(missing)} of {', '.join(labels)}: {what} the state machine"


def _targets(found: Transitions, ends: Collection[str]) -> Iterator[Diagnostic]:
    for stage in found.stages:
        for move in stage.moves:
            target = move.target.text
            if target not in found.labels and target not in ends:
                message = f"`{target[:60]}` is neither a label nor an outcome of the state machine"
                hint = near(target, (*found.labels, *ends)) or f"write a label, or `StateMachine([…, {target[:60]!r}])`"
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
    listed = ", ".join(f"`{name}`" for name in found.labels[:20])
    return Diagnostic(LABEL, message, hint=f"the labels are {listed}", file=found.source.name)


def _outcomes(stage: Stage, outcomes: tuple[str, ...], state: State) -> Iterator[Diagnostic]:
    label, what = stage.label.text[:60], type(state).__name__
    if not outcomes or isinstance(state.outcomes, str) or not all(isinstance(each, str) for each in outcomes):
        message = f"the state `{label}` does not say what it may give: {what} has no `outcomes`, or not a list of texts"
        example = tuple(move.outcome.text for move in stage.moves[:3])
        yield Diagnostic(UNDECLARED, message, stage.label.span, hint=f"write `outcomes = {example}` in the class")
        return
    told = [move.outcome.text for move in stage.moves]
    for outcome in dict.fromkeys(outcomes):
        if outcome not in told and outcome not in TROUBLES:
            message = f"the state `{label}` may give `{outcome[:60]}`, for which it has no transition"
            rest = [text for text in told if text not in outcomes]
            unused = f"{what} never gives {', '.join(f'`{text}`' for text in rest)}" if rest else None
            hint = near(outcome, rest) or f"write `{outcome[:60]}: STATE` here"
            yield Diagnostic(UNMAPPED, message, _before(stage.at), (unused,) if unused else (), hint)


def _endless(found: Transitions, given: Mapping[str, tuple[str, ...]], ends: Collection[str]) -> Iterable[Diagnostic]:
    """States from which no outcome that a state may give leads to an end, one after the other."""
    good = set(ends)
    while True:
        more = {
            label
            for label in found.labels
            if label not in good and any(found[label].target(outcome) in good for outcome in given[label])
        }
        if not more:
            break
        good |= more
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
