"""The time that bounds in properties speak of: that of the arrangement's cycles."""

from __future__ import annotations

from fractions import Fraction

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.logic import codes
from llfsm_verify.logic.bounds import MAX_TICKS, Clock
from llfsm_verify.logic.formula import TIMED, operators
from llfsm_verify.logic.parsing.bounds import decimal
from llfsm_verify.logic.properties import PropertySet


def clock_of(arrangement: Arrangement, properties: PropertySet) -> Clock | None:
    """The clock for the bounds in time in `properties`; None: there are none.

    DiagnosticError, at each operator: the arrangement has no time of its own (E336), or a bound has more than 2^20
    cycles (E337), or none (E339).
    """
    timed = [p for p in properties if p.formula is not None and operators(p.formula) & TIMED]
    period = arrangement.cycle_ms
    problems: list[Diagnostic] = []
    for line in timed:
        for place, bound in line.bounds:
            if len(arrangement.processes) > 1 or period is None:
                problems.append(
                    Diagnostic(codes.TIMELESS, _why(arrangement, place.text), place, hint=_hint(arrangement))
                )
                continue
            least, most = Clock(period).ticks(bound)
            longest = max(t for t in bound if t is not None)
            if longest // period > MAX_TICKS:
                cycles = f"{longest // period:,} cycles of {_ms(period)} ms"
                message = f"{decimal(longest)} ms are {cycles}, more than {MAX_TICKS:,}"
                hint = "use a longer cycle or a shorter time"
                problems.append(Diagnostic(codes.TOO_LONG, message, place, hint=hint))
            elif most is not None and most < least:
                between = f"from {decimal(bound[0])} to {decimal(longest)} ms"
                message = f"no cycle begins in the time {between}: there is one every {_ms(period)} ms"
                hint = f"write times between which a multiple of {_ms(period)} ms lies"
                problems.append(Diagnostic(codes.NO_CYCLE, message, place, hint=hint))
    if problems:
        raise DiagnosticError(problems)
    assert not timed or period is not None, "a formula with a bound in time has one in its text"
    return Clock(period) if timed and period is not None else None


def _why(arrangement: Arrangement, operator: str) -> str:
    if arrangement.timing == "untimed":
        return f"`{operator}` asks for time, and this arrangement is untimed"
    if len(arrangement.processes) > 1:
        return f"`{operator}` asks for one time, and each of the {len(arrangement.processes)} processes has its own"
    return f"`{operator}` needs to know how long a cycle takes"


def _hint(arrangement: Arrangement) -> str:
    steps = "count steps (`F[0:5] p`, `G[0:5] p`)"
    if arrangement.timing == "untimed":
        return f"{steps}, or write `cycle_ms: …` instead of `timing: untimed` into the arrangement"
    if len(arrangement.processes) > 1:
        return f"{steps}, or let a machine measure the time with `after` and ask for its state"
    return "write `cycle_ms: …` (the period of one cycle) into the arrangement"


def _ms(period: Fraction) -> str:
    return str(period.numerator) if period.denominator == 1 else f"{float(period):g}"
