"""What can be written on the command line."""

from __future__ import annotations

from argparse import ArgumentParser
from typing import NoReturn

from llfsm_verify.cli.argument_types import (
    MONITORS,
    PROPERTY_QUESTIONS,
    all_steps,
    colour,
    engine,
    positive,
    seconds,
    size,
)
from llfsm_verify.cli.asking import lint_arguments, query_arguments
from llfsm_verify.cli.guarding import guard_arguments
from llfsm_verify.cli.running import (
    access_arguments,
    audit_arguments,
    debug_arguments,
    recording_arguments,
    run_arguments,
    send_arguments,
    trace_arguments,
    whiteboard_arguments,
)
from llfsm_verify.cli.simulating import simulate_arguments
from llfsm_verify.exports.formats import MODELS
from llfsm_verify.kripke.export.formats import STRUCTURES
from llfsm_verify.logic.syntax_names import SYNTAXES
from llfsm_verify.report.drawing.formats import DRAWINGS
from llfsm_verify.report.formats import RESULTS
from llfsm_verify.report.schemas import SCHEMAS
from llfsm_verify.report.timeline.formats import TIMELINES

EXIT_CODES = (
    "exit codes: 0 everything holds, 1 violated or a fault, 2 wrong usage, 3 input files wrong or unreadable, "
    "4 unknown, 5 a check of a result failed, 70 internal error, 130 interrupted"
)

VERIFY = "Check properties of an arrangement of logic-labelled finite-state machines, and that no run of it faults."


class Parser(ArgumentParser):
    """A parser, and those of its commands, that says what is wrong in one line, as all commands do."""

    def error(self, message: str) -> NoReturn:
        """Ends the process with exit code 2."""
        from llfsm_verify.diagnostics import without_controls

        missing = message.startswith("the following arguments are required")
        advice = f" (`{self.prog} --help` says more)" if missing else ""
        self.exit(2, f"usage: {without_controls(message.removeprefix('argument '))}{advice}\n")


def llfsm_parser() -> ArgumentParser:
    """The parser of `llfsm`; the result has the name of the command in `command`."""
    parser = Parser(
        "llfsm",
        description="Verify, run and draw arrangements of logic-labelled finite-state machines.",
        epilog="example: `llfsm init crossing` writes a small arrangement, which `llfsm verify "
        "crossing/arrangement.yaml crossing/properties.ltl` checks. Documentation: README.md and docs/ of the project; "
        "`llfsm COMMAND --help` lists the options of a command",
    )
    _version(parser)
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    _verify_arguments(commands.add_parser("verify", help="check properties"))
    simulate_arguments(commands.add_parser("simulate", help="run an arrangement and show each step"))
    run_arguments(commands.add_parser("run", help="run an arrangement in real time, or as fast as it goes"))
    _replay_arguments(commands.add_parser("replay", help="run saved traces and recordings again"))
    debug_arguments(commands.add_parser("debug", help="walk a run forwards and backwards, and see why"))
    whiteboard_arguments(commands.add_parser("whiteboard", help="read and post on the whiteboards of what runs"))
    send_arguments(commands.add_parser("send", help="give an operator's command to an arrangement that runs"))
    _report_arguments(commands.add_parser("report", help="write a page for a safety case"))
    access_arguments(commands.add_parser("access", help="say who may do what, and who does"))
    audit_arguments(commands.add_parser("audit", help="look whether an audit log was changed"))
    trace_arguments(
        commands.add_parser("trace", help="write a recording or a saved trace as CSV, VCD, SVG, MCAP or ITF")
    )
    recording_arguments(commands.add_parser("check-recording", help="decide properties on a recording"))
    _draw_arguments(commands.add_parser("draw", help="draw a machine or the arrangement"))
    _property_arguments(commands.add_parser("property", help="ask about formulas over free atoms"))
    _monitor_arguments(commands.add_parser("monitor", help="say what can be decided at run time, and write monitors"))
    guard_arguments(
        commands.add_parser("guard", help="put a monitor and a switch before outputs, and prove what they keep")
    )
    _kripke_arguments(commands.add_parser("kripke", help="write the Kripke structure, or a model for another checker"))
    _check_arguments(commands.add_parser("check", help="check the arrangements that changed files belong to"))
    lint_arguments(commands.add_parser("lint", help="find what is wrong whatever the properties, by proof"))
    query_arguments(commands.add_parser("query", help="find a run that reaches something, or prove that none does"))
    _init_arguments(commands.add_parser("init", help="write a small arrangement with properties and tests"))
    _schema_arguments(commands.add_parser("schema", help="print a JSON Schema"))
    return parser


