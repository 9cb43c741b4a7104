"""The colours of values: named ones are themselves, and all can be read."""

from __future__ import annotations

import random
import string
from colorsys import rgb_to_hls

import pytest

from llfsm_verify.extensions.view.colours import ELSEWHERE, NAMED, OTHERS, colours_of

INK = {"light": "#1c2733", "dark": "#e4eaf0"}
"""Of the page's style."""


def parts(colour: str) -> tuple[float, ...]:
    return tuple(int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))


def hue(colour: str) -> float:
    red, green, blue = parts(colour)
    return rgb_to_hls(red, green, blue)[0] * 360


def contrast(one: str, other: str) -> float:
    """As WCAG 2 counts it."""
    linear = [[p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts(c)] for c in (one, other)]
    low, high = sorted(0.2126 * red + 0.7152 * green + 0.0722 * blue for red, green, blue in linear)
    return (high + 0.05) / (low + 0.05)


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
    for name, colour in colours_of(names).items():
        for shade in colour.values():
            assert low <= hue(shade) <= high, (name, shade)


@pytest.mark.parametrize(
    "name", ["REDUCED", "rotate", "rot_left", "SCORED", "Evergreens", "IDLE", "", "<script>", "\ud800"]
)
def test_other_names_are_not_taken_for_colours(name: str) -> None:
    assert tuple(colours_of([name])[name].values()) in OTHERS


def test_all_can_be_read() -> None:
    chance = random.Random(3)
    names = ["".join(chance.choices(string.ascii_letters, k=5)) for _ in range(200)]
    for name, colour in colours_of([*names, *NAMED, *ELSEWHERE]).items():
        for theme, shade in colour.items():
            assert contrast(shade, INK[theme]) >= 4.5, (name, theme, shade)
    assert contrast("#000000", "#ffffff") == pytest.approx(21)
