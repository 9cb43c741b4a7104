"""`llfsm explain`: each code has a meaning, an example and what to do."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from llfsm_verify.report.codes import MENDS, all_codes, explained
from tests.cli.running import llfsm
from tests.outputs import examples
from tests.outputs.examples import ELSEWHERE, KEPT, PROVOKED, example, of_wrong_texts

EXAMPLES = json.loads(KEPT.read_text(encoding="utf-8"))


def test_each_code_has_an_example_that_names_no_machine():
    assert set(EXAMPLES) == set(all_codes())
    for code, text in EXAMPLES.items():
        assert f"[{code}]" in text
        assert not re.search(r"/(?:tmp|home|root|work|usr)/", text), code


def test_each_explanation_says_what_to_do_once():
    silent = {code for code, text in EXAMPLES.items() if "\n  hint: " not in text}
    assert silent == set(MENDS)


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
