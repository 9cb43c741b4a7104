"""`llfsm explain`: each code has a meaning, an example and what to do."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from llfsm_verify.registry import Entry
from llfsm_verify.report.codes import OF_OTHERS, all_codes, everyone, explained, meanings, ours
from tests.cli.running import llfsm
from tests.outputs import examples
from tests.outputs.examples import ELSEWHERE, PROVOKED, example, of_wrong_texts, places

EXAMPLES = {code: text for section in ours() for code, text in section.examples.items()}


def test_each_code_has_an_example_that_names_no_machine():
    assert set(EXAMPLES) == set(all_codes())
    for code, text in EXAMPLES.items():
        assert f"[{code}]" in text or f": {code}: " in text
        assert not re.search(r"/(?:tmp|home|root|work|usr)/", text), code


def test_each_explanation_says_what_to_do_once():
    silent = {code for code, text in EXAMPLES.items() if "\n  hint: " not in text}
    assert silent == {code for section in ours() for code in section.mends}


@pytest.mark.slow
@pytest.mark.parametrize("code", PROVOKED)
def test_an_example_is_what_is_printed_today(code):
    """`python -m tests.outputs.examples` writes the examples anew."""
    if code == "E412" and not Path("/dev/full").exists():
        pytest.skip("needs the device that is always full")
    assert example(code) == EXAMPLES[code]


@pytest.mark.slow
def test_examples_from_wrong_texts_are_what_is_said_today():
    found = of_wrong_texts()
    assert [code for code, said in found.items() if EXAMPLES[code] not in said] == []
    assert sorted([*found, *PROVOKED, *ELSEWHERE]) == sorted(all_codes())


def test_a_code_that_no_command_provokes_is_said_or_comes_from_its_case(monkeypatch):
    kept = []
    monkeypatch.setattr(examples, "of_wrong_texts", lambda: {"E110": ["error[E110]: so"]})
    monkeypatch.setattr(examples, "keep", kept.append)
    examples.main(["E110"])
    assert kept == [{}]
    for code, told in (("E999", "E999 has no command in PROVOKED"), ("E165", "E165 needs a running arrangement")):
        with pytest.raises(SystemExit, match=told):
            examples.main([code])


def test_a_code_is_explained_with_its_example():
    done = llfsm("explain", "e110", "E111")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == f"{explained('E110')}\n\n{explained('E111')}\n"
    assert "error[E110]" in done.stdout and "hint: " in done.stdout


def test_without_a_code_all_are_listed():
    done = llfsm("explain")
    assert done.returncode == 0
    assert all(f"  {code}  " in done.stdout for code in all_codes())


@pytest.mark.parametrize(("word", "told"), [("E11O", "did you mean `E"), ("quux", "`llfsm explain` lists them")])
def test_what_is_no_code_is_said(word, told):
    done = llfsm("explain", word)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"error: there is no diagnostic `{word.upper()}`; {told}")


class Point:
    """An entry point of another package, whose list of codes is here under a name."""

    dist = None

    def __init__(self, name: str) -> None:
        self.name, self.value = name, f"theirs:{name}"

    def load(self) -> Entry:
        return Entry(self.name, f"{__name__}:{self.name.upper()}", f"Codes of {self.name}")


BIKES = {"E900": "A bicycle without a bell.", "E110": "A bicycle without a light."}
CARS, BOATS, PLANES = {"E9": "A car."}, {"E901": ""}, ["E902"]


@pytest.fixture
def theirs(monkeypatch):
    points = [Point(name) for name in ("bikes", "boats", "cars", "planes", "trains")]
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: points if group == OF_OTHERS.group else [])
    monkeypatch.setattr(OF_OTHERS, "_entries", dict(OF_OTHERS._entries))
    monkeypatch.setattr(OF_OTHERS, "_broken", None)


@pytest.mark.usefixtures("theirs")
def test_codes_of_other_packages_are_explained_and_what_is_wrong_with_them_is_a_note():
    done = llfsm("explain", "e900", "E110")
    assert done.returncode == 0 and done.stdout == f"E900: A bicycle without a bell.\n\n{explained('E110')}\n"
    list_of = "note: the list of codes `{}` of another package cannot be used ({})"
    assert done.stderr.splitlines() == [
        "note: E110 of the list of codes `bikes` of another package has a meaning already",
        list_of.format("boats", "E901 has no meaning"),
        list_of.format("cars", "`E9` is not one of the letters EFLW with three digits"),
        list_of.format("planes", f"{__name__}:PLANES is not a mapping"),
        list_of.format("trains", f"AttributeError: module '{__name__}' has no attribute 'TRAINS'"),
    ]
    assert "E900" not in all_codes()
    sections, _ = everyone()
    assert meanings(sections) == all_codes() | {"E900": BIKES["E900"]}
    assert llfsm("explain").stdout.endswith("Codes of bikes\n  E900  A bicycle without a bell.\n")


def test_codes_of_an_extension_have_their_examples_beside_them():
    for name in OF_OTHERS.ours:
        (section,) = (one for one in ours() if one.codes is OF_OTHERS.load(name))
        assert section.title == OF_OTHERS[name].about and section.examples.keys() == section.codes.keys()
        assert {places()[code].parent.name for code in section.codes} == {
            OF_OTHERS[name].place.split(":")[0].split(".")[-2]
        }
