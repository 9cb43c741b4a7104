"""Monitors in a few lines, as drawings, tables and machines."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.automata.boolean import Guards
from llfsm_verify.diagnostics import Fragment, counted
from llfsm_verify.logic.bounds import Clock
from llfsm_verify.logic.formula import to_text
from llfsm_verify.logic.parsing.bounds import decimal
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.monitoring.json import table_json
from llfsm_verify.monitoring.machine import Action, monitor_machine, sight
from llfsm_verify.monitoring.properties import Monitored, shown
from llfsm_verify.monitoring.states import Monitor, Monitorability, MonitorVerdict
from llfsm_verify.report.drawing.formats import DRAWINGS
from llfsm_verify.report.drawing.graph import Edge, Graph, Node, shorten, summarise

LABEL_WIDTH = 80

_WORDS = {
    Monitorability.ALWAYS: "monitorable: after every word a verdict can still come",
    Monitorability.SOMETIMES: "monitorable in part: there are words after which no verdict can come any more",
    Monitorability.NEVER: "not monitorable: no word gives a verdict",
}


Tell = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Monitors:
    """What was made of properties, and for what."""

    found: Sequence[Monitored]
    lines: PropertySet
    """With the assumptions."""
    arrangement: Arrangement | None
    clock: Clock | None
    action: Action
    """What a machine does on a violation."""


def report(monitors: Monitors, _: Tell) -> str:
    """All of them in words."""
    return "".join(summary(found) + "\n" for found in monitors.found)


def report_dot(monitors: Monitors, tell: Tell) -> str:
    """The drawing of the one that there is."""
    (found,) = monitors.found
    graph, note = summarise(monitor_graph(found))
    if note is not None:
        tell(note)
    return str(DRAWINGS.load("dot")(graph))


def report_table(monitors: Monitors, _: Tell) -> str:
    """The table of the one that there is. AutomatonTooLarge."""
    (found,) = monitors.found
    return table_json(found)


def report_machine(monitors: Monitors, tell: Tell) -> str:
    """The machine file of the one that there is; what the machine sees is said in it as well. DiagnosticError."""
    (found,) = monitors.found
    arrangement, action = monitors.arrangement, monitors.action
    places: Mapping[str, Fragment] = {**monitors.lines.atoms, **found.line.atoms}
    plain = monitor_machine(found, places, arrangement, action)
    notes = sight(plain.reads, arrangement)
    if monitors.clock is not None:
        period = decimal(monitors.clock.period)
        notes.append(f"Bounds in time count its turns: it has one a cycle, and a cycle takes {period} ms.")
    for note in notes:
        tell(f"note: {note}")
    return monitor_machine(found, places, arrangement, action, notes).text


def summary(found: Monitored) -> str:
    """Name, what the monitor is good for, its states and verdicts, one line each."""
    monitor, line = found.monitor, found.line
    kind = "" if line.kind == "ltl" else f"{line.kind} "
    lines = [f"{kind}{line.name}: {line.text}", f"  {_words(monitor)}"]
    if monitor.monitorability is not Monitorability.NEVER:
        count = len(monitor.verdicts)
        parts = [f"{n} {what}" for what, n in _counted(monitor) if n]
        lines.append(f"  {counted(count, 'state')}: {', '.join(parts)}")
    return "\n".join(lines)


def _words(monitor: Monitor) -> str:
    if monitor.verdicts[0] is not MonitorVerdict.NOT_YET:
        return f"decided before anything is read: always {monitor.verdicts[0].value}"
    return _WORDS[monitor.monitorability]


def _counted(monitor: Monitor) -> list[tuple[str, int]]:
    undecided = sum(monitor.hopeless)
    return [
        ("not yet", monitor.verdicts.count(MonitorVerdict.NOT_YET) - undecided),
        ("true", monitor.verdicts.count(MonitorVerdict.TRUE)),
        ("false", monitor.verdicts.count(MonitorVerdict.FALSE)),
        ("without a verdict forever", undecided),
    ]


def monitor_graph(found: Monitored) -> Graph:
    """The monitor as a graph for drawing: states by number and verdict, transitions by their letters."""
    monitor = found.monitor
    guards = Guards([shown(key) for key in monitor.atoms])
    nodes = [Node("start", "", (), "initial")]
    for q, verdict in enumerate(monitor.verdicts):
        title = "undecidable" if monitor.hopeless[q] else verdict.value
        nodes.append(Node(f"s{q}", str(q), (title,), "state" if verdict is MonitorVerdict.NOT_YET else "note"))
    edges = [Edge("start", "s0", "", "start")]
    for q, row in enumerate(monitor.edges):
        for target in dict.fromkeys(e.target for e in row):
            letters = guards.union(guards.cube(e.positive, e.negative) for e in row if e.target == target)
            label = shorten(to_text(guards.formula(letters)), LABEL_WIDTH)
            edges.append(Edge(f"s{q}", f"s{target}", label, "transition"))
    return Graph(shorten(f"{found.line.name}: {found.line.text}", LABEL_WIDTH), tuple(nodes), tuple(edges), "machine")
