from llfsm_verify.analysis.coverage.result import Coverage
from llfsm_verify.analysis.coverage.result import Judged as JudgedGoal
from llfsm_verify.analysis.coverage.result import Status as CoverageStatus
from llfsm_verify.analysis.coverage.running import ended as vector_ended
from llfsm_verify.analysis.coverage.running import fault_of, field_names, record_of
from llfsm_verify.analysis.coverage.search import find_vectors
from llfsm_verify.analysis.coverage.vectorfile import program_hash
from llfsm_verify.analysis.coverage.vectors import Sequence as VectorSteps
from llfsm_verify.analysis.coverage.vectors import Unit, Vectors
from llfsm_verify.analysis.lint.finding import LintResult
from llfsm_verify.api.options import check_options
from llfsm_verify.api.options import checked as checked_options
from llfsm_verify.api.sweeping import RowState
from llfsm_verify.arrangement.draft import (
    UNREADABLE,
    ArrangementDraft,
    Draft,
    InstanceDraft,
    MachineDraft,
    ParameterDraft,
    ProcessDraft,
    StateDraft,
    TransitionDraft,
    VariableDraft,
    WhiteboardDraft,
)
from llfsm_verify.arrangement.draft import Unreadable as UnreadablePart
from llfsm_verify.arrangement.files import read_named, read_source
from llfsm_verify.arrangement.formats import ARRANGEMENTS, WRITERS, ending_of, machine_in, read_arrangement, writer_of
from llfsm_verify.arrangement.formats import Given as GivenArrangement
from llfsm_verify.arrangement.formats.data import draft_data, node_of_data
from llfsm_verify.arrangement.formats.reading import MACHINES, Reading, opened
from llfsm_verify.arrangement.formats.writing import Actions as StateActions
from llfsm_verify.arrangement.formats.writing import Editor, Edits, NewMachine, NewState, Uneditable, Writer
from llfsm_verify.arrangement.formats.writing import Value as DocumentValue
from llfsm_verify.arrangement.granting import policy_digest
from llfsm_verify.arrangement.kinds import kind_of, other_kind
from llfsm_verify.arrangement.loader import load_arrangement
from llfsm_verify.arrangement.model import ACTION_KINDS, ActionKind, Arrangement, Machine
from llfsm_verify.arrangement.plants import PLANTS, Plant, UsedPlant
from llfsm_verify.arrangement.plants import Site as PlantSite
from llfsm_verify.arrangement.requests import Request
from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge
from llfsm_verify.automata.automaton import Edge as AutomatonEdge
from llfsm_verify.automata.boolean import Guards
from llfsm_verify.automata.files import AUTOMATA, AutomataFormat, FileAutomaton
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.automata.ltl.translation import is_safety_property
from llfsm_verify.automata.omega.emptiness import find_accepting_lasso
from llfsm_verify.automata.omega.moves import Lazy, moves_of
from llfsm_verify.automata.omega.products import is_deterministic
from llfsm_verify.automata.safety import PrefixMonitor, Safety, safety
from llfsm_verify.backends.native.executor import ENDED as PROGRAM_ENDED
from llfsm_verify.backends.native.executor import NativeProgram, StepResult
from llfsm_verify.backends.native.layout import BitField, Layout, TooManyInitial
from llfsm_verify.backends.reference import Interpreter, evaluate
from llfsm_verify.backends.reference import Outcome as StepOutcome
from llfsm_verify.checking.claims import add_premises, claim_of
from llfsm_verify.checking.doubts import doubts
from llfsm_verify.checking.engine import Answer, Given, Holds, Session, Unknown, Violated
from llfsm_verify.checking.engine_option import (
    COUNT,
    FILE,
    FLAG,
    SECONDS,
    SWITCH,
    WHEN,
    EngineOption,
    EngineOptions,
)
from llfsm_verify.checking.goals.goal import Goal, bad_prefixes_of, mask
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.monitors import WORDS as VERDICT_WORDS
from llfsm_verify.checking.monitors import monitors_of
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.checking.reach import FaultRun, Reachable
from llfsm_verify.checking.replay.confirm import Letter, Schedule
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.checking.trace import Trace
from llfsm_verify.checking.verdict import (
    Exploration,
    FaultFinding,
    FaultResult,
    Options,
    PropertyResult,
    Result,
    Verdict,
)
from llfsm_verify.cli.arguments import DRAWN as DRAWN_VALUES
from llfsm_verify.cli.arguments import arrangement as arrangement_argument
from llfsm_verify.cli.arguments import (
    assignments,
    drawn_inputs,
    other_arrangement,
    property_files,
    property_lines,
    repeatable,
)
from llfsm_verify.cli.arguments import colour as colour_argument
from llfsm_verify.cli.arguments import engine as engine_argument
from llfsm_verify.cli.arguments import max_states as states_argument
from llfsm_verify.cli.arguments import memory_and_timeout as limit_arguments
from llfsm_verify.cli.arguments import only as only_argument
from llfsm_verify.cli.arguments import output as output_argument
from llfsm_verify.cli.arguments import positive as positive_number
from llfsm_verify.cli.certificates import write_certificate
from llfsm_verify.cli.commands import COMMANDS
from llfsm_verify.cli.commands.check.run import find_owners, is_arrangement, properties_beside
from llfsm_verify.cli.commands.trace.arguments import steps as step_range
from llfsm_verify.cli.drawing_format import drawing_format
from llfsm_verify.cli.io.ending import ending_raises
from llfsm_verify.cli.io.files import ready, ready_beside, write_whole
from llfsm_verify.cli.io.output import Output, tell
from llfsm_verify.cli.io.progress import StatusLine
from llfsm_verify.cli.io.standard_error import Unhurried
from llfsm_verify.cli.io.verdicts import EarlyVerdicts
from llfsm_verify.cli.opening import chosen, limits_of, open_draft, told
from llfsm_verify.cli.opening import read_properties as asked_properties
from llfsm_verify.cli.outside import command as order_of
from llfsm_verify.cli.outside import refuse_undeclared
from llfsm_verify.cli.parser import CommandEntry, UsageError, wrong_usage
from llfsm_verify.cli.parser import Parser as CommandParser
from llfsm_verify.collector import do_more_tasks
from llfsm_verify.diagnostics import Fragment, Source, Span, counted, without_controls
from llfsm_verify.files import UNSAVED, publish, read_regular, unfinished
from llfsm_verify.jsonvalue import Json
from llfsm_verify.kripke.explore import MAX_ROOTS
from llfsm_verify.kripke.export.formats import MODELS, STRUCTURES
from llfsm_verify.kripke.export.rows import (
    Element,
    RowWriter,
    edges,
    elements,
    initial_letters,
    letters,
    portions,
    steps_known,
    ways,
)
from llfsm_verify.kripke.export.specification import Specification
from llfsm_verify.kripke.labels.sizes import is_wide
from llfsm_verify.kripke.labels.wide import labels_of
from llfsm_verify.kripke.observing import Observer, observed_outputs
from llfsm_verify.kripke.steps import Step
from llfsm_verify.language.atoms import PropertyScope, check_atom
from llfsm_verify.language.parser import parse_actions, parse_guard
from llfsm_verify.language.scope import CALLS, IMPLICIT_SUSPEND, did_you_mean, near_names
from llfsm_verify.language.syntax import Call as CallNode
from llfsm_verify.language.syntax import Path as PathNode
from llfsm_verify.language.trees import nodes as syntax_nodes
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import AtState, Edge, Expression, IfElse, Observe, Query, Read, Sampled, Sampling
from llfsm_verify.language.types import ArrayType, EnumType, RecordType, decimal_text, digits_of, has_int, scalar_text
from llfsm_verify.language.types import Type as DeclaredType
from llfsm_verify.limits import Budget, LimitReached, Limits, parse_size, reached, tick
from llfsm_verify.logic.bounds import IN_STEPS, MAX_STEPS, MAX_TICKS, TICK, Clock, repeat, step_bound, without_steps
from llfsm_verify.logic.codes import BOUND as WRONG_BOUND
from llfsm_verify.logic.codes import EMPTY as WRONG_EMPTY
from llfsm_verify.logic.codes import FOREIGN as WRONG_FOREIGN
from llfsm_verify.logic.codes import HOA as WRONG_HOA
from llfsm_verify.logic.codes import HOA_ACCEPTANCE, HOA_NUMBER, HOA_UNSUPPORTED
from llfsm_verify.logic.codes import MIXTURE as WRONG_MIXTURE
from llfsm_verify.logic.codes import OPEN_BRACKET as WRONG_OPEN_BRACKET
from llfsm_verify.logic.codes import REPETITION as WRONG_REPETITION
from llfsm_verify.logic.codes import STRAY_BRACKET as WRONG_STRAY_BRACKET
from llfsm_verify.logic.codes import TOO_DEEP as WRONG_TOO_DEEP
from llfsm_verify.logic.codes import TOO_MANY_WORDS as WRONG_TOO_MANY_WORDS
from llfsm_verify.logic.expressions import first_match, sequence
from llfsm_verify.logic.formula import FALSE as FALSE_FORMULA
from llfsm_verify.logic.formula import (
    PAST_STEPS,
    TIMED,
    Formula,
    apply,
    atom,
    conjunction,
    depth,
    disjunction,
    is_boolean,
    is_plain,
    mapped,
    negation,
    operators,
    postorder,
)
from llfsm_verify.logic.formula import TRUE as TRUE_FORMULA
from llfsm_verify.logic.formula import Op as FormulaOp
from llfsm_verify.logic.lasso import evaluate as evaluate_formula
from llfsm_verify.logic.lines import has_header
from llfsm_verify.logic.parsing.bounds import decimal as exact_decimal
from llfsm_verify.logic.parsing.delays import refuse_delays
from llfsm_verify.logic.parsing.formulas import MAX_DEPTH, Parsed
from llfsm_verify.logic.parsing.tokens import MAX_TOKENS, tokenise
from llfsm_verify.logic.parsing.words import atom_place
from llfsm_verify.logic.properties import FEATURES, Property, PropertySet, asked_text, parse_properties
from llfsm_verify.logic.reading import GivenLines
from llfsm_verify.logic.reading import read_source as read_properties
from llfsm_verify.logic.rewriting.normal_form import nnf
from llfsm_verify.logic.stamps import Stamped, Unstamped
from llfsm_verify.logic.syntax_names import SYNTAXES
from llfsm_verify.logic.syntaxes import Syntax
from llfsm_verify.logic.syntaxes.writing import Spelling
from llfsm_verify.monitoring.lookup import entry_bytes
from llfsm_verify.monitoring.machine import Action as MonitorAction
from llfsm_verify.monitoring.machine import monitor_machine
from llfsm_verify.monitoring.machine_reads import declared_type, expressions_in
from llfsm_verify.monitoring.machine_reads import reads as monitor_reads
from llfsm_verify.monitoring.properties import Monitored, Timing, monitor_properties
from llfsm_verify.monitoring.properties import shown as shown_atom
from llfsm_verify.monitoring.states import Monitor, MonitorVerdict
from llfsm_verify.program.dependence import blocks, uses
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import (
    BOOL,
    INT64_MAX,
    INT64_MIN,
    Block,
    Choice,
    Const,
    Emit,
    EventKind,
    Expr,
    Fault,
    FaultSite,
    Get,
    If,
    Int,
    Ite,
    Let,
    Local,
    Op,
    OpName,
    Process,
    Program,
    Sample,
    Set,
    Slot,
    Stmt,
    Switch,
    Type,
    Var,
)
from llfsm_verify.program.symbolic import FAULT, Key, Values, scalars, typed
from llfsm_verify.program.symbolic import Definitions as SymbolicDefinitions
from llfsm_verify.program.terms import FALSE, TRUE, const, fits, get, interval, ite, op
from llfsm_verify.program.terms import conjunction as all_of
from llfsm_verify.program.terms import disjunction as any_of
from llfsm_verify.program.trees import (
    branches,
    constant_of,
    distinct_nodes,
    expressions,
    fold,
    nodes,
    parts,
    rebuilt,
    ringlet,
    statements,
    stop_at_faults,
    with_arguments,
    with_branches,
    without,
)
from llfsm_verify.registry import Entry, Package, Registry, Unregistered
from llfsm_verify.report.codes import all_codes
from llfsm_verify.report.debugging import FRONT_ENDS, DebugError, lines_of
from llfsm_verify.report.debugging import Answer as DebugAnswer
from llfsm_verify.report.debugging import Part as DebugPart
from llfsm_verify.report.debugging import Session as DebugSession
from llfsm_verify.report.debugging import Steps as DebugSteps
from llfsm_verify.report.debugging import Table as DebugTable
from llfsm_verify.report.drawing import NO_LIBRARY as NO_GRAPHVIZ
from llfsm_verify.report.drawing import UNWRITABLE as NOT_DRAWN
from llfsm_verify.report.drawing.extract import arrangement_graph, machine_graph
from llfsm_verify.report.drawing.formats import DRAWINGS
from llfsm_verify.report.drawing.graph import LEGEND, Graph, explained, shorten, summarise, with_legend
from llfsm_verify.report.drawing.graph import Edge as DrawnEdge
from llfsm_verify.report.drawing.graph import EdgeKind as DrawnEdgeKind
from llfsm_verify.report.drawing.graph import Mark as DrawnMark
from llfsm_verify.report.drawing.graph import Node as DrawnNode
from llfsm_verify.report.entry import ReportEntry
from llfsm_verify.report.formats import REPORTS, Style, Written
from llfsm_verify.report.lint import explain as lint_diagnostic
from llfsm_verify.report.plain import PIPE_WIDTH, plain_text
from llfsm_verify.report.running import ENDINGS as ENDING_WORDS
from llfsm_verify.report.running import duration as duration_text
from llfsm_verify.report.saving import named_runs, trace_documents, update_trace_file
from llfsm_verify.report.schema import SCHEMAS
from llfsm_verify.report.text import result_text, trace_text
from llfsm_verify.report.timeline.formats import TIMELINES
from llfsm_verify.report.tracetable import MARK as CAUSE_MARK
from llfsm_verify.report.tracetable import Row as TraceRow
from llfsm_verify.report.tracetable import initial_text
from llfsm_verify.report.tracetable import rows as trace_rows
from llfsm_verify.report.wording import (
    CLAIMED,
    CONTRADICTED,
    fault_text,
    is_contradicted,
    name_cell,
    resumed_text,
    sentences,
    summary_text,
    under_assumptions,
    vacuity_texts,
    verdict_text,
)
from llfsm_verify.runtime.deciding.letters import SlotLetters
from llfsm_verify.runtime.deciding.logs import (
    LOGS,
    ORACLES,
    LogReading,
    NoColumn,
    Oracle,
    Row,
    Unreadable,
    Wanted,
    cell_text,
    cells_of,
)
from llfsm_verify.runtime.deciding.recordings import Decided, Watch, watches_of
from llfsm_verify.runtime.launch import PANELS, Launch, Panel
from llfsm_verify.runtime.live import ABSENT as NO_WHITEBOARD
from llfsm_verify.runtime.live.frame import COUNTED as FRAME_COUNTS
from llfsm_verify.runtime.live.frame import CYCLE as FRAME_CYCLE
from llfsm_verify.runtime.live.frame import ENDING as FRAME_ENDING
from llfsm_verify.runtime.live.frame import ENDINGS as FRAME_ENDINGS
from llfsm_verify.runtime.live.frame import HEADER as FRAME_HEADER
from llfsm_verify.runtime.live.frame import NUMBER as FRAME_NUMBER
from llfsm_verify.runtime.live.frame import STEPS as FRAME_STEPS
from llfsm_verify.runtime.live.frame import FrameLayout
from llfsm_verify.runtime.live.plan import runnable, safe_values, starting_values
from llfsm_verify.runtime.live.run import Lateness, lateness
from llfsm_verify.runtime.live.slots import STATE as STATE_SLOT
from llfsm_verify.runtime.live.slots import VERDICT as VERDICT_SLOT
from llfsm_verify.runtime.live.slots import Slot as BoardSlot
from llfsm_verify.runtime.live.slots import inputs_of, program_slots, slots_of
from llfsm_verify.runtime.live.text import largest_entry
from llfsm_verify.runtime.outside.reaction_time import Order, Pace, reaction_time
from llfsm_verify.runtime.ports import UNKNOWN as WRONG_PORT
from llfsm_verify.runtime.ports.file import read_ports
from llfsm_verify.runtime.ports.line_port import LINES as LINE_FRAMING
from llfsm_verify.runtime.ports.line_port import Framing, LinePort, LineReader, Malformed
from llfsm_verify.runtime.ports.port import PORTS, Link, Port, Started, Unopened, whole_number
from llfsm_verify.runtime.ports.port import Kind as PortKind
from llfsm_verify.runtime.ports.process.kind import CHILD_FIELDS, patience_of
from llfsm_verify.runtime.ports.process.port import ProcessSettings
from llfsm_verify.runtime.recording.file import HEAD as RECORDING_HEAD
from llfsm_verify.runtime.recording.file import MAGIC as RECORDING_MAGIC
from llfsm_verify.runtime.recording.file import PAGE as RECORDING_PAGE
from llfsm_verify.runtime.recording.file import Recording, is_recording
from llfsm_verify.runtime.recording.origin import arrangement_of, code_of, header_of
from llfsm_verify.runtime.recording.replay import Differs, compared
from llfsm_verify.runtime.recording.timeline import Row as TimelineRow
from llfsm_verify.runtime.recording.timeline import Signal, Timeline, take
from llfsm_verify.runtime.recording.walking import Next as NextStep
from llfsm_verify.runtime.recording.walking import Recorded
from llfsm_verify.runtime.recording.walking import Start as PathStart
from llfsm_verify.runtime.stepping.drawing import (
    ANEW,
    Drawing,
    DrawingError,
    Draws,
    drawing_of,
    free_inputs,
    free_values,
    unknown_input,
)
from llfsm_verify.runtime.whiteboard.places import NoPlace
from llfsm_verify.runtime.whiteboard.places import names as whiteboard_names
from llfsm_verify.runtime.whiteboard.shared import Shared as SharedFrames
from llfsm_verify.semantics.bits import common_bits
from llfsm_verify.semantics.expressions import SURROUNDINGS
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.semantics.operators import OPERATOR
from llfsm_verify.semantics.parts import PART as GUARD_PART
from llfsm_verify.semantics.parts import Part as GuardPart
from llfsm_verify.semantics.parts import Parts as GuardParts
from llfsm_verify.semantics.probes import ACTIONS, Outcome
from llfsm_verify.semantics.storage import leaves
from llfsm_verify.targets.monitors import OnBoard, Watched
from llfsm_verify.targets.target import TARGETS, WORLDS, Difference, Made, Target, Verified
from llfsm_verify.targets.target import Wanted as TargetWanted
from llfsm_verify.transforms.probing import probed
from llfsm_verify.values import Shown, Value, ValueProblem, choice_value, element_names, text, value_text
from llfsm_verify.values import elements as element_texts
from llfsm_verify.verification.engines import DEFAULT_ENGINE, ENGINES, EngineEntry, Turn
from llfsm_verify.verification.replay import Replayed, replay_file, saved_run, schedule_of
from llfsm_verify.verification.schedulers import SCHEDULERS
from llfsm_verify.verification.schedulers import Lost as LostTask
from llfsm_verify.verification.schedulers import Scheduler as TaskScheduler
from llfsm_verify.verification.verify import verify
from llfsm_verify.yaml.compose import compose
from llfsm_verify.yaml.duration import duration_ms
from llfsm_verify.yaml.fields import Report, is_name
from llfsm_verify.yaml.nodes import Mapping as MappingNode
from llfsm_verify.yaml.nodes import Node, Scalar, Sequence, implied, mark, written
from llfsm_verify.yaml.tables import FORMAT as FORMAT_KEY
from llfsm_verify.yaml.tables import NUMBER, TRUTHS, ByName, Either, Field, Several, Single, Table, Words, schema_of
from llfsm_verify.yaml.vocabulary import Vocabulary

