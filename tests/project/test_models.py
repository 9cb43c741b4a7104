from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.cli.running import llfsm
from tests.models.cases import CASES

VIOLATED = {
    "models/traffic_lights/faulty.yaml": {"mutual_exclusion", "lamps_exclusive", "both_green"},
    "models/traffic_lights/abrupt.yaml": {
        "ns_green_amber", "ew_green_amber", "ns_order", "ew_order", "skipped_amber"
    },
    "models/traffic_lights/slow.yaml": {"ew_in_time"},
}  # fmt: skip
"""What does not hold; every other model keeps all of its properties."""

MODELS = sorted(
    str(path) for path in Path("models").glob("*/*.yaml") if not path.name.endswith((".machine.yaml", ".trace.yaml"))
)


def test_there_are_models():
    assert set(VIOLATED) < set(MODELS) and len(MODELS) >= 3


CASE_STUDIES = {case.model for case in CASES}
"""Folders whose verdicts are those of tests/models."""


@pytest.mark.parametrize("model", [m for m in MODELS if Path(m).parent.name not in CASE_STUDIES])
def test_exactly_what_is_meant_to_fails(model):
    properties = sorted(map(str, Path("properties").glob(f"{Path(model).parent.name}*.ltl")))
    done = llfsm("verify", model, *properties, "--quiet")
    failing = {line.split()[1] for line in done.stdout.splitlines() if line.startswith("violated")}
    assert failing == VIOLATED.get(model, set()) and done.returncode == (1 if failing else 0)
    assert "unknown" not in done.stdout and "fault-free" not in done.stdout


@pytest.mark.parametrize("model", sorted({str(Path(m).parent) for m in MODELS}))
def test_each_model_has_a_page_that_the_index_names(model):
    assert Path(model, "README.md").is_file()
    assert f"({Path(model).name}/README.md)" in Path("models/README.md").read_text()


@pytest.mark.slow
def test_properties_are_not_true_for_want_of_a_case():
    """The other way round: what each property needs does happen."""
    happens = [
        "G !ns@GREEN", "G !ew@GREEN", "G !ns@AMBER", "G !(ew_light == AMBER)", "G !(timer.ran && car)",
        "G !ns.fired(RED, 0)", "G !timer@EW_TURN",
    ]  # fmt: skip
    texts = [word for text in happens for word in ("-p", text)]
    done = llfsm("verify", "models/traffic_lights/arrangement.yaml", *texts, "--quiet")
    assert done.stdout.count("violated") == len(happens)
    texts = [word for text in ("G !stroll@MOVE_FORWARD", "G !stroll@MOVE_BACKWARD") for word in ("-p", text)]
    assert llfsm("verify", "models/komodo_stroll/arrangement.yaml", *texts, "--quiet").stdout.count("violated") == 2


@pytest.mark.slow
def test_the_lines_of_each_kind_hold(tmp_path):
    """Those of the table in docs/properties.md, with an automaton for the file that they name."""
    table = re.findall(r"^\| [^|]*\| `([a-z_ ]+: [^`]*)`", Path("docs/properties.md").read_text(), re.MULTILINE)
    assert len(table) == 13
    head = 'HOA: v1 Start: 0 AP: 2 "ns@GREEN" "ew@GREEN" '
    (tmp_path / "good.hoa").write_text(head + "Acceptance: 0 t --BODY-- State: 0 [!0 | !1] 0 --END--")
    caught = "State: 0 [!0 | !1] 0 [0 & 1] 1 State: 1 {0} [t] 1"
    (tmp_path / "bad.hoa").write_text(f"{head} Acceptance: 1 Inf(0) --BODY-- {caught} --END--")
    (tmp_path / "table.ltl").write_text("\n".join(table))
    done = llfsm("verify", "models/traffic_lights/arrangement.yaml", str(tmp_path / "table.ltl"), "--quiet")
    assert done.returncode == 0 and done.stdout.count("holds") >= 10, done
