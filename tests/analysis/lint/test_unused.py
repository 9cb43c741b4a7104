"""L021 and L022: variables, types and tables that are declared and then never used."""

from __future__ import annotations

from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.analysis.lint.run import lint
from llfsm_verify.analysis.lint.unread import unused
from llfsm_verify.arrangement import load_arrangement, load_arrangement_text
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from tests.quick import examples

TEXT = """
name: t
types: {Phase: [ON, OFF], Outer: {record: {p: Inner}}, Inner: 0..3, Count: 0..9, Mode: [LOW, HIGH], Small: 0..4}
whiteboard:
  lonely: {type: bool}
  known: {type: bool, lint: {L021: for the next version}}
  go: {type: bool, role: input}
  stop: {type: bool, role: input}
  told: {type: bool}
operators: {write: [told]}
machines:
  a:
    inline:
      machine: A
      parameters: {size: {constant: Small}}
      variables: {v: {type: uint8}, w: {type: uint8}}
      states:
        - name: S
          variables: {z: {type: bool}}
          internal: |
            Count c = 2;
            w = c;
          transitions: [{when: go && w < size, to: S}]
    parameters: {size: 3}
schedule: [a]
"""


def found(text: str, properties: str = "") -> list[tuple[str, str]]:
    arrangement = load_arrangement_text(text)
    atoms = bind(arrangement, parse_properties([Source("p", properties)])).atoms
    return [(f.code, f.span.text) for f in unused(arrangement, atoms)]


def test_what_no_text_mentions_is_found() -> None:
    variables = [("L021", name) for name in ("lonely", "known", "stop", "v", "z")]
    assert found(TEXT) == [*variables, *(("L022", name) for name in ("Phase", "Outer", "Inner", "Mode"))]


def test_what_a_property_mentions_is_used() -> None:
    rules = "x: G (a@S -> !lonely)\ny: G a.v < 3\nz: G (sampled(stop) -> lonely)\n"
    assert found(TEXT, rules) == [("L021", n) for n in ("known", "z")] + [
        ("L022", name) for name in ("Phase", "Outer", "Inner", "Mode")
    ]


def test_a_type_is_used_by_what_is_used() -> None:
    """Through another type, by one of its values in a text, or as the type of a parameter or local variable."""
    used = TEXT.replace("lonely: {type: bool}", "lonely: {type: Outer}")
    assert found(used)[-2:] == [("L022", "Phase"), ("L022", "Mode")]
    used = TEXT.replace("w = c;", "w = c; if (ON == OFF) { w = 1; }")
    assert ("L022", "Phase") not in found(used) and ("L022", "Mode") in found(used)


def test_a_table_is_used_by_whoever_names_it() -> None:
    """Also where only a number of it is left: in a bound, in the range of a loop, in a guard."""
    text = TEXT.replace(
        "whiteboard:", "cycle_ms: 10\ntables: {one: [1, 2], two: [0.5, 1.5], three: [2], four: [7]}\nwhiteboard:", 1
    )
    assert [name for code, name in found(text) if code == "L022"][-4:] == ["one", "two", "three", "four"]
    text = text.replace("w = c;", "w = c; for (k in 0..three[0]) { w = k; }")
    text = text.replace("go && w < size", "'after(round(two[1])) && go && w < one[w % 2]'")
    assert ("L022", "Phase") in found(text) and found(text)[-1] == ("L022", "four")
    assert ("L022", "three") not in found(text) and ("L022", "four") not in found(text, "x: G (a.w < four[0])")


def test_of_several_instances_one_that_mentions_it_is_enough(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(
        "machine: M\nparameters: {on: {constant: bool}}\nvariables: {v: {type: bool}}\n"
        "states: [{name: A, transitions: [{when: 'on', to: A}]}]\n"
    )
    (tmp_path / "a.yaml").write_text(
        "name: t\nmachines:\n  a: {file: m.yaml, parameters: {on: true}}\n"
        "  b: {file: m.yaml, parameters: {on: false}}\nschedule: [a, b]\n"
    )
    arrangement = load_arrangement(tmp_path / "a.yaml")
    assert [(f.code, f.span.text, f.machines) for f in unused(arrangement)] == [("L021", "v", ("a", "b"))]
    atoms = bind(arrangement, parse_properties([Source("p", "x: G !b.v")])).atoms
    assert not list(unused(arrangement, atoms))


def test_suppressions() -> None:
    result = lint(load_arrangement_text(TEXT), local=True)
    assert [f.span.text for f in result.findings if f.suppressed is not None] == ["known"]
    accepted = lint(load_arrangement_text(TEXT.replace("name: t", "name: t\nlint: {L022: from a library}")), local=True)
    assert {f.code for f in accepted.findings if f.suppressed == "from a library"} == {"L022"}
    assert {f.level for f in result.findings if f.code in ("L021", "L022")} == {"warning"} and result.exit_code == 1


NAMES = ("p", "q", "r", "s")


SOME = st.sets(st.sampled_from(NAMES))


@settings(max_examples=examples(30), deadline=None)
@given(SOME, SOME, SOME)
def test_exactly_what_no_text_names(guarded: set[str], written: set[str], asked: set[str]) -> None:
    text = f"""
name: t
whiteboard: {{{", ".join(f"{name}: {{type: bool}}" for name in NAMES)}}}
machines:
  m:
    inline:
      machine: M
      states:
        - name: A
          on_entry: "{" ".join(f"{name} = true;" for name in sorted(written))}"
          transitions: [{{when: "{" && ".join(["true", *sorted(guarded)])}", to: A}}]
schedule: [m]
"""
    rules = "".join(f"x{name}: G (m@A || {name})\n" for name in sorted(asked))
    assert found(text, rules) == [("L021", name) for name in NAMES if name not in guarded | written | asked]
