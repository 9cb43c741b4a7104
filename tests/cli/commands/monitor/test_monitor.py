"""`llfsm monitor`: what can be decided at run time, and monitors written in three shapes."""

import json
import re
from pathlib import Path

import jsonschema
import pytest
import yaml

from llfsm_verify.arrangement.keys import schema
from llfsm_verify.monitoring.json import MonitorTable
from llfsm_verify.monitoring.states import MonitorVerdict
from tests.cli.running import COUNTER, LIGHTS, llfsm
from tests.oracle.tables import letter_class

SCHEMA = json.loads(Path("llfsm_verify/report/schema/monitor.schema.json").read_text(encoding="utf-8"))
MACHINE_SCHEMA = schema("machine")
BOTH = "G !(ns@GREEN && ew@GREEN)"


def ask(*arguments, stdin=""):
    done = llfsm("monitor", *arguments, stdin=stdin)
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize(
    ("text", "code", "said", "counted"),
    [
        ("G p", 0, "monitorable: after every word a verdict can still come", "2 states: 1 not yet, 1 false"),
        ("p U q", 0, "monitorable: after every word", "3 states: 1 not yet, 1 true, 1 false"),
        ("G (p -> O q)", 0, "monitorable: after every word", "3 states: 1 not yet, 1 true, 1 false"),
        ("F[0:2] p", 0, "monitorable: after every word", "5 states: 3 not yet, 1 true, 1 false"),
        ("forbid [a && b]", 0, "monitorable: after every word", "2 states: 1 not yet, 1 false"),
        ("forbid initially a", 0, "monitorable: after every word", "3 states: 1 not yet, 1 true, 1 false"),
        ("enforce order: (m@A m@B m@C)*", 0, "monitorable: after every word", "5 states: 4 not yet, 1 false"),
        (
            "initially (p -> G F q) && initially (!p -> X G q)",
            0,
            "monitorable in part: there are words after which no verdict can come any more",
            "4 states: 2 not yet, 1 false, 1 without a verdict forever",
        ),
        ("F p || G !p", 0, "decided before anything is read: always true", "1 state: 1 true"),
        ("G F p", 1, "not monitorable: no word gives a verdict", None),
        ("F G p", 1, "not monitorable: no word gives a verdict", None),
    ],
)
def test_what_can_be_monitored(text, code, said, counted):
    status, output, errors = ask(text)
    lines = output.splitlines()
    assert (status, errors) == (code, "")
    assert lines[1].strip().startswith(said)
    assert (lines[2].strip() if len(lines) > 2 else None) == counted


def test_the_surroundings_are_warned_of_once_with_the_other_places(tmp_path):
    """Not once for each property, and not only at the first atom of all."""
    world = "{inline: {machine: W, variables: {x: {type: 0..9}}, states: [{name: S, internal: go = choose(bool);}]}}"
    (tmp_path / "a.yaml").write_text(f"{COUNTER}environment: {world}\n", encoding="utf-8")
    rules = "assume calm: G F env.x == 0\na: G go\nb: G n < 3\n" + "".join(
        f"p{i}: G env.x < {i}\n" for i in range(1, 7)
    )
    (tmp_path / "p.ltl").write_text(rules, encoding="utf-8")
    code, output, errors = ask(str(tmp_path / "p.ltl"), "--arrangement", str(tmp_path / "a.yaml"))
    assert code == 0 and output.count("monitorable:") == 8 and errors.count("W003") == 1
    assert "p.ltl:1:18" in errors.splitlines()[0]
    assert [f"p.ltl:{line}:7" in errors for line in range(4, 8)] == [True] * 3 + [
        False
    ] and "and 3 more places" in errors
    code, _, errors = ask(str(tmp_path / "p.ltl"), "--arrangement", str(tmp_path / "a.yaml"), "--only", "p6")
    assert "p.ltl:1:18" in errors and "also at" in errors and ":9:7" in errors and "more place" not in errors


