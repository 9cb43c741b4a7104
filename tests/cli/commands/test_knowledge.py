"""`llfsm knowledge`: what it prints, its exit codes, and what it says of wrong commands."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path
from random import Random

import jsonschema
import pytest

from llfsm_verify.report.schema import load
from tests.cli.running import llfsm
from tests.cli.test_interrupt import interrupted_after
from tests.knowledge.theories import DEFEATER, random_theory, tags
from tests.quick import examples

COOK = """\
% MicrowaveCook.d
name {MicrowaveCook}.
input {timeLeft}.
input {doorOpen}.
C0: {} => ~cook.
C1: timeLeft => cook. C1 > C0.
C2: doorOpen => ~cook. C2 > C1.
output {b cook, "cook"}.
"""
TWO = "input {a, b}.\na => p.\n~a => ~p.\nb => q.\na => ~q.\noutput {b p}. output {b q}.\n"
MICROWAVE = "models/microwave/arrangement.yaml"


@pytest.fixture
def cook(tmp_path: Path) -> str:
    path = tmp_path / "cook.d"
    path.write_text(COOK)
    return str(path)


@pytest.fixture
def two(tmp_path: Path) -> str:
    path = tmp_path / "two.d"
    path.write_text(TWO)
    return str(path)


def test_what_no_output_depends_on_is_said_beside_the_table(tmp_path: Path) -> None:
    path = tmp_path / "cook.d"
    path.write_text(COOK + "doorOpen => Cook. hot => ~fan. input {hot, cold}.\n")
    done = llfsm("knowledge", "table", str(path))
    assert (done.returncode, "doorOpen  cook" in done.stdout) == (0, True)
    assert re.findall(r"warning\[W006\]: (.*)", done.stderr) == [
        "no output depends on input `cold`",
        "no output depends on `Cook`",
        "no output depends on `fan`",
    ]
    assert "hint: did you mean `cook`?" in done.stderr
    path.write_text("".join(f"hot => name{n}.\n" for n in range(50)) + "input {hot}. output {b name1}.\n")
    assert llfsm("knowledge", "table", str(path)).stderr.count("W006") == 20


@pytest.mark.parametrize(
    ("command", "code", "says"),
    [
        ("", 2, "usage: llfsm knowledge"),
        ("tabel COOK", 2, "error: QUESTION: there is no `tabel`; did you mean `table`?"),
        ("table", 2, "the following arguments are required: FILE"),
        ("table cok.d", 3, "cok.d: error[E001]: there is no such file"),
        ("table tests", 3, "tests: error[E003]: this is a directory, not a file"),
        (f"table {MICROWAVE}", 3, "error[E019]: this looks like an arrangement, and a theory is expected"),
        ("table COOK --output heat", 2, "COOK has no output `heat`; it has cook"),
        ("table COOK --output cok", 2, "COOK has no output `cok`; did you mean `cook`?"),
        ("table COOK --format yaml", 2, "--format: there is no `yaml`; there are: text, json"),
        ("explain COOK doorOpn=true", 2, "COOK has no input `doorOpn`; did you mean `doorOpen`?"),
        ("explain COOK heat=true", 2, "COOK has no input `heat`; it has timeLeft, doorOpen"),
        ("explain COOK doorOpen=yes", 2, "`doorOpen` is true or false, not `yes`"),
        ("explain COOK doorOpen=1", 2, "`doorOpen` is true or false, not `1`"),
        ("explain COOK doorOpen", 2, "not `doorOpen`; write `doorOpen=true`"),
        ("explain COOK !doorOpen", 2, "not `!doorOpen`; write `doorOpen=false`"),
        ("explain COOK ~doorOpen", 2, "not `~doorOpen`; write `doorOpen=false`"),
        ("explain COOK timeLeft,doorOpen", 2, "explain needs INPUT=true or INPUT=false, not `timeLeft,doorOpen`"),
        ("explain COOK doorOpen=true doorOpen=false", 2, "explain gives `doorOpen` twice"),
        ("equivalent COOK", 2, "the following arguments are required: B"),
        ("equivalent COOK 'timeLeft && !dooropen'", 3, "error[E110]: there is no input `dooropen`"),
        ("equivalent COOK heat", 3, "hint: known here: `timeLeft`, `doorOpen`"),
        ("equivalent COOK 'timeLeft &&'", 3, "<command line>:1:11: error[E101]: the text ends too early"),
        ("equivalent COOK 'timeLeft + 1'", 3, "<command line>:1:1: error[E121]: a number is expected"),
        ("equivalent COOK '3 < 4'", 3, "<command line>:1:1: error[E145]: inputs of theories are truth values"),
        ("equivalent COOK 'after(3)'", 3, "<command line>:1:1: error[E145]: inputs of theories are truth values"),
        ("equivalent COOK ''", 3, "<command line>:1:1: error[E109]: an expression is missing here"),
        ("equivalent COOK none.d", 3, "none.d: error[E001]: there is no such file"),
        ("equivalent COOK TWO", 2, "TWO has the outputs p, q: choose one by --output"),
        ("equivalent COOK a --output cook --output cook", 2, "--output is given once for each theory at most"),
        ("equivalent a b", 2, "neither `a` nor `b` is a theory (a .d file): name one, or the arrangement"),
        (f"equivalent COOK door_open --arrangement {MICROWAVE}", 2, "write the name that `knowledge` gives to COOK"),
        (f"equivalent door_open button --output a --arrangement {MICROWAVE}", 2, "--output is for theories"),
        (f"equivalent door_open dor_open --arrangement {MICROWAVE}", 3, "did you mean `door_open`?"),
        (f"equivalent door_open time_left --arrangement {MICROWAVE}", 3, "error[E120]: a condition is expected"),
        (f"equivalent door_open oven@NO --arrangement {MICROWAVE}", 3, "error[E111]"),
        (f"equivalent door_open cycle --arrangement {MICROWAVE}", 3, "error[E145]: this asks about machines or steps"),
        (f"equivalent door_open '9/time_left > 1' --arrangement {MICROWAVE}", 3, "E143]: a property may divide only"),
        ("equivalent door_open button --arrangement none.yaml", 3, "none.yaml: error[E001]: there is no such file"),
        ("equivalent COOK a --timeout -1", 2, "--timeout"),
    ],
)  # fmt: skip
def test_wrong_commands(command: str, code: int, says: str, cook: str, two: str) -> None:
    done = llfsm("knowledge", *shlex.split(command.replace("COOK", cook).replace("TWO", two)))
    assert says.replace("COOK", cook).replace("TWO", two) in done.stderr + done.stdout
    assert (done.returncode, "Traceback" in done.stderr) == (code, False)
    if code == 3:
        assert "hint:" in done.stderr or "E00" in done.stderr


@pytest.mark.parametrize("theory", ["models/microwave/MicrowaveCook.d", "COOK"])
def test_a_table(theory: str, cook: str) -> None:
    done = llfsm("knowledge", "table", theory.replace("COOK", cook))
    assert done.returncode == 0
    assert done.stdout == (
        "timeLeft  doorOpen  cook\n"
        "false     false     false\n"
        "false     true      false\n"
        "true      false     true\n"
        "true      true      false\n"
    )


def test_a_table_marks_what_is_not_decided(two: str) -> None:
    done = llfsm("knowledge", "table", two)
    assert done.stdout == (
        "a      b      p      q\n"
        "false  false  false  false (neither)\n"
        "false  true   false  true\n"
        "true   false  true   false\n"
        "true   true   true   false (neither)\n"
        "(neither): neither the output nor its negation is proved; it is then false\n"
    )
    assert llfsm("knowledge", "table", two, "--output", "p").stdout == (
        "a      p\nfalse  false\ntrue   true\nnothing here depends on b\n"
    )


def test_a_table_marks_what_is_contradictory() -> None:
    text = "input {a}.\na -> p.\n{} -> ~p.\noutput {b p}.\n"
    done = llfsm("knowledge", "table", "-", stdin=text)
    assert "true   true (both)\n(both): the output is proved, and its negation also; it is then true\n" in done.stdout


def test_long_tables_are_cut(tmp_path: Path) -> None:
    names = [f"i{number}" for number in range(17)]
    path = tmp_path / "long.d"

    def write(count: int) -> None:
        rules = "".join(f"{name} => ~p.\n" for name in names[:count])
        path.write_text(f"input {{{', '.join(names)}}}.\n{{}} => p.\n{rules}output {{b p}}.\n")

    write(11)
    first = llfsm("knowledge", "table", str(path)).stdout.splitlines()
    assert first[-1] == "the first 1,024 of 2,048 rows; --all prints the others as well" and len(first) == 1028
    assert first[-2] == "nothing here depends on i11, i12, i13, i14, i15, i16"
    assert first[1].split() == ["false"] * 11 + ["true"]
    whole = llfsm("knowledge", "table", str(path), "--all").stdout.splitlines()
    assert whole[:1025] == first[:1025] and len(whole) == 2051
    value = json.loads(llfsm("knowledge", "table", str(path), "--format", "json").stdout)
    assert (value["count"], len(value["rows"])) == (2048, 1024)
    write(17)
    done = llfsm("knowledge", "table", str(path), "--all")
    assert done.returncode == 2 and "a table has 16 inputs at most, and this one has 17" in done.stderr


def test_an_explanation(cook: str) -> None:
    done = llfsm("knowledge", "explain", cook, "timeLeft=true", "doorOpen=true")
    assert done.returncode == 0
    assert done.stdout == (
        "cook is false where timeLeft=true, doorOpen=true\n"
        "\n"
        "cook: `~cook` is proved\n"
        "  line 5  C0: {} => ~cook        applies and wins, because C1 is beaten itself\n"
        "  line 6  C1: timeLeft => cook   applies, and is beaten by C2\n"
        "  line 7  C2: doorOpen => ~cook  applies and wins\n"
    )
    assert "does not apply: `doorOpen` is false\n" in llfsm("knowledge", "explain", cook, "timeLeft=true").stdout


def test_an_explanation_goes_down_to_the_inputs() -> None:
    text = """\
