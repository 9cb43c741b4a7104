"""The table of a monitor as JSON; `schema/monitor.schema.json` defines it."""

from __future__ import annotations

import json

from llfsm_verify.monitoring.properties import Monitored, shown
from llfsm_verify.monitoring.table import MonitorTable, monitor_table

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
