"""What a right arrangement becomes, and that no text whatever does anything but load or be explained."""

from __future__ import annotations

import hashlib
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement import build_arrangement, load_arrangement, load_arrangement_text
from llfsm_verify.arrangement.model import PROFILES, Arrangement, Profile
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.language.types import ArrayType, EnumType, FixedType, IntType, RangeType, RecordType
from tests.bad_input.cases import CASES, FRAMED, TOP
from tests.quick import examples

MODELS = Path(__file__).parents[2] / "models"


def small(text: str = "") -> Arrangement:
    return load_arrangement_text(TOP(text))


def test_defaults() -> None:
    a = small()
    assert (a.name, a.path, a.profile, a.observe) == ("arrangement", "<text>", PROFILES["llfsm"], "ringlet")
    assert (a.timing, a.cycle_ms, a.finished, a.fairness) == ("timed", None, "leave", "processes")
    assert [(p.name, p.schedule) for p in a.processes] == [("main", ("m",))]
    assert (a.warnings, a.whiteboard, a.types) == ((), (), {})
    machine = a.machine("m")
    assert (machine.kind, machine.initial, machine.suspend, machine.suspended) == ("M", 0, None, False)


def test_settings() -> None:
    a = small("name: x y\nobserve: cycle\ncycle_ms: 12.5\nfinished: keep\nfairness: none")
    assert (a.name, a.observe, a.cycle_ms, a.finished, a.fairness) == ("x y", "cycle", Fraction(25, 2), "keep", "none")
    assert small("timing: untimed").timing == "untimed"


def test_profiles() -> None:
    assert small("profile: swiftfsm").profile == PROFILES["swiftfsm"]
    text = "profile: {base: clfsm, snapshot: cycle, self_transition_restarts_clock: true, commands: end_of_ringlet}"
    assert small(text).profile == Profile("clfsm", "cycle", True, True, "end_of_ringlet")
    assert small("profile: {restart_enters_initial: false}").profile.restart_enters_initial is False


def test_types_and_initial_values() -> None:
    board = (
        "types: {Later: {array: Colour, size: 2}, Colour: [RED, GREEN], Same: Colour, "
        "P: {record: {x: int8, c: Same}}}\n"
        "whiteboard:\n"
        "  a: {type: Later, init: [GREEN, Colour.RED]}\n"
        "  p: {type: P, init: {c: GREEN, x: -3}}\n"
        "  q: {type: {array: P, size: 2}, init: [{x: 1, c: RED}, {x: 2, c: GREEN}]}\n"
        "  r: {type: 5..9}\n  s: {type: -5 .. -2}\n  t: {type: uint16, init: 0xFFFF}\n  i: {type: int, init: 2 * 3}\n"
        "  d: {type: P}\n  f: {type: bool, role: input, changes: never}\n  g: {type: Same, role: input, init: GREEN}\n"
    )
    a = small(board)
    colour = EnumType("Colour", ("RED", "GREEN"))
    point = RecordType((("x", FixedType(8, True)), ("c", colour)))
    assert list(a.types) == ["Later", "Colour", "Same", "P"]
    assert a.enumerations == (colour,)
    found = {w.variable.name: (w.variable.type, w.variable.init) for w in a.whiteboard}
    assert found == {
        "a": (ArrayType(colour, 2), (1, 0)),
        "p": (point, (-3, 1)),
        "q": (ArrayType(point, 2), ((1, 0), (2, 1))),
        "r": (RangeType(5, 9), 5),
        "s": (RangeType(-5, -2), -2),
        "t": (FixedType(16, False), 65535),
        "i": (IntType(), 6),
        "d": (point, (0, 0)),
        "f": (found["f"][0], False),
        "g": (colour, 1),
    }
    roles = {w.variable.name: (w.role, w.changes, w.free) for w in a.whiteboard}
    assert roles["f"] == ("input", "never", True)
    assert roles["g"] == ("input", "step", False)
    assert roles["a"] == ("shared", "step", False)


