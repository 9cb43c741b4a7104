"""The traffic lights of the case study, asking the real Prolog."""

from __future__ import annotations

import csv
import shlex
from pathlib import Path

import pytest

from tests.cli.running import llfsm
from tests.outside import needs

FOLDER = Path("models/reasoned_lights")
SHOWN = [Path("docs/knowledge.md"), FOLDER / "README.md"]
"""Pages with a run of 20 s, and the command that shows its answers."""


@needs("swipl")
@pytest.mark.slow
@pytest.mark.parametrize("ports", ["prolog", "endless"])
def test_runs_with_the_real_prolog(ports: str, tmp_path: Path) -> None:
    """Also with a query that never ends nothing is violated, and the recording is replayed."""
    words = ["run", f"{FOLDER}/arrangement.yaml", "--ports", f"{FOLDER}/{ports}.ports.yaml", "--simulate"]
    words += ["--seed", "1", "--hold", "10s", "--for", "100s", "--monitor", "properties/reasoned_lights.ltl"]
    for rate in ("50", "5"):  # where the machine is busy, Prolog has more time
        recording = str(tmp_path / rate)
        done = llfsm(*words, "--rate", rate, "--on-violation", "stop", "--record", recording)
        assert done.returncode == 0 and "100 cycles (700 ringlets)" in done.stdout, done
        answered = llfsm(
            "check-recording", recording, "properties/reasoned_lights.ltl", "-p", "green: F ns@GREEN"
        ).stdout
        again = llfsm("replay", recording)
        assert again.returncode == 0 and "the same bit for bit" in again.stdout, again
        assert "violated" not in answered
        if "satisfied" in answered and (ports == "prolog" or "within its limit of 50 ms" in done.stderr):
            break
    else:
        pytest.fail(f"{done}\n{answered}")


@needs("swipl")
@pytest.mark.slow
@pytest.mark.parametrize("page", SHOWN, ids=str)
def test_the_commands_of_a_page_show_answers(page: Path, tmp_path: Path) -> None:
    lines = [line[8:] for line in page.read_text(encoding="utf-8").splitlines() if line.startswith("$ llfsm ")]
    at = next(at for at, line in enumerate(lines) if "prolog.ports.yaml" in line)
    run, trace = (shlex.split(line) for line in lines[at : at + 2])
    name = run[run.index("--record") + 1]
    run, trace = ([str(tmp_path / name) if word == name else word for word in words] for words in (run, trace))
    done = llfsm(*run, "--rate", "40")
    assert done.returncode == 0 and "violated" not in done.stdout, done
    *rows, last = csv.DictReader(llfsm(*trace).stdout.splitlines())
    assert last["car"] == "true" and {"may_go_ns", "must_stop_ew"} <= last.keys() and len(rows) >= 20
