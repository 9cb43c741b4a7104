"""What can be written on the command line: the commands, and the arguments of those that are no family."""

from __future__ import annotations

from argparse import ArgumentParser
from collections.abc import Callable, Iterable, Sequence

from llfsm_verify.cli.argument_types import MONITORS, PROPERTY_QUESTIONS, SHELLS, seconds
from llfsm_verify.cli.asking import lint_arguments, query_arguments
from llfsm_verify.cli.common_arguments import (
    arrangement,
    colour,
    max_states,
    memory_and_timeout,
    only,
    other_arrangement,
    output,
    property_files,
    property_lines,
    repeatable,
    syntax,
)
from llfsm_verify.cli.guarding import guard_arguments
from llfsm_verify.cli.parser import Parser
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
from llfsm_verify.cli.verifying import report_arguments, verify_arguments
from llfsm_verify.exports.formats import MODELS
from llfsm_verify.kripke.export.formats import STRUCTURES
from llfsm_verify.logic.syntax_names import SYNTAXES
from llfsm_verify.report.drawing.formats import DRAWINGS, PICTURES
from llfsm_verify.report.schema import SCHEMAS


def llfsm_parser(words: Sequence[str] | None = None) -> Parser:
    """The parser of `llfsm`; the result has the name of the command in `command`.

    `words`: those on the command line, if no others will be parsed; only commands among them get their arguments.
    """
    parser = Parser("llfsm")
    parser.about(
        "Verify, run and draw arrangements of logic-labelled finite-state machines.",
        "llfsm init crossing\nllfsm verify crossing/arrangement.yaml crossing/properties.ltl",
        "Documentation: README.md and docs/ of the project; `llfsm COMMAND --help` lists the options of a command, its "
        "exit codes and an example.",
    )
    _version(parser)
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, arguments, text in _commands():
        command = commands.add_parser(name, help=text)
        if words is None or name in words:
            arguments(command)
    return parser


def _commands() -> Iterable[tuple[str, Callable[[Parser], None], str]]:
    """Each command: its name, what adds its arguments, and its line in the help of `llfsm`."""
    return (
        ("verify", verify_arguments, "check properties"),
        ("simulate", simulate_arguments, "run an arrangement and show each step"),
        ("run", run_arguments, "run an arrangement in real time, or as fast as possible"),
        ("replay", _replay_arguments, "run saved traces and recordings again"),
        ("debug", debug_arguments, "walk a run forwards and backwards, and see why transitions fire"),
        ("whiteboard", whiteboard_arguments, "read and post on the whiteboards of running arrangements"),
        ("send", send_arguments, "give a command to a running arrangement"),
        ("report", report_arguments, "write a page for a safety case"),
        ("access", access_arguments, "list what machines and users may do, and what they do"),
        ("audit", audit_arguments, "tell whether an audit log was changed"),
        ("trace", trace_arguments, "write a recording or a saved trace as CSV, VCD, SVG, MCAP or ITF"),
        ("check-recording", recording_arguments, "decide properties on a recording"),
        ("draw", _draw_arguments, "draw a machine or the arrangement"),
        ("property", _property_arguments, "ask about formulas over free atoms"),
        ("monitor", _monitor_arguments, "say what can be decided at run time, and write monitors"),
        ("guard", guard_arguments, "put a monitor and a switch before outputs, and prove what they keep"),
        ("kripke", _kripke_arguments, "write the Kripke structure, or a model for another checker"),
        ("check", _check_arguments, "check the arrangements that changed files belong to"),
        ("lint", lint_arguments, "find mistakes that no property asks about, by proof"),
        ("query", query_arguments, "find a run that reaches something, or prove that none does"),
        ("init", _init_arguments, "write a small arrangement with properties and tests"),
        ("schema", _schema_arguments, "print a JSON Schema"),
        ("explain", _explain_arguments, "say what a diagnostic means, with an example"),
        ("completion", _completion_arguments, "print what makes a shell complete commands"),
    )


def verify_parser() -> Parser:
    """The parser of `llfsm-verify`."""
    parser = Parser("llfsm-verify")
    _version(parser)
    verify_arguments(parser)
    parser.set_defaults(command="verify")
    return parser


