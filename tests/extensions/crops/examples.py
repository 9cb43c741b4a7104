"""Programs and commands that say what is wrong with a state machine of CROPS."""

from __future__ import annotations

from tests.outputs.provoking import Provoked

FILE = """\
- state:
    state_label: Locate_fruits
    descriptive_name: Localizing fruits
    transitions: {No fruit: Locate_fruits, Found_fruit: Exit}
"""
PROGRAM = """\
from llfsm_verify import DiagnosticError
from llfsm_verify.extensions.crops import State, StateMachine

class LocateFruits(State):
    outcomes = ("No fruit", "Found_fruit")

sm = StateMachine(["Exit"])
sm.add_transition_file("transfile.yaml")
sm.add("Locate_fruits", LocateFruits())
try:
    sm.execute("Locate_fruits")
except DiagnosticError as error:
    print(error)
"""


def _program(old: str, new: str) -> Provoked:
    assert old in PROGRAM
    return Provoked(("python robot.py",), {"transfile.yaml": FILE, "robot.py": PROGRAM.replace(old, new)})


def _file(old: str, new: str) -> Provoked:
    assert old in FILE
    return Provoked(("llfsm verify transfile.yaml",), {"transfile.yaml": FILE.replace(old, new)})


PROVOKED = {
    "E544": _file("{No fruit: Locate_fruits, Found_fruit: Exit}", "{}"),
    "E545": _program('["Exit"]', '["End"]'),
    "E546": _program('("No fruit"', '("No_fruit_detected"'),
    "E547": _program('execute("Locate_fruits")', 'execute("Locate_fruit")'),
    "E548": _program('("No fruit", "Found_fruit")', '("No fruit",)'),
    "E549": _program('outcomes = ("No fruit", "Found_fruit")', "pass"),
    "W544": _file("No fruit: Locate_fruits", "No fruit: Locate_fruit"),
}
