"""What lint finds in small arrangements, each made for one kind of mistake, and how suppressions accept it."""

from __future__ import annotations

import shlex
import tempfile
import textwrap
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import pytest
import yaml

from llfsm_verify.analysis.lint.finding import Finding, LintResult
from llfsm_verify.analysis.lint.reach import Reach
from llfsm_verify.analysis.lint.run import lint
from llfsm_verify.arrangement import build_arrangement, load_arrangement_text
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.verdict import Options
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.kripke.kernels import blocks
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.report.lint import lint_text
from llfsm_verify.verification.query import ask, parse_query
from llfsm_verify.verification.verify import verify

Document = dict[str, object]


def arrangement(states: list[Document], whiteboard: Document | None = None, **keys: object) -> Document:
    machine: Document = {"machine": "M", "states": states, **keys}
    return {"whiteboard": whiteboard or {}, "machines": {"m": {"inline": machine}}, "schedule": ["m"]}


def state(name: str, *transitions: tuple[str, str], **keys: object) -> Document:
    return {"name": name, "transitions": [{"when": w, "to": t} for w, t in transitions], **keys}


def said(result: LintResult) -> list[tuple[str, str, str, str]]:
    """Code, level, proof, and the text at the place, of what is not silenced."""
    return [(f.code, f.level, f.proof, " ".join(f.span.text.split()).strip('"')) for f in result.shown]


def found(document: Document, **options: bool) -> list[tuple[str, str, str, str]]:
    return said(lint(build_arrangement(document), **options))


CAR: Document = {"car": {"type": "bool", "role": "input"}}


def test_nothing_is_said_of_good_style() -> None:
    """Guards that exclude each other, a fallback `true`, a `false` that stays forever."""
    states = [
        state("A", ("car", "B"), ("not car", "C")),
        state("B", ("car", "A"), ("true", "C")),
        state("C", ("false", "A"), ("true", "C")),
    ]
    assert found(arrangement(states, CAR)) == []


@pytest.mark.parametrize(
    ("ways", "note"),
    [
        ((), "no transition leads to it"),
        ((("n == 1", "C"),), "the only transition to it never fires"),
        ((("n == 1", "C"), ("n == 2", "C")), "none of the 2 transitions to it fires"),
    ],
)
def test_the_ways_to_a_state_that_is_never_entered(ways: tuple[tuple[str, str], ...], note: str) -> None:
    states = [state("A", *ways, ("true", "B")), state("B", ("true", "A")), state("C", ("true", "C"))]
    result = lint(build_arrangement(arrangement(states, {"n": {"type": "0..3"}})))
    (only,) = [each for each in result.shown if each.code == "L002"]
    assert only.notes[0] == note


def test_a_transition_that_others_cover() -> None:
    states = [state("A", ("car", "B"), ("not car", "B"), ("true", "C")), state("B", ("true", "A")), state("C")]
    assert found(arrangement(states, CAR)) == [
        ("L001", "warning", "local", "true"),
        ("L002", "warning", "local", "C"),
    ]


def test_a_guard_that_cannot_be_true() -> None:
    whiteboard = {"n": {"type": "0..9", "role": "input"}}
    states = [state("A", ("n > 5 && n < 3", "B"), ("n > 3", "B")), state("B", ("true", "A"))]
    result = lint(build_arrangement(arrangement(states, whiteboard)))
    assert said(result) == [("L001", "warning", "local", "n > 5 && n < 3")]
    assert result.findings[0].notes == ("its guard is never true",)
    assert result.exit_code == 1


@pytest.mark.slow
def test_only_the_reachable_configurations_tell() -> None:
    """`n` is 0 or 2, so `n == 1` is never true, which no single turn tells."""
    whiteboard = {"n": {"type": "0..2", "init": 0}, **CAR}
    states = [
        state("A", ("n == 1", "B"), ("car", "C"), on_entry="n = 2 - n;"),
        state("B", ("true", "A")),
        state("C", ("true", "A")),
    ]
    document = arrangement(states, whiteboard)
    assert found(document) == [("L001", "warning", "reachable", "n == 1"), ("L002", "warning", "reachable", "B")]
    assert found(document, local=True) == [("L003", "note", "ranges", "car")]
    cut = lint(build_arrangement(document), Limits(max_states=1))
    assert said(cut) == [("L003", "note", "ranges", "car")]
    assert cut.exit_code == 4
    assert {q.code for q in cut.open} == {"L001", "L002", "L012"}


