"""What a language server knows: texts of editors, what was found in them, and verdicts on properties."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from llfsm_verify.extensions.editor.checking import Checked
from llfsm_verify.extensions.editor.findings import Findings, Said


@dataclass(frozen=True, slots=True)
class Opened:
    """A file in an editor."""

    uri: str
    text: str
    version: int


@dataclass(slots=True)
class Verdict:
    """What a lens shows: a check that runs (None), or what came of it, for the texts of that time."""

    texts: Mapping[str, str]
    checked: Checked | None = None
    page: Path | None = None


@dataclass(slots=True)
class State:
    """All of it. Files are named by their real paths."""

    opened: dict[str, Opened] = field(default_factory=dict)
    """Those that were opened last come last."""
    owners: dict[str, tuple[tuple[str, tuple[str, ...]], ...]] = field(default_factory=dict)
    """The arrangements of a file, and their properties."""
    found: dict[str, Findings] = field(default_factory=dict)
    """By the root, the newest findings."""
    good: dict[str, dict[str, Findings]] = field(default_factory=dict)
    """By file and root, the newest findings whose index has names for it."""
    verdicts: dict[tuple[str, str], Verdict] = field(default_factory=dict)
    """By the property file and the name."""

    def put(self, findings: Findings) -> set[str]:
        """Take new findings; the files of which something else is said now."""
        before = self.found.get(findings.root)
        self.found[findings.root] = findings
        for file in findings.readable:
            self.good.setdefault(file, {})[findings.root] = findings
        return _files(before) | _files(findings)

    def forget_closed(self) -> set[str]:
        """Drop what no open file belongs to; the files of which nothing is said any more."""
        gone = [root for root, found in self.found.items() if not (_files(found) & self.opened.keys())]
        files = {file for root in gone for file in _files(self.found.pop(root))}
        for root in gone:
            for known in self.good.values():
                known.pop(root, None)
        return files

    def said(self, file: str) -> list[Said]:
        """What all findings say of a file, each once."""
        every = (said for found in self.found.values() for said in found.said if said.file == file)
        return list(dict.fromkeys(every))

    def known(self, file: str) -> Findings | None:
        """The newest findings with names for a file; else any in which it is."""
        good = list(self.good.get(file, {}).values())
        return good[-1] if good else next((f for f in self.found.values() if file in f.sorts), None)

    def text(self, file: str, findings: Findings | None = None) -> str:
        """The text of a file as the core counts it: that in the editor, else that of the findings, else none."""
        if file in self.opened:
            return self.opened[file].text.removeprefix("\ufeff")
        return "" if findings is None else findings.texts.get(file, "")

    def is_stale(self, verdict: Verdict) -> bool:
        """Whether a text was changed since the check."""
        return any(self.text(file) != text for file, text in verdict.texts.items() if file in self.opened) or any(
            found.texts[file] != text
            for found in self.found.values()
            for file, text in verdict.texts.items()
            if file in found.texts and file not in self.opened
        )

    def reads(self, file: str) -> Iterator[Findings]:
        """The findings in which a file is."""
        return (found for found in self.found.values() if file in found.sorts)


def _files(findings: Findings | None) -> set[str]:
    return set() if findings is None else {*findings.sorts, *(said.file for said in findings.said)}