input {a, b}.
{} => wet. a ~> ~wet.
wet, ~b => slow.
~a => ~slow.
{} -> slow2. b => ~slow2.
output {b slow}. output {b slow2}.
"""
    done = llfsm("knowledge", "explain", "-", "a=true", stdin=text)
    assert (
        done.stdout
        == """\
slow is false where a=true, b=false
slow2 is true where a=true, b=false

slow: neither it nor its negation is proved
  line 3  wet, ~b => slow  does not apply: `wet` is not proved
  line 4  ~a => ~slow      does not apply: `a` is true

slow2: proved
  line 5  {} -> slow2  applies and wins
  line 5  b => ~slow2  does not apply: `b` is false

wet: neither it nor its negation is proved
  line 2  {} => wet  applies, and is blocked by the rule in line 2
  line 2  a ~> ~wet  applies, and blocks `wet`
"""
    )


def test_equivalent_to_a_condition(cook: str) -> None:
    done = llfsm("knowledge", "equivalent", cook, "timeLeft && !doorOpen")
    assert (done.returncode, done.stdout) == (0, "equal: proved by Z3 for all values of timeLeft, doorOpen\n")
    done = llfsm("knowledge", "equivalent", "timeLeft", cook)
    assert done.returncode == 1
    assert done.stdout == (
        f"told apart where timeLeft=true, doorOpen=true\n  {'timeLeft'.ljust(len(cook))}  is true\n  {cook}  is false\n"
    )


def test_equivalent_to_another_theory(cook: str, two: str, tmp_path: Path) -> None:
    other = tmp_path / "other.d"
    other.write_text("input {doorOpen, timeLeft, a}.\ntimeLeft, ~doorOpen => heat.\na => ~x.\noutput {b heat}.\n")
    done = llfsm("knowledge", "equivalent", cook, str(other))
    assert done.returncode == 0
    assert done.stdout == (
        f"equal: proved by Z3 for all values of timeLeft, doorOpen\nonly {other} has a: free in both\n"
    )
    done = llfsm("knowledge", "equivalent", two, str(other), "--output", "p", "--output", "heat")
    assert done.returncode == 1
    assert done.stdout == (
        "told apart where a=false, doorOpen=false, timeLeft=true\n"
        f"  {two} (p)  is false\n"
        f"  {str(other).ljust(len(two) + 4)}  is true\n"
        f"only {two} (p) has b: free in both\n"
        f"only {other} has doorOpen, timeLeft: free in both\n"
    )
    assert llfsm("knowledge", "equivalent", two, two, "--output", "p").returncode == 0
    assert llfsm("knowledge", "equivalent", two, two, "--output", "p", "--output", "q").returncode == 1


def test_conditions_of_an_arrangement() -> None:
    same = ("time_left > 0 && !door_open", "!(door_open || time_left <= 0)")
    done = llfsm("knowledge", "equivalent", *same, "--arrangement", MICROWAVE)
    assert (done.returncode, done.stdout) == (0, "equal: proved by Z3 for all values of door_open, time_left\n")
    done = llfsm("knowledge", "equivalent", same[0], "time_left > 1 && !door_open", "--arrangement", MICROWAVE)
    assert done.returncode == 1
    assert done.stdout == (
        "told apart where door_open=false, time_left=1\n"
        "  time_left > 0 && !door_open  is true\n"
        "  time_left > 1 && !door_open  is false\n"
        "these are values of the variables' types; `llfsm query` says whether a run reaches them\n"
    )


MACHINE = "  m: {inline: {machine: M, states: [{name: S}]}}\nschedule: [m]\n"
OVEN = """\
name: oven
cycle_ms: 100
whiteboard:
  time_left: {type: 0..180, init: 0}
  door_open: {type: bool, role: input}
  near: {type: bool}
