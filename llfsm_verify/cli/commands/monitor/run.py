"""`llfsm monitor`: whether properties can be decided at run time, and their monitors as machines, tables, drawings."""

from __future__ import annotations

import re
from argparse import Namespace
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, cast

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.cli.commands.monitor.arguments import LOOPBACK
from llfsm_verify.cli.formulas import source_of
from llfsm_verify.cli.io.files import ready, ready_beside, write_whole
from llfsm_verify.cli.io.output import tell
from llfsm_verify.cli.opening import COMMAND_LINE, chosen, open_arrangement, told
from llfsm_verify.cli.parser import UsageError
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment, Source, Span
from llfsm_verify.logic import codes
from llfsm_verify.logic.bounds import Clock
from llfsm_verify.logic.formula import TIMED, operators
from llfsm_verify.logic.lines import Kind, has_header
from llfsm_verify.logic.parsing.definitions import is_definition
from llfsm_verify.logic.parsing.regular import parse_regular
from llfsm_verify.logic.parsing.tokens import BINARY, tokenise
from llfsm_verify.logic.parsing.words import Words
from llfsm_verify.logic.properties import FEATURES, Property, PropertySet, parse_properties
from llfsm_verify.monitoring.codes import UNWRITABLE
from llfsm_verify.monitoring.properties import Monitored, Timing, monitor_properties
from llfsm_verify.monitoring.states import Monitorability
from llfsm_verify.report.formats import REPORTS

if TYPE_CHECKING:
    from llfsm_verify.arrangement.model import Arrangement

NOT_MONITORABLE, UNKNOWN = 1, 4


def run(options: Namespace) -> int:
    """Returns 1 when a property is not monitorable, else 4 when a limit left one unknown, else 0; raises
    DiagnosticError for wrong properties and files, and where a machine or table cannot be made (E430 to E436)."""
    if options.from_machine is not None:
        return _from_machine(options)
    _refuse_misuse(options)
    if options.serve is not None:
        return _serve(options)
    arrangement = None if options.arrangement is None else open_arrangement(options.arrangement)
    lines = _lines(options)
    goals = _goals(options, lines, arrangement)
    if arrangement is not None:
        ready(arrangement, lines, options.output, (UNWRITABLE, UNWRITABLE), "the monitor")
    ready_beside(options.properties, options.output, UNWRITABLE, "the monitor")
    # A machine has one turn a cycle: time passes between any two of its letters.
    timing = Timing(_clock(arrangement, lines), options.shape == "machine")
    made: list[Monitored] = []
    unknown = False
    for line in goals:
        try:
            made.append(monitor_properties(line, lines.assumptions, timing))
        except AutomatonTooLarge as limit:
            tell(Diagnostic(codes.LIMIT, f"unknown: {limit}", line.span))
            unknown = True
    text, code = _text(options, made, lines, arrangement, timing.clock)
    if text:
        write_whole(text, options.output, UNWRITABLE, "the monitor")
    return code or (UNKNOWN if unknown else 0)


def _refuse_misuse(options: Namespace) -> None:
    """UsageError: options that do not go together."""
    if not options.properties:
        raise UsageError("PROPERTY is missing, or --from-machine MACHINE (`llfsm monitor --help` says more)")
    if options.shape != "machine" and (options.set or options.suspend):
        raise UsageError("--set and --suspend say what a machine does: they need --as machine")
    _refuse_misuse_of_serve(options)


def _refuse_misuse_of_serve(options: Namespace) -> None:
    """UsageError: options that do not go together."""
    if options.serve is None and (options.mapping is not None or options.filter or options.host != LOOPBACK):
        raise UsageError("--mapping, --host and --filter say how to serve: they need --serve PORT")
    if options.serve is not None and not (0 <= options.serve < 1 << 16 and options.arrangement and options.mapping):
        raise UsageError("--serve needs a port up to 65535 (0: a free one), --arrangement FILE and --mapping FILE")
    if options.serve is not None and (options.shape != "text" or options.output is not None):
        raise UsageError("--serve answers messages, and writes no monitor: leave out --as and --output")


def _serve(options: Namespace) -> int:
    """0 when a signal ended it. DiagnosticError: wrong files, or it cannot listen there."""
    from llfsm_verify.runtime.deciding.logs import ORACLES, READINGS

    arrangement = open_arrangement(options.arrangement)
    lines = chosen(_lines(options), options.only)
    told(lines, arrangement, stamped=True)
    if not lines.goals:
        raise UsageError("there is no property")
    reading = READINGS.load("mapping")(arrangement, lines, options.mapping, "a message")
    ORACLES.load(options.oracle)(
        reading, options.host, options.serve, filtering=options.filter, tell=lambda line: print(line, flush=True)
    )
    return 0


def _goals(options: Namespace, lines: PropertySet, arrangement: Arrangement | None) -> Sequence[Property]:
    """The properties that are monitored. UsageError: no property is left, or too many are."""
    if arrangement is not None:
        from llfsm_verify.checking.problem import refuse_hiding

        refuse_hiding(arrangement, lines)
    goals = told(chosen(lines, options.only), arrangement).goals
    if not goals:
        raise UsageError("there is no property")
    if options.shape != "text" and len(goals) > 1:
        names = " or ".join(p.name for p in goals)
        raise UsageError(f"a {options.shape} is of one property: choose with --only {names}")
    return goals


