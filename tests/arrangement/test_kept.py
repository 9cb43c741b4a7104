"""Large arrangements and their step programs are kept, and are then what resolving and lowering give."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings

from llfsm_verify import kept
from llfsm_verify.arrangement import build_arrangement, load_arrangement, load_arrangement_text
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.arrangement.resolve import arrangement as resolver
from llfsm_verify.backends.native import machine_code
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.diagnostics import DiagnosticError, Fragment, Source
from llfsm_verify.language.atoms import PropertyScope, check_atom
from llfsm_verify.packing import PackingError
from llfsm_verify.program.program import Program
from llfsm_verify.semantics import lowering
from llfsm_verify.semantics.letters import Observed
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.testing.arrangements import Document, arrangements
from llfsm_verify.testing.properties import state_formulas
from tests.quick import examples

ROOT = Path(__file__).parents[2]
MODELS = sorted((ROOT / "models").glob("**/arrangement.yaml"))
SAME_FOLDER = [HealthCheck.function_scoped_fixture, HealthCheck.too_slow, HealthCheck.data_too_large]
TEXT = """
name: small
whiteboard: {go: {type: bool, init: false, role: input}}
machines:
  m: {inline: {machine: M, variables: {n: {type: 0..9, init: 0}}, states: [
    {name: A, on_entry: n = (n + 1) % 9;, transitions: [{when: go, to: B}, {when: n > 20, to: B}]},
    {name: B, transitions: [{when: true, to: A}]}]}}
schedule: [m]
"""


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty folder, in which everything is worth keeping."""
    monkeypatch.setenv(kept.FOLDER, str(tmp_path / "cache"))
    monkeypatch.setattr(resolver, "WORTH_KEEPING", 0)
    monkeypatch.setattr(resolver, "installation", lambda: "this installation")
    monkeypatch.setattr(machine_code, "WORTH_KEEPING", 0.0)
    kept.forget_waiting()
    yield tmp_path / "cache"
    kept.forget_waiting()


def files(cache: Path, kind: str) -> list[Path]:
    kept.keep_waiting()
    return list(cache.glob(f"{kind}-*"))


def atoms_of(arrangement: Arrangement) -> list[Observed]:
    scope = PropertyScope.of(arrangement)
    texts = state_formulas(arrangement)[::7]
    return [Observed(text, check_atom(Fragment.whole(Source("<atom>", text)), scope)) for text in texts]


def found_again(load: Callable[[], Arrangement]) -> None:
    """What is kept is the arrangement, and its programs are those of the arrangement."""
    made = load()
    programs = [lower(made, atoms_of(made), keep_all_bits=bits) for bits in (False, True)]
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(resolver, "_resolved", lambda *_, **__: pytest.fail("resolved again"))
        found = load()
        assert [each.render() for each in found.warnings] == [each.render() for each in made.warnings]
        again = load()
        assert repr(found) == repr(again) == repr(made)
    atoms = atoms_of(found)
    anew = [lower(replace(found), atoms, keep_all_bits=bits) for bits in (False, True)]
    assert all(each.kept_as is None for each in anew)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(lowering, "_lowered", lambda *_, **__: pytest.fail("lowered again"))
        loaded = [lower(found, atoms, keep_all_bits=bits) for bits in (False, True)]
    assert loaded == anew
    assert [repr(each) for each in loaded] == [repr(each) for each in programs]
    assert [each.kept_as for each in loaded] == [each.kept_as for each in programs]
    assert None not in {each.kept_as for each in loaded}


@pytest.mark.slow
@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.parent.name)
def test_models_are_found_again(cache: Path, path: Path) -> None:
    found_again(lambda: load_arrangement(path))


@pytest.mark.slow
@settings(max_examples=examples(20), deadline=None, suppress_health_check=SAME_FOLDER)
@given(document=arrangements())
def test_random_arrangements_are_found_again(cache: Path, document: Document) -> None:
    text = json.dumps(document)
    found_again(lambda: load_arrangement_text(text))


