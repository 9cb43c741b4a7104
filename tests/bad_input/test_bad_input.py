"""Every wrong file gets exactly its diagnostic, at its place, quickly, and without a traceback."""

from __future__ import annotations

import io
import os
import re
from pathlib import Path

import pytest
import yaml

import llfsm_verify
from llfsm_verify.arrangement import codes as arrangement_codes
from llfsm_verify.arrangement.files import MAX_FILE_BYTES
from llfsm_verify.arrangement.keys import VOCABULARY
from llfsm_verify.arrangement.kinds import kind_of
from llfsm_verify.arrangement.loader import load_arrangement, load_arrangement_text
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment, Source
from llfsm_verify.language import codes as language_codes
from llfsm_verify.language.atoms import PropertyScope, check_atom
from llfsm_verify.yaml.compose import compose
from tests.bad_input.cases import CASES, FRAMED, TOP, Case
from tests.bad_input.messages import kept, messages
from tests.bad_input.property_cases import BOARD_OF_PROPERTIES, PROPERTY_CASES


def errors(load: object, *arguments: object, **options: object) -> list[Diagnostic]:
    assert callable(load)
    with pytest.raises(DiagnosticError) as caught:
        load(*arguments, **options)
    return list(caught.value.diagnostics)


@pytest.mark.parametrize("case", CASES, ids=lambda c: c.reason)
def test_wrong_text(case: Case) -> None:
    assert case.text.count("§") == 1
    source = Source("wrong.yaml", case.text.replace("§", ""))
    expected = (case.code, *source.position(case.text.index("§")))
    found = errors(load_arrangement_text, source.text, "wrong.yaml")
    assert [(d.code, d.span and d.span.line, d.span and d.span.column) for d in found] == [expected]
    for d in found:
        assert d.hint
        assert len(d.render().split("\n")) <= 6
        assert max(map(len, d.render().split("\n"))) < 400
        assert re.search(r"wrong.yaml:\d+:\d+: error", d.render())


@pytest.mark.slow
def test_every_word_of_the_messages() -> None:
    """messages.py says how the expected ones are written anew, for a reader of the difference to judge."""
    assert messages() == kept()


@pytest.mark.parametrize("case", [c for c in CASES if c.code < "E020"], ids=lambda c: c.reason)
def test_both_yaml_parsers_agree(case: Case) -> None:
    source = Source("wrong.yaml", case.text.replace("§", ""))
    fast: list[Diagnostic] = []
    pure: list[Diagnostic] = []
    for found, slow in ((fast, False), (pure, True)):
        try:
            compose(source, found, VOCABULARY, pure=slow)
        except DiagnosticError as e:
            found[:] = e.diagnostics
    assert [d.code for d in fast][:1] == [d.code for d in pure][:1]


def test_the_fast_yaml_parser_is_tested_where_it_exists() -> None:
    assert hasattr(yaml, "CSafeLoader")


def test_every_code_has_a_case() -> None:
    elsewhere = {"E002", "E003", "E004", "E005", "E011", "W001", "W002"}  # cases in this folder
    elsewhere |= {"E165"}  # of a running arrangement: tests/runtime/swapping/test_policies.py
    covered = {c.code for c in CASES} | {c.code for c in PROPERTY_CASES} | elsewhere
    assert covered == set(arrangement_codes.CODES) | set(language_codes.CODES)


def test_every_code_in_the_program_is_documented() -> None:
    package = Path(llfsm_verify.__file__).parent
    for folders, known in ((("arrangement", "yaml"), arrangement_codes.CODES), (("language",), language_codes.CODES)):
        used = set()
        for path in (path for folder in folders for path in (package / folder).rglob("*.py")):
            if path.name != "codes.py":
                used |= set(re.findall(r'"([EW]\d{3})"', path.read_text("utf-8")))
        assert used <= set(arrangement_codes.CODES) | set(language_codes.CODES)
        assert set(known) <= used | {"E129", "E119", "E128"}


def test_every_code_is_on_the_page() -> None:
    page = (Path(llfsm_verify.__file__).parents[1] / "docs" / "diagnostics.md").read_text("utf-8")
    for code, meaning in (arrangement_codes.CODES | language_codes.CODES).items():
        assert f"| {code} | {meaning} |" in page


# ---------------------------------------------------------------- files


