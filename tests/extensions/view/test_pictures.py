"""The pictures of docs/viewing.md are of the page as it is: the same words are on them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests import outside
from tests.extensions.view import pictures

pytestmark = [pytest.mark.long, outside.needs("chromium", "chromedriver", "selenium", "pygraphviz")]


@pytest.fixture(scope="module")
def driver(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with pytest.MonkeyPatch.context() as patch, pictures.browser() as found:
        patch.setenv("LLFSM_WHITEBOARDS", str(tmp_path_factory.mktemp("boards")))
        yield found


@pytest.mark.parametrize("name", pictures.PICTURES)
def test_a_picture_has_the_words_of_the_page(driver: Any, name: str) -> None:
    words = pictures.PICTURES[name](driver)
    kept = pictures.words_of(Path(pictures.FOLDER, name).read_bytes())
    assert list(map(steady, words)) == list(map(steady, kept)), "make it anew: python -m tests.extensions.view.pictures"


def test_both_lights_are_green(driver: Any) -> None:
    pictures.report(driver)
    shown = driver.execute_script("return [...document.querySelectorAll('.machine')].map((one) => one.textContent)")
    assert ["in GREEN" in words for words in shown] == [False, True, True]


def steady(words: str) -> str:
    """Without what differs from run to run."""
    return re.sub(r"[\d.,]+ (ms|overruns?)", "", words)
