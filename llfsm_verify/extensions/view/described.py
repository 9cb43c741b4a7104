"""What a page shows of a run besides its rows: the arrangement that runs, if it is known and the right one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from llfsm_verify import Diagnostic, DiagnosticError, Whiteboard, load
from llfsm_verify.extensions.view.codes import OTHER
from llfsm_verify.extensions.view.colours import colours_of
from llfsm_verify.extensions.view.frames import Drawn
from llfsm_verify.extensions.view.sources import Files, arrangement_svg, machines_of
from llfsm_verify.extensions.view.values import signal_of
from llfsm_verify.plug import Arrangement

UNKNOWN = "this run does not say which arrangement it is of, so machines are not drawn: name it with --arrangement"


@dataclass(frozen=True, slots=True)
class Described:
    """A document without runs, and how frames fit it."""

    document: dict[str, Any]
    drawn: tuple[Drawn, ...]
    """Its machines."""
    turns: tuple[int, ...]
    """As `FrameReader` has them."""
    cycle_ms: Fraction | None


def describe(board: Whiteboard, path: str | None, *, strict: bool) -> Described:
    """The document of a run. `path`: the file of its arrangement, if the run itself is not asked for it.

    DiagnosticError: the file cannot be read, or has another arrangement (E552). If not `strict`, a note of the document
    says so, and only what the whiteboard has is shown.
    """
    named = path or board.told.get("arrangement")
    arrangement, notes = None, []
    try:
        if isinstance(named, str):
            arrangement = _checked(board, named)
        else:
            notes.append(UNKNOWN)
    except DiagnosticError as error:
        if strict and path is not None:
            raise
        notes.append(f"machines are not drawn: {error.diagnostics[0].message}")
    replaced = _replaced(board)
    notes += [f"`{name}` was replaced since the run began, so it is not drawn" for name in replaced]
    signals = [signal_of(slot) for slot in board.slots]
    numbers = {slot.name: number for number, slot in enumerate(board.slots) if slot.kind == "state"}
    cycle_ms, files, processes = _cycle(board), Files(), []
    machines = [_plain(name, board.machines[name]) | {"signal": numbers[name]} for name in numbers]
    if arrangement is not None:
        processes = [{"name": of.name, "machines": list(of.schedule)} for of in arrangement.processes]
        plain = {machine["name"]: machine for machine in machines if machine["name"] in replaced}
        machines = [plain.get(machine["name"], machine) for machine in machines_of(arrangement, files, numbers)]
    places = {machine["name"]: place for place, machine in enumerate(machines)}
    document = {
        "format": "llfsm-view", "version": 1, "source": "live", "title": board.name, "notes": notes,
        "arrangement": {
            "name": board.name if arrangement is None else arrangement.name,
            "path": None if arrangement is None else arrangement.path,
            "cycle_ms": None if cycle_ms is None else float(cycle_ms), "processes": processes,
            "svg": None if arrangement is None else arrangement_svg(arrangement),
        },
        "files": files.entries, "machines": machines, "signals": signals,
        "colours": colours_of(dict.fromkeys(label for slot in board.slots for label in slot.labels)),
    }  # fmt: skip
    fired = board.told.get("fired")
    words = {name: word for name, word in (fired if isinstance(fired, dict) else {}).items() if isinstance(word, int)}
    drawn = tuple(
        Drawn(place, machine["signal"], _leaving(machine), words.get(machine["name"]))
        for place, machine in enumerate(machines)
        if machine["signal"] is not None
    )
    alone = [of["machines"][0] if len(of["machines"]) == 1 else None for of in processes]
    return Described(document, drawn, tuple(places.get(name, -1) for name in alone), cycle_ms)


def _replaced(board: Whiteboard) -> list[str]:
    told = board.told.get("replaced")
    return [str(name) for name in told] if isinstance(told, list) else []


def _cycle(board: Whiteboard) -> Fraction | None:
    """Logical milliseconds of a cycle, if the run says so."""
    with suppress(ValueError, ZeroDivisionError):
        return Fraction(str(board.told.get("cycle_ms")))
    return None


def _leaving(machine: Mapping[str, Any]) -> dict[str, list[tuple[int, str]]]:
    names = [state["name"] for state in machine["states"]]
    found: dict[str, list[tuple[int, str]]] = {}
    for number, transition in enumerate(machine["transitions"]):
        found.setdefault(names[transition["source"]], []).append((number, names[transition["target"]]))
    return found


def _plain(name: str, states: Sequence[str]) -> dict[str, Any]:
    """A machine of which only the states are known."""
    listed = [{"name": state, "node": None, "place": None} for state in states]
    return {"name": name, "kind": "machine", "signal": None, "states": listed, "transitions": [], "svg": None}


def _checked(board: Whiteboard, path: str) -> Arrangement:
    """The arrangement in a file. DiagnosticError: it cannot be read, or the run is of another one (E552)."""
    arrangement = load(path).wrapped
    why = _differs(board, arrangement)
    if why is not None:
        message = f"`{board.name}` runs another arrangement than {path}: {why}"
        raise DiagnosticError(Diagnostic(OTHER, message, hint="name the file that it was started with"))
    return arrangement


def _differs(board: Whiteboard, arrangement: Arrangement) -> str | None:
    """Why the run is of another arrangement; None: it is of this one, as far as its server says."""
    replaced = _replaced(board)
    for machine in arrangement.machines:
        states = board.machines.get(machine.name)
        if states is None:
            return f"it has no machine `{machine.name}`"
        missing = next((state.name for state in machine.states if state.name not in states), None)
        if missing is not None and machine.name not in replaced:
            return f"its `{machine.name}` has no state `{missing}`"
    digest = board.told.get("digest")
    if digest is not None and digest != arrangement.digest:
        return "its text is another one, or was changed since"
    return None
