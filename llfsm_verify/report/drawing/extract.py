"""From the model to graphs: a machine's states and transitions, an arrangement's schedule and whiteboard."""

from __future__ import annotations

from collections.abc import Iterator

from llfsm_verify.arrangement.model import ACTION_KINDS, Arrangement, Machine, State
from llfsm_verify.diagnostics import counted
from llfsm_verify.language.trees import nodes
from llfsm_verify.language.typed import Assign, AtState, Query, Read, Statement, Variable
from llfsm_verify.report.drawing.graph import Edge, EdgeKind, Graph, Node, NodeKind, wrap

ACTION_TITLES = {kind: kind.replace("_", " ") for kind in ACTION_KINDS}
LINE_WIDTH = 64
LABEL_WIDTH = 40
TYPE_WIDTH = 32
LEGEND: tuple[tuple[EdgeKind, str], ...] = (
    ("write", "writes"),
    ("both", "reads and writes"),
    ("read", "is read by"),
    ("command", "commands"),
    ("watch", "is watched by"),
    ("turn", "next in the schedule"),
)


def machine_graph(machine: Machine) -> Graph:
    """States with their actions, and guards numbered in the order in which they are tried."""
    nodes = [_state_node(machine, i, state) for i, state in enumerate(machine.states)]
    edges = [
        Edge(
            f"s{i}", f"s{t.target}", _label((f"{n + 1}: " if len(state.transitions) > 1 else "") + t.text), "transition"
        )
        for i, state in enumerate(machine.states)
        for n, t in enumerate(state.transitions)
    ]
    start = Node("start", "", (), "initial")
    title = machine.name if machine.kind == machine.name else f"{machine.name}: {machine.kind}"
    return Graph(title, (start, *nodes), (Edge("start", f"s{machine.initial}", "", "start"), *edges), "machine")


def _state_node(machine: Machine, index: int, state: State) -> Node:
    variables = [f"{v.name.rsplit('.', 1)[-1]}: {v.type}" for v in state.variables]
    runs = [f"runs {', '.join(state.runs)}"] if state.runs else []
    actions = [line for kind in ACTION_KINDS for line in _action_lines(ACTION_TITLES[kind], getattr(state, kind))]
    lines = tuple(part for line in (*variables, *runs, *actions) for part in wrap(line, LINE_WIDTH))
    kind: NodeKind = "suspend" if index == machine.suspend else "state"
    return Node(f"s{index}", state.name, lines, kind)


def _action_lines(title: str, actions: tuple[Statement, ...]) -> list[str]:
    """An action in the lines of its source; one line follows its title at once."""
    lines: list[str] = []
    last = 0
    # One statement of the source can stand for several (`suspend_all()`), all with the same place.
    for span in {statement.span.start: statement.span for statement in actions}.values():
        text = span.text.strip().rstrip(";")
        first, *others = [line.rstrip() for line in (text if text.endswith("}") else f"{text};").splitlines()]
        if span.line == last:
            lines[-1] += f" {first}"
        else:
            lines.append(first)
        # A line of a block keeps what it is indented by beyond its statement.
        lines += [line[min(span.column - 1, len(line) - len(line.lstrip())) :] for line in others if line]
        last = span.end_position[0]
    if len(lines) == 1:
        return [f"{title}: {lines[0].rstrip(';')}"]
    return [f"{title}:", *(f"  {line}" for line in lines)] if lines else []


def _label(text: str) -> str:
    return "\n".join(_wrapped(text, LABEL_WIDTH))


def _wrapped(text: str, width: int) -> tuple[str, ...]:
    return tuple(line.strip() for line in wrap(" ".join(text.split()), width))


def arrangement_graph(arrangement: Arrangement) -> Graph:
    """Machines in the order of their turns, those inside a state in a frame; the whiteboard variables that each reads
    and writes, and the machines that it watches and commands."""
    keys = {machine.name: f"m{i}" for i, machine in enumerate(arrangement.machines)}
    nodes = list(_machine_nodes(arrangement, keys))
    for number, name in enumerate(arrangement.surroundings):
        keys[name] = f"env{number or ''}"
        nodes.append(Node(keys[name], name, ("surroundings",), "machine"))
    variables = {w.variable.name: f"w{i}" for i, w in enumerate(arrangement.whiteboard)}
    nodes += [
        Node(variables[w.variable.name], w.variable.name, _wrapped(str(w.variable.type), TYPE_WIDTH), w.role)
        for w in arrangement.whiteboard
    ]
    edges = list(_turns(arrangement, keys))
    for machine in arrangement.texts:
        edges += _whiteboard_edges(machine, keys[machine.name], variables)
        edges += _machine_edges(machine, arrangement, keys)
    return Graph(arrangement.name, tuple(nodes), tuple(edges), "arrangement", LEGEND)


