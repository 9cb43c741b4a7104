"""The examples of `llfsm explain`: `python -m tests.outputs.examples` runs all tests but the long ones, and writes anew
what the diagnostics that they provoke look like, one for each code.

Of several the one is taken that says what to write instead, has a place, and stands in the shortest file.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

import pytest

from llfsm_verify.diagnostics import Diagnostic
from llfsm_verify.report.codes import all_codes

KEPT = Path(__file__).parents[2] / "llfsm_verify" / "report" / "examples.json"
LEAST, LONGEST = 40, 400
"""Characters of a file that is an example worth reading, and of what is said."""
_FOLDER = re.compile(r"/(?:[\w.+-]+/)+(?=[\w.+-]+)")


class Seen:
    """The best diagnostic of each code so far: what `pytest.main` gets as a plugin."""

    def __init__(self) -> None:
        self.best: dict[str, tuple[tuple[Any, ...], Diagnostic]] = {}

    def add(self, found: Diagnostic) -> None:
        """One more."""
        size = 0 if found.span is None else len(found.span.source.text)
        key = (found.hint is None, found.span is None, size < LEAST, size, len(found.message), found.message)
        if len(found.message) < LONGEST and (found.code not in self.best or key < self.best[found.code][0]):
            self.best[found.code] = key, found

    def pytest_sessionfinish(self) -> None:
        """Write them."""
        known = all_codes()
        texts = {code: shown(found) for code, (_, found) in sorted(self.best.items()) if code in known}
        KEPT.write_text(json.dumps(texts, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def shown(found: Diagnostic) -> str:
    """A diagnostic without the folders of one machine."""
    return _FOLDER.sub("", found.render())


if __name__ == "__main__":
    seen = Seen()
    made = Diagnostic.__init__

    def init(self: Diagnostic, *arguments: Any, **options: Any) -> None:
        made(self, *arguments, **options)
        seen.add(self)

    Diagnostic.__init__ = init  # type: ignore[method-assign]
    sys.exit(pytest.main(["-q", "-p", "no:xdist", "-m", "not long"], [seen]))
