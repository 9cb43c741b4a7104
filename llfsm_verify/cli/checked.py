"""What a check has come to, for those who check again."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import NamedTuple

from llfsm_verify.checking.verdict import FAULTS, Result
from llfsm_verify.report.wording import verdict_text


class Checked(NamedTuple):
    """The exit code of a check, whether the reader of its output has gone, and the verdicts in words by name."""

    code: int
    gone: bool = False
    verdicts: Mapping[str, str] = MappingProxyType({})


def verdicts_of(result: Result) -> dict[str, str]:
    """What was found of each property, and of faults."""
    found = {item.name: verdict_text(result, item) for item in result.properties}
    return {**found, FAULTS: result.faults.verdict.value}


def changes(before: Mapping[str, str], now: Mapping[str, str]) -> Iterator[str]:
    """Each verdict that is another one: ``never_stuck: violated → holds``."""
    for name, verdict in now.items():
        if name not in before:
            yield f"{name}: new, {verdict}"
        elif before[name] != verdict:
            yield f"{name}: {before[name]} → {verdict}"
    yield from (f"{name}: not asked any more" for name in before if name not in now)
