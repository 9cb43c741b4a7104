"""`--certificate`, `--check-certificate` and `llfsm-check-certificate`, as users call them."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from llfsm_verify import certificate
from llfsm_verify.verification import verify
from tests.cli.running import FAULTY, LIGHTS, PROPERTIES, llfsm

MUTUAL = "mutual: G !(ns@GREEN && ew@GREEN)"
SERVED = "served: G F ns@GREEN"


def checked(path: Path, capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str]:
    code = certificate.main([str(path), *arguments])
    return code, capsys.readouterr().out


@pytest.mark.slow
def test_what_holds_and_what_is_violated_is_proved(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "c.json"
    done = llfsm("verify", "-q", "--certificate", str(path), FAULTY, "-p", MUTUAL, "-p", SERVED)
    assert (done.returncode, done.stderr) == (1, f"certificate saved: {path}\n")
    code, out = checked(path, capsys)
    assert code == 0
    assert "proved  violated  mutual" in out
    assert "proved  holds  served" in out
    assert "3 of 4 inputs compared" in out
    first = path.read_bytes()
    llfsm("verify", "-q", "--certificate", str(path), FAULTY, "-p", MUTUAL, "-p", SERVED)
    assert path.read_bytes() == first


@pytest.mark.slow
def test_configurations_inside_cycles_are_told_apart(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copytree("models/traffic_lights", tmp_path / "model")
    model, path = tmp_path / "model" / "faulty.yaml", tmp_path / "c.json"
    model.write_text(model.read_text() + "observe: cycle\n")
    verified = llfsm("verify", "--certificate", str(path), str(model), "-p", "some: G (ns@RED -> true)").stdout
    explored = re.search(r"^([\d,]+) configurations", verified, re.MULTILINE)
    stored = re.search(
        r"^([\d,]+) configurations, ([\d,]+) of them inside cycles", checked(path, capsys)[1], re.MULTILINE
    )
    assert explored is not None and stored is not None
    of_cycles, nodes, inside = (int(text.replace(",", "")) for text in (explored[1], stored[1], stored[2]))
    assert nodes - inside == of_cycles > 0 and inside > 0


def test_a_changed_input_file_is_noticed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copytree("models/traffic_lights", tmp_path / "model")
    model, path = tmp_path / "model" / "faulty.yaml", tmp_path / "c.json"
    assert llfsm("verify", "-q", "--certificate", str(path), str(model), "-p", SERVED).returncode == 0
    assert checked(path, capsys)[0] == 0
    copy = tmp_path / "elsewhere" / "c.json"
    copy.parent.mkdir()
    shutil.copy(path, copy)
    code, out = checked(copy, capsys)
    assert code == 0
    assert "0 of 4 inputs compared" in out
    assert "3 of 4 inputs compared" in checked(copy, capsys, "--inputs", str(tmp_path))[1]
    model.write_text(model.read_text() + "# changed\n")
    code, out = checked(path, capsys)
    assert code == 1
    assert "an input file" in out


@pytest.mark.slow
def test_a_certificate_is_compared_with_the_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "c.json"
    assert llfsm("verify", "-q", "--certificate", str(path), LIGHTS, "-p", MUTUAL).returncode == 0
    done = llfsm("verify", "--check-certificate", str(path), LIGHTS, "-p", MUTUAL)
    assert done.returncode == 0
    assert done.stdout.splitlines()[-1].endswith("are those that these files give: compared.")
    assert done.stdout.splitlines()[:-1] == checked(path, capsys)[1].splitlines()[:-1]
    other = llfsm("verify", "--check-certificate", str(path), LIGHTS, "-p", SERVED.replace("served", "mutual"))
    assert other.returncode == 1
    assert "rejected: its automata are not those of the properties" in other.stdout
    path.write_text("{}\n")
    assert llfsm("verify", "--check-certificate", str(path), LIGHTS, "-p", MUTUAL).returncode == 1
    missing = llfsm("verify", "--check-certificate", str(tmp_path / "none"), LIGHTS, "-p", MUTUAL)
    assert missing.returncode == 3
    assert "E450" in missing.stderr


@pytest.mark.slow
def test_what_a_limit_leaves_out_is_not_compared_and_not_rejected(tmp_path: Path) -> None:
    whole, cut = tmp_path / "whole.json", tmp_path / "cut.json"
    check = (LIGHTS, "-p", MUTUAL)
    assert llfsm("verify", "-q", "--certificate", str(whole), *check).returncode == 0
    assert (
        llfsm(
            "verify", "-q", "--certificate", str(cut), "--engine", "explicit", "--max-states", "20", *check
        ).returncode
        == 4
    )
    for path, limit, where in ((whole, ("--engine", "explicit", "--max-states", "20"), "now"), (cut, (), "there")):
        done = llfsm("verify", "--check-certificate", str(path), *limit, *check)
        assert (done.returncode, "rejected" in done.stdout) == (4, False)
        assert f"not compared: mutual, because it is not certified {where}: the limit of 20" in done.stdout
    other = llfsm("verify", "--check-certificate", str(cut), LIGHTS, "-p", SERVED.replace("served", "mutual"))
    assert other.returncode == 1
    assert "rejected: its properties" in other.stdout


@pytest.mark.slow
def test_what_cannot_be_compared_is_said_after_what_is_proved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path, unlike = tmp_path / "c.json", "not compared: mutual, because it is not certified there: the memory ran out"
    assert llfsm("verify", "-q", "--certificate", str(path), FAULTY, "-p", MUTUAL).returncode == 1
    monkeypatch.setattr("llfsm_verify.analysis.certificates.making.differences", lambda *_: ([], [unlike]))
    done = llfsm("verify", "--check-certificate", str(path), FAULTY, "-p", MUTUAL)
    assert done.returncode == certificate.NOT_CERTIFIED
    believed = "The program, the formulas and the automata are those that these files give, except for this:"
    assert done.stdout.splitlines() == [*checked(path, capsys)[1].splitlines()[:-1], believed, unlike]


def test_assumptions_are_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, rules = tmp_path / "c.json", tmp_path / "p.ltl"
    rules.write_text("assume never: G F (ns@GREEN && ew@GREEN)\nq: G F car\n")
    done = llfsm("verify", "-q", "--certificate", str(path), LIGHTS, str(rules))
    assert done.returncode == 4 and "not certified: q, because no run satisfies the assumptions" in done.stderr
    done = llfsm("verify", "-q", "--allow-contradiction", "--certificate", str(path), LIGHTS, str(rules))
    assert done.returncode == 0
    assert "note: no run satisfies the assumptions" in done.stdout
    code, out = checked(path, capsys)
    assert code == 0
    assert out.startswith("assuming  never  G F (ns@GREEN && ew@GREEN)\nproved  holds  q")


@pytest.mark.slow
def test_what_is_too_large_is_not_certified(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "c.json"
    monkeypatch.setattr("llfsm_verify.analysis.certificates.proofs.MOST_STATES", 200)
    done = llfsm("verify", "-q", "--certificate", str(path), FAULTY, "-p", MUTUAL, "-p", SERVED)
    assert done.returncode == 1
    assert "not certified: served, because its product has more than 200 states" in done.stderr
    code, out = checked(path, capsys)
    assert code == 4
    assert "not certified  holds  served" in out
    assert "proved  violated  mutual" in out


def test_an_unknown_verdict_is_not_certified(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "c.json"
    done = llfsm(
        "verify", "-q", "--certificate", str(path), "--engine", "explicit", "--max-states", "20", LIGHTS, "-p", MUTUAL
    )
    assert done.returncode == 4
    assert "not certified: mutual, because the limit of 20 configurations was reached" in done.stderr
    assert checked(path, capsys)[0] == 4


def test_input_files_are_never_replaced(tmp_path: Path) -> None:
    shutil.copytree("models/traffic_lights", tmp_path / "model")
    shutil.copy(PROPERTIES, tmp_path)
    model, rules = tmp_path / "model" / "arrangement.yaml", tmp_path / Path(PROPERTIES).name
    for victim in (model, model.with_name("light.machine.yaml"), rules):
        before = victim.read_bytes()
        done = llfsm("verify", "--certificate", str(victim), str(model), str(rules))
        assert done.returncode == 3
        assert "E451" in done.stderr
        assert victim.read_bytes() == before


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--certificate", "-"], "the name of a file"),
        (["--certificate", ""], "the name of a file"),
        (["--check-certificate", ""], "the name of a file"),
        (["--certificate", "a", "--check-certificate", "b"], "one of them at a time"),
        (["--certificate", "a", "--checkpoint", "a"], "name the same file"),
        (["--check-certificate", "a", "--format", "json"], "answers in words"),
    ],
)
def test_options_that_mean_nothing_are_refused(arguments: list[str], words: str) -> None:
    done = llfsm("verify", LIGHTS, *arguments)
    assert done.returncode == 2
    assert words in done.stderr


def test_an_interrupted_check_compares_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "c.json"
    assert llfsm("verify", "-q", "--certificate", str(path), LIGHTS, "-p", MUTUAL).returncode == 0
    whole = verify.verify

    def interrupted(*arguments: object) -> object:
        return replace(whole(*arguments), interrupted=True)  # type: ignore[arg-type]

    monkeypatch.setattr(verify, "verify", interrupted)
    done = llfsm("verify", "--check-certificate", str(path), LIGHTS, "-p", MUTUAL)
    assert (done.returncode, done.stdout) == (130, "")


def test_where_it_cannot_be_written_is_said(tmp_path: Path) -> None:
    done = llfsm("verify", "-q", "--certificate", str(tmp_path / "none" / "c.json"), LIGHTS, "-p", MUTUAL)
    assert done.returncode == 3
    assert "E450" in done.stderr
    assert done.stdout == "", "that is said before the work"


def test_json_on_standard_output_stays_json(tmp_path: Path) -> None:
    done = llfsm("verify", "--format", "json", "--certificate", str(tmp_path / "c.json"), LIGHTS, "-p", MUTUAL)
    assert json.loads(done.stdout)["properties"][0]["verdict"] == "holds"