def _machine_nodes(arrangement: Arrangement, keys: dict[str, str]) -> Iterator[Node]:
    several = len(arrangement.processes) > 1
    inside = {name: f"{m.name}@{s.name}" for m in arrangement.machines for s in m.states for name in s.runs}
    for process in arrangement.processes:
        group = f"process {process.name}" if several else ""
        for position, name in enumerate(process.schedule, 1):
            machine = arrangement.machine(name)
            lines = (machine.kind,) if machine.kind != name else ()
            states = counted(len(machine.states), "state")
            pool = ("pool",) if not machine.loaded else ()
            where = inside.get(name, group)
            yield Node(keys[name], f"{position}. {name}", (*lines, states, *pool), "machine", where)


def _turns(arrangement: Arrangement, keys: dict[str, str]) -> Iterator[Edge]:
    for process in arrangement.processes:
        turns = process.schedule
        if len(turns) > 1:
            for one, other in zip(turns, (*turns[1:], turns[0]), strict=True):
                yield Edge(keys[one], keys[other], "", "turn")


def _whiteboard_edges(machine: Machine, key: str, variables: dict[str, str]) -> Iterator[Edge]:
    reads, writes = whiteboard_uses(machine)
    for name, variable in variables.items():
        if name in writes:
            yield Edge(key, variable, "", "both" if name in reads else "write")
        elif name in reads:
            yield Edge(variable, key, "", "read")


def _machine_edges(machine: Machine, arrangement: Arrangement, keys: dict[str, str]) -> Iterator[Edge]:
    key = keys[machine.name]
    for name, asked in watched(machine, arrangement).items():
        yield Edge(keys[name], key, _label(", ".join(asked)), "watch")
    for name, kinds in commanded(machine).items():
        yield Edge(key, keys[name], ", ".join(kinds), "command")


# ---- What a machine's guards and actions read and write on the whiteboard, and what they watch and command of machines


_QUERIES = {"running": "is_running", "suspended": "is_suspended", "done": "done"}


def whiteboard_uses(machine: Machine) -> tuple[frozenset[str], frozenset[str]]:
    """The names of the whiteboard variables that `machine` reads, and of those that it writes."""
    reads: set[str] = set()
    writes: set[str] = set()
    set_only: set[int] = set()
    for node in nodes(_text(machine)):  # an assignment comes before its target
        if isinstance(node, Assign) and isinstance(node.target, Read):
            _note(node.target.variable, writes)
            if node.op is None:
                set_only.add(id(node.target))
        elif isinstance(node, Read) and id(node) not in set_only:
            _note(node.variable, reads)
    return frozenset(reads), frozenset(writes)


def watched(machine: Machine, arrangement: Arrangement) -> dict[str, tuple[str, ...]]:
    """The machines whose control `machine` reads, each with what is asked of it: ``@STATE``, ``is_suspended``."""
    found: dict[str, dict[str, None]] = {}
    for node in nodes(_text(machine)):
        if isinstance(node, AtState):
            state = "__suspend" if node.state < 0 else arrangement.machine(node.machine).states[node.state].name
            found.setdefault(node.machine, {})[f"@{state}"] = None
        elif isinstance(node, Query):
            found.setdefault(node.machine, {})[_QUERIES[node.kind]] = None
    return {name: tuple(asked) for name, asked in found.items()}


def commanded(machine: Machine) -> dict[str, tuple[str, ...]]:
    """The machines to which `machine` gives commands, each with their kinds."""
    found: dict[str, dict[str, None]] = {}
    for command in machine.commands():
        found.setdefault(command.machine, {})[command.kind] = None
    return {name: tuple(kinds) for name, kinds in found.items()}


def _text(machine: Machine) -> tuple[object, ...]:
    guards = tuple(t.guard for state in machine.states for t in state.transitions)
    actions = tuple(getattr(state, kind) for state in machine.states for kind in ACTION_KINDS)
    return (guards, actions)


def _note(variable: Variable, names: set[str]) -> None:
    if variable.scope == "whiteboard":
        names.add(variable.name)
