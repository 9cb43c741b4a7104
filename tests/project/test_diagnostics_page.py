from __future__ import annotations

import re
from pathlib import Path

from llfsm_verify.registry import extensions
from llfsm_verify.report.codes import all_codes, ours, page


def test_the_page_is_up_to_date():
    """Without extensions it begins as the page does."""
    text, written = Path("docs/diagnostics.md").read_text(), "\n".join(page()) + "\n"
    assert text.startswith(written) and (text == written or not extensions())


def test_no_code_has_two_meanings():
    assert sum(len(section.codes) for section in ours()) == len(all_codes())


def test_every_code_that_is_used_is_explained_and_the_other_way_round():
    used: set[str] = set()
    for path in Path("llfsm_verify").rglob("*.py"):
        if path != Path("llfsm_verify/report/codes.py"):
            # In the tables of codes a code is a key, or a constant that is used elsewhere.
            text = re.sub(r'^    "[EFLW]\d{3}": ', "", path.read_text(), flags=re.MULTILINE)
            used.update(re.findall(r'"([EFLW]\d{3})"', text))
    assert used == set(all_codes())