def _version(parser: ArgumentParser) -> None:
    from llfsm_verify.cli.version import Version

    parser.add_argument("--version", action=Version)


def _replay_arguments(parser: Parser) -> None:
    parser.about(
        "Run saved traces again and say whether what they show still happens; perform recordings of `llfsm run` again "
        "and compare each frame, bit for bit.",
        "llfsm replay traces/never_both.trace.yaml --arrangement mended.yaml",
        "exit codes: 0 it still happens (or, with `expect: holds`, does not), 1 otherwise, 2 wrong usage, 3 the trace "
        "no longer fits",
    )
    add = parser.add_argument
    add("traces", metavar="TRACE", nargs="+", help="files that --save-traces or `llfsm run --record` wrote")
    other_arrangement(parser, "the trace names")
    add("-q", "--quiet", action="store_true", help="do not print the table of steps")
    colour(parser)


def _draw_arguments(parser: Parser) -> None:
    parser.about(
        "Draw the arrangement (machines, whiteboard, schedule), one of its machines, or a saved trace on its machines.",
        "llfsm draw arrangement.yaml --machine north -o north.svg",
        "exit codes: 0 drawn, 2 wrong usage, 3 input files wrong or unreadable, the trace does not fit, or the drawing "
        "cannot be written",
    )
    add = parser.add_argument
    arrangement(parser)
    add("--machine", metavar="M", help="draw the states of this machine instance")
    add("--trace", metavar="FILE", help="mark on the machine, or on all, where this saved trace goes and how it ends")
    add("--format", choices=DRAWINGS, help="default: by the ending of FILE, else dot")
    output(parser)


def _property_arguments(parser: Parser) -> None:
    codes = (
        "exit codes: 0, or 1 when an equivalence or implication is false, 2 wrong usage, 3 when a line is wrong (the "
        "others are answered), 4 when a limit was reached"
    )
    parser.about(
        "Questions about formulas over free atoms, without an arrangement, answered line by line.",
        "llfsm property equivalent 'a U b' 'b || (a && X (a U b))'",
        f"INPUT is a formula, a file with one per line, a property file, or - for standard input.\n\n{codes}",
    )
    questions = parser.add_subparsers(dest="question", required=True, metavar="QUESTION")
    for name, text in PROPERTY_QUESTIONS.items():
        question = questions.add_parser(name, help=text)
        pairs = {"accepts": "FORMULA WORD", "equivalent": "FORMULA FORMULA", "implies": "FORMULA FORMULA"}
        second = {"accepts": " 'a&!b;cycle{b}'", "equivalent": " 'b || (a && X (a U b))'", "implies": " 'F b'"}
        question.about(text[0].upper() + text[1:] + ".", f"llfsm property {name} 'a U b'{second.get(name, '')}", codes)
        add = question.add_argument
        of_pairs = f"; or {pairs[name]}; in files a tab separates the two" if name in pairs else ""
        add(
            "input",
            metavar="INPUT",
            nargs="+",
            help=f"a formula, a file with one per line, a property file, or -{of_pairs}",
        )
        syntax(question)
        if name in ("simplify", "print"):
            add("--to", choices=SYNTAXES, help="how to print them (default: as they are written)")
        if name in ("translate", "draw"):
            add(
                "--buchi", action="store_true", help="a Büchi automaton, whose states accept, and not a generalised one"
            )
        if name == "translate":
            add("--stats", action="store_true", help="states, transitions, acceptance sets, deterministic or not")
        if name == "draw":
            add("--format", choices=DRAWINGS, help="default: by the ending of FILE, else dot")
            output(question)
        add(
            "--timeout", metavar="SECONDS", type=seconds, help="what is not answered after this many seconds is unknown"
        )


