"""Every case study: verdicts, faulty versions, premises that happen, replayed traces, both executors."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from llfsm_verify.arrangement.loader import load_arrangement
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.verdict import Result, Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.formula import Formula, to_text
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.logic.reading import read_source
from llfsm_verify.report.saving import save_traces
from llfsm_verify.semantics.letters import TimePasses
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.verification.verify import verify
from tests.backends.native.test_native_random import compare
from tests.cli.running import llfsm
from tests.models.cases import CASES, CaseStudy
from tests.oracle.direct import Direct
from tests.oracle.lockstep import Lockstep
from tests.quick import share

TABLE = Path("models/README.md")

LARGE = ("batman",)
"""The models of which each version takes many seconds."""
FAULTY = [
    pytest.param(
        case, version, id=f"{case.model}-{version}", marks=pytest.mark.long if case.model in LARGE else pytest.mark.slow
    )
    for case in CASES
    for version in case.violated
]

each = pytest.mark.parametrize("case", CASES, ids=[c.model for c in CASES])
each_slow = pytest.mark.parametrize(
    "case",
    [pytest.param(c, id=c.model, marks=pytest.mark.long if c.model in LARGE else pytest.mark.slow) for c in CASES],
)
each_faulty = pytest.mark.parametrize(("case", "version"), FAULTY)


def properties_of(case: CaseStudy) -> PropertySet:
    return parse_properties([read_source(case.property_file)])


def violated(result: Result) -> set[str]:
    found = {p.name for p in result.properties if p.verdict is Verdict.VIOLATED}
    return found | ({"faults"} if result.faults.verdict is Verdict.VIOLATED else set())


@each_slow
def test_everything_holds(case):
    result = verify(load_arrangement(case.arrangement), properties_of(case))
    assert {p.name: p.verdict for p in result.properties if p.verdict is not Verdict.HOLDS} == {}
    assert result.faults.verdict is Verdict.HOLDS and result.complete
    assert (result.exploration.states, len(result.properties)) == (case.configurations, case.properties)


@each_faulty
def test_faulty_versions_violate_what_they_are_about(case, version, tmp_path):
    path = case.arrangement.with_name(f"{version}.yaml")
    arrangement, properties = load_arrangement(path), properties_of(case)
    result = verify(arrangement, properties)
    assert violated(result) == case.violated[version] and result.complete
    assert all(p.verdict is not Verdict.UNKNOWN for p in result.properties)
    # Every counterexample happens again, by the command that users have for it.
    saved = save_traces(result, arrangement, properties, tmp_path)
    assert len(saved) >= len(case.violated[version])
    done = llfsm("replay", *map(str, saved), "--quiet")
    assert (done.returncode, done.stdout.count("the failure still happens")) == (0, len(saved)), done.stdout


@each
def test_there_is_no_faulty_version_without_a_test(case):
    files = {p.stem for p in case.arrangement.parent.glob("faulty*.yaml") if not p.name.endswith(".machine.yaml")}
    assert files == set(case.violated) and files


def premises(formula: Formula) -> Iterator[Formula]:
    """What must happen for `premise -> …` to say anything, at the top or behind `G`, in every part of a conjunction."""
    if formula.op == "and":
        for part in formula.args:
            yield from premises(part)
    elif formula.op == "implies":
        yield formula.args[0]
    elif formula.op == "G":
        yield from premises(formula.args[0])


@each_slow
def test_no_property_is_true_for_want_of_a_case(case):
    """The premise of each implication happens, under the assumptions: `G !premise` is violated."""
    properties = properties_of(case)
    lines = [f"assume {a.name}: {a.text}" for a in properties.assumptions]
    names: dict[str, str] = {}
    for goal in properties.goals:
        for number, premise in enumerate(premises(goal.formula) if goal.formula else ()):  # regular ones have none
            names[f"{goal.name}_{number}"] = goal.name
            lines.append(f"{goal.name}_{number}: G !({to_text(premise)})")
    assert len(set(names.values())) >= len(properties.goals) / 2
    result = verify(load_arrangement(case.arrangement), parse_properties([Source("premises.ltl", "\n".join(lines))]))
    assert {names[p.name] for p in result.properties if p.verdict is not Verdict.VIOLATED} == set()


@each_slow
def test_native_and_reference_executor_agree(case):
    """Along random walks of the model and of its faulty versions."""
    chance = random.Random(5)
    versions = [version for number, version in enumerate(case.violated) if share(number, 3)]
    for path in (case.arrangement, *(case.arrangement.with_name(f"{v}.yaml") for v in versions)):
        program = lower(load_arrangement(path))
        compare(program, NativeProgram(program, events=True), [chance.randrange(1 << 16) for _ in range(60)])


@each_slow
def test_the_lowering_agrees_with_the_page_of_the_semantics(case):
    """The direct interpreter, which knows nothing of step programs, goes the same ways and sees the same letters."""
    arrangement = load_arrangement(case.arrangement)
    atoms = [a for a in bind(arrangement, properties_of(case)).atoms if not isinstance(a.expression, TimePasses)]
    direct = Direct(arrangement, {atom.name: atom.expression for atom in atoms})
    walked = Lockstep(arrangement, lower(arrangement, atoms, keep_all_bits=True), direct).walk(case.walked)
    assert walked.configurations == case.walked and walked.faults == walked.overflows == 0


ROW = re.compile(r"^\| \[[^]]+\]\((\w+)/README\.md\) \| ([\d,]+) \| (\d+) \| [\d.]+ \|", re.MULTILINE)
"""Model, configurations, properties, seconds: the seconds are of one computer on one day."""


def test_the_table_of_sizes_is_up_to_date():
    """`python -m benchmarks.models` prints it anew."""
    found = {model: (int(c.replace(",", "")), int(p)) for model, c, p in ROW.findall(TABLE.read_text(encoding="utf-8"))}
    assert {c.model: found.get(c.model) for c in CASES} == {c.model: (c.configurations, c.properties) for c in CASES}


@each
def test_the_page_names_the_faulty_versions_and_what_they_violate(case):
    page = case.arrangement.with_name("README.md").read_text(encoding="utf-8")
    for version, names in case.violated.items():
        assert f"`{version}.yaml`" in page
        rows = [line for line in page.splitlines() if line.startswith(f"| `{version}.yaml`")]
        assert len(rows) == 1 and all(f"`{name}`" in rows[0] for name in names), version
