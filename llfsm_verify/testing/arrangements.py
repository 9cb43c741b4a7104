"""Hypothesis strategies for whole arrangements: documents for `build_arrangement`, valid by construction."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace

from hypothesis import reject
from hypothesis import strategies as st

from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.testing.texts import Draw, Names, Pen, Place, Whole, Writer

Document = dict[str, object]
"""An arrangement in the shape of its file: mappings, lists, strings, bools and ints."""

ENUMERATION = ("RED", "GREEN", "BLUE")
_TYPES: Document = {"Colour": list(ENUMERATION), "Pair": {"record": {"x": "0..2", "f": "bool"}}}
_SHAPES = (
    "bool", "range", "array", "Colour", "fixed", "record", "int", "bools", "records", "input record", "input array",
    "decimal", "wide",
)  # fmt: skip
_SCALARS: dict[str, tuple[int, int, Document]] = {
    "bool": (0, 0, {"type": "bool"}),
    "range": (0, 3, {"type": "0..3"}),
    "fixed": (-128, 127, {"type": "int8", "init": "126"}),
    "decimal": (-5, 15, {"type": {"decimal": "0.1", "range": "-0.5..1.5"}, "init": "0.3"}),
    "int": (0, 0, {"type": "int"}),
    "Colour": (0, 0, {"type": "Colour", "init": "GREEN"}),
}
"""By shape, which is also the kind of place: from where to where, and how it is declared."""
FORESEEN = frozenset({"E093", "E128", "E131"})
"""What the loader sees coming where constants meet by chance (a store outside a range, an index outside an array, a
time without a bound): such documents are drawn again."""
_ACTIONS = ("on_entry", "internal", "on_exit", "on_suspend", "on_resume")


@st.composite
def arrangements(draw: Draw, max_machines: int = 3, max_states: int = 4) -> Document:
    """Documents of 1 to `max_machines` machine instances with 1 to `max_states` states each.

    They use all of the language: every type, action, command, query, profile and kind of timing, several instances of
    one machine with parameters, several processes. Their inputs have few values. Some of their runs end in a fault, and
    some leave the 64 bits of an `int`. They shrink towards one machine with one empty state.
    """
    document = _Composer(Pen(draw), max_machines, max_states).document()
    try:
        build_arrangement(document)
    except DiagnosticError as error:
        if {d.code for d in error.diagnostics} <= FORESEEN:
            reject()
        raise
    return document


@dataclass(frozen=True, slots=True)
class _Kind:
    """One machine, of which there may be several instances."""

    name: str
    states: tuple[str, ...]
    suspend: str | None
    """What `suspend:` declares."""
    isolated: bool
    """The state `Suspend` has no transitions in or out."""
    constant: bool
    shared: bool
    peer: bool
    suspends: bool = True

    def askable(self) -> tuple[str, ...]:
        """The states that `m@STATE` can name."""
        implicit = self.suspend is None and "Suspend" not in self.states
        return (*self.states, "__suspend") if implicit else self.states


class _Composer:
    def __init__(self, pen: Pen, max_machines: int, max_states: int) -> None:
        self.pen = pen
        self.max_machines = max_machines
        self.max_states = max_states
        self.places: list[Place] = []
        self.wholes: list[Whole] = []

    def document(self) -> Document:
        pen = self.pen
        whiteboard = self._whiteboard()
        count = pen.number(1, self.max_machines)
        kinds = [self._kind(i) for i in range(pen.number(1, count))]
        instances = {f"m{i}": kinds[i] if i < len(kinds) else pen.pick(kinds) for i in range(count)}
        timing, bounds, timed = self._timing()
        names = Names(
            tuple(self.places), tuple(self.wholes), (),
            tuple((n, k.askable()) for n, k in instances.items()),
            (("Colour", ENUMERATION),), bounds, timed, loads=pen.one_in(3), tables=pen.one_in(4),
        )  # fmt: skip
        nesting = self._nesting(instances) if pen.one_in(4) else {}
        names = replace(names, nested=tuple(name for found in nesting.values() for name in found))
        bodies = {k.name: self._machine(k, names) for k in kinds}
        for owner, found in nesting.items():
            states = bodies[instances[owner].name]["states"]
            assert isinstance(states, list)
            free = [s for s in states if s["name"] not in (instances[owner].suspend, "Suspend")]
            pen.pick(free or states)["runs"] = list(found)
        document: Document = {"name": "random", **timing, "types": _TYPES, "whiteboard": whiteboard}
        if names.tables:
            document["tables"] = {"list": ["3", "0", "1", "1", "-2"], "curve": ["0.5", "-0.25", "1"]}
        machines = {n: self._instance(k, bodies[k.name], list(instances)) for n, k in instances.items()}
        document["machines"] = machines
        document |= self._turns(machines, pooled=names.loads and not names.nested)
        single = "schedule" in document
        parts: tuple[tuple[str, bool, int, Callable[[], object]], ...] = (
            ("observe", single, 4, lambda: "cycle"),
            ("profile", True, 1, lambda: self._profile(single)),
            ("environment", single, 4, lambda: {"inline": self._surroundings(names, whiteboard)}),
            ("operators", True, 6, lambda: self._operators(list(instances), whiteboard, loads=not nesting)),
            ("access", True, 5, lambda: self._access(list(instances), whiteboard)),
            ("finished", True, 4, lambda: "keep"),
            ("fairness", True, 6, lambda: "none"),
        )
        return document | {key: make() for key, may, n, make in parts if may and (n == 1 or pen.one_in(n))}

    def _turns(self, machines: dict[str, Document], *, pooled: bool) -> Document:
        """One schedule, or those of two processes; where `pooled`, the last machines of each may not be loaded."""
        pen, order = self.pen, list(machines)
        if pen.one_in(3):
            order.reverse()
        cut = pen.number(1, len(order)) if pen.one_in(3) else len(order)
        single = cut == len(order)
        parts = {"first": order[:cut]} if single else {"first": order[:cut], "second": order[cut:]}
        pools = {name: part[pen.number(1, len(part)) :] for name, part in parts.items() if pooled}
        schedules = {name: [m for m in part if m not in pools.get(name, ())] for name, part in parts.items()}
        for name in (m for pool in pools.values() for m in pool):
            machines[name].pop("suspended", None)
        found: Document = {"schedule": schedules["first"]} if single else {"processes": schedules}
        if any(pools.values()):
            found["pool"] = pools["first"] if single else {name: pool for name, pool in pools.items() if pool}
        return found

    def _nesting(self, instances: dict[str, _Kind]) -> dict[str, tuple[str, ...]]:
        """Which machine runs which, later ones: an owner is the only instance of its kind."""
        found: dict[str, tuple[str, ...]] = {}
        taken: set[str] = set()
        names = list(instances)
        for number, name in enumerate(names):
            single = sum(kind is instances[name] for kind in instances.values()) == 1
            inner = tuple(n for n in names[number + 1 :] if n not in taken and not self.pen.one_in(3))
            if single and inner and instances[name].suspend != instances[name].states[0]:
                found[name] = inner
                taken |= set(inner)
        return found

    def _access(self, names: list[str], whiteboard: Document) -> Document:
        """Two or three levels, with a class for every variable, so that what machines may not do is refused."""
        levels = ("low", "high", "top")[: self.pen.number(2, 3)]
        slots = [n for n, w in whiteboard.items() if isinstance(w, dict) and w.get("role") != "input"]
        return {
            "levels": list(levels), "on_violation": "refuse",
            "machines": {name: self.pen.pick(levels) for name in names if not self.pen.one_in(3)},
            "write": {name: self.pen.pick(levels) for name in slots},
            "command": {name: self.pen.pick(levels) for name in names if self.pen.one_in(3)},
            "users": {"someone": levels[-1]},
        }  # fmt: skip

    def _operators(self, names: list[str], whiteboard: Document, *, loads: bool) -> Document:
        """One or two things that operators may do, since each doubles the steps that begin a cycle."""
        kinds = ("suspend", "resume", "restart", "enter", *(("load", "unload", "load_suspended") if loads else ()))
        found: Document = {kind: [self.pen.pick(names)] for kind in (self.pen.pick(kinds), self.pen.pick(kinds))}
        shared = [(n, w) for n, w in whiteboard.items() if isinstance(w, dict) and w.get("role") != "input"]
        small = [n for n, w in shared if w["type"] in ("bool", "0..3")]
        if small and self.pen.one_in(2):
            return {"write": [self.pen.pick(small)]}
        return found

    # ------------------------------------------------------------ the arrangement

    def _timing(self) -> tuple[Document, tuple[str, ...], bool]:
        """Keys, the bounds that texts may use, and whether time is logical."""
        kind = self.pen.weighted(((2, "timed"), (2, "untimed"), (1, "none")))
        if kind == "none":
            return {}, (), False
        if kind == "untimed":
            return {"timing": "untimed"}, ("after_ms(10)", "after(1)", "after(0.5)"), False
        period = self.pen.pick(("10", "7", "2.5"))
        return {"cycle_ms": period}, ("after_ms(10)", "after_ms(0)", "after_ms(25)", "after(0.01)"), True

    def _profile(self, single: bool) -> object:
        pen = self.pen
        base = pen.pick(("llfsm", "clfsm", "swiftfsm"))
        if not pen.one_in(2):
            return base
        choices: Document = {"base": base}
        snapshots = ("ringlet", "none", "after_entry", *(("cycle",) if single else ()))
        if pen.one_in(2):
            choices["snapshot"] = pen.pick(snapshots)
        if pen.one_in(3):
            choices["commands"] = pen.pick(("next_turn", "end_of_ringlet"))
        for key in ("self_transition_restarts_clock", "restart_enters_initial"):
            if pen.one_in(3):
                choices[key] = pen.pick((True, False))
        return choices

    def _whiteboard(self) -> Document:
        found: Document = {"go": {"type": "bool", "role": "input", **self._changes()}}
        self.places.append(Place("go", "bool", writable=False))
        if self.pen.one_in(2):
            found["level"] = {"type": "0..2", "role": "input", **self._changes()}
            self.places.append(Place("level", "range", 0, 2, writable=False))
        for i in range(self.pen.number(0, 3)):
            found[f"w{i}"] = self._variable(f"w{i}", self.pen.pick(_SHAPES), i > 1)
        return found

    def _changes(self) -> Document:
        changes = self.pen.weighted(((4, "step"), (2, "cycle"), (1, "never"), (1, "never with init")))
        if changes == "never with init":
            return {"changes": "never", "init": self.pen.pick(("true", "false")) if not self.places else "1"}
        return {} if changes == "step" else {"changes": changes}

    def _variable(self, name: str, shape: str, late: bool) -> Document:
        """A whiteboard variable; what texts can do with it is added to the places."""
        output: Document = {"role": "output"} if late else {}
        add = self.places.append
        if shape in _SCALARS:
            low, high, written = _SCALARS[shape]
            add(Place(name, shape, low, high))
            return {**written, **output} if shape != "int" else {**written}
        match shape:
            case "wide":
                kind, init = self.pen.pick((("int64", str((1 << 63) - 1)), ("uint64", str((1 << 64) - 2))))
                add(Place(name, "wide"))
                return {"type": kind, "init": init, **output}
            case "array":
                add(Place(name, "range", -1, 2, 3))
                self.wholes.append(Whole(name, "array", True))
                return {"type": {"array": "-1..2", "size": 3}, "init": ["0", "1", "-1"]}
            case "bools" | "input array":
                given = shape == "input array"
                add(Place(name, "bool", size=2, writable=not given))
                self.wholes.append(Whole(name, "bools", not given))
                role: Document = {"role": "input", **({"changes": "cycle"} if late else {})} if given else {}
                return {"type": {"array": "bool", "size": 2}, **role}
            case "records":
                for i in range(2):
                    self._pair(f"{name}[{i}]", True)
                return {"type": {"array": "Pair", "size": 2}}
        self._pair(name, shape == "record")
        return {"type": "Pair"} if shape == "record" else {"type": "Pair", "role": "input"}

    def _pair(self, name: str, writable: bool) -> None:
        self.places += [Place(f"{name}.x", "range", 0, 2, 0, writable), Place(f"{name}.f", "bool", writable=writable)]
        self.wholes.append(Whole(name, "Pair", writable))

    # ------------------------------------------------------------ machines

    def _kind(self, number: int) -> _Kind:
        pen = self.pen
        states = [f"S{i}" for i in range(pen.number(1, self.max_states))]
        if len(states) > 1 and pen.one_in(4):
            states[-1] = "Suspend"
        isolated = "Suspend" in states and not pen.one_in(4)
        suspend = pen.pick(states[::-1]) if pen.one_in(3) else None
        constant, shared, peer = pen.one_in(3), pen.one_in(3), pen.one_in(3)
        return _Kind(f"Kind{number}", tuple(states), suspend, isolated, constant, shared, peer)

    def _instance(self, kind: _Kind, body: Document, names: list[str]) -> Document:
        parameters: Document = {}
        if kind.constant:
            parameters["c"] = str(self.pen.number(0, 3))
        if kind.shared:
            bools = [p.text for p in self.places if p.kind == "bool" and p.text.isalnum() and not p.size]
            parameters["p"] = self.pen.pick(bools)
        if kind.peer:
            parameters["peer"] = self.pen.pick(names)
        document: Document = {"inline": body, **({"parameters": parameters} if parameters else {})}
        if self.pen.one_in(6):
            document["suspended"] = True
        if self.pen.one_in(5):
            document["on_fault"] = "unload"
        if "choose(" in str(body):
            document["model"] = True
        return document

    def _machine(self, kind: _Kind, names: Names) -> Document:
        pen = self.pen
        own = [*names.places]
        variables: Document = {}
        for name, shape in (("n", "0..3"), ("flag", "bool"), ("u", "uint8"), ("big", "int"), ("row", "row")):
            if pen.one_in(4):
                variables[name] = {"type": {"array": "0..2", "size": 2} if shape == "row" else shape}
                if shape == "int":
                    variables[name] = {"type": "int", "init": str((1 << 63) - 1)}
                place = {"bool": Place(name, "bool"), "uint8": Place(name, "fixed", 0, 255), "int": Place(name, "int")}
                own.append(place.get(shape, Place(name, "range", 0, 2 if shape == "row" else 3, 2 * (shape == "row"))))
        machines = (*names.machines, ("self", kind.states[:1]), *((("peer", ("S0",)),) if kind.peer else ()))
        if kind.shared:
            own.append(Place("p", "bool", writable=False))
        constants = (("c", 0),) if kind.constant else ()
        chooses = pen.one_in(6)
        scope = replace(names, places=tuple(own), machines=machines, constants=constants, chooses=chooses)
        body: Document = {"machine": kind.name}
        parameters = {"c": {"constant": "0..3"}, "p": {"whiteboard": "bool"}, "peer": "machine"}
        given = {"c": kind.constant, "p": kind.shared, "peer": kind.peer}
        used = {n: parameters[n] for n, there in given.items() if there}
        if used:
            body["parameters"] = used
        if variables:
            body["variables"] = variables
        if pen.one_in(5):
            body["initial"] = pen.pick(kind.states)
        if kind.suspend is not None:
            body["suspend"] = kind.suspend
        body["states"] = [self._state(s, kind, scope) for s in kind.states]
        return body

    def _surroundings(self, names: Names, whiteboard: Document) -> Document:
        """A model that writes some of the inputs, those that its first `on_entry` writes."""
        pen = self.pen
        inputs = {n: w for n, w in whiteboard.items() if isinstance(w, dict) and w.get("role") == "input"}
        driven = [n for n, w in inputs.items() if "changes" not in w and not pen.one_in(3)]

        def seen(name: str, writable: bool) -> bool | None:
            """Whether the model writes it; None: it cannot see it."""
            source = re.split(r"[.\[]", name)[0]
            if source in inputs:
                return True if source in driven else None
            return False if source in whiteboard else writable

        places = tuple(replace(p, writable=w) for p in names.places if (w := seen(p.text, p.writable)) is not None)
        wholes = tuple(replace(p, writable=w) for p in names.wholes if (w := seen(p.text, p.writable)) is not None)
        own = Place("n", "range", 0, 3)
        scope = replace(names, places=(*places, own), wholes=wholes, machines=(), chooses=True)
        kind = _Kind(
            "Surroundings", tuple(f"E{i}" for i in range(pen.number(1, 2))), None, False, False, False, False, False
        )
        body: Document = {"machine": kind.name, "variables": {"n": {"type": "0..3"}}}
        states = [self._state(s, kind, scope) for s in kind.states]
        first = [p for p in places if p.writable]
        writer = Writer(pen, replace(scope, places=tuple(p for p in first if not p.size)))
        entry = [f"{p.text}{'[0]' if p.size else ''} = {writer.choose(p)};" for p in first]
        states[0]["on_entry"] = " ".join([*entry, str(states[0].get("on_entry", ""))]).strip() or "n = choose(0..3);"
        return {**body, "states": states}

    def _state(self, name: str, kind: _Kind, names: Names) -> Document:
        pen = self.pen
        state: Document = {"name": name}
        if pen.one_in(6):
            state["variables"] = {"s": {"type": "0..2", "init": "1"}}
            names = replace(names, places=(*names.places, Place("s", "range", 0, 2)))
        writer = Writer(pen, names)
        for action in _ACTIONS if kind.suspends else _ACTIONS[:3]:
            if pen.one_in(3 if action in ("on_entry", "internal") else 5):
                text = writer.actions(3)
                if text:
                    state[action] = text
        targets = [s for s in kind.states if not (kind.isolated and s == "Suspend")]
        if kind.isolated and name == "Suspend":
            return state
        number = pen.weighted(((3, 1), (2, 0), (3, 2), (1, 3)))
        if not number and pen.one_in(3):
            state["stays"] = "true"
        if number:
            state["transitions"] = [{"when": writer.condition(2), "to": pen.pick(targets[::-1])} for _ in range(number)]
        return state