def test_places_are_those_of_the_file_that_was_read(cache: Path) -> None:
    load_arrangement_text(TEXT)
    found = load_arrangement_text(TEXT)
    places = [w.span for w in found.warnings] + [m.span for m in found.machines] + [found.span]
    assert len({id(place.source) for place in places if place is not None}) == 1
    assert [w.code for w in found.warnings] != []
    (fault,) = {site.span.source for site in lower(found).faults if site.span is not None} or {found.span.source}
    assert fault is found.span.source


def test_every_difference_has_another_name(cache: Path) -> None:
    cases: list[tuple[str, str, bool]] = [
        (TEXT, "<text>", False), (TEXT, "other", False), (TEXT, "<text>", True),
        (TEXT.replace("% 9", "% 8"), "<text>", False), (TEXT + "# the end\n", "<text>", False),
    ]  # fmt: skip
    names = {load_arrangement_text(text, name, integer_guards=guards).kept_as for text, name, guards in cases}
    assert len(names - {None}) == len(cases) == len(files(cache, "arrangement"))
    arrangement = load_arrangement_text(TEXT)
    atoms = atoms_of(arrangement)
    assert len(atoms) > 1
    programs = [
        lower(arrangement, atoms), lower(arrangement, atoms[1:]), lower(arrangement, atoms[::-1]),
        lower(arrangement, atoms, keep_all_bits=True), lower(load_arrangement_text(TEXT + "\n"), atoms),
    ]  # fmt: skip
    assert len({program.kept_as for program in programs} - {None}) == len(programs) == len(files(cache, "lowered"))


def test_machine_files_and_their_changes(cache: Path, tmp_path: Path) -> None:
    inline, states = TEXT.index("{inline: "), TEXT.index("}\nschedule")
    (tmp_path / "m.yaml").write_text(TEXT[inline + len("{inline: ") : states])
    (tmp_path / "a.yaml").write_text(TEXT[:inline] + "{file: m.yaml" + TEXT[states:])
    first = load_arrangement(tmp_path / "a.yaml")
    assert load_arrangement(tmp_path / "a.yaml").kept_as == first.kept_as
    (tmp_path / "m.yaml").write_text((tmp_path / "m.yaml").read_text().replace("init: 0", "init: 5"))
    second = load_arrangement(tmp_path / "a.yaml")
    assert second.kept_as != first.kept_as
    assert [arrangement.machines[0].variables[0].init for arrangement in (first, second)] == [0, 5]


def test_a_copy_with_other_parts_is_not_kept(cache: Path) -> None:
    arrangement = load_arrangement_text(TEXT)
    assert replace(arrangement, observe="cycle").kept_as is None
    assert replace(lower(arrangement), name="other").kept_as is None


def test_mistakes_are_found_again(cache: Path) -> None:
    for _ in range(2):
        with pytest.raises(DiagnosticError, match="E"):
            load_arrangement_text(TEXT.replace("to: A", "to: C"))
    assert files(cache, "arrangement") == []


