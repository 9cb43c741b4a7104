from __future__ import annotations

import json
import shlex
import subprocess
import sys

import jsonschema
import pytest

from llfsm_verify import cli
from llfsm_verify.diagnostics import Disagreement
from llfsm_verify.report.schema import load
from tests.cli.running import LIGHTS, PROPERTIES, llfsm


@pytest.mark.parametrize(
    "arguments",
    [
        ("verify",),
        ("frobnicate",),
        ("verify", LIGHTS, "--engine", "psychic"),
        ("verify", LIGHTS, "--format", "yaml"),
        ("verify", LIGHTS, "--max-states", "0"),
        ("verify", LIGHTS, "--max-states", "-3"),
        ("verify", LIGHTS, "--max-states", "many"),
        ("verify", LIGHTS, "--max-states", "²"),
        ("verify", LIGHTS, "--memory", "2X"),
        ("verify", LIGHTS, "--memory", "nan"),
        ("verify", LIGHTS, "--timeout", "0"),
        ("verify", LIGHTS, "--timeout", "inf"),
        ("verify", LIGHTS, "--timeout", "soon"),
        ("verify", "-", "-"),
        ("simulate", LIGHTS, "--steps", "1", "--cycles", "1"),
        ("simulate", LIGHTS, "--set", "car"),
        ("simulate", LIGHTS, "--set", "lorry=true"),
        ("simulate", LIGHTS, "--set", "car=maybe"),
        ("draw", LIGHTS, "--machine", "west"),
        ("schema", "everything"),
        ("replay",),
    ],
    ids=" ".join,
)
def test_wrong_usage_is_2(arguments):
    done = llfsm(*arguments)
    assert done.returncode == 2 and done.stdout == "" and done.stderr.startswith("error: ")
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (("verify", "-"), "E002"),
        (("verify", LIGHTS, "-"), "E301"),
        (("query", "-", "true"), "E002"),
        (("lint", "-"), "E002"),
        (("lint", LIGHTS, "-"), "E301"),
        (("simulate", "-"), "E002"),
        (("draw", "-"), "E002"),
        (("kripke", "-"), "E002"),
        (("monitor", "-"), "E301"),
        (("property", "classify", "-"), "E301"),
        (("property", "draw", "-"), "E301"),
    ],
    ids=" ".join,
)
def test_closed_standard_input_is_said(arguments: tuple[str, ...], code: str) -> None:
    """Python has no standard input at all then (`<&-` in a shell)."""
    done = llfsm(*arguments, stdin=None)
    assert (done.returncode, done.stdout) == (3, "")
    assert done.stderr.startswith(f"<stdin>: error[{code}]: standard input is closed")