def test_definitions_and_families(tmp_path):
    _, output, errors = ask("define x: p && q", "a: G x", "for n in {r, s}: b: F n")
    assert errors == ""
    assert [line for line in output.splitlines() if ":" in line and line[0] != " "][:1]
    assert "G (p && q)" in output and "b_r" in output and "b_s" in output
    file = tmp_path / "p.ltl"
    file.write_text("define car: true\na: G !car\n")
    code, _, errors = ask(str(file), "--arrangement", LIGHTS)
    assert code == 3 and "E317" in errors


def test_several_properties_and_names():
    status, output, _ = ask("G p", "G F q", "named: F p", "forbid x")
    assert status == 1
    heads = [line for line in output.splitlines() if not line.startswith(" ")]
    assert heads == ["P1: G p", "P2: G F q", "named: F p", "forbid P4: x"]
    assert ask("G p", "G F q", "--only", "P1")[0] == 0


@pytest.mark.parametrize("kind", ["enforce", "forbid", "forbid initially"])
def test_regular_properties_with_and_without_a_name(kind):
    nameless, named = ask(f"{kind} a b"), ask(f"{kind} x: a b")
    assert nameless[0] == named[0] == 0 and not nameless[2] + named[2]
    heads = [found[1].split("\n", 1) for found in (nameless, named)]
    assert [head for head, _ in heads] == [f"{kind} P1: a b", f"{kind} x: a b"]
    assert heads[0][1] == heads[1][1]
    assert ask(f"# why\n {kind}  x : a b")[1] == named[1]
    assert "[E311]" in ask(f"{kind}: a b")[2]


def test_atoms_that_are_called_like_kinds():
    assert ask("forbid -> p")[1].startswith("P1: forbid -> p\n")
    assert "did you mean `forbid initially`?" in ask("forbid Initially x: a b")[2]


def test_property_files_and_their_assumptions(tmp_path):
    path = tmp_path / "p.ltl"
    path.write_text("assume fair: G F p\ngoal: G (q -> F p)\nenforce order: (a b)*\n")
    status, output, _ = ask(str(path))
    assert status == 0
    assert "goal: G (q -> F p)\n  decided before anything is read: always true" in output
    assert "enforce order" in output
    assert ask("-", stdin="# syntax: spot\nGFa\n")[0] == 1
    assert ask("--syntax", "spot", "{a;b}|->c")[0] == 0
    status, _, errors = ask("-", "-")
    assert status == 2 and "only once" in errors


def test_automata_from_files(tmp_path):
    (tmp_path / "a.hoa").write_text(
        'HOA: v1\nStates: 1\nStart: 0\nAP: 1 "p"\nAcceptance: 0 t\n--BODY--\nState: 0\n[0] 0\n--END--\n'
    )
    (tmp_path / "p.ltl").write_text("automaton safe: a.hoa\n")
    status, output, _ = ask(str(tmp_path / "p.ltl"))
    assert status == 0
    assert output.splitlines()[0] == "automaton safe: a.hoa" and "2 states: 1 not yet, 1 false" in output


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (["G ("], "E309"),
        (["G (F[<=2s] p)"], "E335"),
        (["forbid"], "E314"),
        (["forbid (a"], "E309"),
        (["ensure x: a"], "E312"),
        (["forbid a*"], "E342"),
        (["enforce [p && !p]"], "E344"),
        (["x: G p", "x: G q"], "E313"),
        (["nowhere.ltl"], "E301"),
        (["G F p", "--as", "machine"], None),
        (["G m.ran", "--as", "machine"], "E430"),
        (["G x == 3", "--as", "machine"], "E431"),
        (["G p", "--as", "machine", "--set", "two words"], "E435"),
        (["F p", "--as", "machine", "--suspend", "m"], "E436"),
        (["G nothing", "--arrangement", LIGHTS], "E110"),
        (["G p", "--as", "table", "-o", "no/such/folder/t.json"], "E434"),
    ],
)
def test_mistakes_are_diagnostics(arguments, code):
    status, output, errors = ask(*arguments)
    assert output == ""
    if code is None:
        assert status == 1 and "E432" in errors and "is not monitorable" in errors
    else:
        assert status == 3 and f"[{code}]" in errors


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["G p", "G q", "--as", "table"], "choose with --only P1 or P2"),
        (["G p", "--only", "q"], "--only: there is no property `q`; there are: P1"),
        (["G p", "--set", "alarm"], "--as machine"),
        (["assume a: G p"], "there is no property"),
    ],
)
def test_usage(arguments, said):
    status, _, errors = ask(*arguments)
    assert status == 2 and said in errors


