"""View documents for tests: two lights and a number, and documents made at random."""

from __future__ import annotations

import random
from typing import Any

COLOURS = {
    "RED": {"light": "#f3b3ad", "dark": "#8c2f28"},
    "GREEN": {"light": "#b5e0bd", "dark": "#1f6b37"},
    "AMBER": {"light": "#f6d48f", "dark": "#7d5a10"},
}
NODE = '<g id="n{i}" class="node"><title>s</title><path fill="white" stroke="black" d="M5,{y}h90v30h-90z"/>'
NODE += '<text text-anchor="middle" x="50" y="{t}" font-size="11">{name}</text></g>'
EDGE = '<g id="e{i}" class="edge"><path fill="none" stroke="black" d="M50,{y}v30"/>'
EDGE += '<polygon fill="black" stroke="black" points="47,{t} 53,{t} 50,{u}"/></g>'


def svg(names: tuple[str, ...]) -> str:
    """A drawing as Graphviz writes one: states below each other, edges from each to the next."""
    nodes = "".join(NODE.format(i=i, y=60 * i + 5, t=60 * i + 24, name=name) for i, name in enumerate(names))
    edges = "".join(EDGE.format(i=i, y=60 * i + 35, t=60 * i + 58, u=60 * i + 65) for i in range(len(names)))
    return f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 {60 * len(names)}">{nodes}{edges}</svg>'


def machine(name: str, signal: int, states: tuple[str, ...], drawn: bool = True) -> dict[str, Any]:
    ids = [(f"n{i}", f"e{i}") if drawn else (None, None) for i in range(len(states))]
    return {
        "name": name,
        "kind": "Light",
        "inside": None,
        "signal": signal,
        "states": [
            {"name": state, "node": ids[i][0], "place": [0, i + 1, 1, i + 1, 4]} for i, state in enumerate(states)
        ],
        "transitions": [
            {"source": i, "target": (i + 1) % len(states), "when": "turn", "edge": ids[i][1], "place": None}
            for i in range(len(states))
        ],
        "svg": svg(states) if drawn else None,
    }


def sample(steps: int = 12, seed: int = 1, loop: int | None = 4, states: tuple[str, ...] = tuple(COLOURS)) -> Any:
    """Two lights that turn at random, an input and a number; the last step violates, unless there are no steps."""
    chance = random.Random(seed)
    signals = [
        {"name": "north", "kind": "state", "group": "states", "draw": "boxes", "labels": list(states)},
        {"name": "west", "kind": "state", "group": "states", "draw": "boxes", "labels": list(states)},
        {"name": "car", "kind": "input", "group": "inputs", "draw": "levels"},
        {"name": "wait", "kind": "machine", "group": "north", "draw": "curve", "low": 0, "high": 40, "unit": "s"},
    ]
    now: list[Any] = [states[0], states[0], False, 0]
    changes: list[dict[str, list[Any]]] = [{"at": [0], "values": [value]} for value in now]
    fired = []
    for row in range(1, steps + 1):
        turn = row % 2
        values = [*now[:2], chance.random() < 0.3, min(40, max(0, now[3] + chance.randint(-3, 4)))]
        if chance.random() < 0.5:
            source = states.index(now[turn])
            values[turn] = states[(source + 1) % len(states)]
            fired.append([row, turn, source])
        for signal, value in enumerate(values):
            if value != now[signal]:
                changes[signal]["at"].append(row)
                changes[signal]["values"].append(value)
        now = values
    rows = range(steps + 1)
    marks = [
        {"row": steps // 2, "kind": "cause", "text": "car is true", "signals": [2], "place": None},
        {"row": steps // 3, "kind": "event", "text": "car came"},
        {
            "row": steps,
            "kind": "violation",
            "text": "safe: both are green",
            "signals": [0, 1],
            "place": [1, 1, 1, 1, 5],
        },
    ]
    run = {
        "name": "safe",
        "kind": "violation",
        "title": "safe is violated: both lights are green in the last step",
        "property": "safe",
        "loop": loop,
        "ending": None,
        "window": None,
        "rows": {
            "step": list(rows),
            "cycle": [(row + 1) // 2 for row in rows],
            "time_ms": [100.0 * ((row + 1) // 2) for row in rows],
            "turn": [-1] + [row % 2 for row in rows[1:]],
        },
        "changes": changes,
        "fired": fired,
        "ran": {
            "sets": [[], [[0, 2, 1, 2, 6]], [[0, 3, 2, 4, 3]]],
            "rows": [0] + [1 + row % 2 for row in rows[1:]],
        },
        "marks": marks if steps else [],
    }
    return {
        "format": "llfsm-view",
        "version": 1,
        "source": "check",
        "title": "Two lights",
        "notes": [],
        "arrangement": {
            "name": "lights",
            "path": "lights.yaml",
            "cycle_ms": 100,
            "processes": [{"name": "lights", "machines": ["north", "west"]}],
            "svg": None,
        },
        "files": [
            {"name": "lights.yaml", "text": "".join(f"line {i} of the machine\n" for i in range(1, 8))},
            {"name": "props.ltl", "text": "safe: G !(both)\n"},
        ],
        "machines": [machine("north", 0, states), machine("west", 1, states, drawn=False)],
        "signals": signals,
        "colours": COLOURS,
        "verdicts": [
            {
                "name": "safe",
                "verdict": "violated",
                "words": "violated",
                "text": "G !(north == GREEN && west == GREEN)",
                "reason": "both are green at the end",
                "engine": "explicit",
                "place": [1, 1, 1, 1, 5],
                "runs": [0],
            },
            {"name": "live", "verdict": "holds", "words": "holds", "text": "G F north == GREEN", "runs": []},
            {"name": "late", "verdict": "unknown", "words": "unknown", "text": "F wait > 30", "reason": "out of time"},
        ],
        "statistics": [{"title": "Exploration", "lines": [["configurations", "1,234"], ["time", "0.2 s"]]}],
        "coverage": {
            "counts": {"state": {"covered": 5, "reachable": 1}, "transition": {"covered": 3, "unreachable": 2}},
            "goals": [
                {"kind": "state", "status": "covered", "name": "north@RED", "span": [0, 2, 1, 2, 4]},
                {"kind": "transition", "status": "unreachable", "name": "west: RED to GREEN"},
            ],
        },
        "runs": [run],
    }
