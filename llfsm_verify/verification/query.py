"""Queries: a state formula that some run shall reach, asked as the property that none does."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.trace import Trace
from llfsm_verify.checking.verdict import Attempt, Options, Proof, Result, Verdict
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment, Source
from llfsm_verify.logic import codes
from llfsm_verify.logic.formula import BOOLEAN, apply, operators
from llfsm_verify.logic.parsing.formulas import refuse_initially
from llfsm_verify.logic.parsing.tokens import tokenise
from llfsm_verify.logic.parsing.words import Words
from llfsm_verify.logic.properties import Property, PropertySet
from llfsm_verify.logic.syntaxes import parse_in
from llfsm_verify.verification.engines import DEFAULT_ENGINE
from llfsm_verify.verification.verify import verify

NAME = "query"
"""What the property that a query stands for is called, also in saved runs."""
ANSWERS = {Verdict.VIOLATED: "reached", Verdict.HOLDS: "unreachable", Verdict.UNKNOWN: "unknown"}


@dataclass(frozen=True, slots=True)
class Query:
    """A state formula as the user wrote it, and the property that no run reaches it."""

    text: str
    properties: PropertySet


@dataclass(frozen=True, slots=True)
class QueryResult:
    """`result` is that of the check of the query's property."""

    query: Query
    result: Result

    @property
    def verdict(self) -> Verdict:
        """VIOLATED: a run reaches it; HOLDS: none does."""
        return self.result.properties[0].verdict

    @property
    def word(self) -> str:
        """`reached`, `unreachable` or `unknown`."""
        return ANSWERS[self.verdict]

    @property
    def trace(self) -> Trace | None:
        """A shortest run that the engine found to it."""
        trace = self.result.properties[0].trace
        return None if trace is None else replace(trace, because=None, witness=True)

    @property
    def reason(self) -> str | None:
        """Why it is unknown."""
        reason = self.result.properties[0].reason
        return None if reason is None else _of_reaching(reason)

    @property
    def proofs(self) -> tuple[Proof, ...]:
        """Why none reaches it, where an inductive engine has found that."""
        return self.result.properties[0].proofs

    @property
    def attempts(self) -> tuple[Attempt, ...]:
        """What each engine did, where several were asked."""
        return tuple(replace(a, reasons=tuple(map(_of_reaching, a.reasons))) for a in self.result.attempts)

    @property
    def engine(self) -> str:
        """The engine that decided it; where none did, the one that was asked."""
        return self.result.engine if self.verdict is Verdict.UNKNOWN else self.result.properties[0].engine

    @property
    def is_complete(self) -> bool:
        """Nothing is left to look at: every configuration was explored, or a proof speaks of all runs."""
        return self.result.complete or self.verdict is Verdict.HOLDS

    @property
    def exit_code(self) -> int:
        """130 interrupted, 0 reached, 1 unreachable, 4 unknown."""
        if self.result.interrupted and self.verdict is Verdict.UNKNOWN:
            return 130
        return {Verdict.VIOLATED: 0, Verdict.HOLDS: 1, Verdict.UNKNOWN: 4}[self.verdict]


def _of_reaching(reason: str) -> str:
    """Engines speak of the property that no run reaches it."""
    return reason.replace("violates it", "reaches it")


def parse_query(text: str, name: str, syntax: str = "llfsm") -> Query:
    """The query `text`, which came from `name`. DiagnosticError: it is no formula, or one with temporal operators."""
    whole = Fragment.whole(Source(name, text))
    words = [t for t in tokenise(text) if t.type != "NEWLINE"]
    if not words:
        raise DiagnosticError(Diagnostic(codes.EMPTY, "there is no formula", whole.span(0, 0)))
    place = whole.span(words[0].start, words[-1].end)
    parsed = parse_in(syntax, whole)
    if syntax == "llfsm":
        refuse_initially(Words(whole, words), "in a query", "ask `llfsm verify` for `initially p`")
    temporal = operators(parsed.formula) - BOOLEAN
    if temporal:
        message = "a state formula is expected: it says what is true at one moment, without temporal operators"
        hint = "leave the operator out: a run to it is looked for, as by `F`; or ask `llfsm verify` for more"
        raise DiagnosticError(Diagnostic(codes.TEMPORAL, message, place, hint=hint))
    written = Words(whole, words).text(0, len(words) - 1) if syntax == "llfsm" else " ".join(text.split())
    never = apply("G", apply("not", parsed.formula))
    always = "[]" if syntax == "spin" else "G"
    goal = Property(NAME, "ltl", f"{always} !({written})", place, never, parsed.atoms, syntax=syntax)
    return Query(written, PropertySet((goal,)))


def saved_query(name: str, kind: str, text: str) -> str | None:
    """What a query asked for, if a saved property is one of those that `parse_query` makes; None where it is not."""
    found = re.fullmatch(r"(?:G|\[\]) !\((.*)\)", text, re.DOTALL)
    if (name, kind) != (NAME, "ltl") or found is None:
        return None
    depth = 0
    for sign in found[1]:
        depth += (sign == "(") - (sign == ")")
        if depth < 0:
            return None  # the parentheses do not belong together
    return found[1] if depth == 0 else None


def ask(
    arrangement: Arrangement, query: Query, options: Options | None = None, engine: str = DEFAULT_ENGINE
) -> QueryResult:
    """Look for a run to `query` with one of the engines. Raises as `verify` does."""
    wanted = replace(options or Options(), faults=False)
    answer = QueryResult(query, verify(arrangement, query.properties, wanted, engine))
    if answer.result.exploration.depth is None:
        return answer
    # Whether a run faults, which was not asked, is not known; the engine calls that not complete.
    return replace(answer, result=replace(answer.result, complete=answer.is_complete))
