"""Regular properties and automata from files on the command line: reports, saved traces, diagnostics."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from pathlib import Path

import jsonschema
import pytest

from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.extensions.hoa.writing import write_hoa
from llfsm_verify.logic.formula import apply, atom, negation
from llfsm_verify.report.schema import load
from llfsm_verify.verification.tracefile_fields import schema
from tests.cli.running import FAULTY, LIGHTS, Done, llfsm

ABRUPT = "models/traffic_lights/abrupt.yaml"
SLOW = "models/traffic_lights/slow.yaml"
RULES = "properties/traffic_lights_rules.ltl"


def test_the_rules_hold_on_the_lights():
    done = llfsm("verify", LIGHTS, RULES, "--quiet")
    assert done.returncode == 0 and "violated" not in done.stdout and "unknown" not in done.stdout
    assert "holds  ew_order       enforce (ew@RED ew@GREEN ew@AMBER)*\n" in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("options", [(), ("--chains", "on"), ("--cone", "on"), ("--cone", "on", "--chains", "on")])
@pytest.mark.parametrize(
    ("model", "name", "steps"), [(ABRUPT, "ew_order", 66), (FAULTY, "both_green", 65), (SLOW, "ew_in_time", 51)]
)
def test_a_mistake_violates_the_rule_with_the_shortest_trace(model, name, steps, options):
    done = llfsm("verify", model, RULES, "--format", "json", *options)
    found = {p["name"]: p for p in json.loads(done.stdout)["properties"]}[name]
    assert (done.returncode, found["verdict"]) == (1, "violated")
    assert len(found["trace"]["steps"]) == steps and found["trace"]["loop"] is None


@pytest.mark.slow
def test_reports():
    regular = ["-p", "forbid initially hurry: true ns@GREEN", "-p", "forbid late: ew@AMBER"]
    done = llfsm("verify", LIGHTS, *regular, "--format", "json")
    value = json.loads(done.stdout)
    jsonschema.Draft202012Validator(load("result")).validate(value)
    assert [(p["kind"], p["initially"], p["text"]) for p in value["properties"]] == [
        ("forbid", True, "true ns@GREEN"),
        ("forbid", False, "ew@AMBER"),
    ]
    done = llfsm("verify", LIGHTS, *regular)
    assert "\nhurry is violated: forbid initially true ns@GREEN\n" in done.stdout
    suite = ET.fromstring(llfsm("verify", LIGHTS, *regular, "--format", "junit").stdout)[0]
    assert [case.get("name") for case in suite.findall("testcase") if case.find("failure") is not None] == [
        "hurry", "late"
    ]  # fmt: skip


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    """A folder with automata, and the traces of everything that they and regular properties find wrong."""
    safe = apply("G", negation(apply("and", atom("ns@GREEN"), atom("ew@GREEN"))))
    (tmp_path / "automata").mkdir()
    (tmp_path / "automata" / "safe one.hoa").write_text(write_hoa(translate(safe)))
    (tmp_path / "automata" / "calm.hoa").write_text(write_hoa(translate(apply("F", apply("G", atom("ns@GREEN"))))))
    (tmp_path / "rules.ltl").write_text(
        'automaton safe: "automata/safe one.hoa"\nautomaton never calm: automata/calm.hoa\n'
        "forbid initially hurry: true ns@GREEN\nenforce order: (ew@RED ew@GREEN ew@RED)*\n"
    )
    done = llfsm("verify", FAULTY, str(tmp_path / "rules.ltl"), "--save-traces", str(tmp_path / "traces"), "--quiet")
    assert done.returncode == 1 and done.stdout.count("violated") == 4, done
    assert "violated  safe   automaton automata/safe one.hoa\n" in done.stdout
    assert "violated  calm   automaton never automata/calm.hoa\n" in done.stdout
    return tmp_path


def replayed(folder: Path, name: str, *options: str) -> Done:
    return llfsm("replay", "--quiet", str(folder / "traces" / f"{name}.trace.yaml"), *options)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "says", "mended"),
    [
        ("safe", "the run ends in a bad prefix of safe", "the run is no longer a bad prefix of safe"),
        ("calm", "the run violates calm", None),
        ("hurry", "the run ends in a bad prefix of hurry", None),
        ("order", "the run ends in a bad prefix of order", None),
    ],
)
def test_saved_traces_are_judged_anew(saved, monkeypatch, name, says, mended):
    validator = jsonschema.Draft202012Validator(schema("trace"))
    import yaml

    trace = saved / "traces" / f"{name}.trace.yaml"
    validator.validate(yaml.safe_load(trace.read_text()))
    done = replayed(saved, name)
    assert (done.returncode, says in done.stdout) == (0, True), done
    if mended:
        done = replayed(saved, name, "--arrangement", LIGHTS)
        assert (done.returncode, mended in done.stdout) == (1, True), done
    # The text of the property decides, not what was found when the trace was saved.
    text = trace.read_text()
    trace.write_text(text.replace("(ew@RED ew@GREEN ew@RED)*", "(ew@RED | ew@GREEN | ew@AMBER)*"))
    assert replayed(saved, name).returncode == (1 if name == "order" else 0)
    trace.write_text(text)
    # The file of an automaton is found from wherever we are.
    monkeypatch.chdir(saved / "traces")
    arrangement = Path(__file__).parents[2] / FAULTY
    assert llfsm("replay", "-q", f"{name}.trace.yaml", "--arrangement", str(arrangement)).returncode == 0


@pytest.mark.slow
def test_an_automaton_that_is_gone(saved):
    (saved / "automata" / "calm.hoa").unlink()
    done = replayed(saved, "calm")
    assert done.returncode == 3 and "E301" in done.stderr and "calm.hoa" in done.stderr
    (saved / "automata" / "calm.hoa").write_text("HOA: v1\nAP: 1 ns@GREEN")
    done = replayed(saved, "calm")
    assert done.returncode == 3 and "calm.hoa:2:" in done.stderr


@pytest.mark.parametrize(
    ("line", "code", "column", "hint"),
    [
        ("forbid x: ns@RED*", "E342", 11, "write `+` instead of `*`"),
        ("enforce x: ns@RED ns@RED", "E344", 12, "letters that hold in the same configurations"),
        ("forbid initially x: [ns@RED && ns@GREEN]", "E344", 21, "a machine is in one state at a time"),
        ("forbid x: [car && !car]", "E344", 11, "write a letter that some configuration satisfies"),
        ("enforce x: ns@BLUE", "E112", 15, None),
        ("enforce x: [G ns@RED]", "E340", 12, "write it as a property of its own"),
        ("enforce x: ns@RED{3,2}", "E341", 18, "write `{2,3}`"),
        ("enforce: ns@RED", "E311", 1, None),
        ("automaton x: nowhere.hoa", "E301", None, None),
    ],
)
def test_mistakes_are_shown_where_they_stand(tmp_path, line, code, column, hint):
    path = tmp_path / "p.ltl"
    path.write_text(f"# rules\n{line}\n")
    done = llfsm("verify", LIGHTS, str(path))
    where = f"p.ltl:2:{column}: error[{code}]" if column else f"error[{code}]"
    assert done.returncode == 3 and where in done.stderr, done
    assert hint is None or hint in done.stderr
    assert done.stdout == ""


@pytest.mark.slow
def test_a_checkpoint_belongs_to_what_the_automata_say(tmp_path):
    hoa, rules, point = tmp_path / "a.hoa", tmp_path / "p.ltl", tmp_path / "c.point"
    rules.write_text("automaton a: a.hoa\nenforce b: (ew@RED ew@GREEN ew@AMBER)*\n")
    hoa.write_text(write_hoa(translate(apply("G", negation(atom("ns@GREEN"))))))
    arguments = ["verify", FAULTY, str(rules), "--checkpoint", str(point), "--quiet"]
    assert llfsm(*arguments, "--max-states", "50").returncode == 1 and point.exists()
    done = llfsm(*arguments, "--resume")
    assert done.returncode == 1 and "going on from" in done.stderr
    assert done.stdout.split()[:2] == ["violated", "a"] and f"holds (resumed from {point})  b" in done.stdout
    assert llfsm(*arguments, "--max-states", "50").returncode == 1
    hoa.write_text(write_hoa(translate(apply("G", negation(atom("ew@GREEN"))))))
    done = llfsm(*arguments, "--resume")
    assert done.returncode == 3 and "E414" in done.stderr and "other properties" in done.stderr


@pytest.mark.slow
def test_traces_of_formulas_in_other_syntaxes(tmp_path):
    spot, spin, option = tmp_path / "a.ltl", tmp_path / "b.ltl", tmp_path / "c.ltl"
    spot.write_text('# syntax: spot\na: F"ew@GREEN" && G!"ns@GREEN"\nassume c: GF"car"\n')
    spin.write_text('# syntax: spin\nltl one { [] !"ns@GREEN" }\n')
    option.write_text('never: [] !("ns@AMBER" U "ns@RED" U "ns@GREEN")\n')  # to the left, and no error
    lines = ["-p", 'ltl two { [] !"ew@GREEN" }', "--syntax", "spin"]
    traces = tmp_path / "traces"
    files = [str(spot), str(spin), str(option)]
    done = llfsm("verify", LIGHTS, *files, *lines, "--save-traces", str(traces), "--quiet")
    assert done.returncode == 1 and done.stdout.count("violated") == 4, done
    validator = jsonschema.Draft202012Validator(schema("trace"))
    import yaml

    for trace in traces.iterdir():
        validator.validate(yaml.safe_load(trace.read_text()))
    assert yaml.safe_load((traces / "one.trace.yaml").read_text())["syntaxes"] == {"c": "spot", "one": "spin"}
    done = llfsm("replay", "--quiet", *map(str, sorted(traces.iterdir())))
    assert done.returncode == 0 and done.stdout.count("still happens") == 4, done


def test_structures_show_the_letters_of_regular_properties_and_models_refuse_them():
    done = llfsm("kripke", LIGHTS, "-p", "enforce order: (ns@RED ns@GREEN ns@AMBER)*")
    assert done.returncode == 0 and '"ns@AMBER"' in done.stdout
    done = llfsm("kripke", LIGHTS, "-p", "enforce order: (ns@RED ns@GREEN ns@AMBER)*", "--format", "smv")
    assert done.returncode == 3 and "error[E315]" in done.stderr and done.stdout == ""


def test_no_property_of_the_command_line_goes_on_into_the_next():
    done = llfsm(
        "verify", LIGHTS, "-p", "assume no: enforce ns@RED*", "-p", "G ns@RED &&", "-p", "(ns@RED", "-p", "ew@RED"
    )
    places = [line.split(" ")[1:4] for line in done.stderr.splitlines() if "error[" in line]
    assert done.returncode == 3 and [place[0] for place in places] == ["line>:1:20:", "line>:2:10:", "line>:3:1:"]
    done = llfsm("verify", LIGHTS, "-q", "-p", "G (ns@RED ||\n!ns@RED)", "-p", "G !(ns@GREEN && ew@GREEN)")
    assert [line.split()[:2] for line in done.stdout.splitlines()] == [
        ["holds", "L1"],
        ["holds", "L3"],
        ["holds", "faults"],
    ]