def test_guards_that_overlap() -> None:
    whiteboard = {"a": {"type": "0..9", "role": "input"}, "b": {"type": "bool", "role": "input"}}
    states = [
        state("A", ("a > 3", "B"), ("b", "C"), ("a < 2", "C")),
        state("B", ("true", "A")),
        state("C", ("true", "A")),
    ]
    result = lint(build_arrangement(arrangement(states, whiteboard)))
    assert said(result) == [("L003", "note", "run", "b")]  # of `b` and `a < 2` both lead to C
    witness = result.findings[0].witness
    assert witness is not None
    assert int(dict(witness.inputs)["a"]) > 3
    assert dict(witness.inputs)["b"] == "true"
    assert result.exit_code == 0


def overlapping(*properties: str) -> list[Finding]:
    whiteboard = {**CAR, "a": {"type": "0..9", "role": "input"}}
    states = [state("A", ("a > 3", "B"), ("car", "B")), state("B", ("true", "A"))]
    loaded = build_arrangement(arrangement(states, whiteboard))
    atoms = bind(loaded, parse_properties([Source("p", "\n".join(properties))])).atoms
    return [f for f in lint(loaded, atoms=atoms).shown if f.code == "L003"]


@pytest.mark.slow
def test_guards_that_overlap_and_lead_to_one_state() -> None:
    """Which of them fires is seen by nobody, unless a property asks for the number."""
    assert overlapping() == []
    assert overlapping("G !m@B || F m.fired(B, 0)") == []
    assert [f.span.text.strip('"') for f in overlapping("G !m.fired(A, 1)")] == ["car"]


CHAIN = """
machines:
  m:
    inline:
      machine: M
      states:
        - name: A
          transitions:
            - {when: d < 2, to: A}
            - {when: d < 4, to: B%s}
            - {when: d < 6, to: C}
            - {when: d < 8, to: D}
        - {name: B, transitions: [{when: true, to: A}]}
        - {name: C, transitions: [{when: true, to: A}]}
        - {name: D, transitions: [{when: true, to: A}]}
whiteboard: {d: {type: 0..9, role: input}}
schedule: [m]
"""


def test_a_chain_of_thresholds_is_one_note() -> None:
    (note,) = lint(load_arrangement_text(CHAIN % "")).shown
    assert (note.code, note.level, note.span.text) == ("L003", "note", "d < 4")
    assert note.notes == (
        "it is at line 9, and leads to A",
        "so can `d < 2` and `d < 6` at line 11",
        "so can `d < 4` and `d < 6` at line 11",
        "so can `d < 2` and `d < 8` at line 12",
        "and so can 2 more pairs of guards of this state",
    )


def test_a_silence_accepts_its_pairs_of_a_chain_and_no_others() -> None:
    accepted, note = lint(load_arrangement_text(CHAIN % ", lint: {L003: nearest first}")).findings
    assert (accepted.suppressed, accepted.span.text) == ("nearest first", "d < 4")
    assert (note.suppressed, note.span.text, len(note.notes)) == (None, "d < 6", 5)


def test_what_a_fault_is_called() -> None:
    whiteboard = {"n": {"type": "0..9", "init": 0, "role": "output"}, "by": {"type": "0..3", "role": "input"}}
    states = [state("A", ("by == 3", "A"), internal="n = n / by + by;")]
    messages = {f.message for f in lint(build_arrangement(arrangement(states, whiteboard))).shown}
    assert "this may divide by zero: by is 0" in messages
    states = [state("A", ("by == 3", "B"), internal="n += by;"), state("B", on_entry="n = by - 9;")]
    messages = {f.message for f in lint(build_arrangement(arrangement(states, whiteboard))).shown}
    assert messages == {
        "this may leave its range: n is declared 0..9",
        "this always faults (value outside its range: n is declared 0..9)",
    }


