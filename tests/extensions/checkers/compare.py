"""Our models for NuSMV and SPIN, run by those: as many states as we count, and the same verdicts.

`python -m tests.extensions.checkers.compare N SEED` draws N random problems and N with many divisions, compares each
with what is installed, prints the counts and what differs, and ends with exit code 1 where something does.
`python -m tests.extensions.checkers.compare models SECONDS` asks NuSMV about each model of `models/`, for so many
seconds of processor time twice, and prints for how many verdicts that was too short (`open`).
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from hypothesis import HealthCheck, Phase, given, seed, settings

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.verdict import Options, Verdict
from llfsm_verify.extensions.checkers.promela.model import promela
from llfsm_verify.extensions.checkers.smv import smv
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.verification.verify import verify
from tests import outside
from tests.extensions.checkers import nusmv, spin
from tests.extensions.checkers.problems import (
    LARGEST,
    NOTHING,
    SHIPPED,
    Problem,
    agreement,
    divisions,
    explored,
    model,
    problems,
    specification,
    written,
)

Tally = Counter[str]
"""How often what came of a comparison; `different` is the mistake of one of the two."""


def nusmv_states(arrangement: Arrangement, limit: int | None = LARGEST, seconds: int = nusmv.SECONDS) -> Tally:
    """Count the states with NuSMV: one for each configuration, and one for each fault that happens."""
    found = explored(arrangement, NOTHING, limit=limit)
    if found is None:
        return Tally(["too large"])
    text = written(smv, specification(arrangement, NOTHING))
    if text is None:
        return Tally(["refused"])
    with TemporaryDirectory() as folder:
        seen = nusmv.count(Path(folder), text, seconds)
    if seen is None:
        return Tally(["out of time"])
    return Tally(["alike" if seen == (len(found) + len(found.faults), bool(found.faults)) else "different"])


def nusmv_verdicts(
    arrangement: Arrangement, lines: PropertySet, limit: int | None = LARGEST, seconds: int = nusmv.SECONDS
) -> Tally:
    """Check the formulas with NuSMV; regular properties are no part of its models."""
    result = verify(arrangement, lines, Options(Limits(max_states=limit)), engine="explicit")
    if not result.complete:
        return Tally(["too large"])
    spec = specification(arrangement, lines)
    text = written(smv, spec)
    if text is None:
        return Tally(["refused"])
    with TemporaryDirectory() as folder:
        seen = nusmv.answers(Path(folder), text, seconds)
    return agreement(result, dict(zip([name for name, _ in spec.goals], seen, strict=True)))


def spin_states(arrangement: Arrangement, limit: int | None = LARGEST, *, keep_all_bits: bool = False) -> Tally:
    """Count the states with SPIN."""
    found = explored(arrangement, NOTHING, keep_all_bits=keep_all_bits, limit=limit)
    if found is None:
        return Tally(["too large"])
    text = written(promela, specification(arrangement, NOTHING, keep_all_bits=keep_all_bits))
    if text is None:
        return Tally(["refused"])
    with TemporaryDirectory() as folder:
        seen = spin.count(Path(folder), text)
    return Tally(["alike" if seen == (len(found), bool(found.faults)) else "different"])


def spin_verdicts(arrangement: Arrangement, lines: PropertySet, limit: int | None = LARGEST) -> Tally:
    """Check the formulas and the faults with SPIN."""
    result = verify(arrangement, lines, Options(Limits(max_states=limit)), engine="explicit")
    if not result.complete:
        return Tally(["too large"])
    spec = specification(arrangement, lines)
    text = written(promela, spec)
    if text is None:
        return Tally(["refused"])
    names = [name for name, _ in spec.goals]
    with TemporaryDirectory() as folder:
        seen = spin.answers(Path(folder), text, [*names, *(["fault_free"] if "fault_free" in text else [])])
    faults = result.faults.verdict is Verdict.VIOLATED
    tally = Tally(["alike" if seen.pop("fault_free", True) is not faults else "different"])
    return tally + agreement(result, seen)


# ---------------------------------------------------------------- at length


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the counts. The exit code is 1 where something differs, and 2 where nothing could be compared."""
    first, second = sys.argv[1:] if arguments is None else arguments
    if first == "models":
        return _models(int(second))
    number, start = int(first), int(second)
    ways: dict[str, Callable[[Problem], Tally]] = {}
    if outside.missing("nusmv") is None:
        ways |= {"NuSMV states": lambda p: nusmv_states(p[0]), "NuSMV verdicts": lambda p: nusmv_verdicts(*p)}
    if outside.missing("spin") is None and outside.missing("gcc") is None:
        ways |= {"SPIN states": lambda p: spin_states(p[0]), "SPIN verdicts": lambda p: spin_verdicts(*p)}
    tallies = {way: Tally() for way in ways}
    seen = 0

    def compare(drawn: Problem) -> None:
        nonlocal seen
        seen += 1
        for way, compared in ways.items():
            try:
                tally = compared(drawn)
                why = ""
            except AssertionError as error:  # the other tool failed
                tally, why = Tally(["different"]), f"{error}\n"
            tallies[way] += tally
            if tally["different"]:
                print(f"DIFFERENT, {way}:\n{why}{drawn[0]}\n{[p.text for p in drawn[1].properties]}\n", flush=True)

    health = [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large]
    health += [HealthCheck.large_base_example, HealthCheck.nested_given]
    for strategy in (problems(), divisions()):
        at_length = settings(
            max_examples=number, database=None, deadline=None, phases=[Phase.generate], suppress_health_check=health
        )
        seed(start)(at_length(given(strategy)(compare)))()
        _say(seen, tallies)
    if not any(tally["alike"] for tally in tallies.values()):
        print("nothing was compared")
        return 2
    return int(any(tally["different"] for tally in tallies.values()))


def _models(seconds: int) -> int:
    tallies = {"NuSMV states": Tally(), "NuSMV verdicts": Tally()}
    for path in SHIPPED:
        arrangement, lines = model(path)
        states = nusmv_states(arrangement, None, seconds)
        verdicts = nusmv_verdicts(arrangement, lines, None, seconds)
        tallies["NuSMV states"] += states
        tallies["NuSMV verdicts"] += verdicts
        print(path, *(", ".join(f"{n} {what}" for what, n in sorted(t.items())) for t in (states, verdicts)), sep=" | ")
    _say(len(SHIPPED), tallies)
    return int(any(tally["different"] for tally in tallies.values()))


def _say(seen: int, tallies: Mapping[str, Tally]) -> None:
    """The counts of the first `seen` problems."""
    print(f"{seen} problems")
    for way, tally in tallies.items():
        print(f"{way:15}", ", ".join(f"{n} {what}" for what, n in sorted(tally.items())), flush=True)


if __name__ == "__main__":
    sys.exit(main())
