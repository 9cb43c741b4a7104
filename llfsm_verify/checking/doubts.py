"""What may be meant otherwise in properties: they are checked as they stand, and this is said beside the verdicts."""

from __future__ import annotations

import re
from collections.abc import Iterator
from fractions import Fraction

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Span, counted
from llfsm_verify.language.atoms import PropertyScope, check_atom
from llfsm_verify.language.constants import evaluate, interval
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import Binary, Expression
from llfsm_verify.language.types import decimal_text, digits_of, is_number
from llfsm_verify.logic.bounds import Clock
from llfsm_verify.logic.codes import BETWEEN_CYCLES, NEVER_EQUAL
from llfsm_verify.logic.formula import TRUE, apply, written
from llfsm_verify.logic.parsing.bounds import decimal
from llfsm_verify.logic.properties import Property, PropertySet

_COMPARES = re.compile(r"[<>=]")
_SIGNS = ("eq", "ne", "lt", "le", "gt", "ge")


def doubts(
    arrangement: Arrangement | None, properties: PropertySet, *, stamped: bool = False
) -> tuple[Diagnostic, ...]:
    """The warnings about properties, each once: what is asked of the initial configuration only (W302), and for an
    arrangement comparisons with numbers that are never reached (W303) and times between its cycles (W304; `stamped`:
    letters have times of their own). Of atoms that do not fit it nothing is said."""
    scope = None if arrangement is None else PropertyScope.of(arrangement)
    found: list[Diagnostic] = []
    fits: dict[str, bool] = {}
    for line in properties:
        at = len(found)
        for key, fragment in line.atoms.items():
            if scope is None or key in fits or not (line.doubt or _COMPARES.search(key)):
                continue
            try:
                found.extend(_hopeless(check_atom(fragment, scope)))
                fits[key] = True
            except DiagnosticError:
                fits[key] = False
        if line.doubt is not None and all(fits.get(key, True) for key in line.atoms):
            found.insert(at, line.doubt)
        if arrangement is not None and arrangement.cycle_ms is not None and not stamped:
            found.extend(_between_cycles(line, arrangement.cycle_ms))
    once: dict[tuple[str, Span | None], Diagnostic] = {}
    for warning in found:  # the members of a family share their line
        once.setdefault((warning.code, warning.span), warning)
    return tuple(once.values())


def _between_cycles(line: Property, period: Fraction) -> Iterator[Diagnostic]:
    """Bounds in time that are not multiples of the cycle, where some cycle begins within them."""
    for place, bound in line.bounds:
        odd = next((time for time in bound if time is not None and time % period), None)
        least, most = Clock(period).ticks(bound)
        if odd is None or (most is not None and most < least):
            continue
        key = ("" if most is None else decimal(most * period), decimal(least * period))
        same = written(apply("F<=", TRUE, bound=f"{key[1]}:{key[0]}" if least or most is None else key[0]))[1:]
        operator = place.text.partition("[")[0]
        meant = f"`{operator}{same}`" if "[" in place.text else f"`{same[1:-1].removeprefix('<=')}`"
        message = f"{decimal(odd)} ms are not a multiple of the cycle of {decimal(period)} ms, so this means {meant}"
        yield Diagnostic(
            BETWEEN_CYCLES, message, place, hint=f"write {meant}, or times that are multiples of the cycle"
        )


def _hopeless(atom: Expression) -> Iterator[Diagnostic]:
    """Comparisons of what varies with a constant that it never is, nor could be a step beyond its bounds."""
    for node in of_kind(atom, Binary):
        if node.op not in _SIGNS or not (is_number(node.left.type) and is_number(node.right.type)):
            continue
        for value, number in ((node.left, node.right), (node.right, node.left)):
            wanted, between = evaluate(number), interval(value)
            if wanted is None or evaluate(value) is not None:
                continue
            text, other, digits = value.span.text, number.span.text, digits_of(value.type)
            equal = node.op in ("eq", "ne")
            margin = 0 if equal else Fraction(1, 10**digits)  # `n < 3` is one way to write `n <= 2`
            hint = f"write a number that `{text}` can be"
            if equal and wanted * 10**digits % 1:
                why = f"has {counted(digits, 'digit')} after the point" if digits else "is a whole number"
                hint += ", or `<` and `>` for what lies on the two sides"
            elif between is not None and not between[0] - margin <= wanted <= between[1] + margin:
                low, high = (decimal_text(int(end * 10**digits), digits) for end in between)
                why = f"is {low} to {high}"
            else:
                continue
            yield Diagnostic(NEVER_EQUAL, f"`{text}` {why}, so it is never {other}", node.span, hint=hint)