@pytest.mark.slow
def test_an_open_question_says_the_command_that_may_decide_it() -> None:
    """Names that are operators of formulas are quoted."""
    whiteboard = {**CAR, "n": {"type": "int", "init": "0"}}
    up = state("U", ("car", "V"), ("n < 0", "F"), on_entry="n += 1;")
    inline = {"machine": "M", "states": [up, state("V", ("true", "U")), state("F")]}
    document: Document = {"whiteboard": whiteboard, "machines": {"G": {"inline": inline}}, "schedule": ["G"]}
    loaded = build_arrangement(document)
    (question,) = (q for q in lint(loaded, Limits(max_states=20)).open if q.code == "L001")
    command = (question.hint or "").partition("`")[2].rpartition("`")[0]
    assert shlex.split(command)[:3] == ["llfsm", "query", loaded.path]
    query = parse_query(shlex.split(command)[3], "formula")
    answer = ask(loaded, query, Options(), "pdr")
    assert answer.exit_code == 1


def test_conditions_that_are_constant() -> None:
    whiteboard = {"n": {"type": "0..9", "role": "input"}, "x": {"type": "bool", "role": "output"}}
    body = "if (n > 3 || n < 5) x = true; x = n > 3 && (n > 2 || x) ? true : false;"
    states = [state("A", ("n == 4", "A"), internal=body)]
    # The second is implied by the condition before it; the one around both is not constant.
    assert found(arrangement(states, whiteboard)) == [
        ("L004", "warning", "local", "n > 3 || n < 5"),
        ("L004", "warning", "local", "n > 2 || x"),
    ]


@pytest.mark.parametrize(
    ("guard", "body", "expected"),
    [
        ("n > 3 || n < 5", "", [("L004", "warning", "the guard `n > 3 || n < 5` is always true")]),
        ("k < 2", "k = 1 - k;", [("L004", "note", "the guard `k < 2` is always true")]),
        (
            "n > 3",
            "if (n > 5 && n < 3) k = 1;",
            [("L005", "warning", "the condition `n > 5 && n < 3` is always false")],
        ),
        ("n > 3", "if (k == 2) x = true; k = 1 - k;", [("L005", "note", "the condition `k == 2` is always false")]),
        (
            "n > 3",
            "x = (n > 6 || n < 2) && n == 4;",
            [
                ("L005", "warning", "the condition `n > 6` is always false"),
                ("L005", "warning", "the condition `n == 4` is always false"),
            ],
        ),
        ("n > 3 && n < 3", "", [("L001", "warning", "the transition A -> B can never fire")]),  # and nothing else
    ],
)
def test_what_is_said_of_constant_conditions(guard: str, body: str, expected: list[tuple[str, str, str]]) -> None:
    whiteboard = {
        "n": {"type": "0..9", "role": "input"},
        "k": {"type": "0..2", "init": 0, "role": "output"},
        "x": {"type": "bool", "role": "output"},
    }
    states = [state("A", (guard, "B"), internal=body), state("B", ("true", "A"))]
    said = lint(build_arrangement(arrangement(states, whiteboard))).shown
    assert [
        (f.code, f.level, f.message.replace('"', "")) for f in said if f.code in ("L001", "L004", "L005")
    ] == expected


@pytest.mark.parametrize(
    ("earlier", "guard", "body", "why"),
    [
        ("n > 3", "n > 5", "", "whenever its guard is true, a transition before it fires"),
        ("n > 3 || n < 5", "n == 4", "", "whenever its turn would come, a transition before it has fired"),
        ("n > 3", "n < 2 && n > 7", "", "its guard is never true"),
        ("n > 3", "n == 1", "k = n / (k - k);", "no turn gets as far as its guard: each ends in a fault before"),
        ("n > 3", "n < 9 && k == 2", "k = 1 - k;", "its guard is never true"),
    ],
)
def test_why_a_transition_can_never_fire(earlier: str, guard: str, body: str, why: str) -> None:
    whiteboard = {"n": {"type": "0..9", "role": "input"}, "k": {"type": "0..2", "init": 0, "role": "output"}}
    first = state("A", (earlier, "B"), (guard, "C"), on_entry=body)
    result = lint(build_arrangement(arrangement([first, state("B", ("true", "A")), state("C")], whiteboard)))
    (finding,) = (f for f in result.shown if f.message == "the transition A -> C can never fire")
    assert finding.notes == (why,)