knowledge:
  cook: {file: COOK, inputs: {timeLeft: time_left > 0, doorOpen: door_open}}
  again: {file: COOK, inputs: {timeLeft: cook, doorOpen: time_left / 10 > 2}}
  divided: {file: COOK, inputs: {timeLeft: 90 / time_left > 1, doorOpen: near}}
machines:
  m:
    inline:
      machine: M
      variables: {timeLeft: {type: bool}, seen: {type: int8}}
      knowledge: {own: {file: COOK, inputs: {doorOpen: seen > 100}}}
      states: [{name: S}]
schedule: [m]
"""


@pytest.mark.parametrize(
    ("left", "right", "code", "says"),
    [
        ("cook", "time_left > 0 && !door_open", 0, "for all values of time_left, door_open"),
        ("cook", "time_left > 1 && !door_open", 1, "told apart where time_left=1, door_open=false\n  cook "),
        ("again", "cook && time_left < 30", 0, "for all values of time_left, door_open"),
        ("again", "cook && time_left <= 30", 1, "told apart where time_left=30, door_open=false"),
        ("m.own", "m.timeLeft && m.seen <= 100", 0, "for all values of m.timeLeft, m.seen"),
        ("m.own || near", "near", 1, "told apart where near=false, m.timeLeft=true, m.seen=0"),
        ("divided", "cook", 3, "error[E143]: a property may divide only by a constant"),
        ("cok", "cook", 3, "did you mean `cook`?"),
    ],
)
def test_knowledge_of_an_arrangement(left: str, right: str, code: int, says: str, cook: str, tmp_path: Path) -> None:
    path = tmp_path / "oven.yaml"
    path.write_text(OVEN.replace("COOK", cook))
    done = llfsm("knowledge", "equivalent", left, right, "--arrangement", str(path))
    assert (done.returncode, says in done.stdout + done.stderr) == (code, True), done


@pytest.mark.slow
def test_a_chain_of_theories_is_compared(cook: str, tmp_path: Path) -> None:
    """Every one reads that before it twice: without sharing there would be 2^60 copies."""
    path = tmp_path / "chain.yaml"
    chain = [
        f"  k{i}: {{file: {cook}, inputs: {{timeLeft: k{i - 1}, doorOpen: k{i - 1} && near}}}}" for i in range(1, 61)
    ]
    first = f"  k0: {{file: {cook}, inputs: {{timeLeft: time_left > 0, doorOpen: door_open}}}}"
    head, tail = OVEN.partition("knowledge:\n")[0], OVEN[OVEN.index("machines:") :].replace("COOK", cook)
    path.write_text("\n".join((f"{head}knowledge:", first, *chain, tail)))
    same = ("k60", "time_left > 0 && !(door_open || near)")
    assert llfsm("knowledge", "equivalent", *same, "--arrangement", str(path)).returncode == 0
    assert llfsm("knowledge", "equivalent", "k60", "k0", "--arrangement", str(path)).returncode == 1


def test_a_word_is_a_condition_whatever_files_there_are(
    cook: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "oven.yaml").write_text(OVEN.replace("COOK", cook))
    (tmp_path / "theory.txt").write_text(COOK)
    for name in ("timeLeft", "near"):
        (tmp_path / name).write_text("a file")
    monkeypatch.chdir(tmp_path)
    assert llfsm("knowledge", "equivalent", "cook.d", "timeLeft").returncode == 1
    assert llfsm("knowledge", "equivalent", "near", "cook", "--arrangement", "oven.yaml").returncode == 1
    assert llfsm("knowledge", "equivalent", "theory.txt", "cook.d").returncode == 0
    assert llfsm("knowledge", "equivalent", "theory.txt", "timeLeft && !doorOpen" * 99).returncode == 3


HARD = "v * w == 4611686014132420609 && v > 1 && v < w"  # the square of a prime


@pytest.fixture
def hard(tmp_path: Path) -> str:
    path = tmp_path / "hard.yaml"
    variables = "v: {type: uint32, role: input}\n  w: {type: uint32}\n"
    path.write_text(OVEN.partition("knowledge:\n")[0] + f"  {variables}machines:\n{MACHINE}")
    return str(path)


@pytest.mark.slow
def test_a_limit_and_ctrl_c(hard: str) -> None:
    command = ("knowledge", "equivalent", HARD, "false", "--arrangement", hard)
    done = llfsm(*command, "--timeout", "0.5", "--format", "json")
    value = json.loads(done.stdout)
    jsonschema.Draft202012Validator(load("knowledge")).validate(value)
    assert (done.returncode, value["answer"], value["reason"]) == (4, "unknown", "the time limit of 0.5 s was reached")
    assert llfsm(*command, "--timeout", "0.1").stdout == "unknown: the time limit of 0.1 s was reached\n"
    assert llfsm(*command, "--memory", "1M").stdout == "unknown: the memory limit of 1 MiB was reached\n"
    assert interrupted_after(1.5, *command) == (130, "", "interrupted\n")


@pytest.mark.parametrize(
    "command",
    [
        "table COOK", "table TWO", "explain COOK doorOpen=true", "explain TWO", "equivalent COOK timeLeft",
        "equivalent COOK TWO --output cook --output p", "table none.d",
        f"equivalent time_left>3 time_left>4 --arrangement {MICROWAVE}",
        f"equivalent time_left>3 time_left>=4 --arrangement {MICROWAVE}",
    ],
)  # fmt: skip
def test_json_fits_its_schema(command: str, cook: str, two: str) -> None:
    done = llfsm("knowledge", *command.replace("COOK", cook).replace("TWO", two).split(), "--format", "json")
    value = json.loads(done.stdout)
    jsonschema.Draft202012Validator(load("knowledge")).validate(value)
    assert value["exit_code"] == done.returncode


@pytest.mark.slow
def test_tables_explanations_and_the_definition_agree_on_every_valuation(tmp_path: Path) -> None:
    path, marks = tmp_path / "random.d", set()
    for seed in range(examples(60)):
        plain = random_theory(Random(seed))
        atoms = list(dict.fromkeys(rule.head for rule in plain.rules if rule.arrow != DEFEATER and rule.head[0] != "~"))
        path.write_text(plain.text(Random(seed)) + "".join(f"output {{b {atom}}}.\n" for atom in atoms))
        shown = [option for atom in atoms for option in ("--output", atom)]
        if not atoms:
            continue
        table = json.loads(llfsm("knowledge", "table", str(path), *shown, "--format", "json").stdout)
        text = llfsm("knowledge", "table", str(path), *shown).stdout.splitlines()
        columns = text[0].split()
        for valuation in plain.valuations():
            proved = tags(plain, valuation).proved
            expected = {atom: {"proved": atom in proved, "refuted": f"~{atom}" in proved} for atom in atoms}
            rows = [number for number, row in enumerate(table["rows"]) if row["inputs"].items() <= valuation.items()]
            assert [table["rows"][number]["outputs"] for number in rows] == [expected]
            cells = dict(zip(columns, re.split(r"  +", text[1 + rows[0]]), strict=True))
            assert [cells[n] == "true" for n in columns[: -len(atoms)]] == [
                valuation[n] for n in columns[: -len(atoms)]
            ]
            for atom in atoms:
                sides = (atom in proved, f"~{atom}" in proved)
                assert cells[atom] == {(0, 0): "false (neither)", (1, 1): "true (both)"}.get(
                    sides, str(sides[0]).lower()
                )
                marks.add(sides)
            values = [f"{name}={str(value).lower()}" for name, value in valuation.items() if value or seed % 2]
            told = json.loads(llfsm("knowledge", "explain", str(path), *values, *shown, "--format", "json").stdout)
            assert told["inputs"] == valuation
            assert told["outputs"] == {atom: atom in proved for atom in atoms}
            for decision in told["decisions"]:
                atom = decision["atom"]
                assert (decision["proved"], decision["refuted"]) == (atom in proved, f"~{atom}" in proved)
    assert len(marks) == 4
