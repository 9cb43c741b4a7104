"""What values look like, for the page and for pictures alike: the colour of each name.

A name that is or has the name of a colour is drawn in it: `RED`, `red_light`, `Grün`. Each other name has a place in a
palette that its letters choose, so that it is the same in all pictures of an arrangement.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from colorsys import hls_to_rgb
from zlib import crc32

INK = {"light": "#1c2733", "dark": "#e4eaf0"}
"""What is written on a fill."""
ENGLISH = {
    "red": 4, "crimson": 350, "scarlet": 8, "orange": 28, "amber": 42, "yellow": 54, "gold": 48, "lime": 85,
    "green": 135, "teal": 175, "turquoise": 175, "cyan": 188, "blue": 215, "navy": 225, "indigo": 250, "violet": 270,
    "purple": 280, "magenta": 305, "pink": 335, "brown": 24,
}  # fmt: skip
"""Colours as degrees of hue."""
OTHERS = {
    "rot": "red", "rouge": "red", "rojo": "red", "rosso": "red", "gelb": "yellow", "jaune": "yellow",
    "amarillo": "yellow", "giallo": "yellow", "grün": "green", "gruen": "green", "vert": "green", "verde": "green",
    "blau": "blue", "bleu": "blue", "azul": "blue", "blu": "blue", "braun": "brown", "lila": "purple",
}  # fmt: skip
"""The same in other languages; only as a whole name, since some are parts of other words."""
GREYS = {
    "white": (0.97, 0.42),
    "grey": (0.80, 0.34),
    "gray": (0.80, 0.34),
    "silver": (0.85, 0.38),
    "black": (0.68, 0.16),
}
"""Lightness on light and on dark pages."""
WORD = re.compile(r"[A-ZÀ-Þ]+(?![a-zà-ÿ])|[A-ZÀ-Þ]?[a-zà-ÿ]+")
PALETTE = tuple((hue, level) for level in (0, 1) for hue in (205, 265, 185, 320, 230, 75, 295, 160, 245, 345, 60, 215))
"""Hue, and whether it is a shade deeper. Red, amber and green are left to what is called so."""


def colours_of(names: Iterable[str]) -> dict[str, dict[str, str]]:
    """The document's `colours`, of states and enumerators. Names whose letters choose one place of the palette have it
    in the order of the alphabet, the later ones the next free place."""
    taken: set[int] = set()
    found = {}
    for name in sorted(set(names)):
        named = _named(name)
        if named is None:
            start = crc32(name.encode("utf-8", "surrogatepass"))
            places = [(start + i) % len(PALETTE) for i in range(len(PALETTE))]
            place = next((p for p in places if p not in taken), places[0])
            taken.add(place)
            hue, deeper = PALETTE[place]
            named = {
                "light": _hex(hue, 0.76 if deeper else 0.87, 0.6),
                "dark": _hex(hue, 0.24 if deeper else 0.32, 0.45),
            }
        found[name] = named
    return found


def _named(name: str) -> dict[str, str] | None:
    """The colour that a name has or means; None: it names none."""
    words = [word.lower() for word in WORD.findall(name)]
    if len(words) == 1:
        words = [OTHERS.get(words[0], words[0])]
    for word in words:
        if word in GREYS:
            light, dark = GREYS[word]
            return {"light": _hex(0, light, 0), "dark": _hex(0, dark, 0)}
        if word in ENGLISH:
            hue = ENGLISH[word]
            if word == "brown":
                return {"light": _hex(hue, 0.70, 0.35), "dark": _hex(hue, 0.22, 0.5)}
            return {"light": _hex(hue, 0.76, 0.8), "dark": _hex(hue, 0.27, 0.65)}
    return None


def _hex(hue: float, lightness: float, saturation: float) -> str:
    """A fill on which ink can be read: what is too near to the ink in brightness is moved away from it."""
    ink = INK["light" if lightness > 0.5 else "dark"]
    step = 0.01 if lightness > 0.5 else -0.01
    while True:
        red, green, blue = (round(255 * part) for part in hls_to_rgb(hue / 360, lightness, saturation))
        made = f"#{red:02x}{green:02x}{blue:02x}"
        if contrast(made, ink) >= 4.6:
            return made
        lightness += step


def contrast(one: str, other: str) -> float:
    """How much two colours ``#rrggbb`` differ in brightness, from 1 to 21, as WCAG 2 counts it."""
    low, high = sorted(map(_luminance, (one, other)))
    return (high + 0.05) / (low + 0.05)


def _luminance(colour: str) -> float:
    parts = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
    red, green, blue = (p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue
