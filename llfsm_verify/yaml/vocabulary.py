"""What a kind of file is written with: the keys it has, and what people write in their place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

CODES: dict[str, str] = {
    "E010": "A file is not YAML.",
    "E011": "A file is empty.",
    "E012": "YAML values are nested too deeply.",
    "E013": "A file has too many YAML values, aliases counted.",
    "E014": "A file has a second YAML document.",
    "E015": "A YAML alias without an anchor before it.",
    "E016": "A YAML tag.",
    "E017": "A key appears twice.",
    "E018": "A key is not a word.",
    "E020": "YAML takes a guard or an action apart: it must be quoted.",
    "E030": "A mapping is expected.",
    "E031": "A list is expected.",
    "E032": "A single value is expected.",
    "E033": "An unknown key.",
    "E034": "A key is missing.",
    "E035": "A value that is not one of the words possible there.",
    "E036": "A name that is not a valid identifier.",
    "E097": "A file is of a later format than this version knows, or its `format` is not a valid number.",
}

HINTS: dict[str, str] = {
    "E010": "check quotes, brackets and indentation here and in the lines before",
    "E011": "write what it is to say, or remove it",
    "E012": "use fewer levels of nesting",
    "E013": "write fewer values, and fewer aliases of large ones",
    "E017": "remove one of them",
    "E030": "write `key: value`, one per line",
    "E032": "write one word, number or text",
}
"""What to write instead, where the place has nothing more exact to say."""


@dataclass(frozen=True, slots=True)
class Vocabulary:
    """Advice about wrong texts is given in these words."""

    keys: frozenset[str] = frozenset()
    """All keys of the file, wherever they stand."""
    guards: tuple[str, ...] = ()
    """Keys whose values are guards."""
    actions: tuple[str, ...] = ()
    """Keys whose values are actions."""
    named: tuple[str, ...] = ()
    """Keys below which users choose the keys."""
    called: Mapping[str, str] = field(default_factory=dict)
    """By key what others call it: words."""
    elsewhere: Mapping[str, str] = field(default_factory=dict)
    """What to say of keys that stand nowhere, or not where they were found."""
    spelt: Mapping[str, str] = field(default_factory=dict)
    """The same for words that are written in another way, where types or guards stand."""
    shapes: Mapping[str, str] = field(default_factory=dict)
    """How what is named is written, where that says more than that it has keys and values."""
    hints: Mapping[str, str] = field(default_factory=lambda: HINTS)
    """By code what to write, where the place has nothing more exact to say."""

    @property
    def texts(self) -> tuple[str, ...]:
        """Keys whose values are guards and actions."""
        return (*self.guards, *self.actions)


PLAIN = Vocabulary()
"""Of a file that has no texts of our language, and whose keys nothing more is known about."""
