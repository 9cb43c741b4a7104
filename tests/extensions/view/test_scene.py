"""The colours of values, and how signals are drawn."""

from __future__ import annotations

import random
import string
from colorsys import rgb_to_hls

import pytest

from llfsm_verify.extensions.view.scene import INK, PALETTE, colours_of, contrast, signal_entry


def hue(colour: str) -> float:
    red, green, blue = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return rgb_to_hls(red, green, blue)[0] * 360


def of(*names: str) -> dict[str, dict[str, str]]:
    return colours_of([{"labels": names}])


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
    signals = [{"labels": ["a", "b"]}, {"name": "number"}, {"labels": ["b", "c"]}]
    assert colours_of(signals) == colours_of(reversed(signals))


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


def test_signals() -> None:
    def drawn(kind: str, *labels: str, boolean: bool = False, low: int = 0, high: int = 9, digits: int = 0) -> object:
        return signal_entry("m.x", kind, labels, boolean=boolean, low=low, high=high, digits=digits)

    assert drawn("machine", "A", "B", "A") == {
        "name": "m.x", "kind": "machine", "group": "m", "draw": "boxes", "labels": ["A", "B"],
    }  # fmt: skip
    assert drawn("input", boolean=True) == {"name": "m.x", "kind": "input", "group": "inputs", "draw": "levels"}
    number = {"name": "m.x", "kind": "whiteboard", "group": "whiteboard", "draw": "curve"}
    assert drawn("whiteboard", low=-5, high=1 << 53) == number | {"low": -5, "high": str(1 << 53)}
    assert drawn("whiteboard", low=-5, high=25, digits=1) == number | {"low": "-0.5", "high": "2.5"}
