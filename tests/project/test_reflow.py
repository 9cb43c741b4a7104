"""`python -m tools.reflow` wraps prose, and nothing else."""

from __future__ import annotations

from pathlib import Path

import pytest

from tools.reflow import main, reflow

WORDS = "a sentence of some words " * 4


def test_a_paragraph_is_wrapped_with_all_its_words() -> None:
    text = f"short\n\n{WORDS}\nand its end.\n"
    found = reflow(text, 40)
    assert found.split() == text.split() and max(map(len, found.split("\n"))) <= 40
    assert found.startswith("short\n\na sentence") and found.endswith("end.\n")


def test_an_item_keeps_its_mark_and_its_indentation() -> None:
    lines = reflow(f"- {WORDS}\n- next\n1. {WORDS}\n   - {WORDS}", 60).split("\n")
    assert lines[0].startswith("- a") and lines[1].startswith("  s") and "- next" in lines
    assert [line for line in lines if line.startswith("1. ")] and [line for line in lines if line.startswith("   - ")]


@pytest.mark.parametrize(
    "text",
    [
        f"```console\n$ {WORDS}\n\n{WORDS}\n```",
        f"| {WORDS} |\n|---|\n| {WORDS} |",
        f"# {WORDS}",
        f"    {WORDS}",
        f"<!-- written by x -->\n\n{WORDS}\n\n<!-- end of x -->",
        f"`{WORDS}`\nis code",
        "short lines\nstay as they are",
        "x" * 100,
    ],
)
def test_what_is_not_prose_stays(text: str) -> None:
    assert reflow(text, 60) == text


def test_no_line_begins_like_an_item_or_a_heading() -> None:
    text = "one two three - four 5. six # seven | eight " * 3
    found = reflow(text, 16)
    assert found.split() == text.split()
    assert not [line for line in found.split("\n") if line[0] in "-#|5"]


def test_a_line_that_begins_with_emphasis_is_of_the_paragraph() -> None:
    assert reflow(f"{WORDS}\n*and* more", 300).endswith("*and* more")
    assert (
        reflow("word " * 20 + "\n*and* more", 60).split("\n")[-1]
        == "word word word word word word word word *and* more"
    )


def test_files_are_written(tmp_path: Path) -> None:
    path = tmp_path / "page.md"
    path.write_text("word " * 50)
    main([str(path)])
    assert len(path.read_text().split("\n")) > 1


@pytest.mark.parametrize("page", ["CHANGELOG.md", "README.md", "docs/architecture.md", "docs/running.md"])
def test_a_page_keeps_its_words_and_what_is_wrapped_stays_so(page: str) -> None:
    text = Path(page).read_text(encoding="utf-8")
    once = reflow(text)
    assert once.split() == text.split() and reflow(once) == once
