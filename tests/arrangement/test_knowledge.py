"""Theories in arrangements and machines: what entries mean, what is said of wrong ones, and that chains stay linear."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import llfsm_verify as lv
from llfsm_verify.arrangement.formats import Given, read_arrangement
from llfsm_verify.arrangement.loader import build_arrangement, load_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.arrangement.replacing import Replacement, with_change
from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.verdict import Options, Verdict
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment, Source
from llfsm_verify.language.atoms import PropertyScope, check_atom
from llfsm_verify.language.trees import nodes
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.program import trees
from llfsm_verify.program.program import Program
from llfsm_verify.program.trees import distinct_nodes, expressions, statements
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.verification.verify import checker

COOK = """\
C0: {} => ~cook.
input {timeLeft}. input {doorOpen}.
C1: timeLeft => cook. C1 > C0.
C2: doorOpen => ~cook. C2 > C1.
output {b cook, "cook"}.
"""
MICROWAVE = """\
cycle_ms: 100
whiteboard:
  door: {type: bool, role: input}
  time_left: {type: 0..9, role: input}
  motor: {type: bool, role: output}
knowledge:
  cook: {file: Cook.d, inputs: {timeLeft: time_left > 0, doorOpen: door}}
machines:
  m: {file: m.machine.yaml}
schedule: [m]
"""
MACHINE = """\
machine: M
variables: {doorOpen: {type: bool}, wait: {type: bool}}
knowledge:
  start: {file: Cook.d, inputs: {timeLeft: cook && !wait}, output: cook}
states:
  - name: OFF
    on_entry: |
      motor = false;
      wait = !wait;
    transitions: [{when: start, to: ON}]
  - name: ON
    on_entry: motor = cook;
    transitions: [{when: not cook, to: OFF}]
