"""Certificates of random arrangements and properties: what is made is accepted, and a flipped verdict never is."""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import HealthCheck, event, given, reject, settings
from hypothesis import strategies as st

from llfsm_verify.analysis.certificates.making import certificate
from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.certificate import NOT_CERTIFIED, PROVED, REJECTED, checked
from llfsm_verify.checking.verdict import Options, Verdict
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.testing.arrangements import arrangements
from llfsm_verify.testing.properties import atoms, properties, regular_properties
from llfsm_verify.verification.verify import verify
from tests.analysis.certificates.changing import signed
from tests.quick import examples, many

LIMITS = Limits(max_states=2_000)
SLOW = [HealthCheck.too_slow, HealthCheck.data_too_large]
TIMED = ("G (({0}) -> F[<=20ms] ({1}))", "F[<=25ms] ({0})", "({0}) U[<=10ms] ({1})", "G[<=15ms] ({0})")
BETWEEN = ("G (({0}) -> F[10ms:20ms] ({1}))", "G (({0}) -> G[10ms:15ms] ({1}))", "({0}) U[>=10ms] ({1})")
PAST = ("G (({0}) -> O ({1}))", "G (({0}) S ({1}))", "F (H ({0}))", "G (({0}) -> Y ({1}))")


@st.composite
def problems(draw: st.DrawFn) -> tuple[Arrangement, PropertySet]:
    """An arrangement with properties of all kinds, in half of the cases with an assumption."""
    arrangement = build_arrangement(draw(arrangements(max_machines=3, max_states=3)))
    atom = atoms(arrangement)
    lines = [f"p: {draw(properties(arrangement))}"]
    kind = draw(st.sampled_from(("ltl", "regular", "past", "timed")))
    if kind == "regular":
        what, text = draw(regular_properties(arrangement))
        lines.append(f"{what} r: {text}")
    elif kind == "past":
        lines.append(f"s: {draw(st.sampled_from(PAST)).format(draw(atom), draw(atom))}")
    elif kind == "timed" and arrangement.cycle_ms is not None and len(arrangement.processes) == 1:
        lines.append(f"t: {draw(st.sampled_from(TIMED + BETWEEN)).format(draw(atom), draw(atom))}")
    if draw(st.booleans()):
        lines.append(f"assume a: {draw(properties(arrangement))}")
    features = frozenset({"regular", "past", "time"})
    try:
        return arrangement, parse_properties([Source("random.ltl", "\n".join(lines))], "llfsm", features)
    except DiagnosticError:
        reject()  # a void regular property


def certified(problem: tuple[Arrangement, PropertySet]) -> None:
    arrangement, lines = problem
    try:
        result = verify(arrangement, lines, Options(LIMITS, allow_contradiction=True), engine="explicit")
    except DiagnosticError:
        event("void")
        return
    with TemporaryDirectory() as name:
        path = Path(name) / "c.json"
        made = certificate(arrangement, lines, result, path.parent)
        path.write_text(made.text)
        said, code = checked(path, path.parent)
        assert code == (NOT_CERTIFIED if made.missing else PROVED), said
        known = {p.name: p.verdict for p in result.properties} | {"faults": result.faults.verdict}
        missing = {n for n, _ in made.missing}
        assert missing >= {n for n, v in known.items() if v is Verdict.UNKNOWN}
        if result.complete:
            assert not missing
        for verdict in set(known.values()):
            event(verdict.value)
        document = json.loads(made.text)
        for item in (*document["properties"], document["faults"]):
            if item["verdict"] != "unknown" and item.get("reason") is None:
                kept = item["verdict"]
                item["verdict"] = "violated" if kept == "holds" else "holds"
                path.write_text(signed(document))
                assert checked(path, path.parent)[1] == REJECTED, item
                item["verdict"] = kept


@pytest.mark.slow
@settings(max_examples=examples(25), suppress_health_check=SLOW)
@given(problems())
def test_what_is_made_is_accepted(problem: tuple[Arrangement, PropertySet]) -> None:
    certified(problem)


@pytest.mark.long
@settings(max_examples=many(1500), suppress_health_check=SLOW)
@given(problems())
def test_what_is_made_is_accepted_at_length(problem: tuple[Arrangement, PropertySet]) -> None:
    certified(problem)
