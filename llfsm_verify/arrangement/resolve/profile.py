"""The profile: one of the published systems by name, with single choices overridden."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal, cast

from llfsm_verify.arrangement.model import PROFILES, Profile
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Node, Scalar

PROFILE_KEYS = ("base", "snapshot", "self_transition_restarts_clock", "restart_enters_initial", "commands")
SNAPSHOTS = ("none", "ringlet", "after_entry", "cycle")
COMMANDS = ("next_turn", "end_of_ringlet")
TRUTH = ("true", "false")


def resolve_profile(report: Report, node: Node | None) -> Profile:
    """`node` is absent, the name of a profile, or a mapping of a `base` and what differs from it."""
    if node is None or isinstance(node, Scalar):
        return PROFILES[report.choice(node, "`profile`", tuple(PROFILES), "llfsm")]
    fields = report.fields(node, "a profile", PROFILE_KEYS) or {}
    base = PROFILES[report.choice(fields.get("base"), "`base`", tuple(PROFILES), "llfsm")]
    snapshot = report.choice(fields.get("snapshot"), "`snapshot`", SNAPSHOTS, base.snapshot)
    commands = report.choice(fields.get("commands"), "`commands`", COMMANDS, base.commands)
    return replace(
        base,
        snapshot=cast('Literal["none", "ringlet", "after_entry", "cycle"]', snapshot),
        commands=cast('Literal["next_turn", "end_of_ringlet"]', commands),
        self_transition_restarts_clock=_truth(
            report, fields, "self_transition_restarts_clock", base.self_transition_restarts_clock
        ),
        restart_enters_initial=_truth(report, fields, "restart_enters_initial", base.restart_enters_initial),
    )


def _truth(report: Report, fields: dict[str, Node], key: str, default: bool) -> bool:
    return report.choice(fields.get(key), f"`{key}`", TRUTH, TRUTH[0] if default else TRUTH[1]) == "true"
