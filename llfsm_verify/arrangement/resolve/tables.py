"""Tables: lists of numbers that texts look up, such as the values of a function."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from fractions import Fraction

from llfsm_verify.arrangement.draft import Entry
from llfsm_verify.language.scope import Table
from llfsm_verify.language.types import MAX_DIGITS, DecimalType, RangeType, fits_in_64_bits
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Node, mark

MOST_NUMBERS = 1024
"""Numbers in one table: what is looked up is found by halving, which is written out at each place."""

SMALLER = "write numbers from -9223372036854775808 to 9223372036854775807, in steps of the smallest digit"
_NUMBER = re.compile(r"-?[0-9]{1,20}(?:\.([0-9]{1,20}))?\Z")


def resolve_tables(report: Report, drafts: Iterable[Entry], taken: Iterable[str]) -> dict[str, Table]:
    """The tables by name; `taken` are names that enumerators and whiteboard variables have."""
    found: dict[str, Table] = {}
    names = frozenset(taken)
    for key, node in drafts:
        name = report.name(key, "the name of a table")
        listed = report.sequence(node, "a table")
        if name is None or listed is None:
            continue
        if name in names:
            report.error("E118", f"there is already something called `{name}`", key.span, "choose another name")
            continue
        if not 1 <= len(listed.items) <= MOST_NUMBERS:
            message = f"a table has from 1 to {MOST_NUMBERS:,} numbers, not {len(listed.items):,}"
            report.error("E047", message, mark(node), "write, for example, `[0.00, 0.50, 0.87, 1.00]`")
            continue
        numbers = _numbers(report, listed.items)
        if numbers is None:
            continue
        digits = max(d for _, d in numbers)
        steps = tuple(int(number * 10**digits) for number, _ in numbers)
        low, high = min(steps), max(steps)
        if not fits_in_64_bits(low, high):
            report.error("E129", "a number of this table does not fit in 64 bits with a sign", mark(node), SMALLER)
            continue
        kind = DecimalType(digits, low, high) if digits else RangeType(low, high)
        found[name] = Table(name, steps, kind, key.span)
    return found


def _numbers(report: Report, items: Sequence[Node]) -> list[tuple[Fraction, int]] | None:
    """Each number and how many digits are after its point; None: an item is not a number, and that is reported."""
    numbers: list[tuple[Fraction, int]] = []
    for item in items:
        scalar = report.scalar(item, "a number of a table")
        if scalar is None:
            return None
        matched = _NUMBER.match(scalar.text)
        digits = 0 if matched is None or matched[1] is None else len(matched[1])
        if matched is None or digits > MAX_DIGITS:
            message = f"`{scalar.text[:40]}` is not a number that a table can have"
            report.error("E047", message, mark(item), f"write digits, at most {MAX_DIGITS} after the point")
            return None
        numbers.append((Fraction(matched[0]), digits))
    return numbers