def _monitor_arguments(parser: Parser) -> None:
    parser.about(
        "Say whether properties can be decided at run time, or write a property's monitor: the minimal automaton that "
        "tells after every word whether all, no or some continuations satisfy the property.",
        "llfsm monitor 'G (car -> F[<=5] green)'\n"
        "llfsm monitor properties.ltl --only never_both --as machine --arrangement arrangement.yaml --set alarm",
        "exit codes: 0 all are monitorable, at least in part, 1 some are not, 2 wrong usage, 3 input files wrong or "
        "unreadable, or what a machine cannot do, 4 a limit was reached, 70 internal error, 130 interrupted",
    )
    add = parser.add_argument
    add(
        "properties",
        metavar="PROPERTY",
        nargs="*",
        default=[],
        help="a formula, a line of a property file (`enforce` and `forbid` also without a name), a property file, or -",
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
    only(parser)
    syntax(parser)
    add("--arrangement", metavar="FILE", help="the arrangement: the types for a machine, and what the machine can miss")
    repeatable(
        parser,
        "--set",
        metavar="VARIABLE",
        text="with --as machine: a whiteboard variable that becomes true on a violation",
    )
    repeatable(
        parser,
        "--suspend",
        metavar="MACHINE",
        text="with --as machine: a machine to suspend on a violation",
    )
    output(parser)


def _kripke_arguments(parser: Parser) -> None:
    parser.about(
        "Write the Kripke structure of an arrangement (json, dot, graphml, aut, npz), or a model of it for "
        "another checker (smv: NuSMV and nuXmv, promela: SPIN). The atoms of the properties are what letters show.",
        "llfsm kripke arrangement.yaml properties.ltl -o model.smv",
        "exit codes: 0 written, 2 wrong usage, 3 input files wrong or unreadable, "
        "4 a limit ended the exploration, 70 internal error, 130 interrupted",
    )
    add = parser.add_argument
    arrangement(parser)
    property_files(parser)
    property_lines(parser)
    add("--format", choices=(*STRUCTURES, *PICTURES, *MODELS), help="default: by the ending of FILE, else json")
    output(parser)
    max_states(parser, "end the exploration after N configurations")
    memory_and_timeout(parser, "end it")
    add("--keep-all-bits", action="store_true", help="keep entered flags that cannot matter any more")
    add("--partial", action="store_true", help="write what a limit has cut short, marked as such")
    add("--large", action="store_true", help="draw more than 300 configurations")


def _schema_arguments(parser: Parser) -> None:
    parser.about(
        "Print the JSON Schema (draft 2020-12) of a file format.",
        "llfsm schema arrangement",
        "exit codes: 0 printed, 2 wrong usage",
    )
    parser.add_argument("name", metavar="SCHEMA", choices=SCHEMAS, help=", ".join(SCHEMAS))


def _check_arguments(parser: Parser) -> None:
    parser.about(
        "Check every arrangement that a file belongs to, with the properties beside it: X.ltl of X.yaml, and "
        "properties.ltl of arrangement.yaml. This is what the hook for pre-commit calls.",
        "llfsm check models",
    )
    add = parser.add_argument
    add(
        "paths",
        metavar="PATH",
        nargs="*",
        default=["."],
        help="files, or folders and all that is below (default: this folder)",
    )
    add("-q", "--quiet", action="store_true", help="print only what fails")
    colour(parser)


def _init_arguments(parser: Parser) -> None:
    parser.about(
        "Write a small arrangement with its properties and tests, all of which pass; overwrites nothing.",
        "llfsm init crossing",
        "exit codes: 0 written, 2 wrong usage, 3 a file is there already, or cannot be written",
    )
    add = parser.add_argument
    add(
        "directory",
        metavar="DIR",
        nargs="?",
        default=".",
        help="the folder, made if it does not exist (default: this folder)",
    )
    add("--name", metavar="NAME", help="the name of the arrangement (default: that of the folder)")


def _explain_arguments(parser: Parser) -> None:
    parser.about(
        "Say what a diagnostic means, with an example and how to correct it.",
        "llfsm explain E110",
        "exit codes: 0 explained, 2 wrong usage, or there is no such code",
    )
    parser.add_argument(
        "code", metavar="CODE", nargs="*", help="such as E110 (default: list all codes with their meaning)"
    )


def _completion_arguments(parser: Parser) -> None:
    parser.about(
        "Print what makes a shell complete commands, options and files of `llfsm` and `llfsm-verify`.",
        "llfsm completion bash >> ~/.bashrc\nllfsm completion fish > ~/.config/fish/completions/llfsm.fish",
        "exit codes: 0 printed, 2 wrong usage",
    )
    parser.add_argument("shell", metavar="SHELL", choices=SHELLS, help=", ".join(SHELLS))
