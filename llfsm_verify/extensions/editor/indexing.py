"""Finds the names of an arrangement and where they stand: in the draft, so also while it has mistakes.

Nothing here is resolved by the language's own rules: tests compare both.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import chain

from llfsm_verify.extensions.editor.names import WORD, Goal, Index, Kind, Name, Names, Place, Region, resolve_word
from llfsm_verify.plug import (
    ArrangementDraft,
    Draft,
    InstanceDraft,
    MachineDraft,
    MappingNode,
    Node,
    PropertySet,
    Scalar,
    Sequence,
    Span,
    StateDraft,
    UnreadablePart,
    VariableDraft,
    WhiteboardDraft,
)

COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
HASH = re.compile(r"#[^\n]*")


def build_index(draft: Draft | None, properties: PropertySet | None, files: Mapping[str, str]) -> Index:
    """The index of an arrangement with its properties. `files`: the real paths of sources by their names."""
    builder = _Builder(files)
    if draft is not None and not isinstance(draft.arrangement, UnreadablePart):
        builder.arrangement(draft.arrangement)
    if properties is not None:
        builder.properties(properties)
    return builder.index()


def index_machine(draft: MachineDraft, files: Mapping[str, str]) -> Index:
    """The index of a machine that no arrangement names."""
    builder = _Builder(files)
    builder.machine(draft)
    return builder.index()


@dataclass(frozen=True, slots=True)
class _Type:
    text: str
    values: tuple[str, ...] = ()
    at_first: str = "0"


class _Builder:
    def __init__(self, files: Mapping[str, str]) -> None:
        self.files = files
        self.types: dict[str, _Type] = {}
        self.world: dict[str, Name] = {}
        self.regions: list[Region] = []
        self.uses: list[tuple[Place, Name]] = []
        self.outline: list[Name] = []
        self.goals: list[Goal] = []
        self.read: dict[int, tuple[dict[str, Name], dict[str, Name]]] = {}
        """By the identity of a machine's draft: what is inside of it, and what its text sees."""
        self.told: set[int] = set()

    def index(self) -> Index:
        """What was found."""
        uses = {place: name for place, name in self.uses if place.end > place.start}
        return Index(tuple(self.regions), tuple(uses.items()), tuple(self.outline), tuple(self.goals))

    def place(self, span: Span) -> Place:
        return Place(self.files.get(span.source.name, span.source.name), span.start, span.end)

    def name(self, kind: Kind, node: Scalar, about: str, **more: object) -> Name:
        found = Name(node.text, kind, self.place(node.span), about, **more)  # type: ignore[arg-type]
        self.uses.append((found.place, found))
        return found

    # ---------------------------------------------------------------- arrangements

    def arrangement(self, draft: ArrangementDraft) -> None:
        """Types, the whiteboard, machines and what refers to them."""
        own = self.place(draft.span).file
        for key, node in draft.types:
            self._type(key, node)
        for key, node in draft.tables:
            count = len(node.items) if isinstance(node, Sequence) else 0
            self.world[key.text] = self.name("table", key, f"`{key.text}`: a table of {count} numbers")
        for variable in draft.whiteboard:
            self.world[variable.name.text] = self._variable(variable, "of the whiteboard")
        self.world |= self._knowledge(draft)
        top = [*self.world.values()]
        machines = () if isinstance(draft.machines, UnreadablePart) else draft.machines
        plants = tuple(plant for plant in draft.plants if isinstance(plant, InstanceDraft))
        instances: list[tuple[InstanceDraft, Kind]] = [(i, "machine") for i in machines]
        instances += [(p, "plant") for p in plants]
        stubs = {i.name.text: self._instance(i, kind) for i, kind in instances}
        # Machines see each other, so their insides come after all their names.
        self.regions.append(Region(own, 0, self.world))
        for instance, _ in instances:
            if isinstance(instance.machine, MachineDraft):
                stub = stubs[instance.name.text]
                given = self._arguments(instance, stubs)
                _fill(stub, self._inside(instance.machine, given, stubs, stub))
        self.world.update(stubs)
        self._told(draft, self.regions[0])
        for instance, _ in instances:
            self.regions.append(Region(own, self.place(instance.name.span).start, self.world))
            if isinstance(instance.machine, MachineDraft):
                self._text(instance.machine, stubs[instance.name.text])
            for _, value in instance.arguments:
                self._refer(value, self.world)
        order = () if isinstance(draft.processes, UnreadablePart) else draft.processes
        for process in order:
            self._refer(process.slots, stubs)
            self._refer(process.pool, stubs)
        for part in (draft.operators, draft.access):
            self._refer(part, self.world, keys=True)
        self.outline += [*(n for n in top if n.place.file == own), *stubs.values()]

    def _instance(self, draft: InstanceDraft, kind: Kind) -> Name:
        machine = draft.machine.name if isinstance(draft.machine, MachineDraft) else None
        of = f", machine `{machine.text}`" if isinstance(machine, Scalar) else ""
        what = "instance" if kind == "machine" else "model of the surroundings"
        return self.name(kind, draft.name, f"`{draft.name.text}`: {what}{of}", inside={})

    def _arguments(self, draft: InstanceDraft, machines: Names) -> dict[str, Name]:
        """The machines that its arguments name, by their parameters."""
        given = {key.text: value.text for key, value in draft.arguments if isinstance(value, Scalar)}
        return {key: machines[value] for key, value in given.items() if value in machines}

    def _type(self, key: Scalar, node: Node) -> None:
        found = self._read_type(node)
        shown = f"`{key.text}`: {found.text}"
        self.world[key.text] = self.name("type", key, shown, values=found.values)
        self.types[key.text] = replace(found, text=f"{key.text} ({found.text})")
        if isinstance(node, Sequence):
            for item in (each for each in node.items if isinstance(each, Scalar)):
                about = f"`{item.text}`: a value of `{key.text}` ({found.text})"
                self.world.setdefault(item.text, self.name("value", item, about, values=found.values))

    def _read_type(self, node: Node | UnreadablePart | None) -> _Type:
        if isinstance(node, Scalar):
            self._refer(node, self.world)
            if node.text == "bool":
                return _Type("bool", ("true", "false"), "false")
            return self.types.get(node.text, _Type(_bounds(node.text)))
        if isinstance(node, Sequence):
            words = tuple(item.text for item in node.items if isinstance(item, Scalar))
            return _Type(", ".join(words), words, words[0] if words else "")
        if isinstance(node, MappingNode):
            parts = {key.text: value for key, value in node.items}
            if "array" in parts:
                size = parts.get("size")
                return _Type(f"array of {size.text if isinstance(size, Scalar) else '?'} {self._of(parts['array'])}")
            record = parts.get("record")
            if isinstance(record, MappingNode):
                fields = record.items
                return _Type("record " + ", ".join(f"{key.text}: {self._of(value)}" for key, value in fields))
            if "decimal" in parts:
                step, between = (self._of(parts[key]) if key in parts else "?" for key in ("decimal", "range"))
                return _Type(f"decimal {between} in steps of {step}")
        return _Type("?")

    def _of(self, node: Node) -> str:
        return self._read_type(node).text

    def _variable(self, draft: WhiteboardDraft | VariableDraft, where: str) -> Name:
        kind = self._read_type(draft.type)
        self._refer(draft.init, self.world)
        first = draft.init.text if isinstance(draft.init, Scalar) else kind.at_first if draft.init is None else "…"
        told = [f"variable {where}"]
        if isinstance(draft, WhiteboardDraft):
            given = {"role": draft.role, "changes": draft.changes, "safe": draft.safe}
            told += [f"{key} {node.text}" for key, node in given.items() if isinstance(node, Scalar)]
        place = self.place(draft.name.span)
        line = draft.name.span.line
        about = f"`{draft.name.text}`: {kind.text}\n\n{', '.join(told)}; at first `{first}`"
        about += f"; declared in {place.file.rsplit('/', 1)[-1]}, line {line}"
        return self.name("variable", draft.name, about, values=kind.values)

    def _knowledge(self, draft: ArrangementDraft | MachineDraft) -> dict[str, Name]:
        """What theories say."""
        entries = draft.knowledge
        return {e.name.text: self.name("definition", e.name, f"`{e.name.text}`: {_said(e.file)}") for e in entries}

    def _told(self, draft: ArrangementDraft | MachineDraft, region: Region) -> None:
        """The names in what theories are told."""
        for node in (node for entry in draft.knowledge for _, node in entry.inputs if isinstance(node, Scalar)):
            self._read(node, region)

    # ---------------------------------------------------------------- machines

    def machine(self, draft: MachineDraft) -> None:
        """A machine alone."""
        if isinstance(draft.name, Scalar):
            stub = self.name("machine", draft.name, f"machine `{draft.name.text}`", inside={})
            _fill(stub, self._inside(draft, {}, {}, stub))
            self._text(draft, stub)
            self.outline.append(stub)

    def _inside(self, draft: MachineDraft, given: Names, machines: Names, stub: Name) -> dict[str, Name]:
        """Its states and variables; what its text sees is kept for `_text`."""
        if id(draft) in self.read:
            return self.read[id(draft)][0]
        found: dict[str, Name] = {}
        seen: dict[str, Name] = {**self.world, **machines}
        for parameter in draft.parameters:
            kind = self._read_type(parameter.type) if parameter.type is not None else _Type("a machine")
            sort = "" if isinstance(parameter.kind, UnreadablePart) else parameter.kind
            target = given.get(parameter.name.text)
            about = f"`{parameter.name.text}`: {kind.text}\n\n{sort} parameter"
            inside = {} if target is None else target.inside
            seen[parameter.name.text] = self.name("parameter", parameter.name, about, values=kind.values, inside=inside)
        for variable in draft.variables:
            found[variable.name.text] = self._variable(variable, "of the machine")
        found |= self._knowledge(draft)
        states = () if isinstance(draft.states, UnreadablePart) else draft.states
        starts = [self.place(s.name.span).start for s in states]
        for state, end in zip(states, chain(starts[1:], [draft.states_at.end]), strict=False):
            if isinstance(state.name, Scalar):
                found[state.name.text] = self._state(state, end)
        own = {word: name for word, name in found.items() if name.kind != "state"}
        self.read[id(draft)] = found, {**seen, **own, "self": stub}
        return found

    def _state(self, state: StateDraft, end: int) -> Name:
        assert isinstance(state.name, Scalar)
        variables = {v.name.text: self._variable(v, f"of state {state.name.text}") for v in state.variables}
        goes = [t.target.text for t in state.transitions if isinstance(t.target, Scalar)]
        to = f"; goes to {', '.join(dict.fromkeys(goes))}" if goes else "; has no transitions"
        place = self.place(state.name.span)
        whole = Place(place.file, place.start, max(end, place.end))
        about = f"state `{state.name.text}`{to}"
        return self.name("state", state.name, about, inside=variables, whole=whole)

    def _text(self, draft: MachineDraft, stub: Name) -> None:
        """The regions of its text, and what stands in it."""
        place, (inside, seen) = self.place(draft.name.span), self.read[id(draft)]
        start = stub.place.start if place.file == stub.place.file else 0
        region = Region(place.file, start, seen, stub)
        if id(draft) in self.told:
            return  # by another instance
        self.told.add(id(draft))
        self.regions.append(region)
        self._told(draft, region)
        states = {word: name for word, name in inside.items() if name.kind == "state"}
        for node in (draft.initial, draft.suspend):
            self._refer(node, states)
        for state in () if isinstance(draft.states, UnreadablePart) else draft.states:
            if not isinstance(state.name, Scalar) or state.name.text not in states:
                continue
            name = states[state.name.text]
            own = Region(place.file, name.place.start, {**seen, **name.inside}, stub)
            self.regions.append(own)
            for text in state.actions.values():
                self._read(text, own)
            for transition in state.transitions:
                if isinstance(transition.guard, Scalar):
                    self._read(transition.guard, own)
                self._refer(transition.target, states)
            self._refer(state.runs, seen)

    def _read(self, node: Scalar, region: Region) -> None:
        """The names in a guard or an action."""
        text = node.fragment.text
        for word in _words(text, COMMENT):
            found = resolve_word(text, word.start(), word.end(), region)
            if found is not None:
                self.uses.append((self.place(node.fragment.span(word.start(), word.end())), found))

    def _refer(self, node: Node | UnreadablePart | None, names: Names, *, keys: bool = False) -> None:
        """The names in a value of the file; `keys`: also in those of mappings."""
        todo: list[Node] = [] if node is None or isinstance(node, UnreadablePart) else [node]
        while todo:
            part = todo.pop()
            if isinstance(part, Sequence):
                todo += part.items
            elif isinstance(part, MappingNode):
                todo += [value for _, value in part.items] + ([key for key, _ in part.items] if keys else [])
            elif isinstance(part, Scalar) and part.text in names:
                self.uses.append((self.place(part.span), names[part.text]))

    # ---------------------------------------------------------------- properties

    def properties(self, properties: PropertySet) -> None:
        """Property files see the world, and what definitions say."""
        seen = dict(self.world)
        for word, span in properties.definitions.items():
            place = self.place(span)
            seen[word] = Name(word, "definition", place, f"`{word}`: {_line(span)}")
            self.uses.append((place, seen[word]))
        sources = {}
        for line in properties:
            place, source = self.place(line.span), line.span.source
            sources[place.file] = source
            at = source.text.rfind(line.name, 0, place.start)
            named = Place(place.file, at, at + len(line.name)) if at >= 0 and place.start - at < 200 else place
            name = Name(line.name, "property", named, f"{line.kind} `{line.name}`: `{line.text}`", whole=place)
            self.outline.append(name)
            if line.kind != "assume":
                self.goals.append(Goal(line.name, line.text, place))
        for file, source in sources.items():
            region = Region(file, 0, seen)
            self.regions.append(region)
            for each in _words(source.text, HASH):
                found = resolve_word(source.text, each.start(), each.end(), region)
                if found is not None:
                    self.uses.append((Place(file, each.start(), each.end()), found))


def _fill(name: Name, inside: Names) -> None:
    """What is inside of a name is known after it; until the index is made, it is a dictionary of ours."""
    assert isinstance(name.inside, dict)
    name.inside.update(inside)


def _said(file: Scalar | None) -> str:
    return f"what {'a theory' if file is None else file.text} says"


def _line(span: Span) -> str:
    return span.source.line(span.line).strip()


def _words(text: str, comment: re.Pattern[str]) -> Iterator[re.Match[str]]:
    """The words of a text outside of comments."""
    yield from WORD.finditer(comment.sub(lambda found: " " * len(found[0]), text))


def _bounds(kind: str) -> str:
    """A type of integers with the numbers in it."""
    width = re.fullmatch(r"(u?)int(8|16|32|64)", kind)
    if width is None:
        return kind
    low, high = (0, 2 ** int(width[2]) - 1) if width[1] else (-(2 ** (int(width[2]) - 1)), 2 ** (int(width[2]) - 1) - 1)
    return f"{kind} ({low:,}..{high:,})"
