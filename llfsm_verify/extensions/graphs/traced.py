"""A run drawn on the machines that it goes through: where they were, what fired, and where the property is violated."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from llfsm_verify.plug import (
    Arrangement,
    DrawnEdge,
    DrawnEdgeKind,
    DrawnMark,
    DrawnNode,
    Graph,
    Machine,
    Replayed,
    Trace,
    machine_graph,
    shorten,
)  # fmt: skip

LEGEND: tuple[tuple[DrawnEdgeKind, str], ...] = (
    ("taken", "fired"),
    ("forever", "fires forever"),
    ("violating", "fired in the last step"),
    ("untaken", "did not fire"),
)
SUSPEND = "__suspend"
FEW = 3
"""So many numbers of steps are listed."""
TITLE_WIDTH = 100


@dataclass(frozen=True, slots=True)
class DrawnRun:
    """What of a trace is drawn, and what is said of its end."""

    trace: Trace
    ending: str
    """What happens at the last step that counts: ``violated``, ``reached``, ``fault F001``."""

    @property
    def last(self) -> int | None:
        """The step in which it happens (0: none is needed); None: no step by itself, the run goes on forever."""
        if self.trace.fault is not None:
            return len(self.trace.steps)
        return self.trace.failed_at

    @property
    def loop(self) -> int | None:
        """How many steps come before those that repeat forever; None: the run ends, or what follows does not matter."""
        return self.trace.loop if self.last is None else None

    @property
    def concerned(self) -> frozenset[str]:
        """The machines that have to do with how it ends: the one whose step it is, and those that the causes read."""
        if not self.last:
            return frozenset(name for cause in self.trace.initial_causes for name, _ in cause.variables)
        step = self.trace.steps[self.last - 1]
        return frozenset((step.machine or "", *(name for cause in step.causes for name, _ in cause.variables)))


@dataclass(frozen=True, slots=True)
class _Path:
    """A machine's part of a run: steps by state and by transition, states that it is in without a step of its own."""

    spent: dict[str, list[int]]
    fired: dict[str, list[int]]
    seen: frozenset[str]
    forever: frozenset[str]
    end: str
    """The state in the end."""


def replayed_graph(arrangement: Arrangement, machine: str | None, done: Replayed) -> Graph | None:
    """A saved run that was performed again, as `run_graph` draws it; None: it does not fit the arrangement."""
    trace = done.replay.trace
    if trace is None or done.replay.outcome == "misfit":
        return None
    return run_graph(arrangement, machine, trace, f"a run of {done.title}", reaches=done.asked is not None)


def run_graph(arrangement: Arrangement, machine: str | None, trace: Trace, about: str, *, reaches: bool) -> Graph:
    """A run drawn on a machine, or on all; `about` is what it shows, `reaches` that it does not violate that."""
    ending = f"fault {trace.fault.code}" if trace.fault else "reached" if reaches else "violated"
    machines = arrangement.texts if machine is None else (arrangement.machine(machine),)
    of = machine_graph(machines[0]).title if len(machines) == 1 else arrangement.name
    return traced_graph(machines, DrawnRun(trace, ending), shorten(f"{of}, {about}", TITLE_WIDTH))


def traced_graph(machines: Sequence[Machine], run: DrawnRun, title: str) -> Graph:
    """These machines with the run drawn on them; several are a group each."""
    nodes: list[DrawnNode] = []
    edges: list[DrawnEdge] = []
    for number, machine in enumerate(machines):
        drawn = machine_graph(machine)
        path = _path(machine, run)
        prefix, group = (f"m{number}_", drawn.title) if len(machines) > 1 else ("", "")
        marked = (_marked(node, path, run, machine.name) for node in _nodes(machine, drawn, path))
        nodes += [replace(node, key=prefix + node.key, group=group) for node in marked]
        edges += [
            replace(edge, source=prefix + edge.source, target=prefix + edge.target)
            for edge in _edges(machine, drawn, path, run)
        ]
    return Graph(title, tuple(nodes), tuple(edges), "machine", LEGEND)


def _path(machine: Machine, run: DrawnRun) -> _Path:
    state = dict(run.trace.initial)[machine.name]
    spent: dict[str, list[int]] = {}
    fired: dict[str, list[int]] = {}
    seen, forever = {state}, set[str]()
    for number, step in enumerate(run.trace.steps[: run.last], 1):
        if run.loop is not None and number > run.loop:
            forever.add(state)
        if step.machine == machine.name:
            state = step.state
            spent.setdefault(state, []).append(number)
            if step.fired is not None:
                fired.setdefault(step.fired, []).append(number)
        state = next((change.after for change in step.changes if change.variable == machine.name), state)
        seen |= {step.state, state} if step.machine == machine.name else {state}
    return _Path(spent, fired, frozenset(seen), frozenset(forever), state)


def _nodes(machine: Machine, drawn: Graph, path: _Path) -> tuple[DrawnNode, ...]:
    """Those of the drawing, and the implicit suspend state where the machine was in it."""
    if machine.suspend is None and SUSPEND in path.seen:
        return (*drawn.nodes, DrawnNode("suspend", SUSPEND, (), "suspend"))
    return drawn.nodes


def _marked(node: DrawnNode, path: _Path, run: DrawnRun, machine: str) -> DrawnNode:
    if node.kind == "initial":
        return node
    if node.title not in path.seen:
        return replace(node, mark="unvisited")
    mark: DrawnMark = "visited"
    lines = [_steps(path.spent[node.title])] if node.title in path.spent else []
    if node.title in path.forever:
        mark = "forever"
        lines.append("forever")
    if run.last is not None and node.title == path.end:
        when = f"at step {run.last}" if run.last else "at first"
        if machine in run.concerned:
            mark = "violating"
            lines.append(f"here: {run.ending} {when}")
        else:
            lines.append(f"here {when}")
    return replace(node, mark=mark, lines=(*node.lines, *lines))


def _edges(machine: Machine, drawn: Graph, path: _Path, run: DrawnRun) -> Iterator[DrawnEdge]:
    """Those of the drawing: the start, and the transitions in their order."""
    start, *edges = drawn.edges
    yield start
    texts = [
        f"{state.name} -> {machine.states[t.target].name} when {t.text}"
        for state in machine.states
        for t in state.transitions
    ]
    for number, (edge, text) in enumerate(zip(edges, texts, strict=True)):
        # Of two that read the same, the first one fires.
        steps = path.fired.get(text, []) if texts.index(text) == number else []
        kind: DrawnEdgeKind = "taken" if steps else "untaken"
        words = f"\n{_steps(steps)}" if steps else ""
        if steps and run.loop is not None and steps[-1] > run.loop:
            kind, words = "forever", f"{words}, forever"
        elif steps and steps[-1] == run.last:
            kind = "violating"
        yield replace(edge, kind=kind, label=edge.label + words)


def _steps(numbers: Sequence[int]) -> str:
    """``step 3``; ``steps 3, 6``; ``21 steps, 3 to 63``."""
    if len(numbers) == 1:
        return f"step {numbers[0]}"
    if len(numbers) <= FEW:
        return f"steps {', '.join(map(str, numbers))}"
    return f"{len(numbers)} steps, {numbers[0]} to {numbers[-1]}"