def verify_parser() -> ArgumentParser:
    """The parser of `llfsm-verify`."""
    parser = Parser("llfsm-verify")
    _version(parser)
    _verify_arguments(parser)
    parser.set_defaults(command="verify")
    return parser


def _version(parser: ArgumentParser) -> None:
    from llfsm_verify.cli.version import Version

    parser.add_argument("--version", action=Version)


def _verify_arguments(parser: ArgumentParser) -> None:
    parser.description, parser.epilog = VERIFY, EXIT_CODES
    add = parser.add_argument
    add("arrangement", metavar="ARRANGEMENT", help="the arrangement's file; - reads standard input")
    add("properties", metavar="PROPERTIES", nargs="*", default=[], help="property files; - reads standard input")
    add(
        "-p",
        "--property",
        metavar="TEXT",
        action="append",
        default=[],
        help="one line of a property file; may be repeated",
    )
    add("--syntax", choices=SYNTAXES, default="llfsm", help="how formulas are written (default: %(default)s)")
    engine(parser)
    add("--depth", metavar="N", type=positive, help="how far bmc (60 steps), induction (k 30) and pdr (1000 frames) go")
    add("--format", choices=RESULTS, default="text", help="how to report (default: %(default)s)")
    add("--save-traces", metavar="DIR", help="save each trace as DIR/NAME.trace.yaml")
    add(
        "--save-as", choices=TIMELINES, action="append", default=[],
        help="save each trace of --save-traces in this format as well; may be repeated",
    )  # fmt: skip
    add("--all", metavar="N", type=positive, default=1, help="N different counterexamples to each violated property")
    add("--strict", action="store_true", help="fail when a property holds only because nothing happens (see --vacuity)")
    add("--vacuity", action="store_true", help="look for subformulas that do not matter in properties that hold")
    add(
        "--accept-vacuity",
        metavar="NAME",
        action="append",
        default=[],
        help="this property may hold emptily under --strict; may be repeated",
    )
    add("--witness", action="store_true", help="show for each property that holds a run in which something happens")
    add("--max-states", metavar="N", type=positive, help="end the search after N configurations")
    add("--memory", metavar="SIZE", type=size, help="end the search when it needs more memory, such as 500M or 2G")
    add("--timeout", metavar="SECONDS", type=seconds, help="end the search after so many seconds")
    add("--keep-all-bits", action="store_true", help="keep entered flags that cannot matter any more")
    add(
        "--cone",
        choices=("auto", "on", "off"),
        default="auto",
        help="leave out what no property depends on; auto: when the space is large (default: %(default)s)",
    )
    add(
        "--compression",
        "--chains",  # its old name, for a release
        choices=("auto", "on", "off"),
        default="auto",
        help="do not store configurations with one step only; auto: when the space is large (default: %(default)s)",
    )
    add(
        "--labels",
        choices=("on", "off"),
        default="on",
        help="explore wide inputs by classes of values instead of value by value (default: %(default)s)",
    )
    add("--checkpoint", metavar="FILE", help="save a long search there now and then, and when a limit ends it")
    add("--checkpoint-every", metavar="SECONDS", type=seconds, help="how often (default: 60)")
    add("--resume", action="store_true", help="go on from the checkpoint")
    add("--certificate", metavar="FILE", help="write what proves the verdicts to llfsm-check-certificate")
    add("--check-certificate", metavar="FILE", help="check a certificate, and that it is one of these files")
    add("--save-invariants", metavar="FILE", help="write the invariants that --engine pdr or induction has found")
    add("--check-invariants", metavar="FILE", help="check that the invariants of a file prove the properties")
    all_steps(parser)
    add("-q", "--quiet", action="store_true", help="print the verdicts alone")
    add("--watch", action="store_true", help="check again whenever one of the files is saved, until Ctrl-C")
    colour(parser)