def test_what_is_nested_too_deeply_is_computed(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    arrangement = load_arrangement_text(TEXT)
    kept.keep_waiting()

    def refuse(*_: object, **__: object) -> bytes:
        raise PackingError

    monkeypatch.setattr(lowering, "pack", refuse)
    assert lower(arrangement).kept_as is None
    monkeypatch.setattr(kept, "pack", refuse)
    assert load_arrangement_text(TEXT + "\n").kept_as is not None
    monkeypatch.setattr(resolver, "pack", refuse)
    assert load_arrangement_text(TEXT + "\n").kept_as is None
    assert len(files(cache, "arrangement")) == 1


def test_damaged_files_are_made_again(cache: Path) -> None:
    made = load_arrangement_text(TEXT)
    (file,) = files(cache, "arrangement")
    whole = file.read_bytes()
    for data in (b"", whole[:-1], whole[:40] + bytes([whole[40] ^ 1]) + whole[41:]):
        file.write_bytes(data)
        assert repr(load_arrangement_text(TEXT)) == repr(made)
        assert files(cache, "arrangement") == [file] and file.read_bytes() == whole


def test_an_installation_that_changes_has_no_name(monkeypatch: pytest.MonkeyPatch) -> None:
    name = kept.installation.__wrapped__()
    assert name is not None
    assert kept.installation.__wrapped__() == name
    monkeypatch.setattr(kept, "BEGAN", 0.0)
    assert kept.installation.__wrapped__() is None


def test_nothing_is_kept_where_the_installation_has_no_name(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resolver, "installation", lambda: None)
    assert load_arrangement_text(TEXT).kept_as is None
    assert not cache.exists()


def test_python_data_is_not_kept(cache: Path) -> None:
    states = [{"name": "A", "on_entry": "n = 1;", "transitions": []}]
    machine = {"machine": "M", "variables": {"n": {"type": "0..9", "init": 0}}, "states": states}
    document = {"name": "data", "machines": {"m": {"inline": machine}}, "schedule": ["m"]}
    assert build_arrangement(document).kept_as is None
    assert load_arrangement_text(json.dumps(document)).kept_as is not None


def test_small_arrangements_are_not_kept(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resolver, "WORTH_KEEPING", 50)
    assert load_arrangement_text(TEXT).kept_as is None
    monkeypatch.setattr(resolver, "WORTH_KEEPING", 10)
    assert load_arrangement_text(TEXT).kept_as is not None


def steps_of(program: Program, *, events: bool = False) -> object:
    native = NativeProgram(program, events=events, effort="quick")
    first = native.layout.first()
    result = native.step(first, 0, {})
    return list(native.successors(first)), result, native.run(first, 50, mode="random", seed=3), native.lines


def test_machine_code_is_kept_under_the_name_of_its_program(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = lower(load_arrangement_text(TEXT))
    made = [steps_of(program), steps_of(program, events=True)]
    assert made[0] != made[1]
    again = lower(load_arrangement_text(TEXT))
    monkeypatch.setattr(NativeProgram, "text", property(lambda _: pytest.fail("written again")))
    assert [steps_of(again), steps_of(again, events=True)] == made
    monkeypatch.undo()
    assert steps_of(replace(program)) == made[0]


def test_what_waits_is_kept_while_machine_code_is_compiled(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    threads = []
    keep = kept.keep_waiting

    def told() -> None:
        threads.append(threading.current_thread())
        keep()

    monkeypatch.setattr(kept, "keep_waiting", told)
    program = lower(load_arrangement_text(TEXT))
    assert not list(cache.glob("*"))
    NativeProgram(program).compile()
    assert {file.name.partition("-")[0] for file in cache.glob("*")} == {"arrangement", "lowered", "program"}
    assert len(threads) == 1 and threads[0] is not threading.current_thread() and not threads[0].is_alive()


def test_only_so_many_values_wait(cache: Path) -> None:
    for number in range(3 * kept.MOST_WAITING):
        load_arrangement_text(f"{TEXT}# {number}\n")
        assert len(kept._waiting) <= kept.MOST_WAITING
    assert list(cache.glob("arrangement-*"))


SCRIPT = """
from llfsm_verify.arrangement import load_arrangement_text
from llfsm_verify.arrangement.resolve import arrangement as resolver
from llfsm_verify.semantics.lowering import lower
resolver.WORTH_KEEPING = 0
arrangement = load_arrangement_text({text!r})
print(arrangement.kept_as, lower(arrangement).kept_as)
"""


@pytest.mark.slow
def test_another_process_finds_them(cache: Path) -> None:
    names = set()
    for seed in ("1", "2"):
        command = [sys.executable, "-c", SCRIPT.format(text=TEXT)]
        environment = {**os.environ, "PYTHONHASHSEED": seed}
        names.add(subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout)
    assert len(names) == 1
    assert len(files(cache, "arrangement")) == len(files(cache, "lowered")) == 1
