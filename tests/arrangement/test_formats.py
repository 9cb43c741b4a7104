"""Formats of arrangements: what a reader of another one has to do, and what is said of drafts that are wrong."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from llfsm_verify.arrangement import formats, load_arrangement, load_arrangement_text
from llfsm_verify.arrangement.draft import (
    UNREADABLE,
    ArrangementDraft,
    Draft,
    InstanceDraft,
    MachineDraft,
    ParameterDraft,
    ProcessDraft,
    StateDraft,
    TransitionDraft,
    Unreadable,
    VariableDraft,
    WhiteboardDraft,
)  # fmt: skip
from llfsm_verify.arrangement.files import read_named, read_source
from llfsm_verify.arrangement.formats import Given
from llfsm_verify.arrangement.formats import reading as machine_formats
from llfsm_verify.arrangement.formats.reading import Reading
from llfsm_verify.arrangement.replacing import Replacement, with_replacement
from llfsm_verify.arrangement.resolve.arrangement import _ordered, resolve
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source, Span
from llfsm_verify.registry import Entry, Registry, Unregistered
from llfsm_verify.yaml.nodes import Scalar, Sequence, implied, mark, written

LAMP = "Lamp: OFF -> ON when button\nLamp: ON -> OFF when true\n"
LINE = re.compile(r"(\w+): (\w+) -> (\w+) when (.*)")


def draft_lines(source: Source) -> MachineDraft:
    """The machine in lines of the form ``Lamp: OFF -> ON when button``."""
    leaving: dict[str, list[TransitionDraft]] = {}
    names: dict[str, Scalar] = {}
    kind, *_ = matches = list(LINE.finditer(source.text))
    for match in matches:
        _, state, target, guard = (written(source, *match.span(i)) for i in range(1, 5))
        names.setdefault(state.text, state)
        leaving.setdefault(state.text, []).append(TransitionDraft(guard, target))
    states = tuple(StateDraft(name, transitions=tuple(leaving[text])) for text, name in names.items())
    return MachineDraft(written(source, *kind.span(1)), states, Span(source, 0, len(source.text)))


def read_machine(reading: Reading, path: Path, at: Scalar) -> MachineDraft:
    text = reading.files.get(str(path))
    source, data = read_named(path, mark(at), "machine") if text is None else (Source(str(path), text), text.encode())
    reading.add_source(source, data)
    return draft_lines(source)


def read_arrangement(given: Given) -> Draft:
    """One machine `m`, alone."""
    source, data = read_source(given.path)
    reading = Reading(Path())
    reading.add_source(source, data)
    return reading.draft(lamp(source), source.name)


def lamp(source: Source) -> ArrangementDraft:
    top = Span(source, 0, 1)
    name = implied("m", top)
    return ArrangementDraft(
        name="lamp",
        span=top,
        whiteboard=(WhiteboardDraft(implied("button", top), implied("bool", top), role=implied("input", top)),),
        machines=(InstanceDraft(name, draft_lines(source)),),
        processes=(ProcessDraft(None, Sequence((name,), top)),),
    )


@pytest.fixture
def lines(monkeypatch: pytest.MonkeyPatch) -> None:
    """The format of lines is there beside the others."""
    for module, kind in ((formats, "ARRANGEMENTS"), (machine_formats, "MACHINES")):
        registry: Registry[object] = getattr(module, kind)
        reader = f"{__name__}:read_{kind[:-1].lower()}"
        entries = [*registry.values(), Entry("lines", reader, "lines", (".lines",))]
        monkeypatch.setattr(module, kind, Registry(registry.kind, entries))


@pytest.mark.usefixtures("lines")
def test_a_file_has_the_format_that_its_ending_stands_for(tmp_path: Path) -> None:
    path = tmp_path / "lamp.lines"
    path.write_text(LAMP)
    whole = load_arrangement(path)
    yaml = tmp_path / "a.yaml"
    yaml.write_text(
        "whiteboard: {button: {type: bool, role: input}}\nmachines: {m: {file: lamp.lines}}\nschedule: [m]\n"
    )
    for arrangement in (whole, load_arrangement(yaml)):
        (machine,) = arrangement.machines
        assert [s.name for s in machine.states] == ["OFF", "ON"]
        assert [(t.text, t.target, str(t.span)) for s in machine.states for t in s.transitions] == [
            ("button", 1, f"{path}:1:22"), ("true", 0, f"{path}:2:22"),
        ]  # fmt: skip
    assert whole.name == "lamp" and whole.digest != load_arrangement(yaml).digest


@pytest.mark.usefixtures("lines")
def test_a_mistake_in_it_is_shown_where_it_stands(tmp_path: Path) -> None:
    path = tmp_path / "lamp.txt"
    path.write_text(LAMP.replace("button", "not knob"))
    with pytest.raises(DiagnosticError) as caught:
        load_arrangement(path, format_name="lines")
    assert caught.value.diagnostics[0].render().split("\n")[:3] == [
        f"{path}:1:26: error[E110]: there is no variable `knob` here",
        "    1 | Lamp: OFF -> ON when not knob",
        "      |                          ^^^^",
    ]


@pytest.mark.usefixtures("lines")
def test_a_machine_in_it_takes_the_place_of_another_and_what_has_no_writer_is_not_written(tmp_path: Path) -> None:
    path = tmp_path / "a.lines"
    path.write_text(LAMP)
    draft = formats.read_arrangement(Given(path))
    changed = resolve(with_replacement(draft, Replacement("m", "new.lines", LAMP.replace("when true", "when button"))))
    assert [t.text for s in changed.machines[0].states for t in s.transitions] == ["button", "button"]
    with pytest.raises(Unregistered, match="writer of arrangements `lines`"):
        formats.writer_of("b.lines")
    assert formats.writer_of("b") is formats.writer_of("b.yml")


@pytest.mark.usefixtures("lines")
def test_an_unknown_format_is_told_which_there_are() -> None:
    with pytest.raises(Unregistered) as told:
        load_arrangement("x", format_name="pictures")
    assert str(told.value) == "there is no arrangement format `pictures`; there are: yaml, crops, lines"
    with pytest.raises(Unregistered):
        load_arrangement_text("", format_name="pictures")


def test_any_other_ending_is_read_as_yaml(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("machines: {m: {inline: {machine: M, states: [{name: A}]}}}\nschedule: [m]\n")
    assert load_arrangement(path).machine("m").states[0].name == "A"


# ---------------------------------------------------------------- wrong drafts

SOURCE = Source("by hand", LAMP)
GOOD = lamp(SOURCE)


def said(draft: ArrangementDraft | Unreadable, *diagnostics: Diagnostic) -> list[str]:
    with pytest.raises(DiagnosticError) as caught:
        resolve(Draft(draft, "by hand", "", (SOURCE,), (), diagnostics))
    return [f"{d.code} {d.message}" for d in caught.value.diagnostics]


def test_what_an_implied_text_says_is_marked_where_it_is_implied() -> None:
    place = Span(SOURCE, 6, 9)
    leaving = TransitionDraft(implied("true && knob", place), implied("ON", place))
    states = (StateDraft(implied("OFF", place), transitions=(leaving,)), StateDraft(implied("ON", Span(SOURCE, 0, 1))))
    with pytest.raises(DiagnosticError) as caught:
        resolve(Draft(with_machine(states=states), "by hand", "", (SOURCE,)))
    assert [(d.code, str(d.span)) for d in caught.value.diagnostics] == [("E110", "by hand:1:7")]


INSTANCE = InstanceDraft(implied("m", GOOD.span), draft_lines(SOURCE))


def with_machine(**changes: Any) -> ArrangementDraft:
    return replace(GOOD, machines=(replace(INSTANCE, machine=replace(draft_lines(SOURCE), **changes)),))


TWICE = [implied("a", Span(SOURCE, i, i + 1)) for i in range(2)]
BOOL = implied("bool", Span(SOURCE, 2, 3))


@pytest.mark.parametrize(
    ("draft", "expected"),
    [
        (replace(GOOD, machines=(INSTANCE, INSTANCE)), "E017 the name `m` appears twice"),
        (replace(GOOD, types=tuple((name, BOOL) for name in TWICE)), "E017 the name `a` appears twice"),
        (replace(GOOD, whiteboard=tuple(WhiteboardDraft(name, BOOL) for name in TWICE)),
         "E017 the name `a` appears twice"),
        (with_machine(variables=tuple(VariableDraft(name, BOOL) for name in TWICE)),
         "E017 the name `a` appears twice"),
        (with_machine(parameters=tuple(ParameterDraft(name, "machine") for name in TWICE)),
         "E017 the name `a` appears twice"),
        (replace(GOOD, machines=(replace(INSTANCE, arguments=tuple((name, BOOL) for name in TWICE)),)),
         "E017 the name `a` appears twice"),
        (replace(GOOD, processes=tuple(ProcessDraft(name, Sequence((), name.span)) for name in TWICE)),
         "E017 the name `a` appears twice"),
        (replace(GOOD, processes=()), "E084 the arrangement has no `schedule`"),
        (with_machine(parameters=(ParameterDraft(TWICE[0], "constant"),)),
         "E065 parameter `a` is not a machine and has no type"),
        (with_machine(states=()), "E074 a machine needs at least one state"),
    ],
)  # fmt: skip
def test_what_a_reader_does_not_see_is_said(draft: ArrangementDraft, expected: str) -> None:
    assert expected in said(draft)


@pytest.mark.parametrize(
    "draft",
    [
        UNREADABLE,
        replace(GOOD, machines=UNREADABLE, processes=UNREADABLE),
        replace(GOOD, processes=UNREADABLE),
        replace(GOOD, machines=(INSTANCE, InstanceDraft(TWICE[0], UNREADABLE))),
        replace(GOOD, whiteboard=(*GOOD.whiteboard, WhiteboardDraft(TWICE[0], UNREADABLE))),
        with_machine(states=UNREADABLE),
        with_machine(variables=(VariableDraft(TWICE[0], UNREADABLE),)),
        with_machine(parameters=(ParameterDraft(TWICE[0], UNREADABLE),)),
        with_machine(states=(StateDraft(TWICE[0], transitions=(TransitionDraft(UNREADABLE, TWICE[0]),)),)),
        with_machine(states=(StateDraft(TWICE[0], variables=(VariableDraft(TWICE[1], UNREADABLE),)),)),
    ],
)
def test_no_part_is_left_out_without_an_error(draft: ArrangementDraft | Unreadable) -> None:
    """A reader that says nothing of what it could not read does not get an arrangement with less in it."""
    with pytest.raises(ValueError, match="no error in the draft says why"):
        resolve(Draft(draft, "by hand", "", (SOURCE,)))
    assert said(draft, Diagnostic("E010", "unreadable", Span(SOURCE, 0, 1)))[0] == "E010 unreadable"


def test_the_draft_is_right_otherwise() -> None:
    assert resolve(Draft(GOOD, "by hand", "", (SOURCE,))).machine("m").states[1].name == "ON"


def test_what_stands_for_all_mistakes_is_said_alone() -> None:
    instead = Diagnostic("E019", "this is a picture", Span(SOURCE, 0, 1))
    assert said(with_machine(states=(), instead=instead)) == ["E019 this is a picture"]
    with pytest.raises(DiagnosticError) as caught:
        resolve(Draft(replace(GOOD, processes=()), "by hand", "", (SOURCE,), instead=instead))
    assert caught.value.diagnostics == (instead,)


def test_mistakes_come_file_by_file_and_those_of_a_whole_file_first() -> None:
    one, two = Source("one.yaml", "abc"), Source("two.yaml", "abc")
    whole = Diagnostic("E003", "whole", file="two.yaml")
    start, later = Diagnostic("E040", "start", Span(two, 0, 1)), Diagnostic("E040", "later", Span(two, 2, 3))
    first, unknown = Diagnostic("E040", "first", Span(one, 1, 2)), Diagnostic("E001", "gone", file="three.yaml")
    again = replace(start, message="said again")
    found = _ordered([unknown, later, start, again, whole, first], ["one.yaml", "two.yaml"])
    assert [d.message for d in found] == ["first", "whole", "start", "later", "gone"]
    tag = Diagnostic("E016", "a tag", Span(two, 0, 1))
    assert [d.message for d in _ordered([tag, start, later], ["two.yaml"])] == ["a tag", "later"]
