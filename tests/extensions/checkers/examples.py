"""Commands that make the program say what a model for another checker cannot hold."""

from __future__ import annotations

from tests.outputs.provoking import LAMP, Provoked, does

PROVOKED = {
    "E420": Provoked(("llfsm kripke a.yaml --format smv",), does("n = n + 1;", "n: {type: int}")),
    "E421": Provoked(("llfsm kripke a.yaml --format promela",), does("n = n * n / 100000;", "n: {type: 0..100000}")),
    "E424": Provoked(("llfsm kripke a.yaml --format promela -p 'x: F (go && X[12] m@ON)'",), LAMP),
}