@pytest.mark.parametrize(
    ("data", "code"),
    [
        (b"", "E011"),
        (b"\xef\xbb\xbf", "E011"),
        (b"# only a comment\n", "E011"),
        (b"\n\n---\n...\n", "E032"),
        (b"\x7fELF\x02\x01\x01\x00", "E005"),
        (b"name: \xff\xfe\n", "E005"),
        (b"name: a\x00b\n", "E005"),
        ("name: a\n".encode("utf-16"), "E005"),
        (b"\x89PNG\r\n\x1a\n", "E005"),
        (b" " * (MAX_FILE_BYTES + 1), "E004"),
    ],
    ids=["empty", "mark only", "comment", "empty document", "ELF", "latin", "null", "UTF-16", "PNG", "huge"],
)
def test_wrong_file(tmp_path: Path, data: bytes, code: str) -> None:
    path = tmp_path / "wrong.yaml"
    path.write_bytes(data)
    found = errors(load_arrangement, path)
    if code == "E032":
        assert found[0].code in ("E030", "E011")
        return
    assert [(d.code, d.file) for d in found] == [(code, str(path))]
    assert found[0].hint
    assert found[0].render().startswith(f"{path}: error[{code}]")
    machine = tmp_path / "arrangement.yaml"
    machine.write_text("machines: {m: {file: wrong.yaml}}\nschedule: [m]\n")
    (again,) = errors(load_arrangement, machine)
    assert again.code == code


