"""The examples of `llfsm explain`: `python -m tests.outputs.examples [ARGUMENTS OF PYTEST]` runs tests, and writes anew
what the diagnostics that they provoke look like, one for each code; other codes keep theirs, and so do those of
provoked.py.

Of several the one is taken that says what to write instead, has a place in a file, and is the shortest.
"""

from __future__ import annotations

import json
import re
import sys
from typing import Any

import pytest

from llfsm_verify.diagnostics import Diagnostic
from tests.cli.running import Done
from tests.outputs.provoked import KEPT, PRINTED, PROVOKED, keep

FILES = (".yaml", ".ltl")
LONGEST = 400
"""Characters of a message that is an example worth reading."""
MOST_LINES = 12
_FOLDER = re.compile(r"/(?:[\w.+-]+/)+(?=[\w.+-]+)")


class Seen:
    """The best diagnostic of each code so far: what `pytest.main` gets as a plugin."""

    def __init__(self) -> None:
        self.best: dict[str, tuple[tuple[Any, ...], Diagnostic]] = {}
        self.printed: dict[str, str] = {}

    def add(self, found: Diagnostic) -> None:
        """One more."""
        named = found.span is not None and found.span.source.name.endswith(FILES)
        key = (found.hint is None, found.span is None, not named, len(found.message), found.message)
        if len(found.message) < LONGEST and (found.code not in self.best or key < self.best[found.code][0]):
            self.best[found.code] = key, found

    def read(self, printed: str) -> None:
        """What a command has printed, in this process or in another: it counts for codes that are not known so far."""
        for found in PRINTED.finditer(printed):
            text = "\n".join(line.rstrip() for line in found[0].split("\n")).rstrip("\n")
            if text.count("\n") < MOST_LINES:
                self.printed.setdefault(found[1], text)

    def pytest_sessionfinish(self) -> None:
        """Write them."""
        kept = json.loads(KEPT.read_text(encoding="utf-8"))
        texts = {code: _FOLDER.sub("", text) for code, text in self.printed.items() if code not in kept}
        texts |= {code: shown(found) for code, (_, found) in self.best.items()}
        keep({code: text for code, text in texts.items() if code not in PROVOKED})


def shown(found: Diagnostic) -> str:
    """A diagnostic without the folders of one machine."""
    return _FOLDER.sub("", found.render())


if __name__ == "__main__":
    seen = Seen()
    made = Diagnostic.__init__

    def init(self: Diagnostic, *arguments: Any, **options: Any) -> None:
        made(self, *arguments, **options)
        seen.add(self)

    def told(self: Done, returncode: int, stdout: str, stderr: str) -> None:
        gave(self, returncode, stdout, stderr)
        seen.read(stderr)
        seen.read(stdout)

    Diagnostic.__init__ = init  # type: ignore[method-assign]
    gave = Done.__init__
    Done.__init__ = told  # type: ignore[method-assign]
    sys.exit(pytest.main(["-q", "-p", "no:xdist", "-m", "not long", *sys.argv[1:]], [seen]))
