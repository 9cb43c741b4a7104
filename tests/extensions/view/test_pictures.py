"""The pictures of docs/viewing.md say what the pages say today."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests import outside
from tests.extensions.view import pictures


@pytest.fixture(scope="module")
def sized() -> Iterator[Any]:
    with pictures.browser() as driver:
        yield driver


@pytest.mark.slow
@outside.needs("chromium", "chromedriver", "selenium")
def test_the_picture_of_a_report_is_what_the_page_shows(sized: Any) -> None:
    outside.load("pygraphviz")
    kept = pictures.words_of((pictures.FOLDER / "report.png").read_bytes())
    assert kept == pictures.report(sized), "write it again: python -m tests.extensions.view.pictures"
    assert any("repeats forever" in words for words in kept)


def test_every_picture_has_words_and_is_shown_and_small() -> None:
    shown = re.findall(r"!\[[^\]]+\]\(pictures/([^)]+)\)", Path("docs/viewing.md").read_text(encoding="utf-8"))
    assert set(shown) == set(pictures.PICTURES) == {path.name for path in pictures.FOLDER.glob("*.png")}
    for name in shown:
        picture = (pictures.FOLDER / name).read_bytes()
        assert pictures.words_of(picture)
        assert len(picture) < 200_000


def test_words_are_put_beside_pixels_and_read_again() -> None:
    picture = (pictures.FOLDER / "live.png").read_bytes()
    other = pictures.with_words(picture, ["ein", "Wörtchen ✗"])
    assert pictures.words_of(other) == ["ein", "Wörtchen ✗"]
    assert pictures.words_of(pictures.with_words(other, ["x"])) == ["x"]
