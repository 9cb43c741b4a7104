"""Results and traces made by hand, with everything in them that a report can show."""

from __future__ import annotations

from dataclasses import replace

from llfsm_verify.checking.trace import Cause, Change, Sampled, Trace, TraceStep
from llfsm_verify.checking.verdict import (
    Exploration,
    FaultFinding,
    FaultResult,
    PropertyResult,
    Result,
    Vacuity,
    VacuityFinding,
    Verdict,
)
from llfsm_verify.diagnostics import Source, Span
from llfsm_verify.kripke.labels.sizes import InputNote
from llfsm_verify.program.program import FaultSite

SOURCE = Source("props.ltl", "good: G a\nbad: G !(x == 3)\nopen: F b\n")


def span(line: int) -> Span:
    start = sum(len(text) + 1 for text in SOURCE.text.split("\n")[: line - 1])
    return Span(SOURCE, start, start + 3)


def step(
    machine: str = "m",
    state: str = "A",
    fired: str | None = None,
    sampled: tuple[Sampled, ...] = (),
    changes: tuple[Change, ...] = (),
    atoms: tuple[tuple[str, bool], ...] = (("x == 3", False),),
) -> TraceStep:
    return TraceStep("main", machine, state, fired, sampled, changes, False, True, atoms)


def sampled(text: str) -> Sampled:
    return Sampled("car", "car", int(text == "true"), text)


PATH = Trace(
    (("x", "0"), ("m", "A")),
    (("mode", 2),),
    (("x == 3", False),),
    (
        step(sampled=(sampled("false"),)),
        *[step("n" if i % 2 else "m", "A", sampled=(sampled("false"),) if i % 2 == 0 else ()) for i in range(6)],
        step(
            fired="A -> B when car", sampled=(sampled("true"),), changes=(Change("m", "A", "B"), Change("x", "0", "3"))
        ),
        step(state="B", atoms=(("x == 3", True),)),
    ),
    None,
)

LASSO = Trace(
    (("x", "0"),),
    (),
    (("b", False),),
    (
        step(atoms=(("b", False),), changes=(Change("x", "0", "1"),)),
        step(atoms=(("b", False),), changes=(Change("x", "1", "2"),)),
        TraceStep(None, None, "", None, (), (), False, True, (("b", False),)),
    ),
    1,
)

SITE = FaultSite("F001", "`x` would become 4, outside 0..3", span(2))
FAULT = Trace((("x", "3"),), (), (), (step(changes=(Change("x", "3", "2"),), atoms=()), step(atoms=())), None, SITE)

GOOD = PropertyResult("good", "ltl", "G a", span(1), Verdict.HOLDS, "explicit", None, notes=("it is trivially true",))
BAD = PropertyResult("bad", "ltl", "G !(x == 3)", span(2), Verdict.VIOLATED, "explicit", PATH)
LOOPING = PropertyResult("looping", "ltl", "F b", span(3), Verdict.VIOLATED, "explicit", LASSO)
OPEN = PropertyResult(
    "open", "ltl", "F b", span(3), Verdict.UNKNOWN, "explicit", None, "the time limit of 1 s was reached"
)

NO_FAULT = FaultResult(Verdict.HOLDS, ())
FAULTS = FaultResult(Verdict.VIOLATED, (FaultFinding(SITE, FAULT),))
UNKNOWN_FAULTS = FaultResult(Verdict.UNKNOWN, (), "the search did not reach every configuration")


def result(
    *properties: PropertyResult, faults: FaultResult = NO_FAULT, complete: bool = True, interrupted: bool = False
) -> Result:
    return Result(
        "lights", "lights.yaml", "explicit", complete, Exploration(complete, 1234, 5678), 0.25, ("fair",), properties,
        faults, interrupted,
    )  # fmt: skip


CAUSE = Cause("x == 3", True, (("x", "3"),))
MARKED = replace(
    PATH,
    steps=(*PATH.steps[:-1], replace(PATH.steps[-1], causes=(CAUSE,))),
    because="`x == 3` is true at step 9",
    failed_at=9,
)
"""PATH with the reason for its failure."""
ANTECEDENT = VacuityFinding("antecedent", "`a` is never true in any run: `G !a` also holds", "a", "G !a")
EMPTY = replace(GOOD, name="empty", notes=(), vacuity=Vacuity((ANTECEDENT,), "all", None, ("a",), ("b",)))
KNOWN = replace(EMPTY, name="known", vacuity=replace(EMPTY.vacuity, accepted=True))
UNSEEN = replace(GOOD, name="unseen", notes=(), vacuity=Vacuity((), "no", "not checked for vacuity: a limit"))
SHOWN = replace(GOOD, name="shown", witness=replace(PATH, witness=True), vacuity=Vacuity((), "all"))
TWICE = replace(BAD, name="twice", trace=MARKED, more=(MARKED,), only="there is no third")
STRICT = replace(result(EMPTY, KNOWN, UNSEEN, SHOWN, TWICE), strict=True, asked_vacuity=True)
LEFT = VacuityFinding("escape", "after step 9 of a run no continuation meets the assumptions", "fair")
ESCAPING = tuple(replace(GOOD, name=n, notes=(), vacuity=Vacuity((LEFT,), "all")) for n in ("one", "two"))
ESCAPED = replace(result(*ESCAPING, BAD), strict=True, asked_vacuity=True, escape=replace(PATH, escape=True))

RESUMED = replace(
    result(EMPTY, KNOWN, UNSEEN, OPEN),
    strict=True,
    asked_vacuity=True,
    exploration=Exploration(
        complete=True,
        states=1234,
        transitions=5678,
        inputs=(
            InputNote(("far",), 65536, 4),
            InputNote(("a", "b"), 1200, 1),
            InputNote(("wide",), 1024, None, "the action adds it up"),
        ),
        left_out=("m.k", "n"),
        longest=12,
        resumed_from="old.ckpt",
    ),
)

ALL = result(GOOD, BAD, LOOPING, OPEN, faults=FAULTS)
EVERY = {
    "everything": ALL,
    "holds": result(GOOD),
    "nothing": result(),
    "cut short": result(OPEN, faults=UNKNOWN_FAULTS, complete=False, interrupted=True),
    "strict": STRICT,
    "escaped": ESCAPED,
    "vacuity": replace(STRICT, strict=False),
    "resumed": RESUMED,
    "holds, faults unknown": result(GOOD, faults=UNKNOWN_FAULTS, complete=False),
}
