"""All engines on random arrangements and properties: those that come to an answer come to the same one.

`python -m tests.verification.agreeing PAIRS SEED` asks about so many pairs and prints what they decided.
"""

from __future__ import annotations

import re
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from random import Random
from typing import cast

from hypothesis import HealthCheck, Phase, given, reject, seed, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.checking.verdict import FAULTS, NO_RUN, EarlyVerdict, Options, Result, Verdict
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.engines.explicit.options import ExplicitOptions
from llfsm_verify.engines.unrolled.options import UnrolledOptions
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.testing.arrangements import Document, arrangements
from llfsm_verify.testing.properties import properties, regular_properties
from llfsm_verify.verification.differential import compare
from llfsm_verify.verification.engines import ENGINES
from llfsm_verify.verification.verify import checker
from tests.arrangement.requests.drawn import asking
from tests.kripke.labels.sensors import NARROW, WIDE, sensors
from tests.quick import each, spread

NAMES = tuple(name for name in ENGINES if name not in ("auto", "all"))
LIMITS = Limits(max_states=2_000)
DEPTHS = {"bmc": 8, "induction": 6, "pdr": 6}
EFFORT = 400_000

Problem = tuple[Arrangement, Problem]
OURS = {
    "go": "loop", "level": "inside", "w0": "saved", "w1": "rounds", "w2": "met0", "m0": "going", "m1": "automaton0",
    "S0": "process", "S1": "monitor", "flag": "shown",
}  # fmt: skip
"""Names of the arrangements that are drawn, and words that the engines use themselves."""


def renamed(document: object) -> object:
    """With names that are words of ours."""
    if isinstance(document, dict):
        return {renamed(k): renamed(v) for k, v in document.items()}
    if isinstance(document, list):
        return [renamed(v) for v in document]
    if isinstance(document, str):
        return re.sub(r"\w+", lambda word: OURS.get(word[0], word[0]), document)
    return document


@st.composite
def composed(draw: st.DrawFn) -> Problem:
    """All of the language, with one property of any kind and now and then an assumption."""
    document = draw(arrangements(max_machines=2, max_states=3))
    if draw(st.booleans()):
        document = cast("Document", renamed(document))
    arrangement = build_arrangement(document)
    if draw(st.integers(0, 3)) == 0:
        kind, text = draw(regular_properties(arrangement))
        lines = [f"{kind} r: {text}"]
    else:
        lines = [f"p: {draw(properties(arrangement))}"]
    if draw(st.integers(0, 5)) == 0:
        lines.append(f"assume a: {draw(properties(arrangement))}")
    try:
        bound = bind(arrangement, parse_properties([Source("random.ltl", "\n".join(lines))]))
        goals_of(bound)
    except DiagnosticError:  # a rule that nothing could break
        reject()
    return arrangement, bound


@st.composite
def requested(draw: st.DrawFn) -> Problem:
    """A plant of a request, often with an operator who lets machines enter states."""
    made = asking(Random(draw(st.integers(0, 1 << 20))), small=True, properties=1)
    arrangement = build_arrangement(made.document)
    return arrangement, bind(arrangement, parse_properties([Source("random.ltl", f"p: {made.properties[0]}")]))


def problems() -> st.SearchStrategy[Problem]:
    """Half from the whole language, the others about sensors, with few values or many, or about requests."""
    whole = composed()
    return st.sampled_from((whole, whole, whole, sensors(NARROW), sensors(WIDE), requested())).flatmap(lambda s: s)


def results(problem: Problem) -> Iterator[tuple[str, Result]]:
    """What each engine says, and `explicit` without symbolic labels, within limits that are small."""
    _, bound = problem
    for name in NAMES:
        told: list[EarlyVerdict] = []
        own = (UnrolledOptions(depth=DEPTHS.get(name)),)
        result = checker(name)(bound, Options(LIMITS, effort=EFFORT, decided=told.append, own=own))
        stay(told, result)
        yield name, result
    yield "enumerated", checker("explicit")(bound, Options(LIMITS, own=(ExplicitOptions(labels=False),)))


def stay(told: Sequence[EarlyVerdict], result: Result) -> None:
    """What was told while the engine searched is what it says at its end, and nothing is left out."""
    final = {p.name: p.verdict for p in result.properties} | {FAULTS: result.faults.verdict}
    doubtful = {p.name for p in result.properties if NO_RUN in p.notes}
    assert all(early.verdict is final[early.name] for early in told), (told, final)
    assert {early.name for early in told} == {n for n, v in final.items() if v is not Verdict.UNKNOWN} - doubtful


def agree(problem: Problem, tally: Counter[str]) -> None:
    """Raises EnginesDisagree; Disagreement, where an engine's trace or proof does not stand a check."""
    found = dict(results(problem))
    compare(found)
    for name, result in found.items():
        for verdict in [*(p.verdict for p in result.properties), result.faults.verdict]:
            tally[f"{name} {verdict.value}"] += 1
    decided = [[p.verdict is not Verdict.UNKNOWN for p in r.properties] for r in found.values()]
    tally["decided by two or more"] += sum(sum(column) > 1 for column in zip(*decided, strict=True))
    tally["pairs"] += 1


def run(pairs: int, start: int | None = None, kinds: Sequence[str] = ()) -> Counter[str]:
    """So many pairs, and more until each of the kinds has come; `start`: drawn from that seed, or as the tests' profile
    says."""
    tally: Counter[str] = Counter()
    phases = [Phase.generate, Phase.shrink]
    amount = settings(max_examples=pairs, deadline=None, suppress_health_check=list(HealthCheck), phases=phases)

    def checked(problem: Problem) -> None:
        agree(problem, tally)

    if start is None:
        spread(checked, amount, problems(), size=8, until=each(tally, kinds))
    else:
        seed(start)(amount(given(problems())(checked)))()
    return tally


if __name__ == "__main__":
    for key, count in sorted(run(int(sys.argv[1]), int(sys.argv[2])).items()):
        sys.stdout.write(f"{count:6} {key}\n")
