"""From the model to graphs: a machine's states and transitions, an arrangement's schedule and whiteboard."""

from __future__ import annotations

from collections.abc import Iterator

from llfsm_verify.arrangement.model import ACTION_KINDS, Arrangement, Machine, State
from llfsm_verify.diagnostics import counted
from llfsm_verify.language.typed import Statement
from llfsm_verify.report.drawing.graph import Edge, EdgeKind, Graph, Node, NodeKind, shorten
from llfsm_verify.report.drawing.uses import commanded, watched, whiteboard_uses

ACTION_TITLES = {kind: kind.replace("_", " ") for kind in ACTION_KINDS}
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
            f"s{i}",
            f"s{t.target}",
            (f"{n + 1}: " if len(state.transitions) > 1 else "") + shorten(t.text),
            "transition",
        )
        for i, state in enumerate(machine.states)
        for n, t in enumerate(state.transitions)
    ]
    start = Node("start", "", (), "initial")
    title = machine.name if machine.kind == machine.name else f"{machine.name}: {machine.kind}"
    return Graph(title, (start, *nodes), (Edge("start", f"s{machine.initial}", "", "start"), *edges), "machine")


def _state_node(machine: Machine, index: int, state: State) -> Node:
    variables = tuple(f"{v.name.rsplit('.', 1)[-1]}: {v.type}" for v in state.variables)
    actions = tuple(
        f"{ACTION_TITLES[kind]}: {_actions_text(getattr(state, kind))}" for kind in ACTION_KINDS if getattr(state, kind)
    )
    runs = (f"runs {', '.join(state.runs)}",) if state.runs else ()
    kind: NodeKind = "suspend" if index == machine.suspend else "state"
    return Node(f"s{index}", state.name, (*variables, *runs, *actions), kind)


def _actions_text(actions: tuple[Statement, ...]) -> str:
    # One statement of the source can stand for several (`suspend_all()`), all with the same place.
    texts = dict.fromkeys((s.span.start, s.span.text) for s in actions)
    return shorten("; ".join(text.strip().rstrip(";") for _, text in texts), 60)


def arrangement_graph(arrangement: Arrangement) -> Graph:
    """Machines in the order of their turns, those inside a state in a frame; the whiteboard variables that each reads
    and writes, and the machines that it watches and commands."""
    keys = {machine.name: f"m{i}" for i, machine in enumerate(arrangement.machines)}
    nodes = list(_machine_nodes(arrangement, keys))
    if arrangement.environment is not None:
        keys[arrangement.environment.name] = "env"
        nodes.append(Node("env", arrangement.environment.name, ("surroundings",), "machine"))
    variables = {w.variable.name: f"w{i}" for i, w in enumerate(arrangement.whiteboard)}
    nodes += [
        Node(variables[w.variable.name], w.variable.name, (shorten(str(w.variable.type), TYPE_WIDTH),), w.role)
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
        yield Edge(keys[name], key, shorten(", ".join(asked)), "watch")
    for name, kinds in commanded(machine).items():
        yield Edge(key, keys[name], ", ".join(kinds), "command")
