"""Decisions: an index by room, and pages of one form, short enough to be read."""

from __future__ import annotations

import re
from datetime import date
from pathlib import Path

import pytest

from tests.project.test_documents import CODE

FOLDER = Path("docs/decisions")
PAGES = sorted(FOLDER.glob("[0-9]*.md"))
ROW = re.compile(r"\| (\d+) \| \[(.+)\]\(([\w-]+\.md)\) \| (\d{4}-\d\d-\d\d) \|")
PARTS = ["Context", "Options", "Decision", "Accepted"]
MOST_WORDS = 300
"""Of a decision, without its tables and blocks."""


def groups() -> list[tuple[str, list[tuple[str, str, str, str]]]]:
    """The titles of the groups, and their rows."""
    parts = (FOLDER / "README.md").read_text(encoding="utf-8").split("\n## ")[1:]
    return [(part.split("\n", 1)[0], ROW.findall(part)) for part in parts]


ROWS = [row for _, rows in groups() for row in rows]


def test_every_page_is_listed_once_with_its_title():
    listed = {name: f"# {number}. {title}" for number, title, name, _ in ROWS}
    assert listed == {page.name: page.read_text(encoding="utf-8").split("\n", 1)[0] for page in PAGES}
    assert len(ROWS) == len(PAGES)


def test_numbers_have_no_gap():
    assert [page.name[:4] for page in PAGES] == [f"{n:04}" for n in range(1, len(PAGES) + 1)]
    assert sorted(int(number) for number, *_ in ROWS) == [*range(1, len(PAGES) + 1)]


@pytest.mark.parametrize(("title", "rows"), groups(), ids=lambda value: value if isinstance(value, str) else "")
def test_groups_name_rooms_and_are_in_order(title, rows):
    assert all(Path("llfsm_verify", room).exists() for room in re.findall(r"`([^`]+)`", title))
    assert rows == sorted(rows, key=lambda row: int(row[0])) != []
    assert all(date.fromisoformat(day) >= date(2026, 11, 21) for *_, day in rows)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name[:4])
def test_a_page_has_four_parts_and_is_short(page):
    text = CODE.sub("", page.read_text(encoding="utf-8"))
    assert re.findall(r"^##+ (.*)$", text, re.MULTILINE) == PARTS
    words = " ".join(line for line in text.splitlines() if not line.startswith("|")).split()
    assert len(words) <= MOST_WORDS