def machine(states: str) -> Arrangement:
    return load_arrangement_text(f"machines: {{m: {{inline: {{machine: M, {states}}}}}}}\nschedule: [m]\n")


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("states: [{name: A}, {name: Suspend}]", 1),
        ("states: [{name: A}, {name: Suspend, transitions: [{when: true, to: A}]}]", None),
        ("states: [{name: A, transitions: [{when: true, to: Suspend}]}, {name: Suspend}]", None),
        ("states: [{name: A}, {name: suspend_}]", None),
        ("suspend: S, states: [{name: A, transitions: [{when: true, to: S}]}, {name: S}, {name: Suspend}]", 1),
    ],
)
def test_suspend_state(text: str, number: int | None) -> None:
    assert machine(text).machines[0].suspend == number


def test_initial_state() -> None:
    assert machine("initial: B, states: [{name: A}, {name: B}]").machines[0].initial == 1


def test_variables_have_full_names() -> None:
    found = machine("variables: {n: {type: int, init: 3}}, states: [{name: A, variables: {k: {type: bool}}}]").machines[
        0
    ]
    assert [(v.name, v.scope, v.init) for v in found.variables] == [("m.n", "machine", 3)]
    assert [(v.name, v.scope) for v in found.states[0].variables] == [("m.A.k", "state")]


def test_processes_and_order() -> None:
    text = FRAMED().replace("schedule: [m, other]", "processes: {first: [other], second: [m]}")
    a = load_arrangement_text(text)
    assert [(p.name, p.schedule) for p in a.processes] == [("first", ("other",)), ("second", ("m",))]
    assert [m.name for m in a.machines] == ["other", "m"]


def test_machine_files_and_digest(tmp_path: Path) -> None:
    (tmp_path / "sub").mkdir()
    light = (
        b"machine: Light\nparameters: {other: machine}\nstates: [{name: A, transitions: [{when: other@A, to: A}]}]\n"
    )
    (tmp_path / "light.yaml").write_bytes(light)
    top = (
        b"machines:\n  a: {file: ../light.yaml, parameters: {other: b}}\n"
        b"  b: {file: ../light.yaml, parameters: {other: a}, suspended: true}\nschedule: [a, b]\n"
    )
    path = tmp_path / "sub" / "pair.arrangement.yaml"
    path.write_bytes(top)
    a = load_arrangement(path)
    assert (a.name, a.path) == ("pair", str(path))
    assert a.digest == hashlib.sha256(top + light).hexdigest()
    assert [m.suspended for m in a.machines] == [False, True]
    assert a.machine("a").states[0].transitions[0].span.source.name.endswith("light.yaml")


def test_a_parameter_may_keep_the_name_of_what_it_stands_for() -> None:
    text = (
        "whiteboard: {light: {type: bool}}\nmachines:\n  m:\n    inline: {machine: M, "
        "parameters: {light: {whiteboard: bool}, m: machine}, states: [{name: A, on_entry: light = m@A;}]}\n"
        "    parameters: {light: light, m: m}\nschedule: [m]\n"
    )
    assert load_arrangement_text(text).machines[0].states[0].on_entry


def test_the_largest_bounds_of_after() -> None:
    assert load_arrangement_text(FRAMED(guard="after(104857.6)"))
    assert load_arrangement_text(FRAMED(guard="after(n * 6990)"))
    assert load_arrangement_text(FRAMED(guard="after(1000000000)").replace("cycle_ms: 100", "timing: untimed"))


def test_documents_from_python() -> None:
    document = {
        "name": 'quotes " and \\ and\nlines',
        "whiteboard": {"on": {"type": "bool", "init": True, "role": "input"}, "n": {"type": "0..3", "init": 2}},
        "machines": {
            "m": {
                "inline": {
                    "machine": "M",
                    "states": [
                        {
                            "name": "ON",
                            "on_entry": "// first: a comment\nn = on ? 1 : 0;",
                            "transitions": [{"when": "!on && n == 1", "to": "ON"}, {"when": True, "to": "ON"}],
                        }
                    ],
                }
            }
        },
        "schedule": ["m"],
    }
    a = build_arrangement(document)
    assert a.name == document["name"]
    assert [t.text for t in a.machines[0].states[0].transitions] == ["!on && n == 1", "true"]
    assert [w.variable.init for w in a.whiteboard] == [True, 2]


