"""`llfsm kripke` from the shell's side."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from tests.cli.running import LIGHTS, PROPERTIES, llfsm
from tests.outside import needs

ENDINGS = [".dot", ".gv", ".json", ".graphml", ".aut", ".smv", ".pml", ".promela", ".npz"]


@pytest.mark.parametrize("ending", ENDINGS)
def test_the_ending_says_the_format(tmp_path, ending):
    target = tmp_path / f"lights{ending}"
    done = llfsm("kripke", LIGHTS, PROPERTIES, "-o", str(target))
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    begins = {
        ".dot": b"digraph", ".gv": b"digraph", ".json": b"{", ".graphml": b"<?xml", ".aut": b"des (", ".smv": b"-- ",
        ".pml": b"/* ", ".promela": b"/* ", ".npz": b"PK",
    }  # fmt: skip
    assert target.read_bytes().startswith(begins[ending])
    assert [p.name for p in tmp_path.iterdir()] == [target.name]


@needs("pygraphviz")
@pytest.mark.slow
@pytest.mark.parametrize(("ending", "begin"), [(".svg", b"<?xml"), (".png", b"\x89PNG")])
def test_pictures(tmp_path, ending, begin):
    target = tmp_path / f"stroll{ending}"
    done = llfsm("kripke", "models/komodo_stroll/arrangement.yaml", "-o", str(target))
    assert (done.returncode, done.stdout) == (0, "") and target.read_bytes().startswith(begin)
    assert ending == ".png" or target.read_text(encoding="utf-8").count("stroll@MOVE_FORWARD") == 16
    done = llfsm("kripke", "models/komodo_stroll/arrangement.yaml", "--format", "png")
    assert done.returncode == 2 and "png is not a text format: name a file with -o" in done.stderr


@pytest.mark.slow
def test_json_to_standard_output_unless_asked_otherwise():
    done = llfsm("kripke", LIGHTS, "-p", "G !(ns@GREEN && ew@GREEN)")
    found = json.loads(done.stdout)
    assert found["atoms"] == ["ew@GREEN", "ns@GREEN"] and len(found["configurations"]) == 185
    assert llfsm("kripke", LIGHTS, "--format", "aut").stdout.startswith("des (0, ")


def one_machine(folder: Path, kind: str, action: str) -> str:
    """The file of an arrangement whose only machine does `action` in each ringlet."""
    file = folder / "a.yaml"
    machine = f"{{machine: M, states: [{{name: S, internal: '{action}', transitions: [{{when: 'false', to: S}}]}}]}}"
    board = f"{{x: {{type: {kind}}}}}"
    file.write_text(f"name: a\nwhiteboard: {board}\nmachines: {{m: {{inline: {machine}}}}}\nschedule: [m]\n")
    return str(file)


def test_keep_all_bits(tmp_path):
    file = one_machine(tmp_path, "0..3", "x = (x + 1) % 4;")
    counts = [
        len(json.loads(llfsm("kripke", file, *more).stdout)["configurations"]) for more in ((), ("--keep-all-bits",))
    ]
    assert counts == [4, 5]


def test_nothing_is_written_of_what_a_limit_cut_short(tmp_path):
    target = tmp_path / "lights.json"
    done = llfsm("kripke", LIGHTS, "--max-states", "40", "-o", str(target))
    assert done.returncode == 4 and not target.exists()
    assert "nothing was written" in done.stderr and "40 configurations" in done.stderr and "--partial" in done.stderr
    done = llfsm("kripke", LIGHTS, "--max-states", "40", "--partial", "-o", str(target))
    assert done.returncode == 4 and "only a part" in done.stderr
    assert json.loads(target.read_text())["complete"] is False


@pytest.mark.parametrize("wanted", ["smv", "promela"])
@pytest.mark.parametrize(
    "words",
    [
        ("--max-states", "1"),
        ("--timeout", "9"),
        ("--memory", "1G"),
        ("--partial",),
        ("--large",),
        ("--large", "--partial"),
    ],
)
def test_a_model_needs_no_exploration(wanted, words):
    done = llfsm("kripke", LIGHTS, "--format", wanted, *words)
    assert done.returncode == 2 and wanted in done.stderr and done.stdout == ""
    assert all(word in done.stderr for word in words if word.startswith("--"))


def test_large_drawings_are_refused_unless_asked_for(tmp_path):
    file = one_machine(tmp_path, "0..400", "x = (x + 1) % 400;")
    done = llfsm("kripke", file, "--format", "dot")
    assert done.returncode == 2 and "--large" in done.stderr and done.stdout == ""
    assert llfsm("kripke", file, "--format", "dot", "--large").stdout.startswith("digraph")


def test_faults_are_told(tmp_path):
    file = one_machine(tmp_path, "0..3", "x++;")
    done = llfsm("kripke", file)
    assert done.returncode == 0 and "note: " in done.stderr and file in done.stderr
    assert json.loads(done.stdout)["faults"][0]["code"] == "F001"


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ((LIGHTS, "-o", "x.gif"), 2, "no format ends like `x.gif`"),
        ((LIGHTS, "--format", "npz"), 2, "-o"),
        (("-", "-"), 2, "only once"),
        ((LIGHTS, "-p", "G nothing@HERE"), 3, "nothing"),
        (("missing.yaml",), 3, "missing.yaml"),
        ((LIGHTS, "-o", "no/such/folder/x.json"), 3, "E422"),
        ((LIGHTS, "-o", "models/x.smv/y.smv"), 3, "E422"),
    ],
)
def test_mistakes(words, code, said):
    done = llfsm("kripke", *words)
    assert done.returncode == code and said in done.stderr and done.stdout == "" and "Traceback" not in done.stderr


@pytest.mark.slow
def test_a_mathematical_integer_is_refused_with_a_hint(tmp_path):
    file = one_machine(tmp_path, "int", "x++;")
    for wanted in ("smv", "promela"):
        done = llfsm("kripke", file, "--format", wanted)
        assert done.returncode == 3 and "E420" in done.stderr and "0..1000" in done.stderr
        assert re.search(r"\.yaml:\d+:\d+: error\[E420\]", done.stderr)


def test_a_calculation_that_is_too_wide_is_refused_at_a_declaration(tmp_path):
    file = one_machine(tmp_path, "0..100000", "x = x * x % 10;")
    done = llfsm("kripke", file, "--format", "smv")
    assert done.returncode == 3 and re.search(r"\.yaml:\d+:\d+: error\[E421\]", done.stderr)


@pytest.mark.parametrize("wanted", ["smv", "promela"])
def test_a_number_that_is_too_wide_is_refused_where_it_is_written(tmp_path, wanted):
    large, small = one_machine(tmp_path, "0..9", "if (x < 18446744073709551616) x = 1;"), tmp_path / "small"
    small.mkdir()
    fine = one_machine(small, "0..9", "x = 1;")
    for words, place in (((large,), r"\.yaml:\d+:\d+"), ((fine, "-p", "a: G x < -18446744073709551616"), "1:10")):
        done = llfsm("kripke", *words, "--format", wanted)
        assert done.returncode == 3 and re.search(place + r": error\[E421\]: `-?18446744073709551616` ", done.stderr)


def test_help_names_what_there_is():
    text = " ".join(llfsm("kripke", "--help").stdout.split())
    assert all(word in text for word in ("graphml", "npz", "promela", "--partial", "exit codes"))
    assert "kripke" in llfsm("--help").stdout


def test_an_existing_file_stays_when_writing_fails(tmp_path, monkeypatch):
    target = tmp_path / "a.aut"
    target.write_text("precious")

    def broken(_):
        yield "des (0, 0, 1)"
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("llfsm_verify.extensions.graphs.aut.aut", broken)
    done = llfsm("kripke", LIGHTS, "-o", str(target))
    assert done.returncode == 3 and "No space left" in done.stderr
    assert target.read_text() == "precious" and [p.name for p in Path(tmp_path).iterdir()] == ["a.aut"]
