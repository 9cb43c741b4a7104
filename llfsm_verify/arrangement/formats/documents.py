"""Documents: arrangements and machines in the shape of mappings with known keys, as YAML files and Python data have it.

Here it is said which keys (`keys.py`) are missing and which have the wrong shape; docs/files.md describes them.
"""

from __future__ import annotations

import re
from dataclasses import fields as dataclass_fields
from dataclasses import replace
from functools import cache
from typing import Any

from llfsm_verify.arrangement import model
from llfsm_verify.arrangement.draft import (
    UNREADABLE,
    ArrangementDraft,
    Entry,
    InstanceDraft,
    KnowledgeDraft,
    Lint,
    MachineDraft,
    ParameterDraft,
    PlantDraft,
    ProcessDraft,
    StateDraft,
    TransitionDraft,
    Unreadable,
    VariableDraft,
    WhiteboardDraft,
)  # fmt: skip
from llfsm_verify.arrangement.formats.reading import Reading
from llfsm_verify.arrangement.keys import (
    ARRANGEMENT,
    ENVIRONMENT,
    INSTANCE,
    KNOWLEDGE,
    MACHINE,
    PARAMETER,
    POLICY_FILE,
    STATE,
    TRANSITION,
    VARIABLE,
    WHITEBOARD,
)
from llfsm_verify.arrangement.model import ACTION_KINDS, ActionKind
from llfsm_verify.arrangement.suppressions import KEY
from llfsm_verify.diagnostics import Span
from llfsm_verify.language.scope import did_you_mean
from llfsm_verify.yaml.fields import Report, is_name
from llfsm_verify.yaml.nodes import Mapping, Node, Scalar, Sequence, implied, mark
from llfsm_verify.yaml.tables import Table


def draft_arrangement(reading: Reading, root: Node, name: str) -> ArrangementDraft | Unreadable:
    """The arrangement that the document `root` describes; `name` is its name where it gives itself none."""
    if not reading.can_read(root, "the arrangement"):
        return UNREADABLE
    fields = reading.fields(root, "an arrangement", ARRANGEMENT.keys)
    if fields is None:
        return UNREADABLE
    top = Span(root.span.source, root.span.start, root.span.start + 1)
    return ArrangementDraft(
        name=fields.get("name", name),
        span=top,
        types=_entries(reading, fields.get("types"), "`types`"),
        tables=_entries(reading, fields.get("tables"), "`tables`"),
        whiteboard=_whiteboard(reading, fields.get("whiteboard")),
        knowledge=_knowledge(reading, fields.get("knowledge")),
        machines=_instances(reading, fields.get("machines"), top),
        processes=_processes(reading, fields) if "machines" in fields else UNREADABLE,
        lint=_lint(fields, root),
        plants=_plants(reading, root, fields.get("environment")),
        access=_access(reading, fields.get("access")),
        **_as_written(ArrangementDraft, fields),
    )


def draft_machine(report: Reading, root: Node) -> MachineDraft | Unreadable:
    """The machine that the document `root` describes."""
    if not report.can_read(root, "the machine"):
        return UNREADABLE
    fields = report.fields(root, "a machine", MACHINE.keys, MACHINE.required)
    if fields is None:
        return UNREADABLE
    return MachineDraft(
        name=fields["machine"],
        parameters=_parameters(report, fields.get("parameters")),
        variables=_variables(report, fields.get("variables")),
        knowledge=_knowledge(report, fields.get("knowledge")),
        states=_states(report, fields["states"]),
        states_at=mark(fields["states"]),
        lint=_lint(fields, root),
        **_as_written(MachineDraft, fields),
    )


@cache
def _written_fields(draft: type) -> tuple[str, ...]:
    return tuple(field.name for field in dataclass_fields(draft) if field.type == "Node | None")


def _as_written(draft: type, fields: dict[str, Node]) -> dict[str, Any]:
    """The fields of a draft that hold a value as it is written: they are called like its key."""
    return {name: fields.get(name) for name in _written_fields(draft)}


def _entries(report: Report, node: Node | None, what: str) -> tuple[Entry, ...]:
    mapping = None if node is None else report.mapping(node, what)
    return mapping.items if mapping else ()


def _knowledge(reading: Reading, node: Node | None) -> tuple[KnowledgeDraft, ...]:
    return tuple(_entry(reading, key, value) for key, value in _entries(reading, node, "`knowledge`"))


