"""The measurement of what watching costs runs, and says what it is to say."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from benchmarks import viewing
from tests.outside import needs


@pytest.fixture(autouse=True)
def boards(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("LLFSM_WHITEBOARDS", str(tmp_path / "boards"))


@pytest.mark.long
def test_a_run_is_measured_alone_and_viewed(capsys):
    viewing.main(["--seconds", "2", "--no-page"])
    alone, viewed = re.findall(r"^(\w+):\n  lateness: 50 % within .*overruns?", capsys.readouterr().out, re.MULTILINE)
    assert (alone, viewed) == ("alone", "viewed")


@pytest.mark.long
@needs("chromium", "chromedriver", "selenium")
def test_a_page_is_measured_too():
    found = viewing.watch("page", 4)
    assert found.page["shown"] > 50
    assert found.viewer is not None and found.viewer < 1
    assert found.browser is not None and str(found).count("\n") == 4