def _report_arguments(parser: ArgumentParser) -> None:
    parser.description = (
        "Check an arrangement as `llfsm verify --strict` does, and write a page of it for a safety case (Markdown)."
    )
    parser.epilog = EXIT_CODES
    add = parser.add_argument
    add("arrangement", metavar="ARRANGEMENT", help="the arrangement's file; - reads standard input")
    add("properties", metavar="PROPERTIES", nargs="*", default=[], help="property files; - reads standard input")
    add("-p", "--property", metavar="TEXT", action="append", default=[], help="one line of a property file; repeatable")
    add("--assurance", action="store_true", help="claims, hashes, assumptions, and what is open")
    add("--syntax", choices=SYNTAXES, default="llfsm", help="how formulas are written (default: %(default)s)")
    engine(parser)
    add("--memory", metavar="SIZE", type=size, help="end the search when it needs more memory, such as 500M or 2G")
    add("--timeout", metavar="SECONDS", type=seconds, help="end the search after so many seconds")
    add("--certificate", metavar="FILE", help="write what proves the verdicts, and name it on the page")
    add("-o", "--output", metavar="FILE", help="the file to write (default: standard output)")


def _replay_arguments(parser: ArgumentParser) -> None:
    parser.description = (
        "Run saved traces again and say whether what they show still happens; perform recordings of `llfsm run` again "
        "and compare each frame, bit for bit."
    )
    parser.epilog = (
        "exit codes: 0 it still happens (or, with `expect: holds`, does not), 1 otherwise, 3 the trace no longer fits"
    )
    add = parser.add_argument
    add("traces", metavar="TRACE", nargs="+", help="files that --save-traces or `llfsm run --record` wrote")
    add("--arrangement", metavar="FILE", help="use this arrangement instead of the one that the trace names")
    add("-q", "--quiet", action="store_true", help="do not print the table of steps")
    colour(parser)


def _draw_arguments(parser: ArgumentParser) -> None:
    parser.description = "Draw the arrangement (machines, whiteboard, schedule) or one of its machines."
    add = parser.add_argument
    add("arrangement", metavar="ARRANGEMENT", help="the arrangement's file; - reads standard input")
    add("--machine", metavar="M", help="draw the states of this machine instance")
    add("--format", choices=DRAWINGS, help="default: what the name of FILE ends in, else dot")
    add("-o", "--output", metavar="FILE", help="write there instead of to standard output")


def _property_arguments(parser: ArgumentParser) -> None:
    parser.description = "Questions about formulas over free atoms, without an arrangement, answered line by line."
    parser.epilog = (
        "INPUT is a formula, a file with one a line, or - for standard input. exit codes: 0, or 1 when an equivalence "
        "or implication is false, 3 when a line is wrong (the others are answered), 4 when a limit was reached"
    )
    questions = parser.add_subparsers(dest="question", required=True, metavar="QUESTION")
    for name, text in PROPERTY_QUESTIONS.items():
        question = questions.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")
        add = question.add_argument
        pairs = {"accepts": "FORMULA WORD", "equivalent": "FORMULA FORMULA", "implies": "FORMULA FORMULA"}
        of_pairs = f"; or {pairs[name]}; in files a tab stands between the two" if name in pairs else ""
        add("input", metavar="INPUT", nargs="+", help=f"a formula, a file with one a line, or -{of_pairs}")
        add("--syntax", choices=SYNTAXES, default="llfsm", help="how formulas are written (default: %(default)s)")
        if name in ("simplify", "print"):
            add("--to", choices=SYNTAXES, help="how to print them (default: as they are written)")
        if name in ("translate", "draw"):
            add(
                "--buchi", action="store_true", help="a Büchi automaton, whose states accept, and not a generalised one"
            )
        if name == "translate":
            add("--stats", action="store_true", help="states, transitions, acceptance sets, deterministic or not")
        if name == "draw":
            add("--format", choices=DRAWINGS, help="default: what the name of FILE ends in, else dot")
            add("-o", "--output", metavar="FILE", help="write there instead of to standard output")
        add("--timeout", metavar="SECONDS", type=seconds, help="what is not answered after so many seconds is unknown")