def _entry(reading: Reading, key: Scalar, node: Node) -> KnowledgeDraft:
    what = f"knowledge `{key.text[:60]}`"
    if isinstance(node, Scalar) and node.text.strip():
        hint = f"write `{key.text[:60]}: {{file: {node.text[:60]}}}`"
        reading.error("E030", f"{what} must be a mapping", mark(node), hint)
        return KnowledgeDraft(key, UNREADABLE)
    before = len(reading.diagnostics)
    fields = reading.fields(node, what, KNOWLEDGE.keys, KNOWLEDGE.required)
    file = None if fields is None else reading.scalar(fields["file"], "`file`")
    if fields is None or file is None or len(reading.diagnostics) > before:
        return KnowledgeDraft(key, UNREADABLE)
    inputs = _entries(reading, fields.get("inputs"), "`inputs`")
    return KnowledgeDraft(key, reading.theory(file), file, inputs, **_as_written(KnowledgeDraft, fields))


# ---------------------------------------------------------------- arrangements


def _whiteboard(report: Report, node: Node | None) -> tuple[WhiteboardDraft, ...]:
    found: list[WhiteboardDraft] = []
    for key, value in _entries(report, node, "`whiteboard`"):
        fields = _declaration(report, key, value, "whiteboard variable", WHITEBOARD)
        if fields is None:
            found.append(WhiteboardDraft(key, UNREADABLE))
            continue
        lint = _lint(fields, value, key)
        found.append(WhiteboardDraft(key, fields["type"], lint=lint, **_as_written(WhiteboardDraft, fields)))
    return tuple(found)


def _instances(reading: Reading, node: Node | None, top: Span) -> tuple[InstanceDraft, ...] | Unreadable:
    if node is None:
        hint = "write `machines:` with one `name: {file: …}` per line"
        reading.error("E034", "an arrangement has no `machines`", top, hint)
        return UNREADABLE
    return tuple(_instance(reading, key, value) for key, value in _entries(reading, node, "`machines`"))


_OF_ONE = frozenset(("use", *ENVIRONMENT.keys, *MACHINE.required))


def _plants(reading: Reading, root: Node, node: Node | None) -> tuple[InstanceDraft | PlantDraft, ...]:
    """The models of the surroundings, under their key in the mapping `root`: one, or several by their names."""
    if node is None or not isinstance(root, Mapping):
        return ()
    key = next(k for k, value in root.items if value is node)
    items = node.items if isinstance(node, Mapping) else ()
    if not items or any(name.text in _OF_ONE or not isinstance(value, Mapping) for name, value in items):
        if any(name.text == "use" for name, _ in items):
            reading.error("E533", "the plant has no name", key.span, "write `environment: {NAME: {use: …}}`")
            return (InstanceDraft(key, UNREADABLE),)
        draft = _instance(reading, key, node, "the `environment`", ENVIRONMENT)
        return (replace(draft, name=implied(model.ENVIRONMENT, key.span)),)
    return tuple(_plant(reading, name, value) for name, value in items)


def _plant(reading: Reading, key: Scalar, node: Node) -> InstanceDraft | PlantDraft:
    if isinstance(node, Mapping) and any(name.text == "use" for name, _ in node.items):
        return PlantDraft(key, node)
    return _instance(reading, key, node, f"plant `{key.text[:60]}`", ENVIRONMENT)


def _access(reading: Reading, node: Node | None) -> Node | Unreadable | None:
    """What the key `access` says, here or in a file."""
    if not isinstance(node, Mapping) or all(key.text != "file" for key, _ in node.items):
        return node
    fields = reading.fields(node, "`access` in a file", POLICY_FILE.keys)
    file = None if fields is None else reading.scalar(fields["file"], "`file`")
    found = None if file is None else reading.policy(file)
    return UNREADABLE if found is None else found