@pytest.mark.slow
def test_what_is_too_large_is_unknown(monkeypatch):
    monkeypatch.setattr("llfsm_verify.monitoring.json.MAX_CELLS", 2)
    status, output, errors = ask("G (p -> X q)", "--as", "table")
    assert (status, output) == (4, "") and "W301" in errors
    status, output, errors = ask("G (p -> " + "X " * 14 + "q)", "G p")
    assert status == 4 and "unknown" in errors and "P2: G p" in output


def test_tables_follow_their_schema(tmp_path):
    path = tmp_path / "t.json"
    assert ask("enforce order: (m@A [m@B && p])*", "--as", "table", "-o", str(path))[0] == 0
    document = json.loads(path.read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    jsonschema.validate(document, SCHEMA)
    assert document["property"] == {"name": "order", "kind": "enforce", "text": "(m@A [m@B && p])*"}
    assert all(len(state["next"]) == len(document["classes"]) for state in document["states"])
    mask = lambda bits: sum(1 << bit for bit in bits)  # noqa: E731
    table = MonitorTable(
        tuple(document["atoms"]),
        tuple(tuple((mask(cube["true"]), mask(cube["false"])) for cube in cubes) for cubes in document["classes"]),
        tuple(tuple(state["next"]) for state in document["states"]),
        tuple(MonitorVerdict(state["verdict"]) for state in document["states"]),
        tuple(state["hopeless"] for state in document["states"]),
    )
    state = 0
    for true in (["m@A"], ["m@A"], ["m@B", "p"], ["m@A"], ["m@B"]):
        assert table.verdicts[state] is MonitorVerdict.NOT_YET
        state = table.rows[state][letter_class(table, mask(table.atoms.index(key) for key in true))]
    assert table.verdicts[state] is MonitorVerdict.FALSE


@pytest.mark.slow
def test_machines_are_machine_files(tmp_path):
    path = tmp_path / "monitor.machine.yaml"
    status, output, errors = ask(
        f"both: {BOTH}", "--as", "machine", "--arrangement", LIGHTS, "--suspend", "ew", "-o", str(path)
    )
    assert (status, output) == (0, "")
    assert "1 letter of 4" in errors
    document = yaml.load(path.read_text(encoding="utf-8"), Loader=yaml.BaseLoader)
    jsonschema.validate(document, MACHINE_SCHEMA)
    assert document["machine"] == "Monitor_both"
    assert list(document["parameters"]) == ["ns", "ew"]
    arrangement = tmp_path / "a.yaml"
    text = Path("models/traffic_lights/faulty.yaml").read_text(encoding="utf-8")
    text = text.replace("file: ", f"file: {Path('models/traffic_lights').resolve()}/")
    text = text.replace("schedule: [timer, ns, ew]", "schedule: [timer, ns, monitor, ew]")
    monitor = f"  monitor: {{file: {path}, parameters: {{ns: ns, ew: ew}}}}\n"
    arrangement.write_text(text.replace("machines:\n", "machines:\n" + monitor), encoding="utf-8")
    done = llfsm("verify", str(arrangement), "-p", "caught: G !monitor.violated", "-p", BOTH, "--quiet")
    assert done.returncode == 1
    assert done.stdout.splitlines()[0].split()[:2] == ["violated", "caught"]


def test_drawings():
    status, output, _ = ask("p U q", "--as", "dot")
    assert status == 0
    assert output.startswith('digraph "P1: p U q" {') and output.rstrip().endswith("}")
    assert any(re.search(rf"s0 -> s{n} \[label=.*>q<", output) for n in (1, 2))


def test_help_names_the_exit_codes():
    done = llfsm("monitor", "--help")
    assert done.returncode == 0 and "1 some are not" in done.stdout
