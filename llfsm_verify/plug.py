"""What an extension, or another package, may know of us besides the front door: the protocols of what can be added.

An engine, a kind of port, a reader of logs, a format of timelines, a report and a front end of the debugger each have
a registry, an entry and a protocol here. As in the front door, each name is imported when it is first
asked for. There is no target yet.
"""

from __future__ import annotations

TYPE_CHECKING = False  # as in the front door

if TYPE_CHECKING:
    from llfsm_verify.checking.engine import Answer, Given, Holds, Session, Unknown, Violated
    from llfsm_verify.checking.goals.goal import Goal
    from llfsm_verify.checking.replay.confirm import Schedule
    from llfsm_verify.jsonvalue import Json
    from llfsm_verify.limits import LimitReached, tick
    from llfsm_verify.program.moves import Move
    from llfsm_verify.registry import Entry, Package
    from llfsm_verify.report.debugging import lines_of
    from llfsm_verify.report.formats import REPORTS, Style, Written
    from llfsm_verify.report.timeline.formats import TIMELINES
    from llfsm_verify.runtime.debugging.commands import Answer as DebugAnswer
    from llfsm_verify.runtime.debugging.commands import parse as parse_command
    from llfsm_verify.runtime.debugging.paths import DebugError
    from llfsm_verify.runtime.debugging.session import FRONT_ENDS
    from llfsm_verify.runtime.debugging.session import Session as DebugSession
    from llfsm_verify.runtime.deciding.logs.formats import LOGS, NoColumn, Row, Unreadable, Wanted, cell_text
    from llfsm_verify.runtime.ports import UNKNOWN as WRONG_PORT
    from llfsm_verify.runtime.ports.line_port import LinePort
    from llfsm_verify.runtime.ports.port import PORTS, Link, Port, Started, Unopened, whole_number
    from llfsm_verify.runtime.ports.port import Kind as PortKind
    from llfsm_verify.runtime.recording.timeline import Row as TimelineRow
    from llfsm_verify.runtime.recording.timeline import Signal, Timeline
    from llfsm_verify.values import Shown, text
    from llfsm_verify.verification.engines import ENGINES, EngineEntry, Turn
    from llfsm_verify.yaml.fields import Report
    from llfsm_verify.yaml.nodes import Node, mark
    from llfsm_verify.yaml.tables import NUMBER, TRUTHS, Field, Single, Table, Words

_PLACES = {
    "checking.engine": ("Answer", "Given", "Holds", "Session", "Unknown", "Violated"),
    "checking.goals.goal": ("Goal",),
    "checking.replay.confirm": ("Schedule",),
    "jsonvalue": ("Json",),
    "limits": ("LimitReached", "tick"),
    "program.moves": ("Move",),
    "registry": ("Entry", "Package"),
    "report.debugging": ("lines_of",),
    "report.formats": ("REPORTS", "Style", "Written"),
    "report.timeline.formats": ("TIMELINES",),
    "runtime.recording.timeline": ("Row as TimelineRow", "Signal", "Timeline"),
    "runtime.debugging.commands": ("Answer as DebugAnswer", "parse as parse_command"),
    "runtime.debugging.paths": ("DebugError",),
    "runtime.debugging.session": ("FRONT_ENDS", "Session as DebugSession"),
    "runtime.deciding.logs.formats": ("LOGS", "NoColumn", "Row", "Unreadable", "Wanted", "cell_text"),
    "runtime.ports": ("UNKNOWN as WRONG_PORT",),
    "runtime.ports.line_port": ("LinePort",),
    "runtime.ports.port": ("PORTS", "Kind as PortKind", "Link", "Port", "Started", "Unopened", "whole_number"),
    "values": ("Shown", "text"),
    "verification.engines": ("ENGINES", "EngineEntry", "Turn"),
    "yaml.fields": ("Report",),
    "yaml.nodes": ("Node", "mark"),
    "yaml.tables": ("NUMBER", "TRUTHS", "Field", "Single", "Table", "Words"),
}
"""Where each name is, below this package."""

__all__ = [
    "ENGINES", "FRONT_ENDS", "LOGS", "NUMBER", "PORTS", "REPORTS", "TIMELINES", "TRUTHS", "WRONG_PORT", "Answer",
    "DebugAnswer", "DebugError", "DebugSession", "EngineEntry", "Entry", "Field", "Given", "Goal", "Holds", "Json",
    "LimitReached", "LinePort", "Link", "Move", "NoColumn", "Node", "Package", "Port", "PortKind", "Report", "Row",
    "Schedule", "Session", "Shown", "Signal", "Single", "Started", "Style", "Table", "Timeline", "TimelineRow",
    "Turn", "Unknown", "Unopened", "Unreadable", "Violated", "Wanted", "Words", "Written", "cell_text", "lines_of",
    "mark", "parse_command", "text", "tick", "whole_number",
]  # fmt: skip

if not TYPE_CHECKING:  # a type checker shall find a name that there is not
    from llfsm_verify.lazily import lazily

    __getattr__, __dir__ = lazily(__name__, _PLACES)
