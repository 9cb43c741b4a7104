"""`llfsm kripke`: the Kripke structure of an arrangement, or a model of the arrangement for another checker."""

from __future__ import annotations

import time
from argparse import Namespace
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, BinaryIO

from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.cli.io.ending import ending_raises
from llfsm_verify.cli.io.files import ready, write_whole
from llfsm_verify.cli.io.output import Output, tell
from llfsm_verify.cli.io.progress import StatusLine
from llfsm_verify.cli.opening import limits_of, open_arrangement, read_properties
from llfsm_verify.cli.parser import UsageError
from llfsm_verify.kripke.export.formats import MODELS, STRUCTURES
from llfsm_verify.limits import Budget, LimitReached
from llfsm_verify.logic.properties import PLAIN, Feature

if TYPE_CHECKING:
    from llfsm_verify.arrangement.model import Arrangement
    from llfsm_verify.kripke.structure import Structure


EXPLORING = ("max_states", "memory", "timeout", "partial", "large")
"""Options that say something about the exploration, or about what it found."""
SHOWN: frozenset[Feature] = frozenset({"regular", "automaton", "past", "expressions"})
"""Of these a structure shows the atoms; bounds in time would need the time of each step."""
DRAWN = ("dot", "svg", "png")
"""Formats that people look at, so a large structure needs `--large`."""
CUT_SHORT = 4
"""The exit code when a limit ended the exploration or the writing."""


def run(options: Namespace) -> int:
    """Returns 0, or 4 when a limit ended it; raises DiagnosticError for wrong files and where nothing can be written
    (E422, and what a model cannot hold)."""
    wanted = _format(options)
    if wanted is None:
        endings = ", ".join([*STRUCTURES.suffixes, *MODELS.suffixes])
        raise UsageError(f"no format ends like `{options.output}`: name it {endings}, or give --format")
    if wanted in STRUCTURES.binary and options.output in (None, "-"):
        raise UsageError(f"{wanted} is not a text format: name a file with -o")
    needless = [name for name in EXPLORING if getattr(options, name)] if wanted in MODELS else []
    if needless:
        named = " and ".join(f"--{name.replace('_', '-')}" for name in needless)
        raise UsageError(f"{named}: the format {wanted} is written without exploring; leave that out")
    arrangement = open_arrangement(options.arrangement)
    properties = read_properties(options, PLAIN if wanted in MODELS else SHOWN)
    ready(arrangement, properties, options.output, ("E422", "E422"), "the structure")
    problem = bind(arrangement, properties)
    if wanted in MODELS:
        write([_model(wanted, problem, options)], options.output)
        return 0
    return _structure(wanted, arrangement, problem, options)


def _format(options: Namespace) -> str | None:
    """The format asked for, or that the output's name ends in; None: it ends in nothing that we write."""
    chosen: str | None = options.format
    if chosen is None and options.output not in (None, "-"):
        return next(filter(None, (formats.named_by(options.output) for formats in (STRUCTURES, MODELS))), None)
    return chosen or "json"


# ---------------------------------------------------------------- models for other checkers


def _model(wanted: str, problem: Problem, options: Namespace) -> str:
    from llfsm_verify.kripke.export.specification import Specification
    from llfsm_verify.language.trees import of_kind
    from llfsm_verify.language.typed import Literal

    program = problem.program(keep_all_bits=options.keep_all_bits, forget=False)
    goals = tuple((p.name, p.formula) for p in problem.properties if p.formula is not None)
    assumptions = tuple((p.name, p.formula) for p in problem.assumptions if p.formula is not None)
    arrangement = problem.arrangement
    variables = [w.variable for w in arrangement.whiteboard]
    variables += [v for m in arrangement.texts for v in (*m.variables, *(v for s in m.states for v in s.variables))]
    declared = {v.name: v.span for v in variables}
    written = (tuple(m.states for m in arrangement.texts), tuple(a.expression for a in problem.atoms))
    numbers = {literal.value: literal.span for literal in of_kind(written, Literal)}
    return MODELS.load(wanted)(Specification(program, goals, assumptions, declared, numbers))


