"""The glossary: words in order, links to headings that are there, and old names that are gone."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.project.test_documents import anchors

PAGE = Path("docs/glossary.md")
WORDS, OLD = (
    [line.strip("| ").split(" | ") for line in part.splitlines() if line.startswith("| ")][1:]
    for part in (
        PAGE.read_text(encoding="utf-8"),
        Path("CONTRIBUTING.md").read_text(encoding="utf-8").split("\n## Old names\n")[1],
    )
)
LINK = re.compile(r"\[[^]]+\]\(([\w/-]+\.md)(?:#([\w-]+))?\)")


def test_words_are_in_order_and_each_stands_once():
    words = [word.lower() for word, *_ in WORDS]
    assert len(words) > 50 and words == sorted(set(words))


@pytest.mark.parametrize("row", WORDS, ids=lambda row: row[0])
def test_a_word_has_a_meaning_and_a_place_that_says_more(row):
    _, meaning, more = row
    assert meaning.endswith(".")
    link = LINK.fullmatch(more)
    assert link
    text = (PAGE.parent / link[1]).read_text(encoding="utf-8")
    assert link[2] is None or link[2] in anchors(text)


@pytest.mark.parametrize("row", OLD, ids=lambda row: row[0])
def test_what_was_renamed_is_where_the_page_says(row):
    _, _, old, now = row
    package = Path("llfsm_verify")
    assert not (package / old.strip("`")).exists() and (package / now.strip("`")).exists()
