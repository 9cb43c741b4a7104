"""Suppressions: findings of `llfsm lint` that a file accepts, with a reason, where they are."""

from __future__ import annotations

from llfsm_verify.arrangement.draft import Lint
from llfsm_verify.arrangement.model import Suppression
from llfsm_verify.language.scope import did_you_mean
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Scalar, mark

KEY = "lint"
"""The key of an arrangement, machine, state, transition or variable that suppresses findings in it."""
CODES: dict[str, str] = {
    "L001": "A transition that can never fire.",
    "L002": "A state in which no turn is ever spent.",
    "L003": "Guards that overlap, so that their order decides.",
    "L004": "A condition that is always true.",
    "L005": "A condition that is always false.",
    "L006": "A statement or guard that always faults.",
    "L007": "A value that may leave its declared range.",
    "L008": "A division that may be by zero.",
    "L009": "An index that may lie outside its array.",
    "L010": "A variable that is written and never read.",
    "L011": "A value that is stored and lost before anything reads it.",
    "L012": "A machine that can get stuck in a state.",
    "L013": "A machine that can stay suspended forever.",
    "L014": "A process that may never take a turn.",
    "L015": "An `internal` action that runs once, because the machine then finishes.",
    "L016": "A model of the surroundings that writes no input.",
    "L017": "A machine inside a state that has its turn before its owner.",
    "L018": "A square root of a number that may be negative.",
    "L019": "A shift by a number of bits that may be outside the width.",
    "L020": "A suppression that suppresses nothing.",
    "L021": "A variable that nothing reads or writes.",
    "L022": "A type that nothing uses, or a table that nothing looks up.",
    "L023": "A state in which a machine finishes that others need, while other machines go on.",
    "L024": "A machine that has its turn before the only writer of what it reads.",
    "L025": "An action that can never run.",
    "L026": "A self-transition that keeps the clock which its state reads.",
}
"""The findings of `llfsm lint`, with what each means."""


def resolve_suppressions(report: Report, lint: Lint | None, *, whole: bool = False) -> list[Suppression]:
    """The suppressions that a part has; wrong ones are reported (E095, E096). `whole`: the part is the arrangement."""
    if lint is None:
        return []
    mapping = report.mapping(lint.node, "`lint`")
    found: list[Suppression] = []
    for key, value in mapping.items if mapping else ():
        if key.text not in CODES:
            hint = did_you_mean(key.text, CODES) or f"the codes are L001 to {max(CODES)}; see docs/lint.md"
            report.error("E095", f"there is no finding `{key.text[:60]}`", mark(key), hint)
            continue
        empty = isinstance(value, Scalar) and not value.text.strip()
        reason = None if empty else report.scalar(value, f"the reason for `{key.text}`")
        if empty:
            message = f"`{key.text}` is suppressed without a reason"
            report.error("E096", message, mark(key), f"write `{key.text}: why it is so`")
        if reason is None:
            continue
        why = " ".join(reason.text.split())
        found.append(Suppression(key.text, why, mark(key), lint.extent.start, lint.extent.end, whole))
    return found
