"""The changelog: days from the newest to the oldest, and codes that are there."""

from __future__ import annotations

import re
from datetime import date
from pathlib import Path

from llfsm_verify.registry import extensions
from llfsm_verify.report.codes import all_codes

TEXT = Path("CHANGELOG.md").read_text(encoding="utf-8")


def test_days_go_back():
    days = [date.fromisoformat(day) for day in re.findall(r"^### (.*)$", TEXT, re.MULTILINE)]
    assert days and days == sorted(set(days), reverse=True)


def test_codes_are_those_of_the_diagnostics():
    codes = set(re.findall(r"\b[EFLW]\d{3}\b", TEXT))
    assert codes and (codes <= set(all_codes()) or not extensions())
