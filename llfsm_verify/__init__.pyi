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
from llfsm_verify.api.options import CheckOptions, ExploreOptions, LimitOptions, QueryOptions
from llfsm_verify.api.properties import Properties
from llfsm_verify.api.results import CheckResult, FaultOutcome, FaultsOutcome, PropertyOutcome
from llfsm_verify.api.running import LiveRun
from llfsm_verify.api.sweeping import SweepRow, SweepRows, sweep
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
    "ExploreOptions",
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
    "SweepRow",
    "SweepRows",
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
    "sweep",
]
