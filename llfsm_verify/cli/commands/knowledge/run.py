"""`llfsm knowledge`: what theories conclude and why, and whether two conditions are the same."""

from __future__ import annotations

import os
import re
from argparse import Namespace
from collections.abc import Callable, Collection, Sequence
from typing import TYPE_CHECKING

from llfsm_verify.arrangement.files import read_source, read_stdin
from llfsm_verify.arrangement.kinds import other_kind
from llfsm_verify.cli.arguments import assignments
from llfsm_verify.cli.io.output import Output, tell
from llfsm_verify.cli.opening import COMMAND_LINE, limits_of, open_arrangement
from llfsm_verify.cli.parser import UsageError
from llfsm_verify.diagnostics import DiagnosticError, Fragment, Source
from llfsm_verify.knowledge.compiled import compiled
from llfsm_verify.knowledge.doubts import without_influence
from llfsm_verify.knowledge.explaining import explained
from llfsm_verify.knowledge.reading import read_theory
from llfsm_verify.knowledge.tables import tables, valuation
from llfsm_verify.knowledge.theory import Literal, Theory
from llfsm_verify.limits import Budget
from llfsm_verify.registry import meant
from llfsm_verify.report.formats import REPORTS
from llfsm_verify.report.knowledge import Explained, Table

if TYPE_CHECKING:
    from llfsm_verify.analysis.knowledge import Comparison, Known
    from llfsm_verify.report.knowledge import Answer

TRUTHS = {"true": True, "false": False}
MOST_ROWS = 1 << 10
MOST_INPUTS = 16
"""Of a table: how many rows are printed without --all, and how many inputs it has at most."""


def run(options: Namespace) -> int:
    """Answers, and returns the exit code: 1 where two conditions are told apart, 4 where that is not known. Raises
    DiagnosticError for wrong files and conditions."""
    questions: dict[str, Callable[[Namespace], Answer]]
    questions = {"table": _table, "explain": _explain, "equivalent": _equivalent}
    answer = questions[options.question](options)
    Output().write(REPORTS.knowledge.load(options.format)(answer))
    return answer.exit_code


def _table(options: Namespace) -> Table:
    theory = _theory(options.theory)
    outputs = _outputs(theory, options.output)
    sides = [compiled(theory, literal) for atom in outputs for literal in (Literal(atom), Literal(atom, False))]
    inputs = [name for name in theory.inputs if any(name in side.inputs for side in sides)]
    if len(inputs) > MOST_INPUTS:
        instead = "`llfsm knowledge explain` answers for one valuation, and `equivalent` compares all"
        raise UsageError(f"a table has {MOST_INPUTS} inputs at most, and this one has {len(inputs)}: {instead}")
    most = 1 << len(inputs) if options.all else MOST_ROWS
    rows = []
    for first, count, columns in tables(sides, inputs):
        for row in range(min(count, most - first)):
            proved = [bool(column >> row & 1) for column in columns]
            values = tuple(valuation(inputs, first + row).values())
            rows.append((values, tuple(zip(proved[::2], proved[1::2], strict=True))))
    return Table(theory, tuple(inputs), tuple(outputs), tuple(rows))


def _explain(options: Namespace) -> Explained:
    theory = _theory(options.theory)
    values = _valuation(theory, options.values)
    return Explained(
        theory, tuple(explained(theory, Literal(atom), values) for atom in _outputs(theory, options.output))
    )


def _valuation(theory: Theory, texts: Sequence[str]) -> dict[str, bool]:
    """The value of each input, by what is written as INPUT=VALUE. UsageError: one is written in another way."""
    form = "INPUT=true or INPUT=false"
    for text in texts:
        name = re.sub(r"^\s*(?:[!~]|not\b)?\s*|\s+$", "", text)
        if name in theory.inputs:
            value = "true" if name == text.strip() else "false"
            raise UsageError(f"explain needs {form}, not `{text}`; write `{name}={value}`")
    given = assignments("explain", texts, form)
    for name, value in given.items():
        if name not in theory.inputs:
            raise UsageError(f"{theory.source.name} has no input `{name[:100]}`{_known(name, theory.inputs)}")
        if value not in TRUTHS:
            raise UsageError(f"`{name}` is true or false, not `{value[:100]}`")
    return {name: TRUTHS[given.get(name, "false")] for name in theory.inputs}


def _equivalent(options: Namespace) -> Comparison:
    from llfsm_verify.analysis.knowledge import compare, compare_in

    budget, texts = Budget(limits_of(options)), (options.left, options.right)
    if options.arrangement is not None:
        named = next((text for text in texts if text.endswith(".d") and os.path.isfile(text)), None)  # noqa: PTH113
        if named is not None or options.output:
            instead = f"write the name that `knowledge` gives to {named}" if named else "--output is for theories"
            raise UsageError(f"with --arrangement both sides are conditions of it: {instead}")
        arrangement = open_arrangement(options.arrangement)
        return compare_in(arrangement, _condition(options.left), _condition(options.right), budget)
    theories = sum(map(_is_file, texts))
    if not theories:
        both = " nor ".join(f"`{text[:100]}`" for text in texts)
        instead = "name one, or the arrangement of both by --arrangement"
        raise UsageError(f"neither {both} is a theory (a .d file): {instead}")
    if len(options.output) > theories:
        raise UsageError("--output is given once for each theory at most")
    second = options.output[1:] if _is_file(options.left) and len(options.output) > 1 else options.output[:1]
    return compare(_side(options.left, options.output[:1]), _side(options.right, second), budget)


def _side(text: str, outputs: Sequence[str]) -> Known | Fragment:
    """A condition, or the output of a theory. UsageError: that is not told."""
    from llfsm_verify.analysis.knowledge import Known

    if not _is_file(text):
        return _condition(text)
    theory = _theory(text)
    atoms = _outputs(theory, outputs)
    if len(atoms) > 1:
        raise UsageError(f"{text} has the outputs {', '.join(atoms)}: choose one by --output")
    return Known(theory, atoms[0])


def _is_file(text: str) -> bool:
    """A condition is no file's name, but one word may also be that."""
    there = not text.isidentifier() and os.path.isfile(text)  # noqa: PTH113 - the text may be too long for a path
    return there or re.fullmatch(r"\S*\.(?:d|ya?ml)", text) is not None


def _condition(text: str) -> Fragment:
    return Fragment.whole(Source(COMMAND_LINE, text))


def _theory(path: str) -> Theory:
    """The theory in a file; what no output depends on is said. DiagnosticError: it cannot be read, has mistakes, or is
    a file of another kind (E019)."""
    source, _ = read_stdin(None) if path == "-" else read_source(path)
    other = other_kind(source, "theory")
    if other is not None:
        raise DiagnosticError(other)
    theory = read_theory(source)
    tell(*without_influence(theory))
    return theory


def _outputs(theory: Theory, names: Sequence[str]) -> list[str]:
    """The atoms of the outputs of these names, or of all when none is given. UsageError: there is no such output."""
    found = [theory.output(name) for name in names]
    for name, output in zip(names, found, strict=True):
        if output is None:
            known = _known(name, [each.atom for each in theory.outputs])
            raise UsageError(f"--output: {theory.source.name} has no output `{name[:100]}`{known}")
    return [output.atom for output in found or theory.outputs if output is not None]


def _known(name: str, names: Collection[str]) -> str:
    """The end of a sentence that says that there is no such name."""
    return meant(name, names) or f"; it has {', '.join(list(names)[:10]) or 'none'}"
