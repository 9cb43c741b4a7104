"""Mutation testing: does every property notice some small change of a machine, and every change some property?"""

from __future__ import annotations

import random
import re

import pytest

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.checking.verdict import Options, Verdict
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.verification.verify import verify
from tests.models.cases import CASES, CaseStudy
from tests.models.mutants import mutants
from tests.quick import FRESH, many

LIMIT = Options(limits=Limits(max_states=300_000))


def smaller(case: CaseStudy, text: str) -> str:
    """The text of a file with everything that `case.smaller` names replaced at once."""
    if not case.smaller:
        return text
    names = "|".join(re.escape(name) for name in case.smaller)
    return re.sub(rf"(?<!\w)(?:{names})(?!\w)", lambda found: case.smaller[found[0]], text)


@pytest.mark.long  # where the unnoticed ones are listed, a tenth of all; all in `make soak`
@pytest.mark.parametrize("case", CASES, ids=[c.model for c in CASES])
def test_mutants_are_noticed(case, tmp_path):
    for file in case.arrangement.parent.parent.glob("*/*.[yd]*"):  # one model may have machines of another
        copy = tmp_path / file.parent.name / file.name
        copy.parent.mkdir(exist_ok=True)
        copy.write_text(smaller(case, file.read_text(encoding="utf-8")), encoding="utf-8")
    text = smaller(case, case.property_file.read_text(encoding="utf-8"))
    properties = parse_properties([Source(case.property_file.name, text)])
    names = {p.name for p in properties.goals}
    tried = list(mutants(tmp_path / case.model / "arrangement.yaml"))
    chosen = random.Random(5)
    if case.unnoticed is None:
        chosen.shuffle(tried)  # until every property has noticed one
    elif not FRESH:
        tried = chosen.sample(tried, many(2 * len(tried)))
    noticed: set[str] = set()
    surviving: set[str] = set()
    for mutant in tried:
        try:
            arrangement = load_arrangement_text(mutant.text, str(tmp_path / case.model / "mutant.yaml"))
        except DiagnosticError:
            continue  # not an arrangement any more
        result = verify(arrangement, properties, LIMIT, engine="explicit")
        found = {p.name for p in result.properties if p.verdict is Verdict.VIOLATED}
        if not found and result.faults.verdict is not Verdict.VIOLATED:
            surviving.add(mutant.name)
        noticed |= found
        if case.unnoticed is None:
            properties = PropertySet(tuple(p for p in properties if p.name not in noticed))
            if not properties.goals:
                break
    if case.unnoticed is None or FRESH:
        assert noticed == names
    if case.unnoticed is not None:
        assert surviving == {mutant.name for mutant in tried} & case.unnoticed
