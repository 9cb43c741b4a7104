"""Check an arrangement against its properties with one of the engines."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import replace
from functools import partial
from typing import Any, cast

from llfsm_verify.arrangement.ending import ending_notes
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.doubts import doubts
from llfsm_verify.checking.edges import with_edges_as_past
from llfsm_verify.checking.engine import Start
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.checking.verdict import NO_RUN, EarlyVerdict, Options, PropertyResult, Result, VacuityFinding, Verdict
from llfsm_verify.diagnostics import telling
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import Observe
from llfsm_verify.logic.properties import Property, PropertySet
from llfsm_verify.verification import groups, harness
from llfsm_verify.verification.engines import DEFAULT_ENGINE, ENGINES

Check = Callable[[Problem, Options], Result]


class _Raised(BaseException):
    """What a function of the caller has raised: past all that engines catch, it has nothing to do with them."""

    def __init__(self, error: Exception) -> None:
        self.error = error


def checker(name: str) -> Check:
    """The engine of a name, in the harness. Unregistered: there is none."""
    entry, found = ENGINES.entry(name), ENGINES.load(name)
    if entry.asks_others:
        return cast(Check, found)
    return partial(groups.check if entry.in_groups else harness.check, name, cast(Start, found))


def verify(
    arrangement: Arrangement, properties: PropertySet, options: Options | None = None, engine: str = DEFAULT_ENGINE
) -> Result:
    """Verdicts for the faults of `arrangement` and for every property.

    Raises DiagnosticError when a property does not fit the arrangement, ValueError for an unknown engine (naming those
    there are), Disagreement when a check of a result fails, and what the functions in the options raise.
    """
    problem, options = with_edges_as_past(bind(arrangement, properties)), options or Options()
    doubted = {line.name for line in problem.properties if line.doubt is not None} if options.strict else set[str]()
    options = _telling_once(options, doubted - options.accepted)
    calls = {name: getattr(options, name) for name in ("progress", "decided", "tell")}
    passing: dict[str, Any] = {name: _passing(call) for name, call in calls.items() if call is not None}
    options = replace(options, **passing)
    try:
        with telling(options.tell, quiet=options.quiet):
            result = checker(engine)(problem, options)
    except _Raised as raised:
        raise raised.error from None
    if not options.allow_contradiction:
        result = without_contradicted(result)
    return replace(
        result,
        properties=tuple(
            _doubted(item, line) for item, line in zip(result.properties, problem.properties, strict=True)
        ),
        notes=(*ending_notes(arrangement), *_never_true(problem)),
        warnings=doubts(arrangement, properties),
    )


def _doubted(item: PropertyResult, line: Property) -> PropertyResult:
    """What holds at the initial configuration only is a finding, as what makes other passes empty."""
    if line.doubt is None or item.verdict is not Verdict.HOLDS:
        return item
    finding = VacuityFinding("initial", line.doubt.message, item.text)
    return replace(item, vacuity=replace(item.vacuity, findings=(finding, *item.vacuity.findings)))


def _passing(call: Callable[[Any], None]) -> Callable[[Any], None]:
    """The same function, whose errors no engine takes for its own."""

    def called(said: Any) -> None:
        try:
            call(said)
        except Exception as error:  # noqa: BLE001 - whatever a function of others raises, its caller gets
            raise _Raised(error) from None

    return called


def _telling_once(options: Options, doubted: Collection[str]) -> Options:
    """The same, where several engines, or one in several ways, may come to the same verdict, and passes of `doubted`
    properties are failures.
    """
    tell, told = options.decided, set[str]()
    if tell is None:
        return options

    def once(known: EarlyVerdict) -> None:
        if known.name not in told and not (known.verdict is Verdict.HOLDS and known.name in doubted):
            told.add(known.name)
            tell(known)

    return replace(options, decided=once)


def _never_true(problem: Problem) -> Iterator[str]:
    """The questions about faults and refusals that no run answers with yes, in sentences without their full stops."""
    access = problem.arrangement.access
    for question in dict.fromkeys(
        (node.kind, node.machine) for atom in problem.atoms for node in of_kind(atom.expression, Observe)
    ):
        kind, machine = question[0], problem.arrangement.machine(question[1]) if question[1] else None
        if machine is not None and kind == "faulted" and machine.on_fault == "end":
            yield f"`faulted({machine.name})` is never true: `{machine.name}` has no `on_fault: unload`"
        if machine is not None and kind == "refused" and (access is None or not machine.has_refusals(access)):
            yield f"`refused({machine.name})` is never true: `{machine.name}` does nothing that it may not"


# ---- What holds only because no run satisfies the assumptions is unknown (docs/decisions/0016-vacuity.md)


def without_contradicted(result: Result) -> Result:
    """The same, with the verdict *unknown* for each property that holds only since no run satisfies the assumptions."""
    return replace(result, properties=tuple(map(_judged, result.properties)))


def _judged(item: PropertyResult) -> PropertyResult:
    if item.verdict is not Verdict.HOLDS or NO_RUN not in item.notes:
        return item
    said = (finding.message for finding in item.vacuity.findings if finding.kind == "assumptions")
    notes = tuple(note for note in item.notes if note != NO_RUN)
    return replace(item, verdict=Verdict.UNKNOWN, reason=next(said, NO_RUN), notes=notes, proofs=())
