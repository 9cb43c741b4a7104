"""The files of a guarded arrangement: the texts that are there, edited where something changes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from llfsm_verify.arrangement.draft import Draft, Unreadable
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.diagnostics import Source, Span
from llfsm_verify.guarding.editing import Document, Edits, flow, quoted
from llfsm_verify.guarding.rewiring import instances
from llfsm_verify.guarding.wanted import Names
from llfsm_verify.language.parser import parse_actions
from llfsm_verify.language.syntax import Call
from llfsm_verify.language.types import ArrayType, RecordType, scalar_text
from llfsm_verify.monitoring.machine_reads import expressions_in, type_text
from llfsm_verify.yaml.nodes import Scalar

SUFFIX = ".machine.yaml"
POLICY_FILE = ("access", "file")


class Layout:
    """Collects what changes; `files` gives the texts."""

    def __init__(self, draft: Draft, arrangement: Arrangement, names: Names) -> None:
        """DiagnosticError: the arrangement's text cannot be edited."""
        self._names = names
        self._arrangement = arrangement
        self._draft = draft
        main = draft.sources[0]
        self._document = Document(main)
        self._edits = {main.name: self._document.edits}
        self._folder = Path() if main.name.startswith("<") else Path(main.name).parent
        self._sources = {source.name: source for source in draft.sources[1:]}
        self._main = "arrangement.yaml" if main.name.startswith("<") else Path(main.name).name
        self._files: dict[str, str | Source] = {}
        """New files by their names: a text, or the source of one."""

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
                text = f"{{type: {type_text(kind, known)}, init: {start}}}"
                document.put(("whiteboard", variable.name), text)
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
            entries = {
                "levels": f"[behaviour, {names.level}]",
                "machines": flow(machines),
                "write": flow(write),
                **({"command": flow(command)} if command else {}),
                **({"on_violation": "refuse"} if self._suspends_all() else {}),
            }
            self._document.put(("access",), entries)
            return
        document, at = self._policy()
        document.append((*at, "levels"), names.level)
        for output, slot in names.requests.items():
            if output in access.write:
                write[slot] = access.levels[access.write[output]]
        document.put_all((*at, "machines"), machines)
        document.put_all((*at, "write"), write)
        if command:
            document.put_all((*at, "command"), command)
        if self._suspends_all() and not access.refuses:
            document.put((*at, "on_violation"), "refuse")

    def _policy(self) -> tuple[Document, tuple[str, ...]]:
        """Where the policy stands: a document, and the keys that lead to it."""
        file = self._document.text(*POLICY_FILE)
        if file is None:
            return self._document, POLICY_FILE[:1]
        source = self._sources[str(self._folder / file)]
        document = Document(source)
        self._edits[source.name] = document.edits
        return document, ()

    def _suspends_all(self) -> bool:
        """A machine suspends all others, and so would do what it may not: monitor and switch are among them."""
        return any(
            isinstance(node, Call) and node.function.name.text == "suspend_all"
            for action in self._actions()
            for node in expressions_in(parse_actions(action.fragment).statements)
        )

    def _actions(self) -> Iterator[Scalar]:
        assert not isinstance(self._draft.arrangement, Unreadable)
        for instance in instances(self._draft.arrangement):
            machine = instance.machine
            if not isinstance(machine, Unreadable) and not isinstance(machine.states, Unreadable):
                for state in machine.states:
                    yield from state.actions.values()

    def add_machine(self, name: str, file: str, arguments: Mapping[str, str], text: str | Source) -> None:
        """Another machine at the end of the schedule, in a file of its own. A source is edited as others are."""
        self.define(name, file, arguments, text)
        one = self._document.get("schedule") is not None
        self._document.append(("schedule",) if one else ("processes", self._document.names("processes")[0]), name)

    def define(self, name: str, file: str, arguments: Mapping[str, str], text: str | Source) -> None:
        """The same, but it has no turn yet."""
        placed = self._place(file, text)
        parameters = {"parameters": flow(arguments)} if arguments else {}
        self._document.put(("machines", name), flow({"file": quoted(placed), **parameters}))

    def _place(self, file: str, text: str | Source) -> str:
        """A name in the new folder that nothing has yet."""
        stem = file.removesuffix(SUFFIX)
        ending = file[len(stem) :]
        name, number = file, 2
        while name in (self._main, *self._files):
            name, number = f"{stem}_{number}{ending}", number + 1
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
                self._document.put(keys, quoted(placed[source.name, same]))
        return {
            self._main: self._document.edits.result(),
            **{name: self._edited(text) for name, text in self._files.items()},
        }

    def named_files(self) -> list[tuple[str, ...]]:
        """Where the arrangement may name files: keys that lead inwards."""
        machines = self._document.names("machines")
        return [*(("machines", name, "file") for name in machines), ("environment", "file"), POLICY_FILE]

    def _edited(self, text: str | Source) -> str:
        if isinstance(text, str):
            return text
        edits = self._edits.get(text.name)
        return text.text if edits is None else edits.result()
