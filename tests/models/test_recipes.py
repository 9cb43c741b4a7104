"""The recipes of docs/modelling.md: each is there, and has the verdicts that the page speaks of."""

from __future__ import annotations

from pathlib import Path

import pytest

import llfsm_verify as lv

FOLDER = Path("models/recipes")
VIOLATED: dict[str, set[str]] = {
    "beam": set(),
    "deaf_beam": {"off"},
    "noisy": set(),
    "timeout": set(),
    "button": set(),
    "suspension": set(),
    "inside": set(),
    "subsumption": set(),
    "clearance": set(),
    "requests": set(),
    "hasty_requests": {"new_answer", "new_end"},
}


def lines_of(recipe: str) -> Path:
    return FOLDER / f"{recipe.removeprefix('deaf_').removeprefix('hasty_')}.ltl"


@pytest.mark.parametrize("recipe", VIOLATED)
def test_a_recipe_does_what_its_page_says(recipe: str) -> None:
    result = lv.load(FOLDER / f"{recipe}.yaml").check(lines_of(recipe), engine="explicit")
    found = {p.name: str(p.verdict) for p in result}
    assert {name for name, verdict in found.items() if verdict == "violated"} == VIOLATED[recipe]
    assert set(found.values()) <= {"holds", "violated"}


def test_every_recipe_is_tested_and_on_the_page() -> None:
    page = Path("docs/modelling.md").read_text(encoding="utf-8")
    assert {path.stem for path in FOLDER.glob("*.yaml")} == set(VIOLATED)
    for recipe in VIOLATED:
        assert f"models/recipes/{recipe}.yaml" in page, recipe
