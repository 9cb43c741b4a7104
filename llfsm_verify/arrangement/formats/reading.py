"""Reading one arrangement: what was read so far, what is wrong with it, and its machine files, each read once.

The formats of machine files and of policies are here as well, by name.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from llfsm_verify.arrangement.draft import UNREADABLE, ArrangementDraft, Draft, MachineDraft, Unreadable
from llfsm_verify.arrangement.files import read_named, read_source, read_stdin, source_of
from llfsm_verify.arrangement.formats import USUAL, Given
from llfsm_verify.arrangement.keys import VOCABULARY
from llfsm_verify.arrangement.kinds import may_be_shown, unlike
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source
from llfsm_verify.registry import Entry, Registry
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Node, Scalar, mark, written


class Reading(Report):
    """Readers of arrangements begin one, and readers of machines add to it."""

    def __init__(self, folder: Path, files: Mapping[str, str] | None = None) -> None:
        """`folder`: where machine files are looked up. `files`: texts of some by their paths, read instead."""
        super().__init__(VOCABULARY)
        self.folder = folder
        self.files = dict(files or {})
        self.sources: list[Source] = []
        self._digest = hashlib.sha256()
        self._machines: dict[str, MachineDraft | Unreadable] = {}
        self._policies: list[Path] = []
        self._theories: dict[str, Source | Unreadable] = {}
        self.known: Mapping[str, Source] | None = None
        """The only theories that there are, by their paths; None: files are read."""

    def add_source(self, source: Source, data: bytes) -> None:
        """A text that is read now, and the bytes that the arrangement's digest has of it."""
        self.sources.append(source)
        self._digest.update(data)

    def machine(self, at: Scalar) -> MachineDraft | Unreadable:
        """The machine in the file that `at` names."""
        path = self.folder / at.text
        if str(path) not in self._machines:
            self._machines[str(path)] = read_machine(self, path, at)
        return self._machines[str(path)]

    def machine_text(self, name: str, text: str) -> MachineDraft | Unreadable:
        """The machine in a text that came from elsewhere, where it has this name, whose ending tells its format."""
        path = Path(name)
        self.files[str(path)] = text
        return read_machine(self, path, _named(name))

    def policy_text(self, name: str, text: str) -> Node | None:
        """The same for a policy; None: it cannot be read."""
        path = Path(name)
        self.files[str(path)] = text
        return read_policy(self, path, _named(name))

    def policy(self, at: Scalar) -> Node | None:
        """What the policy file that `at` names says; None: it cannot be read."""
        self._policies.append(self.folder / at.text)
        return read_policy(self, self._policies[-1], at)

    def theory(self, at: Scalar) -> Source | Unreadable:
        """The text of the theory in the file that `at` names; its path is relative to the text in which it stands."""
        path = (Path(at.span.source.name).parent if self.known is None else self.folder) / at.text
        if str(path) not in self._theories:
            self._theories[str(path)] = self._read_theory(path, at)
        return self._theories[str(path)]

    def _read_theory(self, path: Path, at: Scalar) -> Source | Unreadable:
        if self.known is not None:
            if str(path) not in self.known:
                hint = "a machine that is loaded into a run has the theories that the run began with"
                self.error("E001", f"theory `{at.text[:200]}`: the run has no such file", mark(at), hint)
                return UNREADABLE
            return self.known[str(path)]
        source = named_source(self, path, at, "theory")
        if source is not None and may_be_shown(source, "theory"):
            return source
        if source is not None:
            self.diagnostics.append(unlike("theory", at.text, mark(at)))
        return UNREADABLE

    def added(self, draft: Draft, arrangement: ArrangementDraft) -> Draft:
        """The draft with this arrangement in its place, and with what was read for that."""
        sources, diagnostics = (*draft.sources, *self.sources), (*draft.diagnostics, *self.diagnostics)
        return replace(draft, arrangement=arrangement, sources=sources, diagnostics=diagnostics)

    def draft(self, arrangement: ArrangementDraft | Unreadable, path: str, instead: Diagnostic | None = None) -> Draft:
        """All that was read."""
        return Draft(
            arrangement,
            path,
            self._digest.hexdigest(),
            tuple(self.sources),
            (*map(Path, self._machines), *self._policies, *map(Path, self._theories)),
            tuple(self.diagnostics),
            instead,
        )


def opened(given: Given) -> tuple[Source, bytes]:
    """The text that a reader is asked for, and its bytes. DiagnosticError: there is no such file, or it is no text."""
    if given.text is not None:
        data = given.text.encode("utf-8", "surrogatepass")
        return source_of(data, str(given.path)), data
    if given.named_at is not None:
        return read_named(given.path, given.named_at, f"arrangement `{str(given.path)[:200]}`")
    return read_stdin(given.stdin) if str(given.path) == "-" else read_source(given.path)


def named_source(reading: Reading, path: Path, at: Scalar, what: str) -> Source | None:
    """The text of a file that is named `at` a place, or the text that is given for it; None: it cannot be read."""
    try:
        if str(path) in reading.files:
            data = reading.files[str(path)].encode("utf-8", "surrogatepass")
            source = source_of(data, str(path))
        else:
            source, data = read_named(path, mark(at), f"{what} file `{at.text[:200]}`")
    except DiagnosticError as e:
        reading.add(e)
        return None
    reading.add_source(source, data)
    return source


MACHINES: Registry[Callable[[Reading, Path, Scalar], MachineDraft | Unreadable]] = Registry(
    "machine format",
    [Entry("yaml", "llfsm_verify.arrangement.formats.yaml:read_machine", "YAML", (".yaml", ".yml"))],
    "llfsm_verify.machines",
)
"""Of machines in files of their own. A reader gets the path and the place where it is named; what it reads, and what is
wrong with it, goes to the `Reading`."""

POLICIES: Registry[Callable[[Reading, Path, Scalar], Node | None]] = Registry(
    "policy format", [Entry("yaml", "llfsm_verify.arrangement.formats.yaml:read_policy", "YAML", (".yaml", ".yml"))]
)
"""Of what `access` may say in a file of its own; otherwise as for machines."""


def read_machine(reading: Reading, path: Path, at: Scalar) -> MachineDraft | Unreadable:
    """The draft of the machine in the file at `path`, in the format that its ending stands for; `at` names it."""
    return MACHINES.load(MACHINES.named_by(str(path)) or USUAL)(reading, path, at)


def read_policy(reading: Reading, path: Path, at: Scalar) -> Node | None:
    """What the policy file at `path` says; `at` names it. None: it cannot be read."""
    return POLICIES.load(POLICIES.named_by(str(path)) or USUAL)(reading, path, at)


def _named(name: str) -> Scalar:
    """A name that stands in no file."""
    return written(Source(name, name), 0, len(name))
