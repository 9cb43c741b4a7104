"""Settings of ports that are whole numbers."""

from __future__ import annotations

from collections.abc import Mapping

from llfsm_verify.runtime.ports.codes import UNKNOWN
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Node, mark


def whole_number(report: Report, found: Mapping[str, Node], key: str, low: int, high: int, default: int) -> int | None:
    """The number under a key, or the default where there is none; None: it is wrong, which was reported."""
    if key not in found:
        return default
    scalar = report.scalar(found[key], f"`{key}`")
    if scalar is None:
        return None
    text = scalar.text
    if text.isascii() and text.isdigit() and len(text) <= 9 and low <= int(text) <= high:
        return int(text)
    message = f"`{key}` cannot be `{text[:40]}`"
    report.error(UNKNOWN, message, mark(scalar), f"write a whole number from {low} to {high}")
    return None
