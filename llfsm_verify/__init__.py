"""A model checker for arrangements of logic-labelled finite-state machines.

`import llfsm_verify as lv` is the front door (docs/api.md). What it gives is imported when it is first asked for, from
the room `api/` and from the values below that `api/` hands out.

This file has no assertions for pytest to rewrite (PYTEST_DONT_REWRITE): else pytest, which loads our plugin, would warn
where a program imports us before it runs pytest.
"""

from __future__ import annotations

TYPE_CHECKING = False  # type checkers take this name for true; `typing` would take most of the time of the import

if TYPE_CHECKING:
    from llfsm_verify.api.answers import (
        CoverageReport,
        LintReport,
        QueryAnswer,
        Reachability,
        RecordingOutcome,
        ReplayOutcome,
    )
    from llfsm_verify.api.building import InstanceDefinition, MachineDefinition, StateDefinition, build
    from llfsm_verify.api.model import Model, load, replay
    from llfsm_verify.api.monitors import MonitorReading, MonitorSet, PropertyMonitor, WatchedSimulation
    from llfsm_verify.api.options import CheckOptions, LimitOptions, QueryOptions
    from llfsm_verify.api.properties import Properties
    from llfsm_verify.api.results import CheckResult, FaultOutcome, FaultsOutcome, PropertyOutcome
    from llfsm_verify.api.running import LiveRun
    from llfsm_verify.api.traces import RunView, SimulatedRun, TraceView, Value
    from llfsm_verify.checking.trace import Cause, Change, Sampled, TraceStep
    from llfsm_verify.checking.verdict import EarlyVerdict, Progress, Proof, Vacuity, Verdict
    from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Disagreement
    from llfsm_verify.kripke.steps import Steps
    from llfsm_verify.kripke.structure import Structure
    from llfsm_verify.limits import LimitReached
    from llfsm_verify.runtime.live.run import RunReport
    from llfsm_verify.runtime.stepping.simulation import (
        Simulation,
        SimulationError,
        SimulationFault,
        SimulationOverflow,
    )
    from llfsm_verify.runtime.whiteboard.client import InputWriter, PostRefused, View, Whiteboard, WhiteboardError
    from llfsm_verify.runtime.whiteboard.subscription import Subscription, Update

_ROOMS = {
    "api.answers": ("CoverageReport", "LintReport", "QueryAnswer", "Reachability", "RecordingOutcome", "ReplayOutcome"),
    "api.building": ("InstanceDefinition", "MachineDefinition", "StateDefinition", "build"),
    "api.model": ("Model", "load", "replay"),
    "api.monitors": ("MonitorReading", "MonitorSet", "PropertyMonitor", "WatchedSimulation"),
    "api.options": ("CheckOptions", "LimitOptions", "QueryOptions"),
    "api.properties": ("Properties",),
    "api.results": ("CheckResult", "FaultOutcome", "FaultsOutcome", "PropertyOutcome"),
    "api.running": ("LiveRun",),
    "api.traces": ("RunView", "SimulatedRun", "TraceView", "Value"),
    "checking.trace": ("Cause", "Change", "Sampled", "TraceStep"),
    "checking.verdict": ("EarlyVerdict", "Progress", "Proof", "Vacuity", "Verdict"),
    "diagnostics": ("Diagnostic", "DiagnosticError", "Disagreement"),
    "kripke.steps": ("Steps",),
    "kripke.structure": ("Structure",),
    "limits": ("LimitReached",),
    "runtime.live.run": ("RunReport",),
    "runtime.stepping.simulation": ("Simulation", "SimulationError", "SimulationFault", "SimulationOverflow"),
    "runtime.whiteboard.client": ("InputWriter", "PostRefused", "View", "Whiteboard", "WhiteboardError"),
    "runtime.whiteboard.subscription": ("Subscription", "Update"),
}
"""Where each name is, below this package."""

__all__ = [
    "Cause",
    "Change",
    "CheckOptions",
    "CheckResult",
    "CoverageReport",
    "Diagnostic",
    "DiagnosticError",
    "Disagreement",
    "EarlyVerdict",
    "FaultOutcome",
    "FaultsOutcome",
    "InputWriter",
    "InstanceDefinition",
    "LimitOptions",
    "LimitReached",
    "LintReport",
    "LiveRun",
    "MachineDefinition",
    "Model",
    "MonitorReading",
    "MonitorSet",
    "PostRefused",
    "Progress",
    "Proof",
    "Properties",
    "PropertyMonitor",
    "PropertyOutcome",
    "QueryAnswer",
    "QueryOptions",
    "Reachability",
    "RecordingOutcome",
    "ReplayOutcome",
    "RunReport",
    "RunView",
    "Sampled",
    "SimulatedRun",
    "Simulation",
    "SimulationError",
    "SimulationFault",
    "SimulationOverflow",
    "StateDefinition",
    "Steps",
    "Structure",
    "Subscription",
    "TraceStep",
    "TraceView",
    "Update",
    "Vacuity",
    "Value",
    "Verdict",
    "View",
    "WatchedSimulation",
    "Whiteboard",
    "WhiteboardError",
    "build",
    "load",
    "replay",
]

if not TYPE_CHECKING:  # a type checker shall find a name that there is not

    def __getattr__(name: str) -> object:
        from llfsm_verify.lazily import imported

        return imported(__name__, _ROOMS, name)

    def __dir__() -> list[str]:
        return sorted({*globals(), *__all__})