@pytest.mark.slow
def test_a_process_without_standard_input_ends_in_a_diagnostic() -> None:
    command = shlex.join([sys.executable, "-m", "llfsm_verify", "verify", "-"])
    done = subprocess.run(["sh", "-c", f"{command} <&-"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr.splitlines()[0]) == (3, "<stdin>: error[E002]: standard input is closed")


@pytest.mark.parametrize(
    ("arguments", "stdin", "says"),
    [
        (("verify", "models"), "", "models: error[E003]: this is a directory"),
        (("verify", "nowhere.yaml"), "", "nowhere.yaml: error[E001]: there is no such file"),
        (("verify", "-"), "name: x\nmachine: {}\n", "<stdin>:2:1: error[E033]"),
        (("verify", "-"), "", "the file is empty"),
        (("verify", LIGHTS, "nowhere.ltl"), "", "nowhere.ltl: error[E301]"),
        (("verify", LIGHTS.replace(".yaml", ".yml")), "", f"\n  hint: did you mean `{LIGHTS}`?"),
        (("verify", LIGHTS, PROPERTIES.replace("lights", "light")), "", f"\n  hint: did you mean `{PROPERTIES}`?"),
        (("check", LIGHTS.replace(".yaml", ".yml")), "", f"\n  hint: did you mean `{LIGHTS}`?"),
        (("verify", LIGHTS, "-p", "G (ns@GREEN"), "", "<command line>:1:3: error[E309]"),
        (("verify", LIGHTS, "-p", "x: G !ns@GREN"), "", "<command line>:1:"),
        (("verify", LIGHTS, PROPERTIES, PROPERTIES), "", ":4:1: error[E313]: there are two properties `fair_cars`"),
        (("simulate", LIGHTS, "--inputs", "nowhere.yaml"), "", "nowhere.yaml: error[E001]"),
        (("replay", LIGHTS), "", ":2:1: error[E019]: this looks like an arrangement, and a trace file is expected"),
        (("replay", "/dev/null"), "", "/dev/null: error[E011]: the file is empty\n  hint: an arrangement has"),
        (("draw", LIGHTS, "-o", "/nowhere/x.dot"), "", "/nowhere/x.dot: error[E407]"),
        (("verify", LIGHTS, "x\udcff.ltl"), "", "error[E301]"),
    ],
    ids=lambda value: " ".join(value)[:60].replace("\udcff", "") if isinstance(value, tuple) else "",
)
def test_wrong_files_are_3_with_their_place(arguments, stdin, says):
    done = llfsm(*arguments, stdin=stdin)
    assert done.returncode == 3 and done.stdout == "" and says in done.stderr and "Traceback" not in done.stderr


def test_wrong_files_are_an_object_for_programs_that_asked_for_json():
    wrong = "name: x\nmachine: {}\n"
    done = llfsm("verify", "-", "--format", "json", stdin=wrong)
    value = json.loads(done.stdout)
    jsonschema.Draft202012Validator(load("result")).validate(value)
    first = next(d for d in value["error"]["diagnostics"] if d["code"] == "E033")
    assert done.returncode == value["exit_code"] == 3
    assert (first["file"], first["line"], first["column"]) == ("<stdin>", 2, 1)
    assert done.stderr == llfsm("verify", "-", stdin=wrong).stderr != ""
    for arguments in ((LIGHTS, "nowhere.ltl"), ("nowhere.yaml",), (LIGHTS, "-p", "G (")):
        done = llfsm("verify", *arguments, "--format", "json")
        assert done.returncode == 3 and len(json.loads(done.stdout)["error"]["diagnostics"]) == 1


class Broken(Exception):
    pass


@pytest.mark.parametrize(
    ("error", "code", "says"),
    [
        (Broken("the\nreason"), 70, "internal error: Broken: the reason"),
        (RecursionError("deep"), 70, "internal error: RecursionError"),
        (Disagreement("trace of p"), 5, "two parts of the toolkit disagree: trace of p"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (MemoryError(), 4, "out of memory"),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, BaseException) else "",
)
def test_what_is_our_own_fault_is_one_line(error, code, says, monkeypatch, capsys):
    def deeper():
        raise error

    def fail(options):
        deeper()

    monkeypatch.setattr("llfsm_verify.cli.commands.schema.run", fail)
    monkeypatch.delenv("LLFSM_DEBUG", raising=False)
    assert cli.main(["schema", "result"]) == code
    err = capsys.readouterr().err
    assert says in err and err.count("\n") == 1
    assert ("(deeper, line " in err) == (code in {70, 5})
    monkeypatch.setenv("LLFSM_DEBUG", "1")
    assert cli.main(["schema", "result"]) == code
    assert ("Traceback" in capsys.readouterr().err) == (code in (70, 5))


def test_the_real_disagreement_is_the_one_that_is_known():
    from llfsm_verify.diagnostics import Disagreement as Real

    assert Real.__name__ == "Disagreement"


def test_only_a_file_that_a_file_names_is_relative_to_one(tmp_path):
    assert "hint: check the path\n" in llfsm("verify", "nowhere.yaml").stderr
    path = tmp_path / "a.yaml"
    path.write_text("machines: {m: {file: nowhere.machine.yaml}}\nschedule: [m]\n")
    assert "it is relative to the file that names it" in llfsm("verify", str(path)).stderr


@pytest.mark.parametrize(
    ("named", "hint"),
    [
        ("sub/enter.d", "did you mean `sub/Enter.d`?"),
        ("sub/enter", "did you mean `sub/Enter.d`?"),
        ("../outside/secrets.d", "check the path"),
        ("sub/../../outside/secrets.d", "check the path"),
        ("{}/outside/secrets.d", "check the path"),
    ],
)
def test_files_beside_the_one_that_names_them_are_suggested(tmp_path, named, hint):
    for folder, name in (("there/sub", "Enter.d"), ("outside", "secret.d")):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / name).write_text("")
    path = tmp_path / "there/a.yaml"
    machines = "machines: {m: {inline: {machine: M, states: [{name: A}]}}}\nschedule: [m]\n"
    path.write_text(f"knowledge: {{q: {{file: {named.format(tmp_path)}}}}}\n{machines}")
    assert f"hint: {hint}" in llfsm("verify", str(path)).stderr
