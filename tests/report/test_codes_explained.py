"""`llfsm explain`: each code has a meaning and an example that was printed once."""

from __future__ import annotations

import json
import re

import pytest

from llfsm_verify.report.codes import all_codes, explained
from tests.cli.running import llfsm
from tests.outputs.examples import KEPT

EXAMPLES = json.loads(KEPT.read_text(encoding="utf-8"))


def test_examples_are_of_codes_that_there_are_and_of_no_machine():
    assert set(EXAMPLES) <= set(all_codes())
    for code, text in EXAMPLES.items():
        assert f"[{code}]" in text
        assert not re.search(r"/(?:tmp|home|root|work|usr)/", text), code


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
