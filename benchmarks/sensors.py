"""An arrangement with any number of sensors of 16 bits: one machine each, which tells in which of four ranges it is."""

from __future__ import annotations


def sensors(n: int) -> str:
    """`n` machines, each with a sensor and three thresholds of its own; a last one stops when two are at their end."""
    names = range(n)
    board = [f"  d{i}: {{type: uint16, init: 0, role: input}}\n  z{i}: {{type: 0..3, init: 0}}" for i in names]
    reader = """\
  m{i}:
    inline:
      machine: M{i}
      states:
        - name: READ
          transitions:
            - {{when: d{i} < {a}, to: LOW}}
            - {{when: d{i} > {c}, to: HIGH}}
            - {{when: d{i} == {b}, to: EXACT}}
            - {{when: true, to: MIDDLE}}
        - {{name: LOW, on_entry: z{i} = 0;, transitions: [{{when: true, to: READ}}]}}
        - {{name: MIDDLE, on_entry: z{i} = 1;, transitions: [{{when: true, to: READ}}]}}
        - {{name: EXACT, on_entry: z{i} = 2;, transitions: [{{when: true, to: READ}}]}}
        - {{name: HIGH, on_entry: z{i} = 3;, transitions: [{{when: true, to: READ}}]}}"""
    machines = [reader.format(i=i, a=100 + 7 * i, b=1_000 + 11 * i, c=40_000 + 13 * i) for i in names]
    schedule = ", ".join(f"m{i}" for i in names)
    return "\n".join(
        [f"name: sensors_{n}", "whiteboard:", *board, "machines:", *machines, f"schedule: [{schedule}]", ""]
    )


def properties(n: int) -> str:
    """That what is told has been read: of the first and of the last sensor, and of both at once (which is violated)."""
    last = n - 1
    return (
        f"low: G (m0@READ && X (m0.ran && d0 < 100) -> X m0@LOW)\n"
        f"high: G (m{last}@HIGH -> X !(m{last}@MIDDLE))\n"
        f"never_all: G !(z0 == 3 && z{last} == 2)\n"
    )
