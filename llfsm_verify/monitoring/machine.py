"""A monitor as a machine: it observes, tests and acts in every turn of its own.

The pattern is that of figure 6 in the paper on run-time verification with LLFSMs (observe the states of other machines,
test them, act on a violation), done in a single ringlet so that a letter is not missed while the last one is tested.
It reads one letter per turn of its own: `sight` says what it sees of a run, and what it misses.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from textwrap import wrap

from llfsm_verify.arrangement.formats import machine_in
from llfsm_verify.arrangement.formats.writing import NewMachine, NewState, Value
from llfsm_verify.arrangement.model import Arrangement, Machine, Process
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment
from llfsm_verify.language.limits import MAX_LENGTH
from llfsm_verify.language.scope import RESERVED
from llfsm_verify.monitoring.codes import NEVER_VIOLATED, NOT_MONITORABLE, TOO_LARGE, UNKNOWN_NAME
from llfsm_verify.monitoring.machine_reads import Reads, free_name, reads
from llfsm_verify.monitoring.properties import Monitored
from llfsm_verify.monitoring.states import Monitor, Monitorability, MonitorVerdict

_IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")
FEW = 8
"""So many states are written one by one."""
WIDTH = 110
"""Characters of a comment's line."""


@dataclass(frozen=True, slots=True)
class Action:
    """What a monitor machine does at once when the verdict is false."""

    set_variables: tuple[str, ...] = ()
    """Whiteboard variables of type bool that become true."""
    suspend: tuple[str, ...] = ()
    """Machines that are suspended."""


NOTHING = Action()


@dataclass(frozen=True, slots=True)
class MonitorMachine:
    """A machine that monitors, and what it reads."""

    machine: NewMachine
    reads: Reads

    @property
    def text(self) -> str:
        """Of its file in the usual format."""
        return machine_in(self.machine)


def monitor_machine(
    found: Monitored,
    places: Mapping[str, Fragment],
    arrangement: Arrangement | None = None,
    action: Action = NOTHING,
    notes: Sequence[str] = (),
) -> MonitorMachine:
    """The machine that monitors a property; `places` leads from its atoms to where they are written.

    Its variables `state`, `violated`, `satisfied` and `undecidable`, those that can come true, tell where it stands.
    `notes` become comments. DiagnosticError: the property cannot be monitored (E432), an atom cannot be read by a
    machine (E430, E431), the text is too large (E433), the action names what there is not (E435) or can never be taken
    (E436).
    """
    monitor = found.monitor
    if monitor.monitorability is Monitorability.NEVER:
        raise DiagnosticError(not_monitorable(found))
    used = [key for i, key in enumerate(monitor.atoms) if monitor.used >> i & 1]
    read = reads({key: places[key] for key in used}, arrangement)
    if (action.set_variables or action.suspend) and MonitorVerdict.FALSE not in monitor.verdicts:
        message = "no word violates this property, so there is nothing to act on"
        raise DiagnosticError(Diagnostic(NEVER_VIOLATED, message, found.line.span))
    _check(action, arrangement, read)
    return MonitorMachine(_Writer(found, read, used, arrangement, action, notes).machine(), read)


def not_monitorable(found: Monitored) -> Diagnostic:
    """That there is no monitor of a property."""
    message = f"`{found.line.name}` is not monitorable: no word decides it"
    hint = "bound the waiting, such as `F[0:100] p`, or check the property with `llfsm verify`"
    return Diagnostic(NOT_MONITORABLE, message, found.line.span, hint=hint)


def _check(action: Action, arrangement: Arrangement | None, read: Reads) -> None:
    """DiagnosticError (E435): a name that cannot be what the action takes it for."""
    names = (*action.set_variables, *action.suspend)
    problems = [f"`{name}` is not a valid name" for name in names if not _IDENTIFIER.match(name) or name in RESERVED]
    problems += [f"`{name}` is a machine" for name in action.set_variables if name in (*read.machines, *action.suspend)]
    problems += [f"`{name}` is a variable" for name in action.suspend if name in read.variables]
    if arrangement is not None and not problems:
        fit = {w.variable.name for w in arrangement.whiteboard if w.role != "input" and str(w.variable.type) == "bool"}
        machines = {m.name for m in arrangement.machines}
        problems += [
            f"`{name}` is not a whiteboard variable of type bool that a machine may set"
            for name in action.set_variables
            if name not in fit
        ]
        problems += [f"there is no machine `{name}`" for name in action.suspend if name not in machines]
    if problems:
        raise DiagnosticError([Diagnostic(UNKNOWN_NAME, problem) for problem in problems])


