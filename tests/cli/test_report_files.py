"""`--report FILE`: what `--format` prints, in files that are named for it, beside any other output."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from llfsm_verify.plug import REPORTS
from tests.cli.running import COUNTER, LIGHTS, llfsm

NEVER = ("-p", "never: G !ns@GREEN")
TIMES = re.compile(r'"(?:seconds|time)": [\d.e-]+|(?:time|timestamp)="[^"]*"|[\d.]+ m?s\b|"guid": "[^"]*"')


@pytest.mark.parametrize(("ending", "name"), REPORTS.result.suffixes.items())
def test_a_file_has_what_the_format_prints(tmp_path: Path, ending: str, name: str) -> None:
    file = tmp_path / f"out{ending}"
    done = llfsm("verify", LIGHTS, *NEVER, "-q", "--report", str(file))
    assert done.returncode == 1
    assert f"{file} written" in done.stderr
    assert done.stdout.startswith("violated  never"), "the text is as short as -q says"
    printed = llfsm("verify", LIGHTS, *NEVER, "--format", name)
    assert TIMES.sub("", file.read_text()) == TIMES.sub("", printed.stdout)


def test_several_are_written_also_when_nothing_is_decided(tmp_path: Path) -> None:
    files = tmp_path / "a.json", tmp_path / "b.json", tmp_path / "c.TXT"
    options = [word for file in files for word in ("--report", str(file))]
    assert llfsm("verify", LIGHTS, *NEVER, "--max-states", "1", "--engine", "explicit", *options).returncode == 4
    assert json.loads(files[0].read_text())["exit_code"] == 4
    assert files[0].read_text() == files[1].read_text()
    assert "unknown" in files[2].read_text()


@pytest.mark.parametrize("name", ["out.doc", "out", ".json", "-"])
def test_another_ending_is_wrong_usage(name: str) -> None:
    done = llfsm("verify", LIGHTS, *NEVER, "--report", name)
    assert done.returncode == 2
    assert f"no report ends like `{name}`: name it {', '.join(REPORTS.result.suffixes)}" in done.stderr
    assert not Path(name).exists()


def test_no_input_is_replaced(tmp_path: Path) -> None:
    text = COUNTER
    given, properties = tmp_path / "given.json", tmp_path / "p.txt"
    given.write_text(text)
    properties.write_text("never: G !m@B\n")
    for file in (given, properties):
        done = llfsm("verify", str(given), str(properties), "--report", str(file))
        assert done.returncode == 3
        assert "E490" in done.stderr
        assert "the report would replace it" in done.stderr
    broken = f"{text}\n: [}}"
    given.write_text(broken)
    assert llfsm("verify", str(given), "--report", str(given)).returncode == 3
    assert (given.read_text(), properties.read_text()) == (broken, "never: G !m@B\n")


def test_wrong_files_are_said_in_formats_that_have_it(tmp_path: Path) -> None:
    names = ("a.json", "b.json", "c.txt")
    options = [word for name in names for word in ("--report", str(tmp_path / name))]
    done = llfsm("verify", LIGHTS, "-p", "G !ns@GREN", *options)
    assert done.returncode == 3
    assert {path.name for path in tmp_path.iterdir()} == {"a.json", "b.json"}
    printed = llfsm("verify", LIGHTS, "-p", "G !ns@GREN", "--format", "json")
    assert (tmp_path / "a.json").read_text() == printed.stdout
    # An old report says what is wrong too, where it cannot be a file of the arrangement.
    (tmp_path / "b.json").write_text("old")
    assert llfsm("verify", LIGHTS, "-p", "G !ns@GREN", *options).returncode == 3
    assert (tmp_path / "b.json").read_text() != "old"


def test_a_place_that_cannot_be_written_is_said_before_the_check(tmp_path: Path) -> None:
    done = llfsm("verify", LIGHTS, *NEVER, "--report", str(tmp_path / "no" / "out.json"))
    assert (done.returncode, done.stdout) == (3, "")
    assert "error[E490]: the report cannot be written there" in done.stderr


@pytest.mark.parametrize("option", ["--check-certificate", "--check-invariants"])
def test_a_check_of_proofs_has_no_report(option: str) -> None:
    done = llfsm("verify", LIGHTS, *NEVER, option, "proof.json", "--report", "out.json")
    assert done.returncode == 2
    assert "leave --report out" in done.stderr