def test_a_warning_of_the_loader_is_not_said_again() -> None:
    states = [state("A", ("n >= 0", "B")), state("B", ("true", "A"))]
    document = arrangement(states, {"n": {"type": "0..9", "role": "input"}})
    assert [w.code for w in build_arrangement(document).warnings] == ["W002"]
    assert found(document) == []


def test_values_that_leave_their_range() -> None:
    whiteboard = {"n": {"type": "0..9", "init": 0, "role": "output"}, "by": {"type": "0..3", "role": "input"}}
    states = [state("A", ("by == 3", "B"), internal="n += by;"), state("B", ("true", "C"), on_entry="n = by - 9;")]
    result = lint(build_arrangement(arrangement([*states, state("C")], whiteboard)))
    assert [entry[:3] for entry in said(result)] == [
        ("L007", "warning", "run"),
        ("L001", "warning", "reachable"),
        ("L006", "warning", "run"),
        ("L002", "warning", "reachable"),
    ]
    assert result.findings[1].notes == ("no turn gets as far as its guard: each ends in a fault before",)
    witness = result.findings[0].witness
    assert witness is not None
    assert witness.trace is not None
    assert witness.trace.fault is not None
    assert int(dict(witness.variables)["n"]) + int(dict(witness.inputs)["by"]) > 9


@pytest.mark.slow
def test_runs_where_inputs_are_too_wide_to_enumerate() -> None:
    whiteboard = {n: {"type": "0..65535", "role": "input"} for n in ("a", "b")}
    whiteboard["k"] = {"type": "0..65535"}
    states = [state("A", ("b > 40000", "B"), on_entry="k = a + b;"), state("B", ("k / a == 7", "A"))]
    with patch.object(blocks, "MAX_STEPS", 5_000):
        result = lint(build_arrangement(arrangement(states, whiteboard)))
    assert not result.complete
    faults = [f for f in result.shown if f.code in ("L007", "L008")]
    assert [(f.code, f.level, f.proof) for f in faults] == [("L007", "warning", "run"), ("L008", "warning", "run")]
    assert [q.code for q in result.open] == ["L012"]


@pytest.mark.slow
def test_no_run_beyond_64_bits_is_shown() -> None:
    """The solver's integers have no end, the executor's have."""
    whiteboard = {"n": {"type": "int", "init": "9223372036854775807", "role": "output"}}
    whiteboard["k"] = {"type": "0..3", "role": "output"}
    states = [state("A", ("true", "B"), on_exit="n += 1;"), state("B", ("true", "A"), on_entry="k += 9;")]
    result = lint(build_arrangement(arrangement(states, whiteboard)))
    assert (result.complete, result.exit_code) == (False, 1)
    assert [(f.code, f.proof) for f in result.shown] == [("L006", "ranges")]
    assert "L007" in {q.code for q in result.open}


def test_divisions_and_indices() -> None:
    whiteboard = {
        "d": {"type": "0..3", "role": "input"},
        "a": {"type": {"array": "0..9", "size": 2}, "role": "output"},
    }
    states = [state("A", ("d == 1", "A"), internal="a[d] = 9 / d;")]
    codes = [entry[:3] for entry in found(arrangement(states, whiteboard))]
    assert sorted(codes) == [("L006", "warning", "run"), ("L008", "warning", "run")]  # 1 is where it would be inside
    guarded = [state("A", ("d == 3", "A"), internal="if (d == 1) a[d] = 9 / d;")]
    assert found(arrangement(guarded, whiteboard)) == []


def test_what_may_be_is_a_note_until_a_run_shows_it() -> None:
    """`n` is even, so it never reaches 9, which no single turn tells."""
    whiteboard = {"n": {"type": "0..9", "init": 0, "role": "output"}}
    document = arrangement([state("A", ("n < 0 - n", "A"), internal="if (n < 8 || n == 9) n += 2;")], whiteboard)
    codes = [entry[:3] for entry in found(document, local=True)]
    assert ("L007", "note", "ranges") in codes
    assert not [entry for entry in found(document) if entry[0] == "L007"]