"""


def arranged(text: str = MICROWAVE, **files: str) -> Arrangement:
    """The microwave, with other texts in the place of some files (`Cook_d` for `Cook.d`)."""
    there = {"Cook.d": COOK, "m.machine.yaml": MACHINE} | {k.replace("_", "."): v for k, v in files.items()}
    return resolve(read_arrangement(Given("a.yaml", text, files=there)))


def said(text: str = MICROWAVE, **files: str) -> list[str]:
    """What is wrong."""
    with pytest.raises(DiagnosticError) as caught:
        arranged(text, **files)
    return [f"{d.span}: {d.code}: {d.message}" for d in caught.value.diagnostics]


def fragment(text: str) -> Fragment:
    return Fragment(text, Source("p", text), range(len(text) + 1))


def verdicts(arrangement: Arrangement, *properties: str) -> list[str]:
    sources = [Source("p.ltl", "\n".join(properties))]
    result = checker("explicit")(bind(arrangement, parse_properties(sources)), Options())
    return [p.verdict.value for p in result.properties]


def test_entries_of_arrangements_and_machines_in_properties() -> None:
    holds = ('G "cook == (time_left > 0 && !door)"', 'G "m.start == (cook && !m.wait && !m.doorOpen)"')
    assert verdicts(arranged(), *holds, "G cook", "F (rose(cook))") == ["holds", "holds", "violated", "violated"]


def test_python_data_names_theories_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("Cook.d").write_text(COOK)
    machine = {"machine": "M", "states": [{"name": "A", "internal": "on = cook;", "stays": True}]}
    document: dict[str, Any] = {
        "whiteboard": {n: {"type": "bool", "role": "input"} for n in ("timeLeft", "doorOpen")}
        | {"on": {"type": "bool"}},
        "knowledge": {"cook": {"file": "Cook.d"}},
        "machines": {"m": {"inline": machine}},
        "schedule": ["m"],
    }
    assert verdicts(build_arrangement(document), 'G "cook == (timeLeft && !doorOpen)"') == ["holds"]
    known = {"other": {"file": "Cook.d"}}
    own = lv.MachineDefinition("M", {"A": {"internal": "on = other;", "stays": True}}, knowledge=known)
    model = lv.build("a", {"m": own}, whiteboard=document["whiteboard"], knowledge=document["knowledge"])
    Path("new").mkdir()
    model.write("new/a.yaml")
    assert Path("new/a.yaml").read_text().count("file: ../Cook.d") == 2
    assert verdicts(lv.load("new/a.yaml").wrapped, "G (m.other <-> cook)") == ["holds"]


def test_a_theory_is_relative_to_the_file_that_names_it(tmp_path: Path) -> None:
    for name, text in {"a.yaml": MICROWAVE, "Cook.d": COOK, "machines/m.machine.yaml": MACHINE}.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text.replace("{file: m.", "{file: machines/m."))
    with pytest.raises(DiagnosticError, match="E001"):
        load_arrangement(tmp_path / "a.yaml")
    (tmp_path / "machines/Cook.d").write_text(COOK.replace("=> cook", "-> cook"))
    draft = read_arrangement(Given(tmp_path / "a.yaml"))
    names = ["a.yaml", "Cook.d", "machines/m.machine.yaml", "machines/Cook.d"]
    assert [Path(s.name).relative_to(tmp_path).as_posix() for s in draft.sources] == names
    assert {Path(f).name for f in draft.files} == {"Cook.d", "m.machine.yaml"}
    (tmp_path / "Cook.d").write_text(COOK + "% changed\n")
    assert read_arrangement(Given(tmp_path / "a.yaml")).digest != draft.digest


FALSE = "it is false then"
MANY = [f"i{n}" for n in range(21)]


@pytest.mark.parametrize(
    ("inputs", "rules", "warning"),
    [
        ("a", "a => q.", "W004: `q` is neither proved nor refuted where `a` is false: it is false then"),
        ("a", "a -> q. {} -> ~q.", "W005: `q` and `~q` are both proved where `a` is true: it is true then"),
        ("a", "a => q. ~a => ~q.", None),
        ("a", "{} ~> ~q. {} => q.", "W004: `q` is neither proved nor refuted: " + FALSE),
        (
            ", ".join(MANY),
            f"{', '.join(MANY)} => q.",
            "W004: `q` depends on more than 20 inputs, so it is not known where it is undecided",
        ),
    ],
)  # fmt: skip
def test_what_is_not_decided_is_said_with_a_valuation(inputs: str, rules: str, warning: str | None) -> None:
    found = [d for d in warned(inputs, rules) if d.code != "W006"]
    assert [f"{d.code}: {d.message}" for d in found] == ([] if warning is None else [warning])
    assert all(d.span is not None and d.span.text == "q" for d in found)


def warned(inputs: str, rules: str) -> tuple[Diagnostic, ...]:
    """Warnings about a theory of two entries."""
    board = "".join(f"  {n}: {{type: bool, role: input}}\n" for n in inputs.split(", "))
    text = f"whiteboard:\n{board}knowledge: {{q: {{file: Q.d}}, second: {{file: Q.d, output: q}}}}\n"
    text += "machines: {m: {inline: {machine: M, knowledge: {third: {file: Q.d}}, states: [{name: A}]}}}\n"
    text += "schedule: [m]\n"
    return arranged(text, Q_d=f"input {{{inputs}}}. {rules} output {{b q}}.").warnings


@pytest.mark.parametrize(
    ("rules", "hint"),
    [
        ("{} => ~q. a, b => q.", "`{} => ~q` and `a, b => q` block each other: give them labels, and write which is "),
        ("A: a => q. B: b => ~q. D: {} => ~q. A > D.", "`A` and `B` block each other: write `A > B.` or `B > A.`"),
        ("A: a => q. B: b ~> ~q. D: {} => ~q. A > D.", "`B` blocks `A`: write `A > B.`"),
        ("A: a => q. B: {b,\n a} => ~q. a => q. D: {} => ~q. A > D.", "`A` and `B` block each other: write"),
        (
            "A: a => q. B: b => ~q. C: ~a => q. D: ~a => ~q. B > C. C > D. D > A.",
            "`A` and `B` block each other: write `B > A.`",
        ),
        ("A: a => q. B: b ~> ~q. D: {} => ~q. A > D. B > A.", "`B` is stronger than `A`, but concludes nothing: write"),
        ("a, b => q.", "add a rule for what holds by default, such as `{} => ~q.`"),
        ("a, ~b => ~q. b => q.", "add a rule for what holds by default, such as `{} => ~q.`"),
    ],
)  # fmt: skip
def test_what_decides_is_told(rules: str, hint: str) -> None:
    found = warned("a, b", rules)
    assert {d.code for d in found} == {"W004"}, found
    assert (found[0].hint or "").startswith(hint)


def test_what_no_output_depends_on_is_told_once() -> None:
    found = warned("a, b, c", "a => Q. a, b => q. {} => ~q. r => s. a => r. b => ~s.")
    assert [(d.span and d.span.text, d.message, d.hint) for d in found if d.code == "W006"] == [
        ("c", "no output depends on input `c`", "write a rule with `c` in its body, or remove the input"),
        ("a => Q", "no output depends on `Q`", "did you mean `q`?"),
        ("r => s", "no output depends on `s`", "write `s` in the body of a rule, or `output {b s}.`"),
    ]


def test_mistakes_in_theories_and_entries_are_said_at_their_places() -> None:
    assert said(Cook_d=COOK.replace("C2 > C1", "C2 > C7")) == ["Cook.d:4:29: E574: no rule has the label `C7`"]
    assert said(Cook_d="ROOT: secret\n") == [
        "a.yaml:7:16: E019: `Cook.d` is not a theory: no line of it begins with `input {` or `output {`",
    ]
    two = COOK + "{} => other. output {b other}.\n"
    assert said(MICROWAVE.replace("  cook:", "  go:").replace("Cook.d", "Two.d"), Two_d=two)[0] == (
        "a.yaml:7:3: E166: theory `Cook` has 2 outputs, and none of them is called `go`"
    ).replace("`Cook`", "`Two`")
    assert said(**{"m.machine.yaml": MACHINE.replace("doorOpen: {type: bool}, ", "")}) == [
        "m.machine.yaml:4:3: E167: input `doorOpen` of theory `Cook` is told nothing, and no variable is called so"
    ]


@pytest.mark.parametrize(
    ("old", "new", "code"),
    [
        ("wait: {type: bool}}", "wait: {type: bool}, cook: {type: bool}}", "E118"),
        ("  start:", "  cook:", "E118"),
        ("  start:", "  wait:", "E118"),
        ("  start:", "  m:", "E118"),
        ("  start:", "  self:", "E119"),
        ("cook && !wait", "start", "E110"),
        ("cook && !wait", "after(1)", "E168"),
        ("motor = cook;", "start = cook;", "E127"),
        ("machine: M\n", "machine: M\nparameters: {start: {constant: bool}}\n", "E061"),
    ],
)
def test_wrong_entries_of_machines(old: str, new: str, code: str) -> None:
    with pytest.raises(DiagnosticError) as caught:
        arranged(**{"m.machine.yaml": MACHINE.replace(old, new)})
    assert code in {d.code for d in caught.value.diagnostics}


@pytest.mark.parametrize(
    ("told", "code"),
    [
        ("6 / (time_left + 1) > 2", "E143"),
        ("few[time_left]", "E144"),
        ("(bits & 1) == 1", "E145"),
        ("sqrt(time_left) > 1", "E145"),
        ("few[1] && time_left % 2 == 1", ""),
    ],
)
def test_a_property_asks_no_theory_that_is_told_what_it_cannot_say(told: str, code: str) -> None:
    more = "  few: {type: {array: bool, size: 10}}\n  bits: {type: uint8}\nknowledge"
    arrangement = arranged(MICROWAVE.replace("knowledge", more).replace("time_left > 0", f'"{told}"'))
    found: list[tuple[str, str | None, int]] = []
    try:
        check_atom(fragment("cook && door"), PropertyScope.of(arrangement))
    except DiagnosticError as e:
        found = [(d.code, d.span and d.span.text, len(d.notes)) for d in e.diagnostics]
    assert found == ([(code, "cook", 1)] if code else [])


def test_a_name_that_is_spelt_wrong_is_told() -> None:
    scope = PropertyScope.of(arranged())
    for text, hint in {
        "cok": "did you mean `cook`?",
        "m.strat": "did you mean `start`?",
        "start": "write `m.start`",
    }.items():
        with pytest.raises(DiagnosticError) as caught:
            check_atom(fragment(text), scope)
        assert caught.value.diagnostics[0].hint == hint


def test_a_machine_that_is_loaded_has_the_theories_of_the_run() -> None:
    files = {"Cook.d": COOK, "m.machine.yaml": MACHINE}
    draft = read_arrangement(Given("a.yaml", MICROWAVE, files=files))
    other = resolve(with_change(draft, Replacement("m", "new.yaml", MACHINE.replace("motor = cook", "motor = true"))))
    assert verdicts(other, 'G "m.start == (cook && !m.wait && !m.doorOpen)"') == ["holds"]
    with pytest.raises(DiagnosticError, match="the run has no such file"):
        resolve(with_change(draft, Replacement("m", "new.yaml", MACHINE.replace("Cook.d", "Else.d"))))


# ---------------------------------------------------------------- sizes


def chain(length: int) -> Arrangement:
    """Each theory asks the one before twice."""
    theory = "input {a}. input {b}. R: a, ~b => q. S: ~a, b => q. R > D. S > D. D: {} => ~q. output {b q}."
    lines = ["  k0: {file: T.d, inputs: {a: x, b: y}}"]
    lines += [f"  k{i}: {{file: T.d, inputs: {{a: k{i - 1}, b: y || k{i - 1} && x}}}}" for i in range(1, length)]
    text = (
        "whiteboard: {x: {type: bool, role: input}, y: {type: bool, role: input}, o: {type: bool, role: output}}\n"
        "knowledge:\n" + "\n".join(lines) + "\nmachines:\n"
        f"  m: {{inline: {{machine: M, states: [{{name: A, internal: o = k{length - 1};, stays: true}}]}}}}\n"
        "schedule: [m]\n"
    )
    return arranged(text, T_d=theory)


def size(program: Program) -> int:
    """Nodes of all expressions, those of a letter too, each counted wherever it stands."""
    blocks = (*(b for slot in program.slots for b in slot.blocks), program.letter)
    return sum(1 for b in blocks for s in statements(b) for e in expressions(s) for _ in trees.nodes(e))


def test_a_chain_of_theories_grows_with_its_length() -> None:
    def program(length: int) -> Program:
        sources = [Source("p.ltl", f"G (k{length - 1} -> x || y)\nG (rose(k{length - 1}) -> !Y k{length - 1})")]
        problem = bind(chain(length), parse_properties(sources))
        return lower(problem.arrangement, problem.atoms)

    small, large = program(10), program(40)
    assert size(large) < 4.5 * size(small)
    assert sum(1 for a in large.atoms for _ in distinct_nodes(a.expression)) < 5000
    entry = chain(40).knowledge["k39"]
    assert sum(1 for _ in nodes(entry)) < 40 * 100


@pytest.mark.slow
def test_a_long_chain_is_decided() -> None:
    assert verdicts(chain(30), "G (k29 -> x || y)", "G !k29", "G (rose(k29) -> !Y k29)")[0] == Verdict.HOLDS.value
