"""Properties searched in groups, against all of them in one search: verdicts, findings, runs and certificates.

Random arrangements, with properties that need much: inputs that are free, stored, overwritten or wide, samples, values
of the letter before. `python -m tests.verification.grouping CASES SEED` tells what came.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import cast

from hypothesis import HealthCheck, Phase, given, reject, seed, settings
from hypothesis import strategies as st

from llfsm_verify.analysis.certificates.making import certificate
from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.certificate import NOT_CERTIFIED, PROVED, checked
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.groups import groups_of
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.checking.verdict import Options, PropertyResult, Result, Verdict
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.engines.explicit.engine import ExplicitSession
from llfsm_verify.limits import Limits
from llfsm_verify.testing.arrangements import Document, arrangements
from llfsm_verify.testing.properties import properties, state_formulas
from llfsm_verify.verification import groups, harness
from tests.checking.replaying import again, lines_of
from tests.kripke.labels.sensors import WIDE, sensors
from tests.quick import each, spread

LIMITS = Limits(max_states=2_000, max_steps=200_000)
KINDS = (
    "free inputs", "held inputs", "snapshot: cycle", "overwritten by a plant", "shared inputs", "ended processes",
    "assumptions with inputs", "observe: cycle", "wide inputs", "samples", "holds", "violated", "faults",
)  # fmt: skip
CERTIFIED = 4
"""One of so many cases also gets a certificate."""


@dataclass(frozen=True)
class Case:
    arrangement: Arrangement
    lines: tuple[str, ...]
    most: int
    """Bits that a group may need."""

    @property
    def problem(self) -> Problem:
        return bind(self.arrangement, lines_of("\n".join(self.lines)))

    def of(self, name: str) -> str:
        """The line of a property, with the assumptions."""
        return "\n".join(line for line in self.lines if line.startswith((f"{name}:", "assume ")))


@st.composite
def documents(draw: st.DrawFn) -> Document:
    """All of the language, with one thing that is hard for groups."""
    document = draw(arrangements(max_machines=2, max_states=3))
    hard = draw(st.sampled_from(("free", "held", "snapshot", "observe", "as it is", "as it is")))
    board = cast("dict[str, dict[str, object]]", document["whiteboard"])
    single = "schedule" in document
    if hard in ("free", "held"):
        board["go"] = {"type": "bool", "role": "input", **({"changes": "cycle"} if hard == "held" else {})}
        board["more"] = {"type": "0..3", "role": "input", **({"changes": "cycle"} if hard == "held" else {})}
    elif hard == "snapshot" and single:
        document["profile"] = {"base": "llfsm", "snapshot": "cycle"}
    elif hard == "observe" and single:
        document["observe"] = "cycle"
    return document


@st.composite
def cases(draw: st.DrawFn) -> Case:
    """Several properties, most about inputs, which are wide in a fifth of the cases; now and then an assumption."""
    try:
        wide = draw(st.integers(0, 4)) == 0
        arrangement = draw(sensors(WIDE))[0] if wide else build_arrangement(draw(documents()))
        inputs = [w.variable.name for w in arrangement.whiteboard if w.role == "input"]
        atoms = [text for text in state_formulas(arrangement) if any(name in text for name in inputs)]
        about = st.sampled_from(atoms or state_formulas(arrangement))
        shape = st.sampled_from(("G (({}) -> F ({}))", "G (({}) || X ({}))", "({}) W ({})", "G !(({}) && ({}))"))
        mine = st.builds(str.format, shape, about, about)
        texts = draw(st.lists(st.one_of(mine, mine, properties(arrangement)), min_size=2, max_size=6))
        lines = [f"p{i}: {text}" for i, text in enumerate(texts)]
        if draw(st.integers(0, 3)) == 0:
            lines.append(f"assume a: {draw(st.one_of(st.builds('G F ({})'.format, about), mine))}")
        case = Case(arrangement, tuple(lines), draw(st.integers(0, 3)))
        goals_of(case.problem)
    except DiagnosticError:  # what may not stand together
        reject()
    return case


def check_both(case: Case) -> tuple[Result, Result]:
    """All in one search, and in groups."""
    options = Options(LIMITS, allow_contradiction=True)
    return (
        harness.check("explicit", ExplicitSession, case.problem, options),
        groups.check("explicit", ExplicitSession, case.problem, options, case.most),
    )


def compare(case: Case, number: int = 0) -> tuple[Result, Result]:
    """What is decided together is decided in the same way by groups; runs are performed again."""
    together, parts = check_both(case)
    assert [(p.name, p.text) for p in parts.properties] == [(p.name, p.text) for p in together.properties]
    for one, other in zip(together.properties, parts.properties, strict=True):
        assert one.verdict in (other.verdict, Verdict.UNKNOWN), (one.name, one.verdict, other.verdict, other.reason)
        if one.verdict is other.verdict:
            assert set(one.notes) == set(other.notes) or one.verdict is Verdict.VIOLATED, (one, other)
            assert facts(one) == facts(other)
        if other.trace is not None:
            assert again(case.arrangement, lines_of(case.of(other.name)), other.trace).outcome == "fails", other
    assert together.faults.verdict in (parts.faults.verdict, Verdict.UNKNOWN)
    if together.complete:
        assert parts.complete
        assert {f.site for f in together.faults.findings} == {f.site for f in parts.faults.findings}
        assert (together.escape is None) == (parts.escape is None)
        if number % CERTIFIED == 0:
            certify(case, together, parts)
    return together, parts


def facts(item: PropertyResult) -> object:
    """What makes a pass empty, where it was looked at; what other searches may word in another way is left out."""
    found = item.vacuity
    return found.looked != "no" and (found.never, found.always, {(f.kind, f.subject) for f in found.findings})


def certify(case: Case, together: Result, parts: Result) -> None:
    """The certificate of a result of groups is accepted, and lacks no more than that of one search."""
    lines = lines_of("\n".join(case.lines))
    with TemporaryDirectory() as name:
        path = Path(name) / "c.json"
        first, second = (certificate(case.arrangement, lines, result, path.parent) for result in (together, parts))
        assert {n for n, _ in second.missing} <= {n for n, _ in first.missing}
        path.write_text(second.text)
        assert checked(path, path.parent)[1] == (NOT_CERTIFIED if second.missing else PROVED)


def kinds_of(case: Case, result: Result) -> Iterator[str]:
    """What a case is an example of, if it has several groups."""
    problem, arrangement = case.problem, case.arrangement
    made = groups_of(problem, case.most)
    if len(made) < 2:
        return
    yield "several groups"
    inputs = [w for w in arrangement.whiteboard if w.role == "input"]
    named = {name for group in made for name in group.needs}
    needed = [w for w in inputs if any(w.variable.name in name for name in named)]
    yield from ("free inputs" for w in needed if w.changes == "step" and not w.driven)
    yield from ("held inputs" for w in needed if w.changes == "cycle")
    yield from ("overwritten by a plant" for w in needed if w.driven)
    yield from ("wide inputs" for w in needed if "65535" in str(w.variable.type))
    yield from ("samples" for name in named if "sampled" in name)
    if arrangement.profile.snapshot == "cycle":
        yield "snapshot: cycle"
    if arrangement.observe == "cycle":
        yield "observe: cycle"
    if any(not s.transitions for m in arrangement.machines for s in m.states):
        yield "ended processes"
    if len(named) < sum(len(group.needs) for group in made):
        yield "shared inputs"
    if problem.assumptions and any(w.variable.name in line for w in inputs for line in case.lines[-1:]):
        yield "assumptions with inputs"
    yield from (p.verdict.value for p in result.properties)
    yield from ("faults" for _ in result.faults.findings)


def run(number: int, start: int | None = None, kinds: tuple[str, ...] = ()) -> Counter[str]:
    """So many cases, and more until each of the kinds has come; `start`: drawn from that seed."""
    tally: Counter[str] = Counter()
    phases = [Phase.generate, Phase.shrink]
    amount = settings(max_examples=number, deadline=None, suppress_health_check=list(HealthCheck), phases=phases)

    def tried(case: Case) -> None:
        _, parts = compare(case, tally["cases"])
        tally.update({"cases", *kinds_of(case, parts)})

    if start is None:
        spread(tried, amount, cases(), size=10, until=each(tally, kinds))
    else:
        seed(start)(amount(given(cases())(tried)))()
    return tally


if __name__ == "__main__":
    for key, count in sorted(run(int(sys.argv[1]), int(sys.argv[2])).items()):
        sys.stdout.write(f"{count:6} {key}\n")