def test_writes_never_read() -> None:
    whiteboard = {"shared": {"type": "0..3"}, "out": {"type": "0..3", "role": "output"}}
    variables = {"self_only": {"type": "uint8"}, "chain": {"type": "0..3"}, "used": {"type": "bool"}}
    body = "self_only += 1; chain = 2; shared = chain; out = 1; used = not used;"
    document = arrangement([state("A", ("used", "A"), internal=body)], whiteboard, variables=variables)
    names = [entry[3] for entry in found(document) if entry[0] == "L010"]
    assert sorted(names) == ["chain", "self_only", "shared"]
    loaded = build_arrangement(document)
    atoms = bind(loaded, parse_properties([Source("p", "G shared < 3")])).atoms
    assert [f.span.text for f in lint(loaded, atoms=atoms).shown if f.code == "L010"] == ["self_only"]


def test_what_a_read_variable_is_computed_from_is_read_however_far() -> None:
    whiteboard = {"out": {"type": "0..3", "role": "output"}}
    variables = {name: {"type": "0..3"} for name in ("a", "b", "c", "d")}
    document = arrangement(
        [state("A", internal="out = a; a = b; b = c; c = d; d = 1;")], whiteboard, variables=variables
    )
    assert not [entry for entry in found(document) if entry[0] == "L010"]


@pytest.mark.parametrize(
    ("body", "lost"),
    [
        ("n = 1; n = 2;", ["n = 1;"]),
        ("n = 1; n += 2;", []),
        ("n = 1; if (car) n = 2;", []),
        ("n = 1; if (car) n = 2; else n = 3;", ["n = 1;"]),
        ("n = 1; if (n > 0) n = 2; else n = 3;", []),
        ("for (int i = 0; i < 3; i++) n = i;", []),
        ("for (int i = 0; i < 3; i++) { n = 1; n = i; }", ["n = 1;"]),
        ("int x = n; n = 2;", ["int x = n;"]),
        ("int x = n; n = x + 1;", []),
        ("int x = 0; x = 1; n = 2;", ["int x = 0;"]),
        ("int x = 1; n = x; x = 2;", ["x = 2;"]),
    ],
)
def test_values_lost(body: str, lost: list[str]) -> None:
    whiteboard = {**CAR, "n": {"type": "int8", "role": "output"}}
    document = arrangement([state("A", ("car", "A"), internal=body)], whiteboard)
    texts = [entry[3].rstrip(";") for entry in found(document) if entry[0] == "L011"]
    assert texts == [text.rstrip(";") for text in lost]


def test_a_machine_gets_stuck() -> None:
    whiteboard = {**CAR, "n": {"type": "0..1", "init": 0}}
    states = [
        state("A", ("car", "B"), on_exit="n = 1;"),
        state("B", ("n == 0", "A")),
    ]
    result = lint(build_arrangement(arrangement(states, whiteboard)))
    stuck = [f for f in result.shown if f.code == "L012"]
    assert [(f.span.text, f.machines) for f in stuck] == [("B", ("m",))]
    assert stuck[0].witness is not None
    assert stuck[0].witness.trace is not None
    assert len(stuck[0].witness.trace.steps) == 1


def two(first: Document, second: Document, **keys: object) -> Document:
    machines = {n: {"inline": {"machine": n, "states": s["states"]}} for n, s in (("a", first), ("b", second))}
    return {"whiteboard": CAR, "machines": machines, **keys}


def test_suspended_for_ever() -> None:
    first = {
        "states": [
            state("A", ("car", "B"), on_exit="suspend(b);"),
            state("B", ("is_running(b)", "C")),
            state("C", ("true", "D"), on_exit="resume(b);"),
            state("D"),
        ]
    }
    second = {"states": [state("X", ("car", "X"))]}
    result = lint(build_arrangement(two(first, second, schedule=["a", "b"])))
    assert {(f.code, f.machines) for f in result.shown if f.code in ("L012", "L013")} >= {("L013", ("b",))}


