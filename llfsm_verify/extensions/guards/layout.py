"""The files of a guarded arrangement: the texts that are there, edited where something changes."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.guards.codes import UNFIT
from llfsm_verify.extensions.guards.rewiring import instances
from llfsm_verify.extensions.guards.wanted import Names
from llfsm_verify.plug import (
    Arrangement,
    ArrayType,
    CallNode,
    DocumentValue,
    Draft,
    Editor,
    Edits,
    InstanceDraft,
    MachineDraft,
    NewMachine,
    RecordType,
    Scalar,
    Source,
    Span,
    Uneditable,
    UnreadablePart,
    Unregistered,
    declared_type,
    ending_of,
    expressions_in,
    parse_actions,
    scalar_text,
    writer_of,
)

POLICY_FILE = ("access", "file")
_ENDING = re.compile(r"(\.machine)?\.[^.]+$")


class Layout:
    """Collects what changes; `files` gives the texts."""

    def __init__(self, draft: Draft, arrangement: Arrangement, names: Names) -> None:
        """DiagnosticError: the arrangement's text cannot be edited."""
        self._names = names
        self._arrangement = arrangement
        self._draft = draft
        main = draft.sources[0]
        (edit, self._machine), self._ending = _writer(main), ending_of(main.name)
        self._document = _editor(edit, main)
        self._edits = {main.name: self._document.edits}
        self._editors: dict[str, Editor] = {}
        """Of other files than the arrangement's."""
        self._folder = Path() if main.name.startswith("<") else Path(main.name).parent
        self._sources = {source.name: source for source in draft.sources[1:]}
        self._main = f"arrangement{self._ending}" if main.name.startswith("<") else Path(main.name).name
        self._files: dict[str, str | Source] = {}
        """New files by their names: a text, or the source of one."""
        assert not isinstance(draft.arrangement, UnreadablePart)
        self._theories = [*draft.arrangement.knowledge]
        for instance in (*instances(draft.arrangement), *draft.arrangement.plants):
            if isinstance(instance, InstanceDraft):
                self._tell(instance.machine)

    def _tell(self, machine: MachineDraft | UnreadablePart) -> None:
        self._theories += () if isinstance(machine, UnreadablePart) else machine.knowledge

    def replace(self, span: Span, text: str) -> None:
        """Another text at a place of a file."""
        name = span.source.name
        self._sources.setdefault(name, span.source)
        self._edits.setdefault(name, Edits(span.source)).replace(span.start, span.end, text)

    def route(self, known: Arrangement) -> None:
        """Slots, clearances and what becomes of faults; `known` has the types of the slots."""
        document, names, arrangement = self._document, self._names, self._arrangement
        for entry in known.whiteboard:
            variable = entry.variable
            if variable.name in (*names.requests.values(), names.alarm):
                kind, init = variable.type, variable.init
                assert not isinstance(init, tuple)
                assert not isinstance(kind, ArrayType | RecordType)
                start = scalar_text(init, kind)
                document.put(("whiteboard", variable.name), {"type": declared_type(kind, known), "init": start})
        if arrangement.observe != "cycle":
            document.put(("observe",), "cycle")
        for machine in names.guarded:
            document.put(("machines", machine, "on_fault"), "unload")
        document.swap(("operators", "write"), names.requests)
        self._clearances()

    def _clearances(self) -> None:
        names, access = self._names, self._arrangement.access
        machines = dict.fromkeys((*names.monitors, names.switch, *names.rights.substitutes), names.level)
        write = dict.fromkeys((*names.requests, names.alarm, *names.rights.variables), names.level)
        command = dict.fromkeys(names.rights.commanded, names.level)
        if access is None:
            entries: dict[str, DocumentValue] = {
                "levels": ["behaviour", names.level],
                "machines": machines,
                "write": write,
                **({"command": command} if command else {}),
                **({"on_violation": "refuse"} if self._suspends_all() else {}),
            }
            self._document.put(("access",), entries)
            return
        document, at = self._policy()
        document.append((*at, "levels"), names.level)
        for output, slot in names.requests.items():
            if output in access.write:
                write[slot] = access.levels[access.write[output]]
        for key, levels in (("machines", machines), ("write", write), ("command", command)):
            if levels and not document.has(*at, key):
                document.put((*at, key), levels)
                continue
            for name, level in levels.items():
                document.put((*at, key, name), level)
        if self._suspends_all() and not access.refuses:
            document.put((*at, "on_violation"), "refuse")

    def _policy(self) -> tuple[Editor, tuple[str, ...]]:
        """Where the policy stands: a document, and the keys that lead to it."""
        file = self._document.text(*POLICY_FILE)
        if file is None:
            return self._document, POLICY_FILE[:1]
        source = self._sources[str(self._folder / file)]
        document = _editor(_writer(source)[0], source)
        self._edits[source.name], self._editors[source.name] = document.edits, document
        return document, ()

    def _suspends_all(self) -> bool:
        """A machine suspends all others, and so would do what it may not: monitor and switch are among them."""
        return any(
            isinstance(node, CallNode) and node.function.name.text == "suspend_all"
            for action in self._actions()
            for node in expressions_in(parse_actions(action.fragment).statements)
        )

    def _actions(self) -> Iterator[Scalar]:
        assert not isinstance(self._draft.arrangement, UnreadablePart)
        for instance in instances(self._draft.arrangement):
            machine = instance.machine
            if not isinstance(machine, UnreadablePart) and not isinstance(machine.states, UnreadablePart):
                for state in machine.states:
                    yield from state.actions.values()

    def add_machine(self, name: str, arguments: Mapping[str, str], machine: NewMachine | MachineDraft) -> None:
        """Another machine at the end of the schedule, in a file of its own. What was read is edited as others are."""
        self.define(name, arguments, machine)
        one = self._document.has("schedule")
        self._document.append(("schedule",) if one else ("processes", self._document.names("processes")[0]), name)

    def define(self, name: str, arguments: Mapping[str, str], machine: NewMachine | MachineDraft) -> None:
        """The same, but it has no turn yet."""
        if isinstance(machine, MachineDraft):
            self._tell(machine)
            source = machine.states_at.source
            placed = self._place(Path(source.name).name, source)
        else:
            placed = self._place(f"{name}.machine{self._ending}", self._machine(machine))
        self._document.put(("machines", name), {"file": placed, **({"parameters": arguments} if arguments else {})})

    def _place(self, file: str, text: str | Source) -> str:
        """A name in the new folder that nothing has yet."""
        ending = _ENDING.search(file)
        stem = file if ending is None else file[: ending.start()]
        name, number = file, 2
        while name in (self._main, *self._files):
            name, number = f"{stem}_{number}{file[len(stem) :]}", number + 1
        self._files[name] = text
        return name

    def files(self) -> dict[str, str]:
        """The texts by their names, that of the arrangement first. To be called once, when all is said."""
        placed: dict[tuple[str, bool], str] = {}
        for keys in self.named_files():
            file = self._document.text(*keys)
            if file is None:
                continue
            source = self._sources[str(self._folder / file)]
            # The model of the surroundings goes on with the outputs themselves, also where a machine has its file.
            same = keys[0] != "environment" or source.name not in self._edits
            if (source.name, same) not in placed:
                text = source if same else source.text
                placed[source.name, same] = self._place(Path(source.name).name, text)
            if placed[source.name, same] != file:
                self._document.put(keys, placed[source.name, same])
        theories: dict[str, str] = {}
        for entry in self._theories:
            assert isinstance(entry.theory, Source)
            assert entry.file is not None
            name = entry.theory.name
            theories[name] = theories.get(name) or self._place(Path(name).name, entry.theory)
            if theories[name] != entry.file.text:
                self.replace(entry.file.span, json.dumps(theories[name], ensure_ascii=False))
        return {
            self._main: self._document.result(),
            **{name: self._edited(text) for name, text in self._files.items()},
        }

    def named_files(self) -> list[tuple[str, ...]]:
        """Where the arrangement may name files: keys that lead inwards."""
        named = [(key, name, "file") for key in ("machines", "environment") for name in self._document.names(key)]
        return [*named, ("environment", "file"), POLICY_FILE]

    def _edited(self, text: str | Source) -> str:
        if isinstance(text, str):
            return text
        found = self._editors.get(text.name) or self._edits.get(text.name)
        return text.text if found is None else found.result()


def _writer(source: Source) -> tuple[Callable[[Source], Editor], Callable[[NewMachine], str]]:
    """What edits a text in the format of this one, and what writes machines in it. DiagnosticError (E438): nothing."""
    try:
        writer = writer_of(source.name)
    except Unregistered as error:
        raise _unwritable(source, str(error)) from None
    if writer.machine is None or writer.edit is None:
        raise _unwritable(source, "its format has no writer of machines, or none that edits texts")
    return writer.edit, writer.machine


def _unwritable(source: Source, why: str) -> DiagnosticError:
    message = f"`{source.name}` cannot be written: {why}"
    return DiagnosticError(Diagnostic(UNFIT, message, Span(source, 0, 1), hint="guard it in another format"))


def _editor(edit: Callable[[Source], Editor], source: Source) -> Editor:
    """DiagnosticError (E438): the text has something that cannot be changed."""
    try:
        return edit(source)
    except Uneditable as error:
        raise DiagnosticError(Diagnostic(UNFIT, error.message, error.span, hint=error.hint)) from None
