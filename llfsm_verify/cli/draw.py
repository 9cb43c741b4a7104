"""`llfsm draw`: a machine or the arrangement as DOT, Mermaid or SVG."""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.cli.arguments import DRAWINGS
from llfsm_verify.cli.output import Output, usage
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.report.drawing.dot import dot
from llfsm_verify.report.drawing.extract import arrangement_graph, machine_graph
from llfsm_verify.report.drawing.graph import summarised
from llfsm_verify.report.drawing.mermaid import mermaid
from llfsm_verify.report.drawing.svg import svg

SUFFIXES = {".dot": "dot", ".gv": "dot", ".mmd": "mermaid", ".mermaid": "mermaid", ".svg": "svg"}


def run(options: Namespace) -> int:
    """Returns 0; raises DiagnosticError: wrong files, no drawing library (E406), output not writable (E407)."""
    wanted = _format(options)
    if wanted is None:
        return usage(f"no drawing ends like `{options.output}`: name it {', '.join(SUFFIXES)}, or give --format")
    arrangement = load_arrangement(options.arrangement)
    if options.machine is None:
        graph = arrangement_graph(arrangement)
    else:
        names = [machine.name for machine in arrangement.machines]
        if options.machine not in names:
            return usage(f"there is no machine `{options.machine}`; there are {', '.join(names)}")
        graph = machine_graph(arrangement.machine(options.machine))
    graph, note = summarised(graph)
    if note is not None:
        print(note, file=sys.stderr)
    text = {"dot": dot, "mermaid": mermaid, "svg": svg}[wanted](graph)
    if options.output is None or options.output == "-":
        Output().plain(text)
        return 0
    try:
        Path(options.output).write_text(text, encoding="utf-8")
    except OSError as e:
        message = f"the drawing cannot be written there: {e.strerror or 'input/output error'}"
        raise DiagnosticError(Diagnostic("E407", message, file=options.output)) from None
    return 0


def _format(options: Namespace) -> str | None:
    """The format asked for, or that the output's name ends in; None: it ends in one that we do not draw."""
    chosen: str | None = options.format
    if chosen is None and options.output not in (None, "-"):
        ending = Path(options.output).suffix.lower()
        chosen = SUFFIXES.get(ending)
        if chosen is None and ending:
            return None
    return chosen or DRAWINGS[0]
