"""What theories conclude and why, and whether two conditions are the same: as text and as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, ClassVar, TypeAlias

from llfsm_verify.diagnostics import without_controls
from llfsm_verify.fileformat import FORMAT
from llfsm_verify.knowledge.explaining import Decision, Explanation, Fate
from llfsm_verify.knowledge.theory import Literal, Rule, Theory
from llfsm_verify.values import text

if TYPE_CHECKING:
    from llfsm_verify.analysis.knowledge import Comparison

NEITHER, BOTH = "false (neither)", "true (both)"
MARKS = {
    NEITHER: "(neither): neither the output nor its negation is proved; it is then false",
    BOTH: "(both): the output is proved, and its negation also; it is then true",
}
CONSTANT = ": both are constant"


@dataclass(frozen=True, slots=True)
class Table:
    """The truth table of outputs over the inputs on which one of them depends."""

    theory: Theory
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    rows: tuple[tuple[tuple[bool, ...], tuple[tuple[bool, bool], ...]], ...]
    """Values of the inputs, and for each output whether it is proved and whether its negation is: the first ones in the
    order of binary numbers, or all."""
    exit_code: ClassVar[int] = 0


@dataclass(frozen=True, slots=True)
class Explained:
    """Why outputs of a theory are what they are for one valuation."""

    theory: Theory
    outputs: tuple[Explanation, ...]
    exit_code: ClassVar[int] = 0

    @property
    def decisions(self) -> tuple[Decision, ...]:
        """About the outputs, and then about what they depend on."""
        own = {each.literal.atom: each.decisions[-1] for each in self.outputs if each.decisions}
        others = {d.atom: d for each in self.outputs for d in reversed(each.decisions)}
        return tuple((own | others).values())


Answer: TypeAlias = "Table | Explained | Comparison"


def report(answer: Answer) -> str:
    """The report for people."""
    if isinstance(answer, Table):
        lines = _table_text(answer)
    else:
        lines = _explained_text(answer) if isinstance(answer, Explained) else _comparison_text(answer)
    return "\n".join(map(without_controls, lines))


def report_json(answer: Answer) -> str:
    """The report for programs: one JSON object (schema `knowledge`)."""
    if isinstance(answer, Table):
        value = _table_object(answer)
    else:
        value = _explained_object(answer) if isinstance(answer, Explained) else asdict(answer)
    value = {"format": FORMAT, **value, "exit_code": answer.exit_code}
    return json.dumps(value, indent=2, ensure_ascii=False, default=float)


# ---------------------------------------------------------------- truth tables


def _table_text(table: Table) -> Iterator[str]:
    lines = [(*table.inputs, *table.outputs)]
    lines += ((*map(text, values), *(_mark(*each) for each in found)) for values, found in table.rows)
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    for line in lines:
        yield "  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip()
    yield from (meaning for mark, meaning in MARKS.items() if any(mark in line for line in lines))
    others = [name for name in table.theory.inputs if name not in table.inputs]
    if others:
        yield f"nothing here depends on {', '.join(others)}"
    if len(table.rows) < 1 << len(table.inputs):
        yield f"the first {len(table.rows):,} of {1 << len(table.inputs):,} rows; --all prints the others as well"


def _mark(proved: bool, refuted: bool) -> str:
    return (BOTH if proved else NEITHER) if proved == refuted else text(proved)


def _table_object(table: Table) -> dict[str, object]:
    def row(values: Sequence[bool], found: Sequence[tuple[bool, bool]]) -> dict[str, object]:
        proofs = [{"proved": proved, "refuted": refuted} for proved, refuted in found]
        return {
            "inputs": dict(zip(table.inputs, values, strict=True)),
            "outputs": dict(zip(table.outputs, proofs, strict=True)),
        }

    rows = [row(*each) for each in table.rows]
    return {"file": table.theory.source.name, "outputs": table.outputs, "count": 1 << len(table.inputs), "rows": rows}


# ---------------------------------------------------------------- explanations


def _explained_text(found: Explained) -> Iterator[str]:
    theory = found.theory
    for each in found.outputs:
        where = ", ".join(f"{name}={text(value)}" for name, value in each.valuation.items())
        yield f"{each.literal} is {text(each.proved)}{' where ' * bool(where)}{where}"
    for decision in found.decisions:
        yield ""
        yield f"{decision.atom}: {_verdict(decision)}"
        rules = [theory.rules[fate.rule] for fate in decision.fates]
        lines = [f"  line {rule.span.line}" for rule in rules]
        texts = [_line(rule) for rule in rules]
        first, second = (max(map(len, column)) for column in (lines, texts))
        for line, rule, fate in zip(lines, texts, decision.fates, strict=True):
            yield f"{line.ljust(first)}  {rule.ljust(second)}  {_fate(theory, fate)}"


def _verdict(decision: Decision) -> str:
    if decision.proved != decision.refuted:
        return "proved" if decision.proved else f"`~{decision.atom}` is proved"
    return "proved, and its negation also" if decision.proved else "neither it nor its negation is proved"


def _fate(theory: Theory, fate: Fate) -> str:
    head = theory.rules[fate.rule].head
    named = [theory.rules[n].label or f"the rule in line {theory.rules[n].span.line}" for n in fate.by]
    others = ", ".join(named if len(named) < 10 else named[:8]) + " and others" * (len(named) >= 10)
    match fate.outcome:
        case "wins":
            beaten = "is beaten itself" if len(fate.by) == 1 else "are beaten themselves"
            return "applies and wins" + (f", because {others} {beaten}" if fate.by else "")
        case "beaten":
            return f"applies, and is beaten by {others}"
        case "blocked":
            return f"applies, and is blocked by {others}"
        case "blocks":
            return f"applies, and blocks `{head.complement}`"
    return f"does not apply: {' and '.join(_lacking(theory, literal) for literal in fate.missing)}"


def _lacking(theory: Theory, literal: Literal) -> str:
    """Why a literal of a body is not there."""
    if literal.atom in theory.inputs:
        return f"`{literal.atom}` is {text(not literal.positive)}"
    return f"`{literal}` is not proved"


def _explained_object(found: Explained) -> dict[str, object]:
    rules = [{"line": r.span.line, "label": r.label or None, "text": _line(r)} for r in found.theory.rules]
    return {
        "file": found.theory.source.name,
        "inputs": dict(found.outputs[0].valuation),
        "outputs": {each.literal.atom: each.proved for each in found.outputs},
        "rules": rules,
        "decisions": [asdict(decision) for decision in found.decisions],
    }


def _line(rule: Rule) -> str:
    """A rule as it is written, on one line."""
    return " ".join(rule.span.text.split())


# ---------------------------------------------------------------- comparisons


def _comparison_text(found: Comparison) -> Iterator[str]:
    if found.answer == "equal":
        yield "equal: proved by Z3" + (f" for all values of {', '.join(found.reads)}" if found.reads else CONSTANT)
    elif found.answer == "unknown":
        yield f"unknown: {found.reason}"
    else:
        where = ", ".join(f"{name}={text(value)}" for name, value in found.values.items())
        yield f"told apart where {where}" if where else f"told apart{CONSTANT}"
        width = max(map(len, found.sides))
        for side, truth in zip(found.sides, found.truths, strict=True):
            yield f"  {side.ljust(width)}  is {text(truth)}"
    for side, alone in zip(found.sides, found.alone, strict=False):
        if alone:
            yield f"only {side} has {', '.join(alone)}: free in both"
    if found.values and found.arrangement is not None:
        yield "these are values of the variables' types; `llfsm query` says whether a run reaches them"
