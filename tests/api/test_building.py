"""Arrangements written in Python: the same model as from files, and diagnostics that say where in the values."""

from __future__ import annotations

import os
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import pytest
import yaml

import llfsm_verify as lv
from llfsm_verify.arrangement.formats.yaml_writer import to_yaml

LIGHT = lv.MachineDefinition(
    "Light",
    {
        "RED": lv.StateDefinition(on_entry="light = RED;", transitions=[("turn && other@RED", "GREEN")]),
        "GREEN": lv.StateDefinition(on_entry="light = GREEN;", transitions=[("not turn", "AMBER")]),
        "AMBER": lv.StateDefinition(on_entry="light = AMBER;", transitions=[("after(3)", "RED")]),
    },
    initial="RED",
    parameters={"light": {"whiteboard": "Colour"}, "turn": {"whiteboard": "bool"}, "other": "machine"},
)
FILE = Path("models/traffic_lights/arrangement.yaml")
TIMER = FILE.with_name("timer.machine.yaml")


def built(light: lv.MachineDefinition = LIGHT, **changes: object) -> lv.Model:
    """The traffic lights, with the lights in Python and the timer in its file."""
    given = yaml.safe_load(FILE.read_text(encoding="utf-8"))
    machines = {
        "timer": TIMER.absolute(),
        "ns": light.bind(light="ns_light", turn="ns_turn", other="ew"),
        "ew": light.bind(light="ew_light", turn="ew_turn", other="ns"),
    }
    words = {"whiteboard": given["whiteboard"], "types": given["types"], "cycle_ms": given["cycle_ms"], **changes}
    return lv.build("traffic_lights", machines, **words)  # type: ignore[arg-type]


def test_what_is_built_can_be_written(tmp_path: Path) -> None:
    model, path = built(), tmp_path / "deeper" / "lights.yaml"
    path.parent.mkdir()
    model.write(path)
    again = lv.load(path)
    assert "file: ../" in path.read_text("utf-8") and again.path == str(path)
    assert again.draw() == model.draw() and again.draw("ns") == model.draw("ns")
    assert str(again.simulate(60, seed=2)) == str(model.simulate(60, seed=2))
    with pytest.raises(ValueError, match=r"^`traffic_lights` comes from .*lights.yaml already: copy that file$"):
        again.write(path)
    with pytest.raises(OSError, match=r"No such file or directory: '.*nowhere/a\.yaml'$"):
        model.write(tmp_path / "nowhere" / "a.yaml")


def test_what_is_no_file_is_not_replaced(tmp_path: Path) -> None:
    pipe, link = tmp_path / "pipe", tmp_path / "link.yaml"
    os.mkfifo(pipe)
    link.symlink_to(tmp_path / "target.yaml")
    model = built()
    model.write(link)
    assert link.is_symlink() and lv.load(tmp_path / "target.yaml").machines == model.machines
    for path, said in ((pipe, "it is a pipe"), (tmp_path, "it is a directory")):
        with pytest.raises(OSError, match=said):
            model.write(path)
    assert pipe.is_fifo() and sorted(p.name for p in tmp_path.iterdir()) == ["link.yaml", "pipe", "target.yaml"]


def test_its_machine_files_are_those_of_the_folder_in_which_it_was_built(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "timer.machine.yaml").write_text("machine: timer\ninitial: A\nstates: [{name: A}]\n")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path)
    model = lv.build("one", {"timer": Path("timer.machine.yaml"), "other": {"file": "./timer.machine.yaml"}})
    monkeypatch.chdir("elsewhere")
    model.write("a.yaml")
    assert Path("a.yaml").read_text("utf-8").count("file: ../timer.machine.yaml") == 2
    assert lv.load("a.yaml").machines == model.machines


@pytest.mark.parametrize("path", sorted(Path("models").rglob("*.yaml")), ids=str)
def test_documents_are_written_as_they_were_read(path: Path) -> None:
    words = yaml.load(path.read_text("utf-8"), yaml.BaseLoader)
    assert yaml.load(to_yaml(words), yaml.BaseLoader) == words


def test_values_of_python_are_written_as_words() -> None:
    given = {"a": 0.1, "b": True, "c": "no", "d": "x = 1;\ny = 2;\n", "e": ("1:30", Decimal("1e-3")), "f": "# : {'"}
    words = {"a": "0.1", "b": "true", "c": "no", "d": "x = 1;\ny = 2;\n", "e": ["1:30", "0.001"], "f": "# : {'"}
    assert yaml.load(to_yaml(given), yaml.BaseLoader) == words


def mistakes(build) -> list[tuple[str, str]]:
    """Codes, each with the text that is marked."""
    with pytest.raises(lv.DiagnosticError) as caught:
        build()
    return [(d.code, "" if d.span is None else d.span.text.strip('"')) for d in caught.value.diagnostics]