# ---------------------------------------------------------------- structures


def _structure(wanted: str, arrangement: Arrangement, problem: Problem, options: Namespace) -> int:
    from llfsm_verify.kripke.export.formats import READABLE

    budget = Budget(limits_of(options))
    try:
        structure = _explore(arrangement, problem, options, budget)
    except LimitReached as reached:
        return _cut_short(f"nothing was written: {reached}")
    for fault in structure.faults:
        note = f"note: {fault.place}: {fault.message} in a step from configuration {fault.configuration}, which it ends"
        tell(note)
    if not structure.complete and not options.partial:
        found = f"{len(structure):,} configurations have been found"
        return _cut_short(f"nothing was written: {structure.stopped}; {found}. --partial writes such a part")
    if wanted in DRAWN and len(structure) > READABLE and not options.large:
        raise UsageError(
            f"{len(structure):,} configurations are more than a drawing can show ({READABLE}): "
            "choose another format, or ask for it with --large"
        )
    if not structure.complete:
        tell(f"only a part is written: {structure.stopped}")
        budget.grant(float("inf"))  # the time may be used up: it was for the exploration
    try:
        budget.check()
        write(STRUCTURES.load(wanted)(structure), options.output, budget.check)
    except LimitReached as reached:
        there = "standard output breaks off" if options.output in (None, "-") else "nothing was written"
        return _cut_short(f"{there}: {reached} while {len(structure):,} configurations were written")
    return 0 if structure.complete else CUT_SHORT


def _cut_short(message: str) -> int:
    tell(message)
    return CUT_SHORT


def _explore(arrangement: Arrangement, problem: Problem, options: Namespace, budget: Budget) -> Structure:
    from llfsm_verify.checking.verdict import Progress
    from llfsm_verify.cli.io.progress import ProgressLine
    from llfsm_verify.kripke.graph import Graph
    from llfsm_verify.kripke.structure import structure
    from llfsm_verify.limits import memory_in_use

    with ProgressLine() as line:

        def report(graph: Graph) -> None:
            configurations, nodes = graph.configurations, len(graph)
            line.update(Progress(configurations, graph.expanded, nodes, graph.depth, budget.seconds, memory_in_use()))

        return structure(
            arrangement,
            problem,
            keep_all_bits=options.keep_all_bits,
            budget=budget,
            report=report if line.shown else None,
            jobs=options.jobs,
        )


# ---------------- writing in portions: limits and progress between them, and never half a file under its name


def write(pieces: Iterable[str | bytes], output: str | None, check: Callable[[], None] = lambda: None) -> None:
    """Write all pieces to the file `output`, or to standard output (None, "-"); see `write_whole`.

    SIGTERM leaves no file either. `check` is called between pieces; what it raises ends the writing. Raises
    DiagnosticError (E412, E422), and SystemExit on SIGTERM.
    """
    if output is None or output == "-":
        _to_standard_output(pieces, check)
        return

    def portions(file: BinaryIO) -> None:
        with _Line(output) as line:
            size = 0  # a pipe does not tell
            for piece in pieces:
                size += file.write(piece.encode() if isinstance(piece, str) else piece)
                line.update(size)
                check()

    with ending_raises():
        write_whole(portions, output, "E422", "the structure")


def _to_standard_output(pieces: Iterable[str | bytes], check: Callable[[], None]) -> None:
    out = Output()
    for piece in pieces:
        out.plain(piece.decode() if isinstance(piece, bytes) else piece)
        if out.closed:
            return
        check()


class _Line(StatusLine):
    """How much has been written."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self._name = name

    def update(self, size: int) -> None:
        """Show that `size` bytes have been written, now and then."""
        self.show(lambda: f"writing {self._name}: {size / 2**20:,.0f} MiB, {time.monotonic() - self.started:.0f} s")