def test_a_process_is_passed_over() -> None:
    first, second = ({"states": [state("A", ("car", "A"))]} for _ in range(2))
    processes = {"p": ["a"], "q": ["b"]}
    fair = build_arrangement(two(first, second, processes=processes))
    assert not lint(fair).shown
    unfair = lint(build_arrangement(two(first, second, processes=processes, fairness="none")))
    assert [(f.code, f.machines) for f in unfair.shown] == [("L014", ("a",)), ("L014", ("b",))]


def test_a_plant_that_writes_no_input() -> None:
    plant = {"inline": {"machine": "Plant", "states": [{"name": "S", "internal": "x = true;"}],
                        "variables": {"x": {"type": "bool"}}}}  # fmt: skip
    document = {**arrangement([state("A", ("car", "A"))], CAR), "environment": plant}
    assert ("L016", "note", "text") in {entry[:3] for entry in found(document)}
    driven = {**plant["inline"], "states": [{"name": "S", "internal": "car = choose(bool);"}]}
    assert "L016" not in {entry[0] for entry in found({**document, "environment": {"inline": driven}})}


def test_an_internal_action_that_runs_once() -> None:
    whiteboard = {**CAR, "n": {"type": "0..9", "role": "output"}}
    states = [
        state("A", ("car", "B"), internal="n = 1;"),
        state("B", internal="n = 2;"),
        state("SUSPEND", internal="n = 3;"),
    ]
    document = arrangement(states, whiteboard, suspend="SUSPEND")
    assert [entry for entry in found(document) if entry[0] != "L002"] == [("L015", "note", "text", "B")]
    once = parse_properties([Source("p", "once: G (m@B && n == 2 -> m.finished)")])
    assert verify(build_arrangement(document), once, engine="explicit").exit_code == 0
    assert "L015" not in {entry[0] for entry in found({**document, "finished": "keep"})}


def test_what_is_so_in_one_instance_only_is_a_note() -> None:
    machine: Document = {
        "machine": "M",
        "parameters": {"light": {"whiteboard": "0..9"}},
        "states": [state("A", ("light > 4", "B"), ("car", "B")), state("B", ("true", "A"))],
    }
    board = {**CAR, "low": {"type": "0..9", "init": 0}, "any": {"type": "0..9", "role": "input"}}
    both = {"x": "low", "y": "any"}
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "m.yaml").write_text(yaml.safe_dump(machine))
        machines = {n: {"file": str(Path(folder, "m.yaml")), "parameters": {"light": v}} for n, v in both.items()}
        result = lint(build_arrangement({"whiteboard": board, "machines": machines, "schedule": list(both)}))
    dead = [f for f in result.shown if f.code == "L001"]
    assert [(f.level, f.machines, f.notes[-1]) for f in dead] == [("note", ("x",), "so in `x`, not in `y`")]


# ---------------------------------------------------------------- suppressions

DEAD = """
machines:
  m:
    inline:
      machine: M
      states:
        - name: A
          transitions:
            - {when: car, to: A}
            - {when: not car, to: A}
            - {when: true, to: A%s}
%s
whiteboard: {car: {type: bool, role: input}}
schedule: [m]
%s
"""


def silenced(*parts: str) -> list[Finding]:
    return list(lint(load_arrangement_text(DEAD % parts)).findings)


@pytest.mark.parametrize(
    "parts",
    [
        (", lint: {L001: so in the paper}", "", ""),
        ("", "          lint: {L001: so in the paper}", ""),
        ("", "      lint: {L001: so in the paper}", ""),
        ("", "", "lint: {L001: so in the paper}"),
    ],
    ids=["transition", "state", "machine", "arrangement"],
)
def test_a_silence_accepts_what_is_inside_it(parts: tuple[str, str, str]) -> None:
    assert [(f.code, f.suppressed) for f in silenced(*parts)] == [("L001", "so in the paper")]


@pytest.mark.slow
def test_the_narrowest_silence_gives_the_reason() -> None:
    transition, state, machine, whole = (
        ", lint: {L001: transition}",
        "          lint: {L001: state}",
        "      lint: {L001: machine}",
        "lint: {L001: arrangement}",
    )
    for parts, reason in [
        ((transition, f"{state}\n{machine}", whole), "transition"),
        (("", f"{state}\n{machine}", whole), "state"),
        (("", machine, whole), "machine"),
        ((transition, state, ""), "transition"),
    ]:
        assert [(f.code, f.suppressed) for f in silenced(*parts)] == [("L001", reason)]


