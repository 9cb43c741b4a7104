"""Transition files are arrangements: what is read, what is said of wrong ones by place, and what holds of them."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from llfsm_verify import DiagnosticError, load
from llfsm_verify.extensions.crops import State, StateMachine
from llfsm_verify.plug import ARRANGEMENTS
from llfsm_verify.testing.conformance import reader_cases
from tests.cli.running import llfsm
from tests.extensions.crops.thesis import FIXED, OUTCOMES, TRANSITION_FILE, Scripted, machine

ONE = TRANSITION_FILE[: TRANSITION_FILE.index("\n\n") + 1].replace("Select_fruit", "Exit")
WRONG = [
    ("- state: §{}", "E034", "state_label"),
    ("- state: §word", "E030", ""),
    ("- state:\n    §word", "E030", "below it"),
    ("- state:§ \n- state:", "E030", "`transitions: …`"),
    (ONE.replace("transitions:", "§transition:"), "E033", "transitions"),
    (ONE.replace("state_label", "§label"), "E033", "state_label"),
    (ONE.replace("Locate_fruits\n    desc", "§[Locate_fruits]\n    desc"), "E032", ""),
    (ONE.replace("Found_fruit: Exit", "Found_fruit: §[Exit]"), "E032", ""),
    (ONE.replace("Found_fruit: Exit", "§No fruit: Exit"), "E017", "remove"),
    (ONE.replace("Found_fruit: Exit", "? §[a, b]\n      : Exit"), "E018", "quote"),
    (ONE.replace("Found_fruit: Exit", "Found_fruit: §*Exit"), "E015", "quote"),
    (ONE.replace("Found_fruit: Exit", "§Found_fruit Exit"), "E010", ""),
    (ONE + "§outcomes: [Exit]", "E010", ""),
    (ONE + "- §outcomes: [Exit]", "E034", "- state:"),
    (ONE + "-§ ", "E030", ""),
    (ONE + ONE.replace("Locate_fruits\n    desc", "§Locate_fruits\n    desc"), "E544", "another label"),
    (ONE.replace("state:", "state: &one", 1) + "- §state: *one", "E544", "without an alias"),
    (ONE + ONE.replace("Locate_fruits\n    desc", "§Locate_fruits\n    desc"), "E544", "another label"),
    (ONE + "- initial: §Locate_fruit", "E547", "did you mean `Locate_fruits`?"),
    (ONE + "- initial: §[Locate_fruits]", "E032", ""),
    (ONE + "- initial: Locate_fruits\n- initial: §Locate_fruits", "E544", "remove one"),
    (ONE[: ONE.index("transitions:")] + "transitions: §{}", "E544", "OUTCOME: STATE"),
    (ONE[: ONE.index("transitions:")] + "transitions: §[No fruit, Found_fruit]", "E030", "key: value"),
    (ONE.replace("Found_fruit: Exit", "Found_fruit: §Locate_fruit"), "W544", "Locate_fruits"),
    (ONE.replace("Found_fruit: Exit", "Found_fruit: §Localizing fruits"), "W544", "write `Locate_fruits`, the label"),
    (ONE.replace("Locate_fruits\n      Found", "§!!str Locate_fruits\n      Found"), "E016", "remove"),
]


@pytest.mark.parametrize("case", reader_cases("crops", TRANSITION_FILE), ids=lambda case: case.name)
def test_the_reader_keeps_to_what_readers_do(case) -> None:
    assert case.look() is None


@pytest.mark.parametrize(("text", "code", "hint"), WRONG)
def test_what_is_wrong_with_a_file_is_said_at_its_place(text: str, code: str, hint: str, tmp_path: Path) -> None:
    path = tmp_path / "transfile.yaml"
    path.write_text(text.replace("§", ""), encoding="utf-8")
    before = text[: text.index("§")]
    if code.startswith("W"):
        found = load(path).wrapped.warnings
    else:
        with pytest.raises(DiagnosticError) as caught:
            load(path)
        found = caught.value.diagnostics
        with pytest.raises(DiagnosticError) as added:
            StateMachine(["Exit"]).add_transition_file(path)
        assert [d.render() for d in added.value.diagnostics] == [d.render() for d in found]
    said = [d for d in found if d.code == code]
    assert said, [d.render() for d in found]
    assert (said[0].span.line, said[0].span.column) == (before.count("\n") + 1, len(before.split("\n")[-1]) + 1)
    assert hint in (said[0].hint or "")


def test_the_file_of_the_thesis_is_one_machine_with_its_words(tmp_path: Path) -> None:
    sm = machine(tmp_path, {})
    arrangement = load(tmp_path / "transfile.yaml").wrapped
    (instance,) = arrangement.machines
    names = ["Locate_fruits", "Select_fruit", "Pick_fruit", "Fruit_to_basket", "Exit", "failed", "timed_out", "Paused"]
    assert [state.name for state in instance.states] == names
    assert sm.values["Moving to fruit"] == "Moving_to_fruit"
    assert len(set(sm.values.values())) == len(sm.values)
    lines = [t.guard.span.line for s in instance.states[:4] for t in s.transitions[:2]]
    assert [TRANSITION_FILE.split("\n")[line - 1].split(":")[0].strip() for line in lines] == [
        "No fruit", "Found_fruit", "Fruit selected", "All fruits picked", "Moving to fruit", "Goal", "Transport fruit",
        "Basket",
    ]  # fmt: skip


def test_names_are_made_of_texts_and_all_differ(tmp_path: Path) -> None:
    words = ("a b", "a_b", "a-b", "ä", "1", "G", "outcome", "NONE", "sm", "if", "")
    lines = "".join(f"      {word!r}: {'Exit' if word else 'Paused'}\n" for word in words)
    sm = machine(tmp_path, {}, ONE[: ONE.index("      No fruit")] + lines)
    names = {word: sm.values[word] for word in words}
    assert names["a_b"] == "a_b"
    assert len(set(sm.values.values())) == len(words) + 2
    assert {"outcome", "NONE", "sm"}.isdisjoint(names.values())


def test_what_the_thesis_contradicts_is_said_by_line(tmp_path: Path) -> None:
    states = {label: Scripted(*outcomes) for label, outcomes in OUTCOMES.items()}
    with pytest.raises(DiagnosticError) as caught:
        machine(tmp_path, states).execute("Locate_fruit")
    said = [(d.code, d.span.line, d.message, d.hint) for d in caught.value.diagnostics if d.span]
    assert said == [
        ("E547", 2, "`execute('Locate_fruit')` names no label of the transition file", "write `Locate_fruits`"),
        (
            "E546", 5, "the state `Locate_fruits` may give `No_fruit_detected`, for which it has no transition",
            "write `No_fruit_detected: STATE` here",
        ),
        (
            "E546", 19, "the state `Pick_fruit` may give `Out of reach`, for which it has no transition",
            "write `Out of reach: STATE` here",
        ),
    ]  # fmt: skip
    assert caught.value.diagnostics[1].notes == ("Scripted never gives `No fruit`",)


def test_a_file_is_told_by_its_beginning_in_a_moment(tmp_path: Path) -> None:
    """Banners of `#` and lines before it change nothing, and cost nothing."""
    banner = ("#" * 2_000 + "\n") * 100
    assert ARRANGEMENTS.told_by(f"%YAML 1.2\n--- \n{banner}\n{ONE}") == "crops"
    assert ARRANGEMENTS.told_by(f"{banner}name: a\n") is None
    for begun in ("- {state: {", "-   'state' :", '- "state":\n', "-\n  state:"):
        assert ARRANGEMENTS.told_by(begun) == "crops"


def test_another_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    for text in (f"[{{state: {{}}}}]\n{ONE}", "machines: {}\n"):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(DiagnosticError, match=r"error\[E544\]: this is not a transition file"):
            StateMachine(["Exit"]).add_transition_file(path)


def test_what_is_looked_at_before_a_run_takes_time_as_there_are_states(tmp_path: Path) -> None:
    """Counted in calls, along a chain of states that comes to its end last."""

    def calls(count: int) -> int:
        stages = [ONE.replace("Locate_fruits", f"S{i}", 1).replace("Exit", f"S{i + 1}") for i in range(count)]
        text = "".join(stages).replace(f"S{count}\n", "Exit\n").replace("Locate_fruits", "S0")
        sm = machine(tmp_path, {f"S{i}": Scripted("No fruit", "Found_fruit") for i in range(count)}, text)
        made: list[str] = []
        sys.setprofile(lambda _frame, event, _arg: made.append(event))
        try:
            (said,) = sm.check("S0")
        finally:
            sys.setprofile(None)
        assert said.endswith(f"`S19` and {count - 20} more: they end the state machine")
        return len(made)

    assert calls(160) < 5 * calls(40)


def test_many_ends_are_compared_with_many_labels_in_a_moment(tmp_path: Path) -> None:
    """Counted in comparisons. What differs in one place from a label is still found."""
    asked: list[int] = []
    stages = [ONE.replace("Locate_fruits", f"state {i:x} {i}", 1).replace("Exit", f"{i} out {i:x}") for i in range(500)]
    text = "".join(stages).replace("No fruit: Locate_fruits", "No fruit: state 0 0") + "      more: State 1f3 499\n"
    sys.setprofile(lambda frame, event, _: asked.append(1) if frame.f_code.co_name == "ratio" else None)
    try:
        (tmp_path / "transfile.yaml").write_text(text, encoding="utf-8")
        found = load(tmp_path / "transfile.yaml").wrapped.warnings
    finally:
        sys.setprofile(None)
    assert len(asked) < 5_000
    assert [(d.code, d.hint) for d in found] == [("W544", "did you mean `state 1f3 499`?")]


@pytest.mark.parametrize("tail", ["", "# the end", "...\n", "- initial: 'state 1' # here\n"])
@pytest.mark.parametrize("indent", ["", "  "])
def test_the_item_initial_says_where_it_begins(tail: str, indent: str, tmp_path: Path) -> None:
    text = ONE.replace("Locate_fruits", "state 1") + ONE.replace("Locate_fruits", "'2'")
    tail = tail.replace("- ", f"{indent}- ")
    sm = machine(tmp_path, {}, "".join(f"{indent}{line}\n" for line in text.splitlines()) + tail)
    for label in ("2", "state 1"):
        (tmp_path / "other.yaml").write_text(sm._transitions.text_with(label), encoding="utf-8")
        (instance,) = load(tmp_path / "other.yaml").wrapped.machines
        assert instance.states[instance.initial].name == sm._transitions.states[label]


class Silent(State):
    """It does not say what it gives."""


class Text(State):
    outcomes = "Goal"


class Numbers(State):
    outcomes = (1, [2])  # type: ignore[assignment]


class Number(State):
    outcomes = 3  # type: ignore[assignment]


@pytest.mark.parametrize(
    ("change", "ends", "code", "line", "hint"),
    [
        ({"Locate_fruit": Silent()}, ("Exit",), "E547", 2, "Locate_fruits"),
        ({"Anything else": Silent()}, ("Exit",), "E547", None, "`Locate_fruits`, `Select_fruit`"),
        ({"Pick_fruit": None}, ("Exit",), "E547", 16, "add('Pick_fruit'"),
        ({"Pick_fruit": Silent()}, ("Exit",), "E549", 16, "('Moving to fruit', 'Goal')"),
        ({"Pick_fruit": Text()}, ("Exit",), "E549", 16, "outcomes = ("),
        ({"Pick_fruit": Numbers()}, ("Exit",), "E549", 16, "outcomes = ("),
        ({"Pick_fruit": Number()}, ("Exit",), "E549", 16, "outcomes = ("),
        ({}, ("Ende",), "E545", 13, "StateMachine([…, 'Exit'])"),
        ({}, ("Moving arm to fruit",), "E545", 13, "StateMachine(["),
        ({}, ("Exits",), "E545", 13, "did you mean `Exits`?"),
        ({}, ("Exit", "Pick_fruit"), "E545", 16, "another name"),
        ({"Select_fruit": Scripted("Fruit selected")}, ("Exit",), "E548", 2, "`Exit`"),
        ({"Pick_fruit": Scripted("Moving to fruit")}, ("Exit",), "E548", 16, "`Exit`"),
        ({"Pick_fruit": Scripted("Moving to fruit", "Gaol")}, ("Exit",), "E546", 19, "did you mean `Goal`?"),
    ],
)
def test_what_does_not_fit_is_said_before_anything_is_executed(change, ends, code, line, hint, tmp_path: Path) -> None:
    states = {label: Scripted(*outcomes) for label, outcomes in FIXED.items()} | change
    sm = machine(tmp_path, {label: state for label, state in states.items() if state is not None}, ends=ends)
    with pytest.raises(DiagnosticError) as caught:
        sm.check("Locate_fruits")
    found = next(d for d in caught.value.diagnostics if d.code == code)
    assert (found.span.line if found.span else None) == line
    assert hint in (found.hint or "")
    assert sm.report is None


@pytest.mark.long
def test_it_is_verified_linted_and_drawn(tmp_path: Path) -> None:
    path = tmp_path / "transfile.yaml"
    path.write_text(TRANSITION_FILE, encoding="utf-8")
    formulas = [
        "last: G (sm.fired(Select_fruit, 1) -> sm@Exit)",
        "wrong: G !sm@Fruit_to_basket",
        "stale: G (sm.fired(Pick_fruit, 1) -> sampled(answers) % 5 == 2)",
    ]
    done = llfsm("verify", str(path), *[part for f in formulas for part in ("-p", f)])
    assert done.returncode == 1, done.stderr
    assert [line.split()[:2] for line in done.stdout.split("\n")[:4]] == [
        ["holds", "last"], ["violated", "wrong"], ["holds", "stale"], ["holds", "faults"],
    ]  # fmt: skip
    assert "Goal" in done.stdout
    linted = llfsm("lint", str(path))
    assert (linted.returncode, linted.stdout.split(";")[0]) == (0, "0 warnings, 0 notes")
    drawn = llfsm("draw", str(path), "--machine", "sm")
    assert drawn.returncode == 0
    assert "Fruit_to_basket" in drawn.stdout


@pytest.mark.slow
def test_it_is_checked_with_the_properties_beside_it(tmp_path: Path) -> None:
    """Also where the folder or the file of its properties is named."""
    (tmp_path / "fruits.yaml").write_text(TRANSITION_FILE, encoding="utf-8")
    (tmp_path / "fruits.ltl").write_text("G !sm@Exit\n", encoding="utf-8")
    for named in (tmp_path / "fruits.yaml", tmp_path, tmp_path / "fruits.ltl"):
        done = llfsm("check", str(named))
        assert (done.returncode, done.stdout.split()[0]) == (1, "fails"), done.stderr
