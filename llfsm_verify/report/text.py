"""Verdicts and traces as text for a terminal or a pipe."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from rich.text import Text

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.trace import Trace
from llfsm_verify.checking.verdict import PropertyResult, Result, Verdict
from llfsm_verify.diagnostics import Diagnostic
from llfsm_verify.logic.properties import asked_text
from llfsm_verify.program.program import FaultSite
from llfsm_verify.report.formats import Style
from llfsm_verify.report.steptable import Listed, StepTable
from llfsm_verify.report.wording import (
    CLAIMED,
    attempt_texts,
    ending_text,
    fault_text,
    input_text,
    is_vacuous,
    left_out_text,
    name_cell,
    resumed_text,
    sentences,
    summary_text,
    under_assumptions,
    vacuity_texts,
    verdict_text,
    verdict_word,
)

if TYPE_CHECKING:
    from rich.console import RenderableType

    from llfsm_verify.checking.verdict import Proof

STYLES = {Verdict.HOLDS: "green", Verdict.VIOLATED: "bold red", Verdict.UNKNOWN: "yellow"}


def result_text(
    result: Result, *, quiet: bool = False, fold: bool = True, whole: float | None = None
) -> Iterator[RenderableType]:
    """What `llfsm verify --format text` prints; `quiet` leaves out everything but the verdicts, and what was asked for
    beside them."""
    yield from _first_verdicts(result, quiet=quiet)
    if not quiet:
        yield from _runs(result, fold=fold)
        yield Text()
        yield from _ending(result, whole)


def _first_verdicts(result: Result, *, quiet: bool) -> Iterator[Text]:
    """A verdict of each property with its formula, and that of faults."""
    width = max((len(name_cell(p.name)) for p in result.properties), default=6)
    faults = verdict_word(result, result.faults.verdict)
    words = max(len(faults), max((len(verdict_text(result, p)) for p in result.properties), default=8))
    for item in result.properties:
        beside = _beside(result, item, quiet=quiet)
        yield _verdict_line(result, verdict_text(result, item).ljust(words), item, width, beside)
    line = Text.assemble(
        (faults.ljust(words), STYLES[result.faults.verdict]), f"  {'faults'.ljust(width)}  {fault_text(result)}"
    )
    if result.is_claimed(result.faults.verdict):
        line.append(f"\n{' ' * words}  {' ' * width}  {CLAIMED}", "bold red")
    yield line


def _beside(result: Result, item: PropertyResult, *, quiet: bool) -> Sequence[str]:
    """What is said beside a verdict; with `quiet`, only what was asked for, and that runs do not count."""
    if not quiet or result.asked_vacuity:
        return vacuity_texts(result, item)
    escapes = tuple(finding for finding in item.vacuity.findings if finding.kind == "escape")
    return vacuity_texts(result, replace(item, vacuity=replace(item.vacuity, findings=escapes))) if escapes else ()


def _runs(result: Result, *, fold: bool) -> Iterator[RenderableType]:
    """Counterexamples, witnesses, proofs and runs into faults, each below its title."""
    assuming = f" ({under_assumptions(result)})" if result.assumptions else ""
    for item in result.properties:
        if item.trace is not None:
            title = f"{item.name} is {item.verdict.value}{assuming}: {asked_text(item.kind, item.text)}"
            yield from _titled(title, item.trace, fold=fold)
            yield from (Text(f"Note: {note}.") for note in item.notes)
            yield from _others(item, fold=fold)
    if result.escape is not None:
        title = f"A run in which the arrangement escapes the assumptions ({', '.join(result.assumptions)}):"
        yield from _titled(title, result.escape, fold=fold)
    for item in result.properties:
        if item.witness is not None:
            title = f"{item.name} holds, for example in this run: {asked_text(item.kind, item.text)}"
            yield from _titled(title, item.witness, fold=fold)
    for name, proofs in [*((p.name, p.proofs) for p in result.properties), ("faults", result.faults.proofs)]:
        yield from proofs_text(name, proofs)
    for finding in result.faults.findings:
        yield from _titled(fault_place(finding.site), finding.trace, fold=fold)


def _titled(title: str, trace: Trace, *, fold: bool) -> Iterator[RenderableType]:
    yield Text()
    yield Text(title, "bold")
    yield from trace_text(trace, fold=fold)


def _ending(result: Result, whole: float | None) -> Iterator[Text]:
    """What the search came to, and what there is to say of it."""
    if _has_tables(result):
        yield from _verdicts(result)
        yield Text()
    yield Text(summary_text(result, whole))
    yield from (Text(f"  {sentence}") for sentence in attempt_texts(result.attempts))
    if result.exploration.longest is not None:
        yield Text(f"{ending_text(result.exploration.longest)}{resumed_text(result)}")
    if result.exploration.left_out:
        yield Text(left_out_text(result))
    yield from (Text(input_text(note)) for note in result.exploration.inputs)
    yield from (Text(f"Note: {note}.") for note in result.notes)
    verdicts = {result.faults.verdict, *(item.verdict for item in result.properties)}
    explored = result.exploration
    is_bounded = explored.depth is not None and explored.complete is False and not result.attempts
    if is_bounded and Verdict.UNKNOWN in verdicts:
        yield Text("`--engine auto` also asks engines that do not bound the length of runs.")


def _has_tables(result: Result) -> bool:
    runs = [trace for item in result.properties for trace in (item.trace, item.witness) if trace is not None]
    return bool(result.faults.findings or result.escape is not None or runs)


def _verdicts(result: Result) -> Iterator[Text]:
    """The verdicts once more, without formulas: the first ones have left the screen."""
    lines = [(verdict_text(result, p), STYLES[_colour_of(p)], p.name) for p in result.properties]
    lines.append((verdict_word(result, result.faults.verdict), STYLES[result.faults.verdict], "faults"))
    words = max(len(word) for word, _, _ in lines)
    yield from (Text.assemble((word.ljust(words), style), f"  {name}") for word, style, name in lines)


def _colour_of(item: PropertyResult) -> Verdict:
    """What holds vacuously has the colour of what is unknown."""
    return Verdict.UNKNOWN if is_vacuous(item) else item.verdict


def _verdict_line(result: Result, words: str, item: PropertyResult, width: int, findings: Sequence[str]) -> Text:
    line = Text.assemble(
        (words, STYLES[_colour_of(item)]), f"  {name_cell(item.name).ljust(width)}  {asked_text(item.kind, item.text)}"
    )
    margin = f"\n{' ' * len(words)}  {' ' * width}  "
    if item.reason is not None:
        line.append(f"{margin}because {item.reason}")
    for note in item.notes if item.trace is None else ():
        if any(note in sentence for sentence in findings):
            continue
        line.append(f"{margin}note: {note}")
    for sentence in findings:
        fails = result.is_empty(item) or sentence == CLAIMED
        line.append(f"{margin}{sentence}", "bold red" if fails else "")
    return line


def failures(result: Result) -> Iterator[Text]:
    """A line for each verdict that is not `holds`, and for each place of a fault; without runs."""
    for item in result.properties:
        if item.verdict is not Verdict.HOLDS or result.is_empty(item):
            words = verdict_text(result, item)
            reason = "" if item.reason is None else f" because {item.reason}"
            yield Text.assemble("  ", (words, STYLES[_colour_of(item)]), f"  {item.name}{reason}")
    for finding in result.faults.findings:
        where = "" if finding.site.span is None else f"{finding.site.span}: "
        yield Text.assemble("  ", ("violated", STYLES[Verdict.VIOLATED]), f"  faults  {where}{finding.site.message}")
    if result.faults.verdict is Verdict.UNKNOWN:
        yield Text.assemble("  ", ("unknown", STYLES[Verdict.UNKNOWN]), f"  faults  {fault_text(result)}")


def _others(item: PropertyResult, *, fold: bool) -> Iterator[RenderableType]:
    """The counterexamples that `--all` asked for."""
    count = 1 + len(item.more)
    for number, trace in enumerate(item.more, 2):
        yield from _titled(f"{item.name} is violated on another path ({number} of {count}):", trace, fold=fold)
    if item.only is not None:
        found = "one counterexample is" if count == 1 else f"{count} counterexamples are"
        yield Text(f"No more than {found} shown: {item.only}.")


def fault_place(site: FaultSite) -> str:
    """The fault with the line of the source that raises it."""
    return Diagnostic(site.code, site.message, site.span).render("error")


def run_text(trace: Trace, *, fold: bool = True) -> Iterator[RenderableType]:
    """The first configuration and the table of the steps."""
    if trace.initial:
        yield Listed("Initially", trace.initial)
    yield StepTable(trace, fold=fold)


def trace_text(trace: Trace, *, fold: bool = True) -> Iterator[RenderableType]:
    """The first configuration, the table of the steps, and the sentences that say how they end and why that fails."""
    yield from run_text(trace, fold=fold)
    for sentence in sentences(trace):
        yield Text(f"{sentence[0].upper()}{sentence[1:]}.")


def proofs_text(name: str, proofs: Sequence[Proof]) -> Iterator[Text]:
    """What proves that the property `name` holds; nothing where another engine found that."""
    for proof in proofs:
        yield Text()
        yield Text(f"{name}: proved, since {proof.sentence}.", "bold")
        for line in proof_lines(proof):
            yield Text(line)


def proof_lines(proof: Proof) -> Iterator[str]:
    """A proof without its heading, line by line."""
    times = f"in the beginning and after every {proof.unit}"
    if proof.invariant:
        yield f"Invariant, true {times}:"
        yield from (f"  {line}" for line in proof.invariant)
    elif proof.k == 0:
        yield "Every value is in the range of its type; no other invariant is needed."
    if proof.legend:
        yield "where"
        width = max(len(name) for name, _ in proof.legend)
        yield from (f"  {name.ljust(width)}  {meaning}" for name, meaning in proof.legend)
    if proof.k:
        first, run = (f"first {proof.unit}", f"a {proof.unit}")
        if proof.k != 1:
            first, run = (f"first {proof.k} {proof.unit}s", f"{proof.k} {proof.unit}s in a row")
        given = ", all of which satisfy the invariant" if proof.invariant else ""
        base = f"this does not happen in the {first} of any run"
        yield (
            f"k-induction, k = {proof.k}: {base}; and where it has not happened in {run}, through different "
            f"configurations{given}, it does not happen in the {proof.unit} after."
        )
    solvers = " and ".join(name.split()[0] for name in proof.checked_by)
    yield f"Checked again by {solvers}: initiation, consecution and implication."


def report(result: Result, _: Arrangement, style: Style) -> Iterator[RenderableType]:
    """The report for people, as `report.formats` knows it."""
    return result_text(result, quiet=style.quiet, fold=style.fold, whole=style.whole)