def test_paths(tmp_path: Path) -> None:
    assert [d.code for d in errors(load_arrangement, tmp_path / "nothing.yaml")] == ["E001"]
    assert [d.code for d in errors(load_arrangement, tmp_path)] == ["E003"]
    assert [d.code for d in errors(load_arrangement, "a\0b")] == ["E001"]
    (empty,) = errors(load_arrangement, "")
    assert empty.render().startswith("<empty path>: error[E001]")
    assert [d.code for d in errors(load_arrangement, tmp_path / ("x" * 5000))] == ["E002"]
    loop = tmp_path / "loop.yaml"
    loop.symlink_to(loop)
    assert [d.code for d in errors(load_arrangement, loop)] == ["E002"]
    file = tmp_path / "file"
    file.write_text("x")
    assert [d.code for d in errors(load_arrangement, file / "below.yaml")] == ["E002"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root reads everything")
def test_unreadable_file(tmp_path: Path) -> None:
    path = tmp_path / "secret.yaml"
    path.write_text("name: a\n")
    path.chmod(0)
    assert [d.code for d in errors(load_arrangement, path)] == ["E002"]


@pytest.mark.skipif(not Path("/proc/self/mem").exists(), reason="no /proc here")
def test_file_that_fails_while_it_is_read() -> None:
    assert [d.code for d in errors(load_arrangement, "/proc/self/mem")] == ["E002"]


def test_standard_input() -> None:
    (found,) = errors(load_arrangement, "-", stdin=io.StringIO("name: [\n"))
    assert str(found.span).startswith("<stdin>:")
    binary = io.TextIOWrapper(io.BytesIO(b"\xff\xfe\x00"))
    assert [d.code for d in errors(load_arrangement, "-", stdin=binary)] == ["E005"]
    assert load_arrangement("-", stdin=io.StringIO(TOP("name: fine"))).name == "fine"


def test_errors_of_several_files_and_places_are_all_reported_in_order(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text("machine: M\nstates:\n  - name: A\n    on_entry: x = 1;\n    internal: y = 1;\n")
    text = "whiteboard: {a: {type: colour}}\nmachines: {m: {file: m.yaml}, n: {file: m.yaml}}\nschedule: [m, o]\n"
    (tmp_path / "a.yaml").write_text(text)
    found = errors(load_arrangement, tmp_path / "a.yaml")
    names = [(Path(d.span.source.name).name, d.span.line, d.code) for d in found if d.span]
    assert names == [
        ("a.yaml", 1, "E040"),
        ("a.yaml", 2, "E083"),
        ("a.yaml", 3, "E081"),
        ("m.yaml", 4, "E110"),
        ("m.yaml", 5, "E110"),
    ]


def test_an_arrangement_where_a_machine_is_expected_is_one_mistake(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("machines:\n  m: {file: a.yaml}\nschedule: [m]\n")
    (found,) = errors(load_arrangement, tmp_path / "a.yaml")
    assert (found.code, found.span and found.span.line) == ("E019", 1)
    assert "looks like an arrangement, and a machine file is expected" in found.message


def test_a_machine_with_mistakes_of_its_own_is_no_other_kind(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text("machine: M\nstates: [{name: A, transitions: [{when: x -> y, to: A}]}]\n")
    (tmp_path / "a.yaml").write_text("machines:\n  m: {file: m.yaml}\nschedule: [m]\n")
    assert "E019" not in [d.code for d in errors(load_arrangement, tmp_path / "a.yaml")]


def test_a_long_line_of_blanks_is_looked_at_quickly() -> None:
    assert kind_of(Source("a.yaml", "x" + " " * 1_000_000 + "y")) is None


def test_at_most_fifty_diagnostics() -> None:
    assert len(errors(load_arrangement_text, FRAMED(action="zzz = 1; " * 200))) == 50


# ---------------------------------------------------------------- what must be accepted


def test_words_that_yaml_would_change_stay_what_they_are() -> None:
    text = (
        "types: {Switch: [ON, OFF], Answer: [yes, no, Null, y, n]}\n"
        "whiteboard: {s: {type: Switch, init: OFF}, a: {type: Answer, init: no}}\n"
        "machines:\n  m:\n    inline:\n      machine: M\n      states:\n"
        "        - name: ON\n          on_entry: s = ON; a = yes;\n"
        "          transitions: [{when: s == ON && a == yes, to: OFF}, {when: true, to: ON}]\n"
        "        - name: OFF\n          transitions: [{when: not m@ON, to: ON}]\n"
        "schedule: [m]\n"
    )
    arrangement = load_arrangement_text(text)
    assert [s.name for s in arrangement.machines[0].states] == ["ON", "OFF"]
    assert [w.variable.init for w in arrangement.whiteboard] == [1, 1]


def test_byte_order_mark_and_windows_lines_are_accepted(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes(b"\xef\xbb\xbf" + TOP("name: a").replace("\n", "\r\n").encode())
    assert load_arrangement(path).name == "a"
    path.write_bytes(FRAMED(guard="car &&\n                cat").replace("\n", "\r\n").encode())
    (found,) = errors(load_arrangement, path)
    assert (found.code, found.span and found.span.line, found.span and found.span.column) == ("E110", 30, 17)


def test_anchors_and_aliases_are_accepted() -> None:
    text = "machines: {m: &m {inline: {machine: M, states: [{name: A}]}}, n: *m}\nschedule: [m, n]\n"
    assert [m.name for m in load_arrangement_text(text).machines] == ["m", "n"]


@pytest.mark.parametrize("guard", ["&ready", "&ready ''"])
def test_a_guard_that_yaml_reads_as_an_anchor(guard: str) -> None:
    text = (
        "whiteboard: {ready: {type: bool, role: input}}\n"
        f"machines:\n  m:\n    inline:\n      machine: M\n      states:\n        - name: A\n"
        f"          transitions:\n            - when: {guard}\n              to: A\n"
        "schedule: [m]\n"
    )
    (found,) = errors(load_arrangement_text, text)
    assert found.code == "E020"
    assert found.span is not None and found.span.line == 9


def test_an_unused_parameter_is_a_warning() -> None:
    text = FRAMED().replace("limit > 3", "true")
    (warning,) = load_arrangement_text(text).warnings
    assert (warning.code, warning.span and warning.span.line) == ("W001", 20)


def test_a_parameter_that_says_what_a_state_runs_is_used() -> None:
    text = (
        "machines:\n  box:\n    inline:\n      machine: Box\n      parameters: {child: machine}\n      states:\n"
        "        - {name: WORK, runs: [child], transitions: [{when: all_done, to: END}]}\n        - {name: END}\n"
        "    parameters: {child: a}\n  a: {inline: {machine: Child, states: [{name: DONE}]}}\nschedule: [box, a]\n"
    )
    assert load_arrangement_text(text).warnings == ()


# ---------------------------------------------------------------- atoms of properties


@pytest.mark.parametrize("case", PROPERTY_CASES, ids=lambda c: c.reason)
def test_wrong_atom(case: Case) -> None:
    scope = PropertyScope.of(load_arrangement_text(BOARD_OF_PROPERTIES))
    text = case.text.replace("§", "")
    (found,) = errors(check_atom, Fragment.whole(Source("props.ltl", text)), scope)
    assert found.hint
    assert (found.code, found.span and found.span.start) == (case.code, case.text.index("§"))


def test_a_machine_is_known_by_its_name_and_its_states() -> None:
    name, states = "machine: M\n", "states:\n  - name: A\n"
    assert kind_of(Source("a.yaml", name + states)) == "machine"
    assert kind_of(Source("a.yaml", name)) is None and kind_of(Source("a.yaml", states)) is None