UNREAD = """
machines:
  m:
    inline:
      machine: M
      variables: {k: {type: uint8%s}}
      states: [{name: A, variables: {j: {type: uint8%s}}, on_entry: n = car; k = 1; j = 1;}]
whiteboard: {n: {type: bool%s}, car: {type: bool, role: input%s}}
schedule: [m]
"""


def test_suppressions_on_variables() -> None:
    """Each accepts what is found at its variable; one on a variable that is fine accepts nothing."""
    why = ", lint: {L010: logged by hand}"
    plain = lint(load_arrangement_text(UNREAD % ("", "", "", ""))).findings
    assert [(f.code, f.suppressed, f.span.text) for f in plain] == [("L010", None, n) for n in "kjn"]
    assert all("`lint: {L010: why}` in its declaration" in (f.hint or "") for f in plain)
    for place, name in enumerate("kjn"):
        result = lint(load_arrangement_text(UNREAD % tuple(why if i == place else "" for i in range(4))))
        assert {f.span.text: f.suppressed for f in result.findings} == {
            n: "logged by hand" if n == name else None for n in "kjn"
        }
    result = lint(load_arrangement_text(UNREAD % ("", "", "", why)))
    assert [f.span.text for f in result.findings if f.code == "L020"] == ["L010"]


TEXT = """\
<text>:6:19: warning[L010]: variable `k` is written, and nothing that the machine does depends on it
    6 |       variables: {k: {type: uint8}}
      |                   ^
  hint: remove it, or give lint the property files that read it; `lint: {L010: why}` in its declaration accepts it

<text>:7:38: accepted[L010]: variable `j` is written, and nothing that the machine does depends on it
    7 |       states: [{name: A, variables: {j: {type: uint8, lint: {L010: paper}}}, on_entry: n = car; k = 1; j = 1;}]
      |                                      ^
  note: accepted: paper
  hint: remove it, or give lint the property files that read it; `lint: {L010: why}` in its declaration accepts it

<text>:8:14: warning[L010]: whiteboard variable `n` is written, and no machine's behaviour depends on it
    8 | whiteboard: {n: {type: bool}, car: {type: bool, role: input}}
      |              ^
  hint: write `role: output` if the surroundings read it; give lint the property files that do; \
`lint: {L010: why}` in its declaration accepts it

2 warnings, 0 notes, 1 accepted; 2 configurations, complete, 0.00 s
counted without what nothing depends on: n, m.k, m.A.j, car
"""


def test_findings_as_text() -> None:
    found = lint(load_arrangement_text(UNREAD % ("", ", lint: {L010: paper}", "", "")))
    result = replace(found, seconds=0.0)
    shown, whole = ([str(line) for line in lint_text(result, suppressed=all_of_them)] for all_of_them in (False, True))
    assert whole == TEXT.splitlines()
    assert shown == [*whole[:5], *whole[11:]]


def test_a_silence_that_silences_nothing_is_found() -> None:
    result = silenced(", lint: {L001: so in the paper, L003: no}", "", "")
    assert [(f.code, f.suppressed, f.span.text) for f in result] == [
        ("L001", "so in the paper", "true"),
        ("L020", None, "L003"),
    ]


@pytest.mark.parametrize(
    ("silence", "code"), [("{L001: ''}", "E096"), ("{L001: }", "E096"), ("{L999: no}", "E095"), ("L001", "E030")]
)
def test_wrong_suppressions_are_errors(silence: str, code: str) -> None:
    with pytest.raises(DiagnosticError) as caught:
        load_arrangement_text(DEAD % (f", lint: {silence}", "", ""))
    assert [d.code for d in caught.value.diagnostics] == [code]


def test_nothing_is_said_of_suppressions_where_guards_alone_were_not_explored() -> None:
    """What is constant only in the reachable configurations may then have been missed."""
    whole = Reach.complete.fget
    assert whole is not None
    with patch.object(Reach, "complete", property(lambda reach: not reach.probed.wide and whole(reach))):
        result = silenced(", lint: {L001: so in the paper, L004: always so when it is reached}", "", "")
    assert [f.code for f in result] == ["L001"]


