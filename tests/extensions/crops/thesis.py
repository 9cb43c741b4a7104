"""The transition file of section 3.2.1 of the thesis, and the states of sections 3.2 and 3.3, as they are printed.

Print has lost the underscores. They are put back where the program of the thesis has them.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from pathlib import Path

from llfsm_verify.extensions.crops import Data, State, StateMachine

TRANSITION_FILE = """\
- state:
    state_label: Locate_fruits
    descriptive_name: Localizing fruits
    transitions:
      No fruit: Locate_fruits
      Found_fruit: Select_fruit

- state:
    state_label: Select_fruit
    descriptive_name: Selecting fruit to pick
    transitions:
      Fruit selected: Pick_fruit
      All fruits picked: Exit

- state:
    state_label: Pick_fruit
    descriptive_name: Moving arm to fruit
    transitions:
      Moving to fruit: Pick_fruit
      Goal: Fruit_to_basket

- state:
    state_label: Fruit_to_basket
    descriptive_name: Transporting fruit to basket
    transitions:
      Transport fruit: Fruit_to_basket
      Basket: Select_fruit
"""
OUTCOMES = {
    "Locate_fruits": ("Found_fruit", "No_fruit_detected"),
    "Pick_fruit": ("Goal", "Out of reach", "Moving to fruit"),
    "Fruit_to_basket": ("Transport fruit", "Basket"),
    "Select_fruit": ("Fruit selected", "All fruits picked"),
}
"""What the program gives to `add`, in that order, and what the states return."""
FIXED = {**OUTCOMES, "Locate_fruits": ("No fruit", "Found_fruit"), "Pick_fruit": ("Moving to fruit", "Goal")}


class Scripted(State):
    """Gives these outcomes, one after the other and then again."""

    def __init__(self, *outcomes: str) -> None:
        self.outcomes = tuple(dict.fromkeys(outcomes))
        self.left = itertools.cycle(outcomes)
        self.executed = 0

    def execute(self, data: Data) -> str:
        self.executed += 1
        return next(self.left)


def machine(
    folder: Path, states: Mapping[str, State], text: str = TRANSITION_FILE, ends: tuple[str, ...] = ("Exit",)
) -> StateMachine:
    """The machine of a transition file with these states."""
    path = folder / "transfile.yaml"
    path.write_text(text, encoding="utf-8")
    made = StateMachine(ends)
    made.add_transition_file(path)
    for label, state in states.items():
        made.add(label, state)
    return made