def _monitor_arguments(parser: ArgumentParser) -> None:
    parser.description = (
        "Say whether properties can be decided at run time, or write a property's monitor: the minimal automaton that "
        "tells after every word whether all, no or some continuations satisfy the property."
    )
    parser.epilog = (
        "exit codes: 0 all are monitorable, at least in part, 1 some are not, 2 wrong usage, 3 input files wrong or "
        "unreadable, or what a machine cannot do, 4 a limit was reached, 70 internal error, 130 interrupted"
    )
    add = parser.add_argument
    add(
        "properties",
        metavar="PROPERTY",
        nargs="*",
        default=[],
        help="a formula, a line of a property file (`enforce` and `forbid` without a name too), a property file, or -",
    )
    add(
        "--from-machine",
        metavar="MACHINE",
        help="write the rules that follow from the text of this machine of the --arrangement, as a property file",
    )
    add(
        "--as",
        dest="shape",
        choices=MONITORS,
        default="text",
        help="a sentence or two, a machine file, a JSON table, a drawing (default: %(default)s)",
    )
    add("--only", metavar="NAME", help="this property of those given")
    add("--syntax", choices=SYNTAXES, default="llfsm", help="how formulas are written (default: %(default)s)")
    add("--arrangement", metavar="FILE", help="the arrangement: types for a machine, and what it can miss")
    add(
        "--set",
        metavar="VARIABLE",
        action="append",
        default=[],
        help="with --as machine: a whiteboard variable that becomes true on a violation; may be repeated",
    )
    add(
        "--suspend",
        metavar="MACHINE",
        action="append",
        default=[],
        help="with --as machine: a machine to suspend on a violation; may be repeated",
    )
    add("-o", "--output", metavar="FILE", help="write there instead of to standard output")


def _kripke_arguments(parser: ArgumentParser) -> None:
    parser.description = (
        "Write the Kripke structure of an arrangement (json, dot, graphml, aut, npz), or a model of it for "
        "another checker (smv: NuSMV and nuXmv, promela: SPIN). The atoms of the properties are what letters show."
    )
    parser.epilog = (
        "exit codes: 0 written, 2 wrong usage, 3 input files wrong or unreadable, "
        "4 a limit ended the exploration, 70 internal error, 130 interrupted"
    )
    add = parser.add_argument
    add("arrangement", metavar="ARRANGEMENT", help="the arrangement's file; - reads standard input")
    add("properties", metavar="PROPERTIES", nargs="*", default=[], help="property files; - reads standard input")
    add("-p", "--property", metavar="TEXT", action="append", default=[], help="one line of a property file; repeatable")
    add("--syntax", choices=SYNTAXES, default="llfsm", help="how formulas are written (default: %(default)s)")
    add("--format", choices=(*STRUCTURES, *MODELS), help="default: what the name of FILE ends in, else json")
    add("-o", "--output", metavar="FILE", help="write there instead of to standard output")
    add("--max-states", metavar="N", type=positive, help="end the exploration after N configurations")
    add("--memory", metavar="SIZE", type=size, help="end it when it needs more memory, such as 500M or 2G")
    add("--timeout", metavar="SECONDS", type=seconds, help="end it after so many seconds")
    add("--keep-all-bits", action="store_true", help="keep entered flags that cannot matter any more")
    add("--partial", action="store_true", help="write what a limit has cut short, marked as such")
    add("--large", action="store_true", help="draw more than 300 configurations")


def _schema_arguments(parser: ArgumentParser) -> None:
    parser.description = "Print the JSON Schema (draft 2020-12) of a file format."
    parser.add_argument("name", metavar="SCHEMA", choices=SCHEMAS, help=", ".join(SCHEMAS))


def _check_arguments(parser: ArgumentParser) -> None:
    parser.description = (
        "Check every arrangement that a file belongs to, with the properties beside it: X.ltl of X.yaml, and "
        "properties.ltl of arrangement.yaml. This is what the hook for pre-commit calls."
    )
    parser.epilog = EXIT_CODES
    add = parser.add_argument
    add("paths", metavar="PATH", nargs="*", default=["."], help="files, and folders with all below (default: here)")
    add("-q", "--quiet", action="store_true", help="print only what fails")
    colour(parser)


def _init_arguments(parser: ArgumentParser) -> None:
    parser.description = (
        "Write a small arrangement with its properties and tests, all of which pass; overwrites nothing."
    )
    add = parser.add_argument
    add("directory", metavar="DIR", nargs="?", default=".", help="where (default: here); made when it is not there")
    add("--name", metavar="NAME", help="the name of the arrangement (default: that of the folder)")