def test_what_decides_whether_a_run_faults_is_read() -> None:
    """A divisor, an index, and what is stored into a range."""
    text = """
    name: uses
    whiteboard:
      go: {type: bool, role: input}
      a: {type: {array: 0..3, size: 4}}
      d: {type: 0..3, init: 1}
      e: {type: uint8}
      f: {type: uint8}
      k: {type: 0..9}
      n: {type: 0..5}
      o: {type: uint8}
      q: {type: 0..100}
    machines:
      m:
        inline:
          machine: M
          states:
            - name: A
              internal: "if (go) { d = 0; k = 7; e = 5; } q = 10 / d; a[k] = 1; n = e; o = f; f = 3; q = n;"
    schedule: [m]
    """
    loaded = load_arrangement_text(textwrap.dedent(text), "uses.yaml")
    assert {f.span.text for f in lint(loaded).shown if f.code == "L010"} == {"a", "f", "n", "o", "q"}


BOX: Document = {**CAR, "n": {"type": "0..9", "role": "output"}}


@pytest.mark.parametrize(
    ("keys", "action"),
    [
        ({"internal": "n = 1;"}, "internal"),
        ({"on_suspend": "n = 1;"}, "on_suspend"),
        ({"on_resume": "n = 1;"}, "on_resume"),
        ({"on_exit": "n = 1;"}, None),
        ({"on_entry": "n = 1;"}, None),
    ],
)
def test_an_action_that_can_never_run(keys: Document, action: str | None) -> None:
    states = [state("A", ("true", "B"), **keys), state("B", ("car", "A"))]
    result = lint(build_arrangement(arrangement(states, BOX)))
    said = [(f.level, f.proof, f.message) for f in result.shown]
    wanted = ("warning", "local", f"the action `{action}` of `A` can never run")
    assert said == ([] if action is None else [wanted])
    states[0]["lint"] = {"L025": "as in the paper"}
    accepted = lint(build_arrangement(arrangement(states, BOX))).shown
    assert [f.code for f in accepted] == (["L020"] if action is None else [])


def test_an_exit_action_of_a_state_that_is_never_left() -> None:
    """Only the reachable configurations tell that the guard is false, so the transition explains it as well."""
    states = [state("A", ("n > 3", "B"), on_exit="n = 2;"), state("B", ("car", "A"), internal="n = 1;")]
    codes = [(f.code, f.proof) for f in lint(build_arrangement(arrangement(states, BOX))).shown]
    assert ("L025", "reachable") in codes and ("L001", "reachable") in codes
    assert codes.count(("L025", "reachable")) == 1  # that of B is in a state without turns


def test_actions_of_suspension_that_run() -> None:
    first = {
        "states": [state("A", ("car", "B"), on_exit="suspend(b);"), state("B", ("true", "A"), on_exit="resume(b);")]
    }
    second = {"states": [state("X", ("car", "X"), on_suspend="n = 1;", on_resume="n = 2;")]}
    document = {**two(first, second, schedule=["a", "b"]), "whiteboard": BOX}
    assert "L025" not in {entry[0] for entry in found(document)}


def test_a_self_transition_that_keeps_the_clock_of_its_state() -> None:
    states = [state("A", ("after(10) && not car", "B"), ("car", "A")), state("B", ("car", "B"), ("not car", "A"))]
    document = {**arrangement(states, CAR), "cycle_ms": 1000}
    (note,) = lint(build_arrangement(document), local=True).shown
    assert (note.code, note.level, note.proof, note.span.text.strip('"')) == ("L026", "note", "text", "car")
    assert "A -> A" in note.message and "`after(10)`" in note.message
    assert "L026" not in {entry[0] for entry in found({**document, "profile": "swiftfsm"}, local=True)}
    for guard, target in (("after(10) && not car", "B"), ("car", "A")):  # no self-transition, and no clock
        clean = [state("A", (guard, target)), state("B", ("car", "B"), ("not car", "A"))]
        assert "L026" not in {entry[0] for entry in found({**arrangement(clean, CAR), "cycle_ms": 1000}, local=True)}
