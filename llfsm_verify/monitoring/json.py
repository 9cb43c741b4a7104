"""The table of a monitor as JSON; `schema/monitor.schema.json` defines it."""

from __future__ import annotations

import json
from dataclasses import dataclass

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.boolean import Guards
from llfsm_verify.monitoring.properties import Monitored, shown
from llfsm_verify.monitoring.states import Monitor, MonitorVerdict

VERSION = 1


def table_json(found: Monitored) -> str:
    """The table of the monitor with what it is about. AutomatonTooLarge: as for `monitor_table`."""
    table = monitor_table(found.monitor)
    head: dict[str, object] = {
        "format": "llfsm-verify monitor table",
        "version": VERSION,
        "property": {"name": found.line.name, "kind": found.line.kind, "text": found.line.text},
        "monitorable": found.monitor.monitorability.value,
        "atoms": [shown(key) for key in table.atoms],
    }
    lines = [f"  {json.dumps(key)}: {json.dumps(value, ensure_ascii=False)}" for key, value in head.items()]
    lines.append(_block("classes", [[_cube(p, n) for p, n in cubes] for cubes in table.classes]))
    lines.append(_block("states", [_state(table, q) for q in range(len(table.rows))]))
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _block(key: str, items: list[object] | list[list[dict[str, list[int]]]]) -> str:
    """A list with an item a line."""
    inside = ",\n".join(f"    {json.dumps(item)}" for item in items)
    return f"  {json.dumps(key)}: [\n{inside}\n  ]"


def _cube(positive: int, negative: int) -> dict[str, list[int]]:
    return {"true": _bits(positive), "false": _bits(negative)}


def _state(table: MonitorTable, q: int) -> object:
    return {"verdict": table.verdicts[q].value, "hopeless": table.hopeless[q], "next": list(table.rows[q])}


def _bits(mask: int) -> list[int]:
    return [i for i in range(mask.bit_length()) if mask >> i & 1]


# ---- Monitors as tables: a row for each state, a column for each class of letters that no state tells apart


MAX_CELLS = 2_000_000

Cube = tuple[int, int]


@dataclass(frozen=True, slots=True)
class MonitorTable:
    """`rows[q][c]` is the state after state q and a letter of class c; state 0 is initial.

    A letter is in class c when it is in one of `classes[c]`: the mask of atoms that hold, and of those that do not (bit
    i: `atoms[i]`). Each letter is in just one class. `hopeless[q]`: no verdict can be reached any more.
    """

    atoms: tuple[str, ...]
    classes: tuple[tuple[Cube, ...], ...]
    rows: tuple[tuple[int, ...], ...]
    verdicts: tuple[MonitorVerdict, ...]
    hopeless: tuple[bool, ...]


def monitor_table(monitor: Monitor) -> MonitorTable:
    """The table of `monitor` over those of its atoms that matter; no two columns are the same.

    AutomatonTooLarge: more than `boolean.MAX_CLASSES` classes of letters, or `MAX_CELLS` cells.
    """
    used = [i for i in range(len(monitor.atoms)) if monitor.used >> i & 1]
    guards = Guards([monitor.atoms[i] for i in used])

    def narrow(mask: int) -> int:
        return sum(1 << i for i, place in enumerate(used) if mask >> place & 1)

    labels = []
    for row in monitor.edges:
        by_target = dict.fromkeys((e.target for e in row), guards.never)
        for e in row:
            by_target[e.target] = by_target[e.target] | guards.cube(narrow(e.positive), narrow(e.negative))
        labels.append(by_target)
    classes = guards.partition(label for by_target in labels for label in by_target.values())
    if len(classes) * len(labels) > MAX_CELLS:
        raise AutomatonTooLarge("cells", MAX_CELLS)
    rows = tuple(
        tuple(next(t for t, label in by_target.items() if label in inside) for inside in classes.values())
        for by_target in labels
    )
    cubes = tuple(tuple(guards.cubes(part)) for part in classes)
    return MonitorTable(guards.atoms, cubes, rows, monitor.verdicts, monitor.hopeless)
