"""Commands that make the program say what is wrong with a log of others."""

from __future__ import annotations

from tests.outputs.provoking import LAMP, Provoked


def _logged(columns: str, asked: str = "m@ON") -> Provoked:
    """A log of others, with a mapping of these columns beside that of the machine."""
    command = f"llfsm check-recording log.csv --arrangement a.yaml --mapping mapping.yaml -p 'F {asked}'"
    mapping = f"time: t\ncolumns:\n  m: {{column: lamp, values: {{0: OFF, 1: ON}}}}\n{columns}"
    return Provoked((command,), {**LAMP, "log.csv": "t,button,lamp\n0,1,0\n0.1,0,1\n", "mapping.yaml": mapping})


PROVOKED = {
    "E496": _logged("  stop: {column: button}\n"),
    "E497": _logged("  go: {column: button, values: {yes: true, no: false}}\n"),
    "E498": _logged("", "m.ran"),
}
