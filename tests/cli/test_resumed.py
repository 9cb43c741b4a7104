"""What holds by a search that went on from a checkpoint says so, in every format, and is no pass under `--strict`."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from tests.cli.running import FAULTY, llfsm
from tests.engines.explicit.forging import Check, Forged

FAILS = "fails --strict: what the checkpoint says was not searched again"


@pytest.fixture
def lying(tmp_path: Path) -> Check:
    """A check that is violated, with a checkpoint that says otherwise: there is one configuration, with a step to
    itself."""
    (tmp_path / "both.ltl").write_text("both: G !(ns@GREEN && ew@GREEN)\n")
    check = Check((FAULTY, str(tmp_path / "both.ltl")), tmp_path / "g.ckpt", 3)
    saved = check.saved()
    numbers = saved.header["numbers"]
    keys, parents, _, targets, labels, letters = saved.sections
    small = {"nodes": 1, "expanded": 1, "letters": 1, "edges": 1, "transitions": 1, "level_end": 1, "depth": 0}
    sections = (
        keys[: len(keys) // numbers["nodes"]], parents[:4], bytes(8) + b"\1" + bytes(7), bytes(len(targets[:4])),
        bytes(len(labels[:4])), letters[: len(letters) // numbers["letters"]],
    )  # fmt: skip
    Forged({**saved.header, "numbers": {**numbers, **small}}, sections).write(check.path)
    return check


def test_text(lying: Check) -> None:
    done = llfsm(*lying.run("--resume", "-q"))
    assert done.returncode == 0, done.stderr
    held = f"holds (resumed from {lying.path})"
    assert done.stdout.splitlines() == [
        f"{held}  both  G !(ns@GREEN && ew@GREEN)",
        f"{held}  faults  no run ends in a fault",
    ]
    assert f"complete (resumed from {lying.path})," in llfsm(*lying.run("--resume")).stdout


def test_strict(lying: Check) -> None:
    for quiet in ([], ["-q"]):
        done = llfsm(*lying.run("--resume", "--strict", *quiet))
        assert done.returncode == 1, done.stderr
        assert done.stdout.count(FAILS) == 2


def test_json(lying: Check) -> None:
    for strict, code in (([], 0), (["--strict"], 1)):
        done = llfsm(*lying.run("--resume", "--format", "json", *strict))
        result = json.loads(done.stdout)
        assert (done.returncode, result["exit_code"]) == (code, code)
        assert result["resumed_from"] == str(lying.path)
        assert result["properties"][0]["words"] == f"holds (resumed from {lying.path})"


def test_junit(lying: Check) -> None:
    plain = ET.fromstring(llfsm(*lying.run("--resume", "--format", "junit")).stdout)
    assert (plain.get("tests"), plain.get("failures")) == ("2", "0")
    assert f"holds (resumed from {lying.path})" in "".join(plain.itertext())
    strict = ET.fromstring(llfsm(*lying.run("--resume", "--format", "junit", "--strict")).stdout)
    failures = strict.findall(".//failure")
    assert (strict.get("failures"), [f.get("type") for f in failures]) == ("2", ["resumed", "resumed"])
    assert all(FAILS in str(f.get("message")) for f in failures)


def test_sarif(lying: Check) -> None:
    plain, strict = (
        json.loads(llfsm(*lying.run("--resume", "--format", "sarif", *more)).stdout)["runs"][0]
        for more in ([], ["--strict"])
    )
    told = [n["message"]["text"] for n in plain["invocations"][0]["toolExecutionNotifications"]]
    assert told == [f"the search went on from the checkpoint {lying.path}"]
    assert "resumed" not in {r["ruleId"] for r in plain["results"]}
    found = [r for r in strict["results"] if r["ruleId"] == "resumed"]
    assert [(r["kind"], r["level"]) for r in found] == [("fail", "error")] * 2
    assert all(FAILS in r["message"]["text"].replace("Fails", "fails") for r in found)


@pytest.mark.slow
def test_a_search_that_was_not_gone_on_with_says_nothing(lying: Check) -> None:
    lying.path.unlink()
    result = json.loads(llfsm(*lying.run("--resume", "--format", "json")).stdout)
    assert result["resumed_from"] is None
    assert result["properties"][0]["verdict"] == "violated"


@pytest.mark.slow
@pytest.mark.parametrize("option", ["--certificate", "--check-certificate"])
def test_certificates_explore_anew(lying: Check, tmp_path: Path, option: str) -> None:
    before, file = lying.path.read_bytes(), str(tmp_path / "c.json")
    if option == "--check-certificate":
        assert llfsm("verify", *lying.arguments, "--certificate", file).returncode == 1
    done = llfsm(*lying.run("--resume", option, file))
    assert f"{option} explores again: {lying.path} is not used, and stays as it is" in done.stderr
    assert done.returncode == (1 if option == "--certificate" else 0), done.stdout
    assert "resumed" not in done.stdout
    assert lying.path.read_bytes() == before
