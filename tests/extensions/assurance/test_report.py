"""`llfsm report --assurance`: the page says what was checked, what is claimed, and what is open."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from tests.cli.running import LIGHTS, llfsm

FAULTY = "models/traffic_lights/faulty.yaml"
PROPERTIES = "properties/traffic_lights_rules.ltl"


@pytest.mark.slow
def test_what_holds_is_claimed_with_hashes_and_a_certificate(tmp_path: Path) -> None:
    certificate, page = tmp_path / "c", tmp_path / "page.md"
    done = llfsm("report", "--assurance", LIGHTS, PROPERTIES, "--certificate", str(certificate), "-o", str(page))
    assert done.returncode == 0, done.stderr
    text = page.read_text()
    assert "| both_green | `forbid [ns@GREEN && ew@GREEN]` | holds |" in text
    assert "Nothing: each property above holds." in text
    for path in (LIGHTS, PROPERTIES):
        assert f"| `{path}` | `{hashlib.sha256(Path(path).read_bytes()).hexdigest()}` |" in text
    assert hashlib.sha256(certificate.read_bytes()).hexdigest() in text
    assert "- Nothing is assumed about these inputs: `car`." in text
    assert "a cycle is 1000 ms" in text


@pytest.mark.slow
def test_what_is_open_is_said() -> None:
    done = llfsm("report", "--assurance", FAULTY, "-p", "both: G !(ns@GREEN && ew@GREEN)", "-p", "assume cars: G F car")
    assert done.returncode == 1
    assert "- both is violated." in done.stdout and "- cars: `G F car`." in done.stdout
    assert "There is no certificate" in done.stdout
    done = llfsm("report", "--assurance", LIGHTS, "-p", "a: G (ns@GREEN && ew@GREEN -> F car)")
    assert (
        done.returncode == 1
        and "fails --strict" in done.stdout
        and "- a holds, but vacuously (see above)." in done.stdout
    )


def test_a_report_has_a_kind() -> None:
    done = llfsm("report", LIGHTS)
    assert done.returncode == 2 and "say which report: --assurance" in done.stderr
