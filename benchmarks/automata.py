"""Print states and seconds of automata beside recorded ones: ``python benchmarks/automata.py FACTS.TSV [--rows N]``.

The file has the columns of ``corpora/ltl/facts.tsv``: a formula in Spot's syntax, the states of the generalised
(``tgba_s``) and of the plain Büchi automaton (``ba_s``), the class (``mp_class``), and the states of the deterministic
monitor (``monitor_s``). An empty automaton counts as one state, as it is recorded. Seconds are of CPU time, without
reading the formulas. Monitors are compared for safety properties, without the state of the bad prefixes.
"""

from __future__ import annotations

import argparse
import csv
import time
from collections.abc import Callable

from llfsm_verify.automata.ltl.classes import classify
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.logic.formula import Formula
from llfsm_verify.logic.syntaxes import parse_in
from llfsm_verify.monitoring.monitor import MonitorVerdict, monitor

Row = dict[str, str]


def formulas(rows: list[Row]) -> list[Formula]:
    """The formulas of `rows`."""
    return [parse_in("spot", Fragment.whole(Source("facts", row["formula"]))).formula for row in rows]


def measured(what: str, column: str, rows: list[Row], parsed: list[Formula], states: Callable[[Formula], int]) -> None:
    """Print one line of the table."""
    found: list[int] = []
    slowest = 0.0
    start = time.process_time()
    for formula in parsed:
        before = time.process_time()
        found.append(states(formula))
        slowest = max(slowest, time.process_time() - before)
    seconds = time.process_time() - start
    recorded = [int(row[column]) for row in rows]
    more = sum(a > b for a, b in zip(found, recorded, strict=True))
    fewer = sum(a < b for a, b in zip(found, recorded, strict=True))
    ratio = sum(found) / sum(recorded)
    print(
        f"{what:22}{len(rows):6}{sum(recorded):10,}{sum(found):8,}{ratio:8.3f}{more:6}{fewer:7}"
        f"{seconds:9.2f}{slowest * 1000:10.0f}"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("facts", help="a file with the columns of corpora/ltl/facts.tsv")
    parser.add_argument("--rows", type=int, help="only the first so many rows")
    arguments = parser.parse_args()
    with open(arguments.facts, encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file, delimiter="\t"))[: arguments.rows]
    parsed = formulas(rows)
    print(
        f"{'':22}{'rows':>6}{'recorded':>10}{'ours':>8}{'ratio':>8}{'more':>6}{'fewer':>7}{'CPU s':>9}{'worst ms':>10}"
    )
    measured("generalised Büchi", "tgba_s", rows, parsed, lambda f: max(1, len(translate(f).edges)))
    measured("plain Büchi", "ba_s", rows, parsed, lambda f: max(1, len(translate(f, generalised=False).edges)))
    safe = [i for i, row in enumerate(rows) if row["mp_class"] in ("S", "B") and row["accepted_word"]]
    measured(
        "monitors of safety", "monitor_s", [rows[i] for i in safe], [parsed[i] for i in safe],
        lambda f: sum(verdict is not MonitorVerdict.FALSE for verdict in monitor(f).verdicts),
    )  # fmt: skip
    start = time.process_time()
    agreeing = sum(classify(f) == row["mp_class"] for f, row in zip(parsed, rows, strict=True))
    print(f"classes: {agreeing:,} of {len(rows):,} agree, {time.process_time() - start:.2f} s")


if __name__ == "__main__":
    main()
