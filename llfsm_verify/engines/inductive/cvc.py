"""A second opinion: cvc5, where it is installed, on questions that Z3 has found impossible."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.util import find_spec

from llfsm_verify.limits import Budget

EFFORT = 1_000_000
"""cvc5's units of work for all questions together: some 20 seconds at most."""
MOST_TEXT = 20_000_000
"""Characters of a question."""
USED = "resource::resourceUnitsUsed"
"""The statistic that counts them."""


@dataclass(frozen=True, slots=True)
class Opinion:
    """`agrees` None: the solver is not there, cannot read a question, or gave one up."""

    solver: str
    agrees: bool | None


def is_installed() -> bool:
    return find_spec("cvc5") is not None


def other_opinion(texts: Iterable[str], budget: Budget, *, finite: bool) -> Opinion:
    """Whether all questions, in SMT-LIB 2, are impossible. `finite`: bit-vectors, not integers.

    When the time is up there is no opinion, and what another solver has found stands.
    """
    if not is_installed():
        return Opinion("cvc5", None)
    import cvc5

    name = f"cvc5 {cvc5.__version__}"
    agrees: bool | None = True
    effort = EFFORT
    for text in texts:
        if effort <= 0 or len(text) > MOST_TEXT:
            return Opinion(name, None)
        answer, units = _answer(text, effort, budget, finite=finite)
        if answer is False:
            return Opinion(name, False)
        agrees = agrees and answer
        effort -= units
    return Opinion(name, agrees)


def _answer(text: str, effort: int, budget: Budget, *, finite: bool) -> tuple[bool | None, int]:
    """Whether one question is impossible, and the units of work that it took."""
    import cvc5

    manager = cvc5.TermManager()
    solver = cvc5.Solver(manager)
    solver.setOption("rlimit-per", str(effort))
    if budget.left is not None:
        solver.setOption("tlimit-per", str(max(1, round(1000 * budget.left))))
    parser = cvc5.InputParser(solver, cvc5.SymbolManager(manager))
    logic = "QF_BV" if finite else "QF_NIA" if "(* " in text else "QF_LIA"
    parser.setStringInput(cvc5.InputLanguage.SMT_LIB_2_6, f"(set-logic {logic})\n{text}", "condition")
    said = ""
    try:
        while True:
            command = parser.nextCommand()
            if command.isNull():
                break
            said += command.invoke(solver, parser.getSymbolManager())
    except RuntimeError as problem:  # what it cannot read is no answer
        logging.getLogger(__name__).info("cvc5: %s", problem)
        return None, 0
    words = said.split()
    answer = True if "unsat" in words else False if "sat" in words else None
    return answer, int(solver.getStatistics()[USED]["value"])
