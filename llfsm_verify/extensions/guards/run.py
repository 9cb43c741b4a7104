"""`llfsm guard`: an arrangement between whose machines and outputs a monitor and a switch stand, and its proof."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.guards.codes import NOT_GUARDABLE, UNWRITABLE
from llfsm_verify.extensions.guards.guardable import Guardable, Refusal, guardable, unfit, unfit_assumptions
from llfsm_verify.extensions.guards.reactions import KINDS, Reaction, reaction
from llfsm_verify.extensions.guards.transform import Guarded, Task, guard
from llfsm_verify.extensions.guards.wanted import Wanted, refuse_unknown
from llfsm_verify.plug import (
    FEATURES,
    Draft,
    EarlyVerdicts,
    Fragment,
    Output,
    Property,
    PropertySet,
    Source,
    UsageError,
    asked_properties,
    assignments,
    bind,
    chosen,
    counted,
    limits_of,
    open_draft,
    read_regular,
    read_source,
    tell,
    told,
    write_whole,
)

if TYPE_CHECKING:
    from llfsm_verify.plug import Budget, PropertyResult

NOT_ALL, UNKNOWN = 1, 4
FOLDER = "guarded"
"""Where the files would be, in diagnostics, when they are not written."""


def run(options: Namespace) -> int:
    """Returns 0 when the guard is proved to keep its properties (or nothing is to be proved), 1 when it does not, 4
    when that is not known; with --list 1 when some cannot be guarded or assumed. Raises DiagnosticError for wrong
    files, and for what cannot be guarded."""
    _refuse_misuse(options)
    fallbacks, reactions = _fallbacks(options), _reactions(options)
    draft, arrangement = open_draft(options.arrangement)
    properties = chosen(asked_properties(options, FEATURES), options.only)
    if not properties.goals:
        raise UsageError("name what to keep: -p or --properties")
    clock = bind(arrangement, properties).clock
    problems = () if options.outside else tuple(unfit_assumptions(properties.assumptions, arrangement))
    if problems and not options.list:
        raise DiagnosticError(unfit(*problem) for problem in problems)
    found = [guardable(p, arrangement, clock, own_monitor=options.own is not None) for p in properties.goals]
    if options.list:
        told(properties, arrangement)
        Output().plain("".join(_listed(found, problems)))
        return NOT_ALL if problems or any(each.refusal for each in found) else 0
    task = Task(properties.goals, properties.assumptions, None, clock)
    if options.outside:
        from llfsm_verify.extensions.guards.lateness import outside

        return outside(options, draft, arrangement, task, _write, FOLDER)
    wanted = _wanted(options, fallbacks, reactions)
    refuse_unknown(arrangement, wanted)
    _refuse(found, fallbacks, own=options.own is not None)
    own = None if options.own is None else (options.own, read_source(options.own)[0].text)
    told(properties, arrangement)
    return _guarded(options, draft, wanted, replace(task, own=own), properties)


def _refuse_misuse(options: Namespace) -> None:
    """UsageError: options that do not go together."""
    if options.hold and options.until:
        raise UsageError("--for and --until both say when the requested value counts again: give one")
    if options.own is not None and (options.hold or options.until):
        raise UsageError("with --monitor the monitor itself resets its alarm: leave out --for and --until")
    if options.no_proof and options.output is None and not options.list:
        raise UsageError("--no-proof writes files: say where with -o FOLDER")
    if options.output == "":
        raise UsageError("-o needs the name of a folder")


def _fallbacks(options: Namespace) -> dict[str, str]:
    """By output; UsageError."""
    instead = "give one value, which may be an expression such as a ? 1 : 2"
    fallbacks = assignments("--fallback", options.fallback, "OUTPUT=VALUE", instead)
    if not all(fallbacks.values()):
        raise UsageError("--fallback needs OUTPUT=VALUE: the value is missing")
    return fallbacks


def _reactions(options: Namespace) -> tuple[Reaction, ...]:
    """UsageError: one is not a command and a machine."""
    try:
        return tuple(map(reaction, options.react))
    except ValueError:
        words = ", ".join(KINDS)
        what = "--react needs a command and a machine, such as 'suspend M'"
        raise UsageError(f"{what}; the commands are {words}") from None


def _wanted(options: Namespace, fallbacks: Mapping[str, str], reactions: tuple[Reaction, ...]) -> Wanted:
    """UsageError: options of a guard outside are given, or nothing says what replaces a requested value."""
    if options.every or options.looks:
        raise UsageError("--every and --looks are for a guard outside: give its commands with --outside")
    if not fallbacks and not (reactions and options.own is not None):
        raise UsageError("--fallback OUTPUT=VALUE is missing: it says what replaces the requested value")
    until = options.hold or options.until
    return Wanted(
        {output: _expression(f"--fallback {output}", text) for output, text in fallbacks.items()},
        tuple(dict.fromkeys(options.guard)),
        None if until is None else _expression("--until", until),
        reactions,
    )


def _expression(option: str, text: str) -> Fragment:
    return Fragment.whole(Source(option, text))


def _guarded(options: Namespace, draft: Draft, wanted: Wanted, task: Task, properties: PropertySet) -> int:
    try:
        made = guard(draft, wanted, task, Path(options.output or FOLDER))
    except DiagnosticError as error:
        known = {source.name for source in draft.sources}
        raise DiagnosticError(_as_given(d, known, wanted) for d in error.diagnostics) from None
    if options.output is not None:
        _write(made.files, Path(options.output))
    names = made.names
    monitors = " and ".join(f"`{name}`" for name in names.monitors)
    guarded = ", ".join(f"`{name}`" for name in names.guarded)
    tell(f"guarded: {guarded}, by {monitors} and `{names.switch}`")
    for each in wanted.reactions:
        if each.machine not in names.rights.commanded:
            tell(f"note: others also command `{each.machine}`, so they can undo what the switch does to it")
    return 0 if options.no_proof else _prove(options, made, properties)


def _as_given(found: Diagnostic, known: Collection[str], wanted: Wanted) -> Diagnostic:
    """The same at its place in the command, where it is about a file that would have been written from that."""
    expressions = [*wanted.fallbacks.values(), *([] if wanted.until is None else [wanted.until])]
    if found.span is None or found.span.source.name in known or not found.span.text:
        return found
    for given in expressions:
        start = given.text.find(found.span.text)
        if start >= 0:
            return replace(found, span=given.span(start, start + len(found.span.text)))
    return found


def _prove(options: Namespace, made: Guarded, properties: PropertySet) -> int:
    from llfsm_verify.extensions.guards.proof import prove
    from llfsm_verify.plug import REPORTS, Budget, Options, Style

    limits = limits_of(options)
    budget = Budget(limits)
    with EarlyVerdicts(p.name for p in properties.goals) as early:
        wanted = Options(limits, decided=None if options.quiet else early.add, tell=tell)
        proof = prove(made, properties, wanted, options.engine, budget)
    if proof.result is None or proof.arrangement is None:
        tell(f"unknown: {'; '.join(proof.reasons)}")
        return UNKNOWN
    output = Output(options.color, options.width)
    if proof.exit_code == 0:
        output.plain("".join(_proved(proof.result.properties)))
        output.plain(f"\nwhatever these machines do: {', '.join(proof.machines)}\n")
        output.plain(_transparent(made, budget))
        return 0
    output.write(REPORTS.result.load("text")(proof.result, proof.arrangement, Style(quiet=options.quiet)))
    for reason in proof.reasons:
        output.plain(f"{reason}.\n")
    return proof.exit_code


def _proved(found: Sequence[PropertyResult]) -> list[str]:
    from llfsm_verify.plug import asked_text, name_cell

    width = max(len(name_cell(p.name)) for p in found)
    return [f"proved  {name_cell(p.name):<{width}}  {asked_text(p.kind, p.text)}\n" for p in found]


def _transparent(made: Guarded, budget: Budget) -> str:
    """What is known of the guard before its alarm."""
    from llfsm_verify.extensions.guards.transparency import Different, Transparent, transparency

    same = "outputs, variables and states are those of the original"
    answer = transparency(made.original, made.arrangement, made.names, budget)
    match answer:
        case Transparent(configurations):
            return f"proved: until `{made.names.alarm}` is set, {same} ({counted(configurations, 'configuration')})\n"
        case Different(steps, found, fault):
            differ = f"They differ after {counted(len(steps), 'step')}:"
            lines = [f"not proved: until `{made.names.alarm}` is set, {same}. {differ}"]
            lines += [f"  `{name}` is {new}, and was {old}" for name, old, new in found]
            lines += [f"  the guard ends the run in a fault: {fault}"] if fault else []
            inputs = [
                (n, s.machine, [f"{i.input or i.choice} = {i.text}" for i in s.sampled]) for n, s in enumerate(steps, 1)
            ]
            lines += [f"  step {n}, {machine}: {', '.join(given)}" for n, machine, given in inputs if given]
            return "\n".join(lines) + "\n"
    return f"not proved: until `{made.names.alarm}` is set, {same}: {answer.reason}\n"


def _listed(found: Sequence[Guardable], problems: Sequence[tuple[Property, Refusal]] = ()) -> list[str]:
    """A line for each property, and for each place at which an assumption cannot be made."""
    from llfsm_verify.plug import name_cell

    rows = [
        ("guardable", each.line, f"by routing {', '.join(each.outputs)}")
        if each.refusal is None
        else ("not guardable", each.line, each.refusal.reason)
        for each in found
    ]
    rows += [("not assumable", line, refusal.reason) for line, refusal in problems]
    width = max(len(name_cell(line.name)) for _, line, _ in rows)
    return [f"{verdict:<13}  {name_cell(line.name):<{width}}  {why}\n" for verdict, line, why in rows]


def _refuse(found: list[Guardable], routed: Mapping[str, str], *, own: bool) -> None:
    """DiagnosticError (E437): a property cannot be guarded, or not by routing these outputs."""
    problems = [each.refusal.diagnostic(each.line.name) for each in found if each.refusal is not None]
    for each in found:
        if each.refusal is None and not own and not set(each.outputs) & set(routed):
            outputs = " or ".join(f"--fallback {name}=…" for name in each.outputs)
            message = f"`{each.line.name}` speaks of no output that is routed"
            problems.append(Diagnostic(NOT_GUARDABLE, message, each.line.span, hint=f"add {outputs}"))
    if problems:
        raise DiagnosticError(problems)


def _write(files: Mapping[str, str], folder: Path) -> None:
    """DiagnosticError (E440): one of the files is there with another text, or cannot be written. Then none is."""
    for name, text in files.items():
        path = folder / name
        if (path.exists() or path.is_symlink()) and not _has(path, text):
            hint = "name another folder, or move the file away"
            message = f"this would overwrite {name}"
            raise DiagnosticError(Diagnostic(UNWRITABLE, message, hint=hint, file=str(folder)))
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        message = f"no files can be written there: {error.strerror or 'input/output error'}"
        raise DiagnosticError(Diagnostic(UNWRITABLE, message, hint="name another folder", file=str(folder))) from None
    for name, text in files.items():
        write_whole(text, str(folder / name), UNWRITABLE, "the guarded arrangement")


def _has(path: Path, text: str) -> bool:
    """Whether a file is there with this text."""
    data = text.encode()
    try:
        return read_regular(path, len(data) + 1) == data
    except OSError:
        return False