class _Writer:
    def __init__(
        self,
        found: Monitored,
        read: Reads,
        used: Sequence[str],
        arrangement: Arrangement | None,
        action: Action,
        notes: Sequence[str],
    ) -> None:
        self._found = found
        self._monitor: Monitor = found.monitor
        self._read = read
        self._action = action
        self._notes = notes
        self._parameters: dict[str, Value] = dict(read.parameters)
        for name in action.set_variables:
            self._parameters.setdefault(name, {"whiteboard": "bool"})
        for name in action.suspend:
            self._parameters.setdefault(name, "machine")
        taken = {*self._parameters, *(name for name, _, _ in read.samples)}

        def fresh(wanted: str) -> str:
            return free_name(wanted, taken, arrangement)

        self._state, self._next = fresh("state"), fresh("next")
        self._seen = {key: fresh(f"seen_{i}") for i, key in enumerate(used)}
        self._outcomes = [
            (fresh(word), name, states)
            for word, name, states in (
                ("violated", "VIOLATED", self._with(MonitorVerdict.FALSE)),
                ("satisfied", "SATISFIED", self._with(MonitorVerdict.TRUE)),
                ("undecidable", "UNDECIDABLE", [q for q, hopeless in enumerate(self._monitor.hopeless) if hopeless]),
            )
            if states
        ]

    def _with(self, verdict: MonitorVerdict) -> list[int]:
        return [q for q, found in enumerate(self._monitor.verdicts) if found is verdict]

    def machine(self) -> NewMachine:
        line = self._found.line
        kind = "" if line.kind == "ltl" else f"{line.kind} "
        body = [*self._observe(), *self._test(), *self._act()]
        if sum(len(part) + 1 for part in body) > MAX_LENGTH:
            message = f"the machine of this monitor would be longer than {MAX_LENGTH:,} characters"
            raise DiagnosticError(Diagnostic(TOO_LARGE, message, line.span, hint="use --as table"))
        outcomes = ", ".join(f"{q} {name.lower()}" for _, name, states in self._outcomes for q in states)
        flags = [word for word, _, _ in self._outcomes]
        observe = NewState("OBSERVE", {"internal": body}, [(word, name) for word, name, _ in self._outcomes])
        return NewMachine(
            f"Monitor_{line.name.replace('-', '_')}",
            [observe, *(NewState(name) for _, name, _ in self._outcomes)],
            self._parameters,
            {
                self._state: {"type": f"0..{len(self._monitor.edges) - 1}", "init": "0"},
                **{word: {"type": "bool", "init": "false"} for word in flags},
                # A type without a name that is not a word or a range stands only in declarations.
                **{name: {"type": kind} for name, kind, _ in self._read.samples if not isinstance(kind, str)},
            },
            comments=[
                f"The monitor of {kind}{line.name}: {line.text}",
                *(part for note in self._notes for part in wrap(note, WIDTH)),
            ],
            notes={self._state: f"of the monitor's automaton: {outcomes}"},
        )

    def _observe(self) -> list[str]:
        samples = [
            f"{kind} {name} = {text};" if isinstance(kind, str) else f"{name} = {text};"
            for name, kind, text in self._read.samples
        ]
        seen = [f"bool {name} = {self._read.expressions[key]};" for key, name in self._seen.items()]
        return ["// observe", *samples, *seen] if seen else []

    def _test(self) -> list[str]:
        monitor, end = self._monitor, len(self._monitor.edges) - 1
        if end == 0:
            return []
        lines = dict.fromkeys(["// test", f"0..{end} {self._next} = {self._state};"])
        rules: list[tuple[int, int, str]] = []
        for q, row in enumerate(monitor.edges):
            targets = dict.fromkeys(e.target for e in row if e.target != q)
            for target in targets:
                cubes = [self._cube(e.positive, e.negative) for e in row if e.target == target]
                letters = " || ".join(cubes) if len(cubes) == 1 else "(" + " || ".join(_grouped(c) for c in cubes) + ")"
                rules.append((q, target, letters))
        for (_, target, letters), (first, last, by) in zip(rules, _runs(rules), strict=True):
            many = [f"{self._state} >= {first}"] * (first > 0) + [f"{self._state} <= {last}"] * (last < end)
            parts = [
                *(many if first < last else [f"{self._state} == {first}"]),
                *([letters] if letters != "true" else []),
            ]
            to = str(target) if by is None else f"{self._state} {'+' if by > 0 else '-'} {abs(by)}"
            lines[f"if ({' && '.join(parts) or 'true'}) {self._next} = {to};"] = None
        return [*lines, f"{self._state} = {self._next};"]

    def _cube(self, positive: int, negative: int) -> str:
        parts = []
        for i, key in enumerate(self._monitor.atoms):
            if (positive | negative) >> i & 1:
                parts.append(("" if positive >> i & 1 else "!") + self._seen[key])
        return " && ".join(parts) or "true"

    def _act(self) -> list[str]:
        lines = ["// act"]
        for word, name, states in self._outcomes:
            steps = [f"{word} = true;"]
            if name == "VIOLATED":
                steps += [f"{variable} = true;" for variable in self._action.set_variables]
                steps += [f"suspend({machine});" for machine in self._action.suspend]
            one = len(self._monitor.edges) == 1
            test = " || ".join(f"{self._state} == {q}" for q in states)
            lines.append(" ".join(steps) if one else f"if ({test}) {{ {' '.join(steps)} }}")
        return lines


