"""Time: the period of a cycle, and the checks of every `after` against it."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace
from fractions import Fraction
from math import floor
from typing import cast, get_args

from llfsm_verify.arrangement.keys import PROFILE
from llfsm_verify.arrangement.model import PROFILES, Commands, Profile, Snapshot, Timing
from llfsm_verify.language.constants import longest
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import After
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Node, Scalar, mark
from llfsm_verify.yaml.tables import TRUTHS

MAX_TICKS = 1 << 20
_PERIOD = re.compile(r"[0-9]{1,12}(\.[0-9]{1,12})?\Z")


def resolve_timing(report: Report, timing: Node | None, cycle_ms: Node | None) -> tuple[bool, Fraction | None]:
    """Whether the arrangement is timed, and the milliseconds of a cycle if they are given."""
    untimed = report.choice(timing, "`timing`", get_args(Timing), "timed") == "untimed"
    period: Fraction | None = None
    if cycle_ms is not None:
        scalar = report.scalar(cycle_ms, "`cycle_ms`")
        if scalar is not None:
            if _PERIOD.match(scalar.text) and Fraction(scalar.text) > 0:
                period = Fraction(scalar.text)
            else:
                hint = "write a positive number of milliseconds"
                report.error("E094", f"`{scalar.text[:60]}` is not the period of a cycle", mark(scalar), hint)
                period = Fraction(1)
        if untimed:
            report.error("E091", "an untimed arrangement has no `cycle_ms`", mark(cycle_ms), "remove one of them")
    return not untimed, period


def check_time(report: Report, roots: Iterable[object], timed: bool, period: Fraction | None) -> None:
    """Report every `after` in the guards and actions `roots` that the arrangement's timing does not allow."""
    for root in roots:
        for after in of_kind(root, After):
            _check(report, after, timed, period)


def _check(report: Report, after: After, timed: bool, period: Fraction | None) -> None:
    if not timed:
        if not isinstance(after.bound, Fraction):
            report.error("E092", "without a clock the bound of `after` must be a constant", after.span)
        return
    if period is None:
        hint = "write `cycle_ms: …` (the period of one cycle) or `timing: untimed` into the arrangement"
        report.error("E090", "`after` needs to know how long a cycle takes", after.span, hint)
        return
    largest = longest(after)
    if largest is None:
        hint = "use variables with a declared range in it, such as `0..60`"
        report.error("E093", "the largest value of this bound is not known", after.span, hint)
    elif floor(largest / period) > MAX_TICKS:
        ticks = f"{int(largest / period):,} cycles of {_ms(period)} ms" if largest < 10**18 else "far too many cycles"
        hint = "use a longer cycle or a shorter time"
        report.error("E093", f"the bound {_ms(largest)} ms is {ticks}, more than {MAX_TICKS:,}", after.span, hint)


def _ms(value: Fraction) -> str:
    return str(value) if value.denominator == 1 else f"{float(value):g}"


# ---- The profile: one of the published systems by name, with single choices overridden


def resolve_profile(report: Report, node: Node | None) -> Profile:
    """`node` is absent, the name of a profile, or a mapping of a `base` and what differs from it."""
    if node is None or isinstance(node, Scalar):
        return PROFILES[report.choice(node, "`profile`", tuple(PROFILES), "llfsm")]
    fields = report.fields(node, "a profile", PROFILE.keys) or {}
    base = PROFILES[report.choice(fields.get("base"), "`base`", tuple(PROFILES), "llfsm")]
    snapshot = report.choice(fields.get("snapshot"), "`snapshot`", get_args(Snapshot), base.snapshot)
    commands = report.choice(fields.get("commands"), "`commands`", get_args(Commands), base.commands)
    return replace(
        base,
        snapshot=cast(Snapshot, snapshot),
        commands=cast(Commands, commands),
        self_transition_restarts_clock=_truth(
            report, fields, "self_transition_restarts_clock", base.self_transition_restarts_clock
        ),
        restart_enters_initial=_truth(report, fields, "restart_enters_initial", base.restart_enters_initial),
    )


def _truth(report: Report, fields: dict[str, Node], key: str, default: bool) -> bool:
    return report.choice(fields.get(key), f"`{key}`", TRUTHS, TRUTHS[0] if default else TRUTHS[1]) == "true"
