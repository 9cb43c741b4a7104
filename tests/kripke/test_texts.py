"""The kernels' texts that come with the package are those of its sources."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib import resources
from pathlib import Path
from zipfile import ZipFile

import pytest

from llfsm_verify.kripke import texts
from llfsm_verify.kripke.kernels.entries import MODULES

ROOT = Path(__file__).parents[2]


def made_from() -> dict[str, list[str]]:
    with resources.files(texts.PACKAGE).joinpath(texts.ARCHIVE).open("rb") as file, ZipFile(file) as archive:
        return dict(json.loads(archive.read(texts.INDEX)))


def test_the_texts_are_those_of_the_sources() -> None:
    """Where this fails, run `python -m tools.kernels`."""
    made = made_from()
    assert {name: origin[0] for name, origin in made.items()} == {n: texts.origin(m)[0] for n, m in MODULES.items()}


def test_a_text_of_other_sources_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    for place in range(3):
        other = texts.origin("sets").copy()
        other[place] += "?"
        with monkeypatch.context() as patch:
            patch.setattr(texts, "origin", lambda _, other=other: other)
            assert texts.shipped("rebuild", "sets") is None


def test_a_package_without_texts_works(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(texts, "ARCHIVE", "nothing.zip")
    assert texts.shipped("rebuild", "sets") is None


@pytest.mark.long
def test_the_texts_are_what_numba_makes() -> None:
    if any(origin[1:] != texts.origin(MODULES[name])[1:] for name, origin in made_from().items()):
        pytest.skip("the texts are for another LLVM or machine")
    command = [sys.executable, "-m", "tools.kernels", "--check"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