def _runs(rules: Sequence[tuple[int, int, str]]) -> Iterator[tuple[int, int, int | None]]:
    """For each rule (state, target, letters) the states that it is written for together, and how much further each of
    these leads; None: all to the target. Those of a counter are one after the other; few are written one by one."""
    runs: dict[tuple[str, int | None, int | None], list[list[int]]] = {}
    joined: list[list[tuple[list[int], int | None]]] = []
    for q, target, letters in rules:
        joined.append([])
        for to, by in ((target, None), (None, target - q)):
            found = runs.setdefault((letters, to, by), [])
            if found and found[-1][1] == q - 1:
                found[-1][1] = q
            else:
                found.append([q, q])
            joined[-1].append((found[-1], by))
    for (q, _, _), both in zip(rules, joined, strict=True):
        (first, last), by = max(both, key=lambda run: run[0][1] - run[0][0])
        yield (first, last, by) if last - first >= FEW else (q, q, None)


def _grouped(cube: str) -> str:
    return f"({cube})" if " && " in cube else cube


GENERAL = (
    "It reads one letter per turn of its own: the configuration as it stands, and the inputs that this turn samples.",
    "A step of the property (`X`, a bound, two neighbours) is from one turn of the monitor to its next one.",
)
ANYWHERE = (
    "It misses the letters after the ringlets of all other machines. One in its own process takes a turn between two "
    "of the monitor's, so no state at the end of that is missed, but states that two of them had together may be."
)


def sight(read: Reads, arrangement: Arrangement | None) -> list[str]:
    """Sentences on what the machine sees, and which letters it misses, in an arrangement or in any."""
    if arrangement is None:
        return [*GENERAL, ANYWHERE, "With --arrangement FILE this is said for its machines."]
    return [*GENERAL, *_in(read, arrangement)]


def _in(read: Reads, arrangement: Arrangement) -> Iterator[str]:
    home = _home(read, arrangement)
    others = list(home.schedule)
    several = len(arrangement.processes) > 1
    where = f"In process {home.name}" if several else "In this schedule"
    yield (
        f"{where} it sees 1 letter of {len(others) + 1} in a cycle: it misses those after the ringlets of "
        f"{_listed(others)}" + (", and of the other processes, as many as there are." if several else ".")
    )
    once: list[str] = []
    often: list[str] = []
    for name in read.machines:
        (often if _moves_often(arrangement.machine(name), home, arrangement) else once).append(f"the state of {name}")
    for name in read.variables:
        variable = next(w for w in arrangement.whiteboard if w.variable.name == name)
        if variable.role == "input":
            continue
        writers = [m for m in arrangement.machines if any(name == written for written, _ in m.writes())]
        inside = all(m.name in home.schedule for m in writers)
        (once if len(writers) <= 1 and inside else often).append(name)
    if once:
        names = _listed(once)
        yield f"Between two of its turns at most one ringlet changes each of these, and no value is skipped: {names}."
    if often:
        yield f"Several ringlets in between can change {_listed(often)}: values can be missed."
    if len(once) + len(often) > 1:
        yield (
            "What holds only between two ringlets of a cycle, such as two states at the same time, is missed: its "
            "place in the schedule decides which letter of a cycle it sees."
        )
    if any(w.role == "input" and w.variable.name in read.variables for w in arrangement.whiteboard):
        yield "Inputs are seen only as its own turns sample them."


def _home(read: Reads, arrangement: Arrangement) -> Process:
    """The process with most of the machines that are read: the place for the monitor."""
    return max(arrangement.processes, key=lambda p: sum(m in p.schedule for m in read.machines))


def _moves_often(machine: Machine, home: Process, arrangement: Arrangement) -> bool:
    """Whether its state can change more than once between two turns of a machine in `home`."""
    if machine.name not in home.schedule:
        return True
    commanded = any(c.machine == machine.name for m in arrangement.machines for c in m.commands())
    return arrangement.profile.commands == "end_of_ringlet" and commanded


def _listed(names: list[str]) -> str:
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + f" and {names[-1]}"