def _from_machine(options: Namespace) -> int:
    """The rules of a machine, as a property file."""
    from llfsm_verify.monitoring.rules import rules_of

    if options.properties or options.shape != "text" or options.only or options.set or options.suspend:
        raise UsageError("--from-machine writes properties: give them to another `llfsm monitor`, or to `llfsm verify`")
    arrangement = None if options.arrangement is None else open_arrangement(options.arrangement)
    if arrangement is None:
        raise UsageError("--from-machine needs --arrangement FILE, which says what its parameters are")
    try:
        rules = rules_of(arrangement, options.from_machine)
    except KeyError:
        names = ", ".join(machine.name for machine in arrangement.texts)
        raise UsageError(f"there is no machine `{options.from_machine[:60]}`, but {names}") from None
    ready(arrangement, None, options.output, (UNWRITABLE, UNWRITABLE), "the properties")
    write_whole("".join(f"{rule.line}\n" for rule in rules), options.output, UNWRITABLE, "the properties")
    return 0


def _text(
    options: Namespace, made: list[Monitored], lines: PropertySet, arrangement: Arrangement | None, clock: Clock | None
) -> tuple[str, int]:
    """What is written, and 1 when a property cannot be monitored."""
    from llfsm_verify.monitoring.machine import Action, not_monitorable
    from llfsm_verify.report.monitor import Monitors

    if arrangement is not None and made and options.shape != "machine":  # which refuses it
        _warn_of_surroundings(arrangement, PropertySet((*lines.assumptions, *(found.line for found in made))))
    never = any(found.monitor.monitorability is Monitorability.NEVER for found in made)
    shape = options.shape if made else "text"
    if shape != "text" and never:
        tell(not_monitorable(made[0]))
        return "", NOT_MONITORABLE
    action = Action(tuple(dict.fromkeys(options.set)), tuple(dict.fromkeys(options.suspend)))
    monitors = Monitors(made, lines, arrangement, clock, action)
    try:
        text = REPORTS.monitor.load(shape)(monitors, tell)
    except AutomatonTooLarge as limit:
        tell(Diagnostic(codes.LIMIT, f"unknown: {limit}", made[0].line.span))
        return "", UNKNOWN
    return text, NOT_MONITORABLE if never else 0


def _warn_of_surroundings(arrangement: Arrangement, asked: PropertySet) -> None:
    from llfsm_verify.monitoring.machine_reads import surroundings_in

    warning = surroundings_in(asked.atoms, arrangement)
    if warning is not None:
        tell(warning)


def _clock(arrangement: Arrangement | None, lines: PropertySet) -> Clock | None:
    """The clock of bounds in time. DiagnosticError: there are some and no arrangement (E335), or the properties do not
    fit the arrangement."""
    if arrangement is not None:
        from llfsm_verify.checking.problem import bind

        return bind(arrangement, lines).clock
    timed = [line for line in lines if line.formula is not None and operators(line.formula) & TIMED]
    if timed:
        message, hint = "a bound in time needs to know how long a cycle takes", "give --arrangement FILE"
        raise DiagnosticError(Diagnostic(codes.UNTRANSLATED, message, line.span, hint=hint) for line in timed)
    return None


# ---------------------------------------------------------------- properties


def _lines(options: Namespace) -> PropertySet:
    """The lines of all arguments, with unique names: formulas on the command line are called P1, P2 and so on."""
    found: list[Property] = []
    mistakes: list[Diagnostic] = []
    direct = 0
    sources = [source_of(argument) for argument in options.properties]
    defined = [s.text for s in sources if s.name == COMMAND_LINE and is_definition(s.text.lstrip(), 0)]
    definitions: dict[str, Span] = {}
    for source in sources:
        try:
            if source.name != COMMAND_LINE:
                read = parse_properties([source], options.syntax, FEATURES)
                found += read
                definitions |= read.definitions
            elif source.text not in defined:
                direct += 1
                found += _direct(source, f"P{direct}", options.syntax, defined, definitions)
        except DiagnosticError as error:
            mistakes += error.diagnostics
    names: dict[str, Property] = {}
    for line in found:
        if line.name in names:
            notes = (f"the other one is at {names[line.name].span}",)
            message = f"there are two properties `{line.name}`"
            mistakes.append(Diagnostic(codes.DUPLICATE_NAME, message, line.span, notes))
        names[line.name] = line
    if mistakes:
        raise DiagnosticError(mistakes)
    return PropertySet(tuple(found), definitions)


_REGULAR = re.compile(r"(enforce|forbid(?:[ \t]+initially)?)\b")


def _direct(source: Source, name: str, syntax: str, defined: list[str], definitions: dict[str, Span]) -> list[Property]:
    """An argument that is no file: lines of a property file, or an `enforce` or `forbid` line without a name.

    `defined` are the arguments that are definitions; the places of their names are added to `definitions`."""
    text = Fragment.whole(source)
    tokens = [token for token in tokenise(source.text) if token.type != "NEWLINE"]
    start = tokens[0].start if tokens else 0
    match = None if has_header(source.text, start) else _REGULAR.match(source.text, start)
    body = [token for token in tokens if match is not None and token.start >= match.end()]
    if match is None or (body and body[0].type in BINARY):  # an atom may be called so
        given = Source(COMMAND_LINE, "\n".join([*defined, source.text])) if defined else source
        lines = parse_properties([given], syntax, FEATURES)
        definitions |= lines.definitions
        return [replace(line, name=name) if line.name == f"L{line.span.line}" else line for line in lines]
    kind = " ".join(match[1].split())
    if not body:
        raise DiagnosticError(
            Diagnostic(codes.EMPTY, f"there is no expression after `{kind}`", text.span(*match.span(1)))
        )
    words = Words(text, body)
    parsed = parse_regular(words)
    last = len(body) - 1
    place = words.span(0, last)
    return [Property(name, cast(Kind, kind), words.text(0, last), place, None, parsed.atoms, expression=parsed.formula)]