def _instance(
    reading: Reading, key: Scalar, node: Node, what: str | None = None, table: Table = INSTANCE
) -> InstanceDraft:
    what = what or f"machine `{key.text}`"
    if isinstance(node, Scalar) and is_name(key):
        named = node.text[:60] if re.search(r"[./]", node.text) else f"{node.text[:60] or 'NAME'}.machine.yaml"
        reading.error("E030", f"{what} must be a mapping", mark(node), f"write `{key.text}: {{file: {named}}}`")
        return InstanceDraft(key, UNREADABLE)
    if isinstance(node, Mapping) and {"machine", "states"} & {k.text for k, _ in node.items}:
        hint = "write `inline:` above them, and indent them by more"
        reading.error("E060", f"{what} has the keys of a machine", key.span, hint)
        return InstanceDraft(key, UNREADABLE)
    fields = reading.fields(node, what, table.keys) if is_name(key) else None
    if fields is None:
        return InstanceDraft(key, UNREADABLE)
    if ("file" in fields) == ("inline" in fields):
        hint = "write `{file: NAME.machine.yaml}`"
        reading.error("E060", f"{what} needs either `file` or `inline`", key.span, hint)
        return InstanceDraft(key, UNREADABLE)
    machine: MachineDraft | Unreadable
    if "inline" in fields:
        machine = draft_machine(reading, fields["inline"])
    else:
        file = reading.scalar(fields["file"], "`file`")
        machine = UNREADABLE if file is None else reading.machine(file)
    arguments = _entries(reading, fields.get("parameters"), "`parameters`")
    return InstanceDraft(key, machine, arguments, **_as_written(InstanceDraft, fields))


def _processes(report: Report, fields: dict[str, Node]) -> tuple[ProcessDraft, ...] | Unreadable:
    if "processes" not in fields:
        only = _pools(report, fields.get("pool"), ("main",))
        return (ProcessDraft(None, fields["schedule"], only.get("main")),) if "schedule" in fields else ()
    node = fields["processes"]
    if "schedule" in fields:
        report.error("E084", "an arrangement cannot have both `schedule` and `processes`", mark(node), "keep one")
        return UNREADABLE
    mapping = report.mapping(node, "`processes`")
    if mapping is not None and not mapping.items:
        report.error("E080", "there are no processes", mark(mapping), "write `{main: […]}`")
    if mapping is None or not mapping.items:
        return UNREADABLE
    pools = _pools(report, fields.get("pool"), tuple(key.text for key, _ in mapping.items))
    return tuple(ProcessDraft(key, value, pools.get(key.text)) for key, value in mapping.items)


def _pools(report: Report, node: Node | None, processes: tuple[str, ...]) -> dict[str, Node]:
    """The pool of each process that has one."""
    if node is None:
        return {}
    if isinstance(node, Mapping):
        if not node.items:
            report.error("E080", "the pool is empty", mark(node), "remove it")
        for key, _ in node.items:
            if key.text not in processes:
                hint = did_you_mean(key.text, processes)
                report.error("E089", f"there is no process `{key.text[:60]}`", key.span, hint)
        return {key.text: value for key, value in node.items}
    if len(processes) > 1:
        hint = f"write `pool: {{{processes[0]}: […]}}`"
        report.error(
            "E089", "with several processes, `pool` must say to which process each machine belongs", mark(node), hint
        )
    return {processes[0]: node}


# ---------------------------------------------------------------- machines


def _parameters(report: Report, node: Node | None) -> tuple[ParameterDraft, ...]:
    return tuple(_parameter(report, key, value) for key, value in _entries(report, node, "`parameters`"))


def _parameter(report: Report, key: Scalar, node: Node) -> ParameterDraft:
    unreadable = ParameterDraft(key, UNREADABLE)
    if not is_name(key):
        return unreadable
    shape = "write `machine`, `{whiteboard: TYPE}` or `{constant: TYPE}`"
    if isinstance(node, Scalar):
        if node.text == "machine":
            return ParameterDraft(key, "machine")
        message = f"parameter `{key.text}` is not a machine and has no type"
        report.error("E065", message, mark(node), shape)
        return unreadable
    fields = report.fields(node, f"parameter `{key.text}`", PARAMETER.keys)
    if fields is None:
        return unreadable
    if len(fields) != 1:
        report.error("E065", f"parameter `{key.text}` must be one kind of thing", mark(node), shape)
        return unreadable
    if "constant" in fields:
        return ParameterDraft(key, "constant", fields["constant"])
    return ParameterDraft(key, "whiteboard", fields["whiteboard"])


def _declaration(report: Report, key: Scalar, value: Node, what: str, table: Table) -> dict[str, Node] | None:
    """What a variable is declared with."""
    what = f"{what} `{key.text[:60]}`"
    if isinstance(value, Scalar) and value.text.strip():
        hint = f"write `{key.text[:60]}: {{{_declared(value.text[:60], table.keys)}}}`"
        report.error("E030", f"{what} must be a mapping (`key: value`)", mark(value), hint)
        return None
    return report.fields(value, what, table.keys, table.required)


_DECLARED = re.compile(r"(?:(input|output)\s+)?(.*?)(?:[\s,]+(input|output))?(?:\s*=\s*([^\s=;]+))?[;,]?")