__all__ = [
    "ACTIONS",
    "ACTION_KINDS",
    "ANEW",
    "ARRANGEMENTS",
    "AUTOMATA",
    "BOOL",
    "CALLS",
    "CAUSE_MARK",
    "CHILD_FIELDS",
    "CLAIMED",
    "COMMANDS",
    "CONTRADICTED",
    "COUNT",
    "DEFAULT_ENGINE",
    "DRAWINGS",
    "DRAWN_VALUES",
    "ENDING_WORDS",
    "ENGINES",
    "FALSE",
    "FALSE_FORMULA",
    "FAULT",
    "FEATURES",
    "FILE",
    "FLAG",
    "FORMAT_KEY",
    "FRAME_COUNTS",
    "FRAME_CYCLE",
    "FRAME_ENDING",
    "FRAME_ENDINGS",
    "FRAME_HEADER",
    "FRAME_NUMBER",
    "FRAME_STEPS",
    "FRONT_ENDS",
    "GUARD_PART",
    "HOA_ACCEPTANCE",
    "HOA_NUMBER",
    "HOA_UNSUPPORTED",
    "IMPLICIT_SUSPEND",
    "INT64_MAX",
    "INT64_MIN",
    "IN_STEPS",
    "LEGEND",
    "LINE_FRAMING",
    "LOGS",
    "MACHINES",
    "MAX_DEPTH",
    "MAX_ROOTS",
    "MAX_STEPS",
    "MAX_TICKS",
    "MAX_TOKENS",
    "MODELS",
    "NOT_DRAWN",
    "NO_GRAPHVIZ",
    "NO_WHITEBOARD",
    "NUMBER",
    "OPERATOR",
    "ORACLES",
    "PANELS",
    "PAST_STEPS",
    "PIPE_WIDTH",
    "PLANTS",
    "PORTS",
    "PROGRAM_ENDED",
    "RECORDING_HEAD",
    "RECORDING_MAGIC",
    "RECORDING_PAGE",
    "REPORTS",
    "SCHEDULERS",
    "SCHEMAS",
    "SECONDS",
    "STATE_SLOT",
    "STRUCTURES",
    "SURROUNDINGS",
    "SWITCH",
    "SYNTAXES",
    "TARGETS",
    "TICK",
    "TIMED",
    "TIMELINES",
    "TRUE",
    "TRUE_FORMULA",
    "TRUTHS",
    "UNREADABLE",
    "UNSAVED",
    "VERDICT_SLOT",
    "VERDICT_WORDS",
    "WHEN",
    "WORLDS",
    "WRITERS",
    "WRONG_BOUND",
    "WRONG_EMPTY",
    "WRONG_FOREIGN",
    "WRONG_HOA",
    "WRONG_MIXTURE",
    "WRONG_OPEN_BRACKET",
    "WRONG_PORT",
    "WRONG_REPETITION",
    "WRONG_STRAY_BRACKET",
    "WRONG_TOO_DEEP",
    "WRONG_TOO_MANY_WORDS",
    "ActionKind",
    "Answer",
    "Arrangement",
    "ArrangementDraft",
    "ArrayType",
    "AtState",
    "AutomataFormat",
    "Automaton",
    "AutomatonEdge",
    "AutomatonTooLarge",
    "BitField",
    "Block",
    "BoardSlot",
    "Budget",
    "ByName",
    "CallNode",
    "Choice",
    "Clock",
    "CommandEntry",
    "CommandParser",
    "Const",
    "Coverage",
    "CoverageStatus",
    "DebugAnswer",
    "DebugError",
    "DebugPart",
    "DebugSession",
    "DebugSteps",
    "DebugTable",
    "Decided",
    "DeclaredType",
    "Difference",
    "Differs",
    "DocumentValue",
    "Draft",
    "Drawing",
    "DrawingError",
    "DrawnEdge",
    "DrawnEdgeKind",
    "DrawnMark",
    "DrawnNode",
    "Draws",
    "EarlyVerdicts",
    "Edge",
    "Editor",
    "Edits",
    "Either",
    "Element",
    "Emit",
    "EngineEntry",
    "EngineOption",
    "EngineOptions",
    "Entry",
    "EnumType",
    "EventKind",
    "Execution",
    "Exploration",
    "Expr",
    "Expression",
    "Fault",
    "FaultFinding",
    "FaultResult",
    "FaultRun",
    "FaultSite",
    "Field",
    "FileAutomaton",
    "Formula",
    "FormulaOp",
    "Fragment",
    "FrameLayout",
    "Framing",
    "Get",
    "Given",
    "GivenArrangement",
    "GivenLines",
    "Goal",
    "Graph",
    "GuardPart",
    "GuardParts",
    "Guards",
    "Holds",
    "If",
    "IfElse",
    "InstanceDraft",
    "Int",
    "Interpreter",
    "Ite",
    "Json",
    "JudgedGoal",
    "Key",
    "Lateness",
    "Launch",
    "Layout",
    "Lazy",
    "Let",
    "Letter",
    "LimitReached",
    "Limits",
    "LinePort",
    "LineReader",
    "Link",
    "LintResult",
    "Local",
    "LogReading",
    "LostTask",
    "Machine",
    "MachineDraft",
    "Made",
    "Malformed",
    "MappingNode",
    "Monitor",
    "MonitorAction",
    "MonitorVerdict",
    "Monitored",
    "Move",
    "NativeProgram",
    "NewMachine",
    "NewState",
    "NextStep",
    "NoColumn",
    "NoPlace",
    "Node",
    "Observe",
    "Observer",
    "OnBoard",
    "Op",
    "OpName",
    "Options",
    "Oracle",
    "Order",
    "Outcome",
    "Output",
    "Pace",
    "Package",
    "Panel",
    "ParameterDraft",
    "Parsed",
    "PathNode",
    "PathStart",
    "Plant",
    "PlantSite",
    "Port",
    "PortKind",
    "PrefixMonitor",
    "Problem",
    "Process",
    "ProcessDraft",
    "ProcessSettings",
    "Program",
    "Property",
    "PropertyResult",
    "PropertyScope",
    "PropertySet",
    "Query",
    "Reachable",
    "Read",
    "Reading",
    "RecordType",
    "Recorded",
    "Recording",
    "Registry",
    "Replayed",
    "Report",
    "ReportEntry",
    "Request",
    "Result",
    "Row",
    "RowState",
    "RowWriter",
    "Safety",
    "Sample",
    "Sampled",
    "Sampling",
    "Scalar",
    "Schedule",
    "Sequence",
    "Session",
    "Set",
    "Several",
    "SharedFrames",
    "Shown",
    "Signal",
    "Single",
    "Slot",
    "SlotLetters",
    "Source",
    "Span",
    "Specification",
    "Spelling",
    "Stamped",
    "Started",
    "StateActions",
    "StateDraft",
    "StatusLine",
    "Step",
    "StepOutcome",
    "StepResult",
    "Stmt",
    "Style",
    "Switch",
    "SymbolicDefinitions",
    "Syntax",
    "Table",
    "Target",
    "TargetWanted",
    "TaskScheduler",
    "Timeline",
    "TimelineRow",
    "Timing",
    "TooManyInitial",
    "Trace",
    "TraceRow",
    "TransitionDraft",
    "Turn",
    "Type",
    "Uneditable",
    "Unhurried",
    "Unit",
    "Unknown",
    "Unopened",
    "Unreadable",
    "UnreadablePart",
    "Unregistered",
    "Unstamped",
    "UsageError",
    "UsedPlant",
    "Value",
    "ValueProblem",
    "Values",
    "Var",
    "VariableDraft",
    "VectorSteps",
    "Vectors",
    "Verdict",
    "Verified",
    "Violated",
    "Vocabulary",
    "Wanted",
    "Watch",
    "Watched",
    "WhiteboardDraft",
    "Words",
    "Writer",
    "Written",
    "add_premises",
    "all_codes",
    "all_of",
    "any_of",
    "apply",
    "arrangement_argument",
    "arrangement_graph",
    "arrangement_of",
    "asked_properties",
    "asked_text",
    "assignments",
    "atom",
    "atom_place",
    "bad_prefixes_of",
    "bind",
    "blocks",
    "branches",
    "cell_text",
    "cells_of",
    "check_atom",
    "check_options",
    "checked_options",
    "choice_value",
    "chosen",
    "claim_of",
    "code_of",
    "colour_argument",
    "common_bits",
    "compared",
    "compose",
    "conjunction",
    "const",
    "constant_of",
    "counted",
    "decimal_text",
    "declared_type",
    "depth",
    "did_you_mean",
    "digits_of",
    "disjunction",
    "distinct_nodes",
    "do_more_tasks",
    "doubts",
    "draft_data",
    "drawing_format",
    "drawing_of",
    "drawn_inputs",
    "duration_ms",
    "duration_text",
    "edges",
    "element_names",
    "element_texts",
    "elements",
    "ending_of",
    "ending_raises",
    "engine_argument",
    "entry_bytes",
    "evaluate",
    "evaluate_formula",
    "exact_decimal",
    "explained",
    "expressions",
    "expressions_in",
    "fault_of",
    "fault_text",
    "field_names",
    "find_accepting_lasso",
    "find_owners",
    "find_vectors",
    "first_match",
    "fits",
    "fold",
    "free_inputs",
    "free_values",
    "get",
    "goals_of",
    "has_header",
    "has_int",
    "header_of",
    "implied",
    "initial_letters",
    "initial_text",
    "inputs_of",
    "interval",
    "is_arrangement",
    "is_boolean",
    "is_contradicted",
    "is_deterministic",
    "is_name",
    "is_plain",
    "is_recording",
    "is_safety_property",
    "is_wide",
    "ite",
    "kind_of",
    "labels_of",
    "largest_entry",
    "lateness",
    "leaves",
    "letters",
    "limit_arguments",
    "limits_of",
    "lines_of",
    "lint_diagnostic",
    "load_arrangement",
    "lower",
    "machine_graph",
    "machine_in",
    "mapped",
    "mark",
    "mask",
    "monitor_machine",
    "monitor_properties",
    "monitor_reads",
    "monitors_of",
    "moves_of",
    "name_cell",
    "named_runs",
    "near_names",
    "negation",
    "nnf",
    "node_of_data",
    "nodes",
    "observed_outputs",
    "of_kind",
    "only_argument",
    "op",
    "open_draft",
    "opened",
    "operators",
    "order_of",
    "other_arrangement",
    "other_kind",
    "output_argument",
    "parse_actions",
    "parse_guard",
    "parse_properties",
    "parse_size",
    "parts",
    "patience_of",
    "plain_text",
    "policy_digest",
    "portions",
    "positive_number",
    "postorder",
    "probed",
    "program_hash",
    "program_slots",
    "properties_beside",
    "property_files",
    "property_lines",
    "publish",
    "reached",
    "reaction_time",
    "read_arrangement",
    "read_named",
    "read_ports",
    "read_properties",
    "read_regular",
    "read_source",
    "ready",
    "ready_beside",
    "rebuilt",
    "record_of",
    "refuse_delays",
    "refuse_undeclared",
    "repeat",
    "repeatable",
    "replay_file",
    "resolve",
    "result_text",
    "resumed_text",
    "ringlet",
    "runnable",
    "safe_values",
    "safety",
    "saved_run",
    "scalar_text",
    "scalars",
    "schedule_of",
    "schema_of",
    "sentences",
    "sequence",
    "shorten",
    "shown_atom",
    "slots_of",
    "starting_values",
    "statements",
    "states_argument",
    "step_bound",
    "step_range",
    "steps_known",
    "stop_at_faults",
    "summarise",
    "summary_text",
    "syntax_nodes",
    "take",
    "tell",
    "text",
    "tick",
    "tokenise",
    "told",
    "trace_documents",
    "trace_rows",
    "trace_text",
    "translate",
    "typed",
    "under_assumptions",
    "unfinished",
    "unknown_input",
    "update_trace_file",
    "uses",
    "vacuity_texts",
    "value_text",
    "vector_ended",
    "verdict_text",
    "verify",
    "watches_of",
    "ways",
    "whiteboard_names",
    "whole_number",
    "with_arguments",
    "with_branches",
    "with_legend",
    "without",
    "without_controls",
    "without_steps",
    "write_certificate",
    "write_whole",
    "writer_of",
    "written",
    "wrong_usage",
]
