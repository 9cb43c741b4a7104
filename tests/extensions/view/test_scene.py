"""The colours of values, and how signals are drawn."""

from __future__ import annotations

import random
import string
from colorsys import rgb_to_hls

import pytest

from llfsm_verify.extensions.view.scene import INK, PALETTE, colours_of, contrast


def hue(colour: str) -> float:
    red, green, blue = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return rgb_to_hls(red, green, blue)[0] * 360


def of(*names: str) -> dict[str, dict[str, str]]:
    return colours_of(names)


@pytest.mark.parametrize(
    ("names", "low", "high"),
    [
        (("RED", "red", "Red", "RED_LIGHT", "lightRed", "rot", "rouge", "NORTH_RED", "red2"), 0, 15),
        (("GREEN", "Green", "green_arrow", "grün", "GRÜN", "vert", "verde", "GoGreen"), 110, 160),
        (("AMBER", "amber", "AMBER_FLASH"), 35, 48),
        (("ORANGE", "orange"), 20, 34),
        (("BLUE", "blau"), 205, 225),
    ],
)
def test_names_of_colours_mean_themselves(names: tuple[str, ...], low: float, high: float) -> None:
    for name, colour in of(*names).items():
        for shade in colour.values():
            assert low <= hue(shade) <= high, (name, shade)


@pytest.mark.parametrize("name", ["REDUCED", "rotate", "vertical", "SCORED", "Evergreens", "IDLE", "", "<script>"])
def test_other_names_are_not_taken_for_colours(name: str) -> None:
    for shade in of(name)[name].values():
        assert not (hue(shade) < 20 or 110 <= hue(shade) <= 150), shade


def test_a_name_has_one_colour_whatever_stands_beside_it() -> None:
    assert of("IDLE", "RED")["IDLE"] == of("IDLE")["IDLE"]
    assert colours_of(["a", "b", "b", "c"]) == colours_of(["c", "b", "a"])


def test_few_names_have_different_colours() -> None:
    names = [f"s{i}" for i in range(len(PALETTE))]
    found = [colour["light"] for colour in of(*names).values()]
    assert len(set(found)) == len(names)


def test_all_can_be_read() -> None:
    """By WCAG, of names at random and of all colours that have a name."""
    chance = random.Random(3)
    names = ["".join(chance.choices(string.ascii_letters, k=5)) for _ in range(200)]
    names += ["black", "white", "grey", "silver", "red", "yellow", "navy", "brown", "pink", "lime", "violet"]
    for name, colour in of(*names).items():
        for theme, shade in colour.items():
            assert contrast(shade, INK[theme]) >= 4.5, (name, theme, shade)
    assert contrast("#000000", "#ffffff") == pytest.approx(21)