@pytest.mark.slow
def test_it_is_the_arrangement_of_the_files(lights):
    model = built()
    assert model.machines == lights.machines and model.warnings == ()
    properties = Path("properties/traffic_lights.ltl")
    ours, theirs = model.check(properties), lights.check(properties)
    assert [(o.name, o.verdict) for o in ours] == [(o.name, o.verdict) for o in theirs]
    assert (ours.states, ours.transitions, ours.verdict) == (theirs.states, theirs.transitions, "holds")


def test_mistakes_in_texts_show_the_text():
    red = lv.StateDefinition(
        on_entry='light = RDE; // "quoted"\nlight = GREN;',
        transitions=[("turn && other@REED", "GREEN"), ("turn", "GREEM")],
    )
    wrong = replace(LIGHT, states={**LIGHT.states, "RED": red})
    one = [("E110", "RDE"), ("E110", "GREN"), ("E112", "REED"), ("E071", "GREEM")]
    assert mistakes(lambda: built(wrong)) == [*one, *one]
    with pytest.raises(lv.DiagnosticError, match="did you mean `GREEN`"):
        built(wrong)


@pytest.mark.parametrize(
    ("build", "expected"),
    [
        (lambda: built(observe="never"), ("E035", "never")),
        (lambda: built(schedule=["timer", "ns", "ew", "north"]), ("E081", "north")),
        (lambda: built(schedule=["timer", "ns"]), ("E083", "ew")),
        (lambda: built(replace(LIGHT, initial="BLUE")), ("E072", "BLUE")),
        (lambda: lv.build("x", {"m": LIGHT}, whiteboard={"x": {"type": "Hue"}}), ("E040", "Hue")),
        (lambda: lv.build("x", {"m": lv.MachineDefinition("M", {"A": {"on_enter": "x = 1;"}})}), ("E033", "on_enter")),
        (lambda: lv.build("x", {"m": Path("missing.machine.yaml")}), ("E001", "missing.machine.yaml")),
    ],
)
def test_mistakes_elsewhere_mark_the_value(build, expected):
    assert expected in mistakes(build)


def test_an_empty_name_is_not_left_out():
    assert {code for code, _ in mistakes(lambda: built(replace(LIGHT, initial="")))} == {"E032"}


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: lv.build("x", {"m": 3}), "machines.m: a machine is a definition, a path or a mapping, not 3"),
        (
            lambda: lv.build("x", {"m": lv.MachineDefinition("M", {"A": 3})}),
            r"machines.m.inline.states\[0\]: a state is a definition or a mapping, not 3",
        ),
        (
            lambda: lv.build("x", {"m": lv.MachineDefinition("M", {"A": {"transitions": ["when it rains"]}})}),
            r"machines.m.inline.states\[0\].transitions\[0\]: a transition is a pair",
        ),
        (
            lambda: lv.build("x", {"m": lv.MachineDefinition("M", {"A": {"transitions": "x"}})}),
            r"machines.m.inline.states\[0\].transitions: this is a sequence",
        ),
        (
            lambda: lv.build("x", {"m": lv.MachineDefinition("M", {"A": {"transitions": [(1j, "A")]}})}),
            r"machines.m.inline.states\[0\].transitions\[0\].when: a value is a text, .* not 1j",
        ),
        (lambda: lv.build("x", [LIGHT]), "machines: this is a mapping from names to machines, not"),
        (lambda: built(types={3: ["A"]}), "types: a key is a text, not 3"),
    ],
)  # fmt: skip
def test_values_of_wrong_types(build, message):
    with pytest.raises(TypeError, match=message):
        build()


def test_warnings():
    machine = replace(LIGHT, parameters={**LIGHT.parameters, "spare": {"whiteboard": "bool"}})
    given = {"light": "l", "turn": "t", "spare": "t"}
    board = {"l": {"type": "Colour"}, "t": {"type": "bool"}}
    model = lv.build(
        "x",
        {"a": machine.bind(**given, other="b"), "b": machine.bind(**given, other="a")},
        whiteboard=board, types={"Colour": ["RED", "AMBER", "GREEN"]}, cycle_ms=1000,
    )  # fmt: skip
    found = [w.span.text.strip('"') for w in model.warnings if w.code == "W001" and w.span is not None]
    assert found == ["spare", "spare"]


def test_mappings_have_the_keys_of_files():
    inline = {"machine": "M", "states": [{"name": "A", "transitions": [{"when": "x", "to": "A"}]}]}
    model = lv.build("x", {"m": {"inline": inline}}, whiteboard={"x": {"type": "bool", "role": "input"}})
    assert model.machines == {"m": ("A",)} and model.check("G m@A").verdict == "holds"


def test_several_processes_and_suspended_machines():
    machine = lv.MachineDefinition("M", {"A": lv.StateDefinition(transitions=[("true", "A")])})
    model = lv.build("x", {"a": machine, "b": machine.bind(suspended=True)}, processes={"p": ["a"], "q": ["b"]})
    assert model.check({"b": "G b.suspended", "a": "G !a.suspended"}).verdict == "holds"
