"""The index of decisions lists every page, with its title, date and status."""

from __future__ import annotations

import re
from datetime import date
from pathlib import Path

import pytest

FOLDER = Path("docs/decisions")
PAGES = sorted(FOLDER.glob("[0-9]*.md"))
ROW = re.compile(r"\| (\d+) \| \[(.+)\]\(([\w-]+\.md)\) \| (\d{4}-\d\d-\d\d) \| (.+) \|")
PAGE = r"\[(\d+)\]\(([\w-]+\.md)\)"
STATUS = re.compile(rf"accepted(; extended by {PAGE}(, {PAGE})*( and {PAGE})?)?|superseded by {PAGE}")


def rows() -> list[tuple[str, str, str, str, str]]:
    lines = (FOLDER / "README.md").read_text(encoding="utf-8").splitlines()
    return [found.groups() for line in lines if (found := ROW.fullmatch(line))]


def test_every_page_is_listed_with_its_title_and_in_order():
    listed = [(name, f"# {number}. {title}") for number, title, name, _, _ in rows()]
    assert listed == [(page.name, page.read_text(encoding="utf-8").split("\n", 1)[0]) for page in PAGES]


def test_numbers_have_no_gap():
    assert [page.name[:4] for page in PAGES] == [f"{n:04}" for n in range(1, len(PAGES) + 1)]
    assert [int(number) for number, *_ in rows()] == [*range(1, len(PAGES) + 1)]


@pytest.mark.parametrize("row", rows(), ids=lambda row: row[0])
def test_dates_are_dates_and_a_status_leads_to_later_pages(row):
    number, _, _, day, status = row
    assert date.fromisoformat(day) >= date(2026, 11, 21)
    assert STATUS.fullmatch(status)
    for other, name in re.findall(PAGE, status):
        assert int(other) > int(number) and name.startswith(f"{int(other):04}-") and (FOLDER / name).exists()
