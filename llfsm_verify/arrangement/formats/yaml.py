"""Arrangements and machines in YAML: documents, their files and what is said of files of another kind."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from llfsm_verify.arrangement.draft import UNREADABLE, Draft, MachineDraft, Unreadable
from llfsm_verify.arrangement.formats import ARRANGEMENTS, Given
from llfsm_verify.arrangement.formats.documents import draft_arrangement, draft_machine
from llfsm_verify.arrangement.formats.reading import Reading, named_source, opened
from llfsm_verify.arrangement.keys import VOCABULARY
from llfsm_verify.arrangement.kinds import may_be_shown, other_kind, unlike
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source
from llfsm_verify.yaml.compose import compose
from llfsm_verify.yaml.fields import VERSION
from llfsm_verify.yaml.nodes import Mapping, Node, Scalar, mark


def read_arrangement(given: Given) -> Draft:
    """The draft of an arrangement; DiagnosticError: what `read_source` raises."""
    source, data = opened(given)
    told = ARRANGEMENTS.told_by(source.text)
    if told is not None:
        return ARRANGEMENTS.load(told)(replace(given, path=source.name, text=source.text))
    from_file = (given.text is None or given.files is not None) and str(given.path) != "-"
    reading = Reading(Path(given.path).parent if from_file else Path(), given.files)
    reading.add_source(source, data)
    other = instead = other_kind(source, "arrangement")
    if given.named_at is not None and not may_be_shown(source):
        instead = unlike("arrangement", source.name, given.named_at)
    try:
        root = compose(source, reading.diagnostics, VOCABULARY)
    except DiagnosticError as e:
        reading.diagnostics = list(e.diagnostics)
        return reading.draft(UNREADABLE, source.name, other if _is_empty(e) else instead)
    return reading.draft(draft_arrangement(reading, root, _default_name(source)), source.name, instead)


def read_machine(reading: Reading, path: Path, at: Scalar) -> MachineDraft | Unreadable:
    """The draft of the machine in the file at `path`, which is named `at` a place."""
    source = named_source(reading, path, at, "machine")
    if source is None:
        return UNREADABLE
    other = other_kind(source, "machine")
    shown = str(path) in reading.files or may_be_shown(source)
    return _machine_in(reading, source, other, other if shown else unlike("machine", at.text, mark(at)))


def read_policy(reading: Reading, path: Path, at: Scalar) -> Node | None:
    """What the policy in the file at `path` says, which is named `at` a place; None: it cannot be read."""
    source = named_source(reading, path, at, "policy")
    if source is None:
        return None
    if not may_be_shown(source, "policy"):
        reading.diagnostics.append(unlike("policy", at.text, mark(at)))
        return None
    found: list[Diagnostic] = []
    try:
        root = compose(source, found, VOCABULARY)
    except DiagnosticError as e:
        reading.add(e)
        return None
    reading.diagnostics += found
    if not reading.can_read(root, "the policy"):
        return None
    if isinstance(root, Mapping):
        root = replace(root, items=tuple(item for item in root.items if item[0].text != VERSION))
    return root


def _machine_in(
    reading: Reading, source: Source, other: Diagnostic | None, instead: Diagnostic | None
) -> MachineDraft | Unreadable:
    """`other`: what to say where nothing is in the text; `instead`: where something is wrong with it."""
    before = len(reading.diagnostics)
    found: list[Diagnostic] = []
    try:
        root = compose(source, found, VOCABULARY)
    except DiagnosticError as e:
        said = other if _is_empty(e) else instead
        reading.diagnostics += e.diagnostics if said is None else [said]
        return UNREADABLE
    reading.diagnostics += found
    draft = draft_machine(reading, root)
    if instead is not None and any(d.is_error for d in reading.diagnostics[before:]):
        reading.diagnostics[before:] = [instead]
        return UNREADABLE
    return draft if isinstance(draft, Unreadable) else replace(draft, instead=instead)


def _is_empty(error: DiagnosticError) -> bool:
    """Nothing stands in the file, so nothing of it is shown."""
    return all(d.code == "E011" for d in error.diagnostics)


def _default_name(source: Source) -> str:
    stem = Path(source.name).name.split(".")[0]
    return stem if stem and not source.name.startswith("<") else "arrangement"