def _declared(text: str, keys: tuple[str, ...]) -> str:
    """The keys and values for a variable that is declared as in another language, or by its value alone."""
    before, kind, after, init = found.groups() if (found := _DECLARED.fullmatch(text)) else ("", text, "", None)
    if init is None and re.fullmatch(r"-?\d{1,9}|true|false", kind):
        kind, init = "bool" if kind.isalpha() else f"{min(int(kind), 0)}..{max(int(kind), 15)}", kind
    role = before or after if "role" in keys else None
    return f"type: {kind}" + (f", init: {init}" if init else "") + (f", role: {role}" if role else "")


def _variables(report: Report, node: Node | None) -> tuple[VariableDraft, ...]:
    found: list[VariableDraft] = []
    for key, value in _entries(report, node, "`variables`"):
        fields = _declaration(report, key, value, "variable", VARIABLE)
        if fields is None:
            found.append(VariableDraft(key, UNREADABLE))
        else:
            lint = _lint(fields, value, key)
            found.append(VariableDraft(key, fields["type"], lint=lint, **_as_written(VariableDraft, fields)))
    return tuple(found)


def _states(report: Report, node: Node) -> tuple[StateDraft, ...] | Unreadable:
    sequence = report.sequence(node, "`states`")
    if sequence is None:
        return UNREADABLE
    found: list[StateDraft] = []
    names: dict[str, Span] = {}
    for item in sequence.items:
        if isinstance(item, Mapping) and item.items and "name" not in {k.text for k, _ in item.items}:
            key, value = item.items[0]
            empty = isinstance(value, Mapping) or (isinstance(value, Scalar) and not value.text)
            if empty and is_name(key) and key.text not in STATE.keys:
                hint = f"write `- name: {key.text[:60]}`, and its other keys right below `name`"
                report.error("E034", "a state has no `name`", mark(key), hint)
                found.append(StateDraft(key))
                continue
        fields = report.fields(item, "a state", STATE.keys, STATE.required)
        if fields is None:
            continue
        name = fields["name"]
        if isinstance(name, Scalar) and is_name(name) and names.setdefault(name.text, mark(name)) == mark(name):
            found.append(_state(report, name, fields, item))
        else:  # the name is wrong, and no more is said of the state
            found.append(StateDraft(name))
    return tuple(found) if found or not sequence.items else UNREADABLE


def _state(report: Report, name: Scalar, fields: dict[str, Node], item: Node) -> StateDraft:
    actions: dict[ActionKind, Scalar] = {}
    for kind in ACTION_KINDS:
        text = _text(report, fields[kind], kind) if kind in fields else UNREADABLE
        if not isinstance(text, Unreadable):
            actions[kind] = text
    variables = _variables(report, fields.get("variables"))
    transitions = _transitions(report, fields.get("transitions"))
    return StateDraft(name, variables, actions, transitions, _lint(fields, item), **_as_written(StateDraft, fields))


def _transitions(report: Report, node: Node | None) -> tuple[TransitionDraft, ...]:
    if node is None or (isinstance(node, Scalar) and not node.text):
        return ()
    sequence = report.sequence(node, "`transitions`")
    found: list[TransitionDraft] = []
    for item in sequence.items if sequence else ():
        fields = report.fields(item, "a transition", TRANSITION.keys, TRANSITION.required)
        if fields is not None:
            guard = _text(report, fields["when"], "when")
            found.append(TransitionDraft(guard, fields["to"], _lint(fields, item)))
    return tuple(found)


def _text(report: Report, node: Node, key: str) -> Scalar | Unreadable:
    if report.text(node, key) is None:
        return UNREADABLE
    assert isinstance(node, Scalar)
    return node


# ---------------------------------------------------------------- lint


def _lint(fields: dict[str, Node], around: Node, name: Scalar | None = None) -> Lint | None:
    """The key `lint` of the part `around`, which begins with the key before it, `name`, where it has one."""
    if KEY not in fields:
        return None
    source = around.span.source
    start, end = around.span.start, around.span.end
    if name is not None and name.span.source is source:
        start = min(start, name.span.start)
    todo = [around]
    while todo:
        node = todo.pop()
        if node.span.source is source:
            start, end = min(start, node.span.start), max(end, node.span.end)
        if isinstance(node, Sequence):
            todo.extend(node.items)
        elif isinstance(node, Mapping):
            todo.extend(part for item in node.items for part in item)
    return Lint(fields[KEY], Span(source, start, end))
