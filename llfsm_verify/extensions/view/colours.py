"""The colour of a value, the same wherever it is drawn: names of colours mean themselves, others get one by their name.

Texts on them are dark on light pages and light on dark ones; each has a contrast of 4.5 or more to them (WCAG 2.2).
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from zlib import crc32

NAMED = {
    "red": ("#f4aaa5", "#8f2a24"),
    "green": ("#a9dcb3", "#1d6134"),
    "blue": ("#aecbf2", "#244f8f"),
    "yellow": ("#f4e28a", "#6b5a08"),
    "amber": ("#f7cf7f", "#7a5205"),
    "orange": ("#f8c193", "#86420f"),
    "purple": ("#d5baf0", "#5a3590"),
    "violet": ("#d5baf0", "#5a3590"),
    "pink": ("#f5bfd6", "#8a2f5a"),
    "magenta": ("#f0b4ea", "#84297c"),
    "cyan": ("#a5e0e6", "#14606a"),
    "brown": ("#dcc1a6", "#664321"),
    "white": ("#ffffff", "#5c6670"),
    "black": ("#b3b8bd", "#000000"),
    "grey": ("#d0d5da", "#48505a"),
    "gray": ("#d0d5da", "#48505a"),
}
"""What is filled on light and on dark pages."""
ELSEWHERE = {
    "rot": "red", "rouge": "red", "rojo": "red", "rosso": "red", "gelb": "yellow", "jaune": "yellow",
    "amarillo": "yellow", "giallo": "yellow", "grün": "green", "gruen": "green", "vert": "green", "verde": "green",
    "blau": "blue", "bleu": "blue", "azul": "blue", "blu": "blue", "braun": "brown", "lila": "purple",
}  # fmt: skip
"""The same in other languages; only as a whole name, since some are parts of other words."""
OTHERS = (
    ("#cfe0f5", "#2b4a73"), ("#e3d4f2", "#513a72"), ("#cfe9e4", "#1f5a52"), ("#ece3c4", "#5c4e1e"),
    ("#f3d9e4", "#6f3350"), ("#dde5cc", "#465626"), ("#d8dcf3", "#3a4179"), ("#f0dccf", "#6b4430"),
    ("#cfe6ee", "#235767"), ("#e6dfe6", "#584b58"),
)  # fmt: skip
WORDS = re.compile(r"[A-ZÀ-Þ]+(?![a-zà-ÿ])|[A-ZÀ-Þ]?[a-zà-ÿ]+")


def colours_of(names: Iterable[str]) -> dict[str, dict[str, str]]:
    """The document's `colours` of these states and enumerators."""
    return {name: dict(zip(("light", "dark"), colour_of(name), strict=True)) for name in names}


def colour_of(name: str) -> tuple[str, str]:
    """On light and on dark pages: of the one colour that is a word of the name (`RED`, `redLight`, `ns_green`), or else
    one that only the name decides."""
    words = {ELSEWHERE.get(name.lower(), word.lower()) for word in WORDS.findall(name)} & NAMED.keys()
    if len(words) == 1:
        return NAMED[words.pop()]
    return OTHERS[crc32(name.encode("utf-8", "surrogatepass")) % len(OTHERS)]
