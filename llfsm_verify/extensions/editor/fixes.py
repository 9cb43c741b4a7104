"""Edits that hints of diagnostics name: only where what to write is told in so many words, and only after a trial.

A trial reads the files with the edit in them: what was wrong has to be right then, and what was written must not be
wrong in another way.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from llfsm_verify.extensions.editor.findings import Findings, Said

_MEANT = re.compile(r"did you mean (`[^`]+`(?: or `[^`]+`)*)\?")
_WRITE = re.compile(r"write `([^`…]+)`")
_QUOTE = re.compile(r"(?:write `not` for `!`, or )?quote it: '…'")

_WRITTEN = frozenset(("E031", "E033", "E042", "E101", "E103", "E106", "E110", "E120", "E134", "E307", "E331"))
"""The codes whose `write …` takes the place of what is marked; hints of others show a form, or more than is marked."""


@dataclass(frozen=True, slots=True)
class Fix:
    """Replace the characters `start` to `end` by a text."""

    title: str
    start: int
    end: int
    text: str

    def applied(self, text: str) -> str:
        """A text with the edit in it."""
        return text[: self.start] + self.text + text[self.end :]


def fixes_of(said: Said, text: str) -> list[Fix]:
    """The edits that a hint tells for a text; several, where it names several words that may be meant."""
    hint, marked = said.hint or "", text[said.start : said.end]
    if not marked.strip() or "\n" in marked:
        return []
    if meant := _MEANT.fullmatch(hint):
        news = re.findall(r"`([^`]+)`", meant[1])
    elif said.code in _WRITTEN and (found := _WRITE.fullmatch(hint)):
        if said.message.startswith(f"`{found[1]}` is missing after"):
            return [Fix(f"Write `{found[1]}` after it", said.end, said.end, found[1])]
        news = [found[1]]
    elif _QUOTE.fullmatch(hint):
        news = ["'" + marked.replace("'", "''") + "'"]
    else:
        return []
    return [Fix(f"Replace `{marked}` by `{new}`", said.start, said.end, new) for new in news if new != marked]


def mends(fix: Fix, said: Said, before: Iterable[Findings], after: Iterable[Findings]) -> bool:
    """Whether, by what is found before and after an edit, it makes a diagnostic go away, and nothing wrong instead:
    what is new is elsewhere, and does not speak of what was written."""
    known = {(one.code, one.message) for found in before for one in found.said}
    for found in after:
        text = found.texts.get(said.file, "")
        line = text.rfind("\n", 0, fix.start) + 1, (text + "\n").index("\n", min(fix.start + len(fix.text), len(text)))
        for one in found.said:
            if (one.code, one.message, one.start) == (said.code, said.message, said.start):
                return False
            new = one.severity == "error" and (one.code, one.message) not in known
            near = one.file == said.file and line[0] <= one.start <= line[1]
            if new and (
                near or one.code == said.code or "E010" <= one.code <= "E019" or f"`{fix.text}`" in one.message
            ):
                return False
    return True
