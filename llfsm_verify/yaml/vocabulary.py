"""What a kind of file is written with: the keys it has, and what people write in their place."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from llfsm_verify.yaml.codes import HINTS


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
