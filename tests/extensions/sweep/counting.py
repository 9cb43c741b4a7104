"""A small arrangement with a constant, parameters and variables at all levels, for sweeps."""

from __future__ import annotations

from pathlib import Path

MACHINE = """\
machine: M
parameters: {LIMIT: {constant: 1..9}, total: {whiteboard: 0..20}}
variables: {count: {type: 0..9}}
states:
  - name: COUNT
    variables: {turns: {type: 0..3, init: 1}}
    internal: |
      if (go && total < LIMIT) total += 1;
      if (total > count) count = LIMIT;
    transitions: [{when: total > 7, to: FULL}]
  - {name: FULL, stays: true, variables: {turns: {type: 0..3}}}
"""
ARRANGEMENT = """\
name: counting
cycle_ms: 100
types: {Colour: [RED, GREEN]}
whiteboard:
  go: {type: bool, role: input}
  n: {type: 0..20, init: 0}
  step: {type: {decimal: 0.1, range: 0.0..1.0}}
  light: {type: Colour}
  flags: {type: {array: bool, size: 2}}
machines:
  left: {file: m.machine.yaml, parameters: {LIMIT: 3, total: n}}
  right: {file: m.machine.yaml, parameters: {LIMIT: 5, total: n}}
schedule: [left, right]
"""
FAULTY = ARRANGEMENT.replace("right: {file: m.", "right: {file: faulty.")
PROPERTIES = "few: G n <= 5\nfilled: G !left@FULL\nreaches: F n > 0\n"


def written(folder: Path, sweep: str = "", **more: str) -> Path:
    """All of it in a folder, with a sweep; `more`: other texts by the beginnings of their names. The sweep's path."""
    texts = {
        "a.yaml": ARRANGEMENT,
        "m.machine.yaml": MACHINE,
        "b/faulty.yaml": FAULTY.replace("file: ", "file: ../"),
        "faulty.machine.yaml": MACHINE.replace("total < LIMIT", "total <= LIMIT"),
        "p.ltl": PROPERTIES,
        "q.ltl": "other: G n < 20\n",
        "SWEEP.yaml": sweep,
        **{name.replace("_", "."): text for name, text in more.items()},
    }
    for name, text in texts.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(text)
    return folder / "SWEEP.yaml"
