"""Fixtures: small arrangements and their verdicts, by the explicit engine alone."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.checking.verdict import Options, Result
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.verification.verify import verify

Check = Callable[..., Result]


@pytest.fixture
def check() -> Check:
    """`check(arrangement text, property text, options) -> Result`, by the explicit engine alone."""

    def run(text: str, props: str = "", options: Options | None = None) -> Result:
        lines = parse_properties([Source("test.ltl", props)])
        return verify(load_arrangement_text(text, "test.yaml"), lines, options, "explicit")

    return run


@pytest.fixture
def verdicts(check: Check) -> Callable[..., dict[str, str]]:
    """The verdicts by property name, `faults` included."""

    def run(text: str, props: str = "", options: Options | None = None) -> dict[str, str]:
        result = check(text, props, options)
        found = {p.name: p.verdict.value for p in result.properties}
        return {**found, "faults": result.faults.verdict.value}

    return run
