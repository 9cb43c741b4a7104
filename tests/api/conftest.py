from __future__ import annotations

import pytest

import llfsm_verify as lv

BOTH = "both: G !(ns@GREEN && ew@GREEN)"


@pytest.fixture(scope="session")
def lights() -> lv.Model:
    return lv.load("models/traffic_lights/arrangement.yaml")


@pytest.fixture(scope="session")
def faulty() -> lv.Model:
    return lv.load("models/traffic_lights/faulty.yaml")


@pytest.fixture(scope="session")
def result(faulty: lv.Model) -> lv.CheckResult:
    return faulty.check([BOTH, "served: G F ns@GREEN", "dead: G (ns@GREEN && ns@RED -> F car)"])