def test_an_isolated_mistake_is_one_diagnostic() -> None:
    """Using what is declared wrongly is no further mistake."""
    text = FRAMED(guard="zz == 1 && missing@X", board="  zz: {type: nothing}").replace(
        "schedule: [m, other]", "  missing: {}\nschedule: [m, other, missing]"
    )
    with pytest.raises(DiagnosticError) as caught:
        load_arrangement_text(text)
    assert [d.code for d in caught.value.diagnostics] == ["E040", "E060"]


SEEDS = [FRAMED(guard="car && after(3)", action="if (n > 3) { a[n % 4] = 1; } else suspend(other);")]
SEEDS += [c.text.replace("§", "") for c in CASES if len(c.text) < 2000][::6]
PIECES = ["[", "]", "{", "}", ":", "- ", "&a ", "*a", "!x ", "'", '"', "|", ">", "\n", "  ", "\t", "#", ",", "\\", "%"]
PIECES += [
    "0",
    "-1",
    "true",
    "RED",
    "car",
    "A",
    "m",
    "(",
    ")",
    "==",
    "=",
    ";",
    "<<",
    "? ",
    "---\n",
    "\N{GREEK SMALL LETTER MU}",
    "@",
]


@pytest.mark.slow
@settings(max_examples=examples(150), deadline=None)
@given(
    st.sampled_from(SEEDS),
    st.lists(
        st.tuples(st.integers(0, 10_000), st.integers(0, 30), st.sampled_from(["", *PIECES])), min_size=1, max_size=4
    ),
)
def test_any_text_loads_or_is_explained(seed: str, edits: list[tuple[int, int, str]]) -> None:
    text = seed
    for place, length, piece in edits:
        at = place % (len(text) + 1)
        text = text[:at] + piece + text[at + length :]
    try:
        found = load_arrangement_text(text)
    except DiagnosticError as e:
        problems = e.diagnostics
    else:
        assert found.machines
        return
    assert all(d.is_error and (d.span or d.file) for d in problems)
    assert all(d.render() for d in problems)


@pytest.mark.slow
@settings(max_examples=examples(100), deadline=None)
@given(st.text(max_size=300) | st.binary(max_size=300).map(lambda b: b.decode("latin-1")))
def test_any_characters_load_or_are_explained(text: str) -> None:
    with pytest.raises(DiagnosticError):
        load_arrangement_text(text)


@pytest.mark.parametrize(
    ("name", "hint"), [("GREN", "did you mean `GREEN`?"), ("__suspend", "declare a suspend state of your own")]
)
def test_a_state_that_does_not_exist_is_explained(name: str, hint: str) -> None:
    states = f"states: [{{name: RED, transitions: [{{when: true, to: {name}}}]}}, {{name: GREEN}}]"
    with pytest.raises(DiagnosticError) as raised:
        load_arrangement_text(f"machines: {{m: {{inline: {{machine: M, {states}}}}}}}\nschedule: [m]\n")
    assert [(d.hint or "").startswith(hint) for d in raised.value.diagnostics] == [True]


@pytest.mark.parametrize(
    ("guard", "hint"),
    [
        ("n + n", "write `n + n != 0`"),
        ("n" + " + n" * 14, "write `n" + " + n" * 14 + " != 0`"),
        ("n" + " + n" * 15, "write `… != 0`"),
        ("n\n+ n", "write `… != 0`"),
    ],
)
def test_the_hint_for_an_integer_as_a_condition_stays_short(guard: str, hint: str) -> None:
    action = f"if ({guard}) n = 1;".replace("\n", "\n          ")
    states = f"states:\n      - name: A\n        on_entry: |\n          {action}\n"
    machines = f"machines:\n  m:\n    inline:\n      machine: M\n      {states}"
    with pytest.raises(DiagnosticError) as raised:
        load_arrangement_text(f"whiteboard: {{n: {{type: 0..3}}}}\n{machines}schedule: [m]\n")
    assert [(d.code, d.hint) for d in raised.value.diagnostics] == [("E120", hint)]


@pytest.mark.parametrize("top", ["", "format: 1\n", "format: '1'\n"])
@pytest.mark.parametrize("inside", ["", "format: 1, "])
def test_files_may_say_their_format(top: str, inside: str) -> None:
    text = f"{top}machines: {{m: {{inline: {{{inside}machine: M, states: [{{name: A}}]}}}}}}\nschedule: [m]\n"
    assert load_arrangement_text(text, "a.yaml").machine("m").name == "m"
