"""Two ways to run one arrangement, side by side: every difference between them is a `Mismatch`."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.native.layout import Layout, TooManyInitial
from llfsm_verify.backends.reference import Interpreter, Outcome, evaluate
from llfsm_verify.language.types import ArrayType, RecordType, Type, Value
from llfsm_verify.program.program import Choice, Program
from llfsm_verify.values import Value as Held
from tests.oracle.direct import Configuration, Direct, Picks, Scalar, Step

MAX_WAYS = 50
"""Steps looked at from one configuration."""


class MismatchError(AssertionError):
    """The two ways differ."""


@dataclass(frozen=True, slots=True)
class Walked:
    """How much a walk has compared."""

    configurations: int
    steps: int
    faults: int
    overflows: int


def flat(name: str, kind: Type, value: Value) -> dict[str, Held]:
    """A variable as the lowering lays it out: one variable per field, all elements of an array in one row."""
    found: dict[str, list[int]] = {}
    arrays: set[str] = set()

    def visit(name: str, kind: Type, value: Value, inside: bool) -> None:
        if isinstance(kind, RecordType):
            for (field, t), v in zip(kind.fields, value, strict=True):
                visit(f"{name}.{field}", t, v, inside)
        elif isinstance(kind, ArrayType):
            for v in value:
                visit(name, kind.element, v, True)
        else:
            found.setdefault(name, []).append(int(value))
            if inside:
                arrays.add(name)

    visit(name, kind, value, False)
    return {n: tuple(v) if n in arrays else v[0] for n, v in found.items()}


class Lockstep:
    """An arrangement's lowered program (all bits kept) and the direct interpreter."""

    def __init__(self, arrangement: Arrangement, program: Program, direct: Direct) -> None:
        self.arrangement, self.program, self.direct = arrangement, program, direct
        self.interpreter = Interpreter(program)
        self.layout = Layout.of(program)
        self.types = {w.variable.name: w.variable.type for w in arrangement.whiteboard}
        for m in arrangement.texts:
            self.types |= {v.name: v.type for v in (*m.variables, *(v for s in m.states for v in s.variables))}
        self.kinds = {c.name: c for c in program.choices}
        self.ages = {c.name: c.name.split(".")[0] for c in program.choices if c.kind == "age"}
        self.sampled = {c.name for c in program.choices if c.kind == "input" and not c.name.endswith("#letter")}
        self.persistent = {v.name for v in program.vars if not v.output}

    def walk(self, limit: int) -> Walked:
        """Breadth first, up to `limit` pairs of configurations. Raises MismatchError."""
        pairs = self._initial()
        seen = set(pairs)
        queue = deque(pairs)
        steps = faults = overflows = 0
        while queue:
            c, record = queue.popleft()
            for after, step, outcome in self._compare(c, record):
                steps += 1
                faults += step.fault is not None
                overflows += outcome.overflow
                if after is not None and after not in seen and len(seen) < limit:
                    seen.add(after)
                    queue.append(after)
        return Walked(len(seen), steps, faults, overflows)

    # ------------------------------------------------------------ configurations

    def _initial(self) -> list[tuple[Configuration, bytes]]:
        ours = {self._observable(c): c for c in self.direct.initial()}
        try:
            records = self.layout.initial(4096)
        except TooManyInitial as e:
            raise MismatchError("the strategy draws too many free inputs") from e
        theirs = {self._shown(self.layout.decode(r)): r for r in records}
        self._same("initial configurations", set(ours), set(theirs))
        for key, c in ours.items():
            values = self.layout.decode(theirs[key])
            locals_ = {f"input:{i.name}": i.init for i in self.program.inputs}
            zero = {v.name: v.init for v in self.program.vars if v.output}
            letter = {a.name: bool(evaluate(a.expression, values | zero, locals_)) for a in self.program.atoms}
            self._same("first letters", self.direct.letter(c, _no_choice), letter)
        return [(ours[k], theirs[k]) for k in ours]

    def _observable(self, c: Configuration) -> tuple[tuple[str, Held], ...]:
        seen: dict[str, Held] = {}
        for name, value in c.variables:
            seen |= flat(name, self.types[name], value)
        seen |= {name: int(value) for name, value in c.stored}
        for m, its in zip(self.arrangement.machines, c.machines, strict=True):
            seen[f"{m.name}.$state"] = len(m.states) if its.state == -1 else its.state
            seen[f"{m.name}.$finished"] = int(its.finished)
            seen[f"{m.name}.$loaded"] = int(its.loaded)
            seen[f"{m.name}.$done"] = int(its.done)
        for plant, its in zip(self.arrangement.plants, c.plants, strict=True):
            seen[f"{plant.name}.$state"] = its.state
        for p, its in zip(self.arrangement.processes, c.processes, strict=True):
            seen[f"{p.name}.$ended"] = int(its.ended)
            if not its.ended:
                seen[f"{p.name}.$turn"] = its.turn
        return tuple(sorted((n, v) for n, v in seen.items() if self._known(n)))

    def _known(self, name: str) -> bool:
        """The lowering leaves out control variables that have one value only."""
        return name in self.persistent or not name.endswith(
            ("$finished", "$loaded", "$done", "$ended", "$turn", "$state")
        )

    def _shown(self, values: Mapping[str, Held]) -> tuple[tuple[str, Held], ...]:
        """The same of a lowered configuration."""
        shown = {
            n: v
            for n, v in values.items()
            if "$" not in n or n.endswith(("$state", "$finished", "$loaded", "$done", "$ended"))
        }
        for p in self.program.processes:
            if not (p.ended and values[p.ended]):
                shown[p.turn] = values[p.turn]
        return tuple(sorted(shown.items()))

    # ------------------------------------------------------------ steps

    def _compare(
        self, c: Configuration, record: bytes
    ) -> list[tuple[tuple[Configuration, bytes] | None, Step, Outcome]]:
        values, outputs = self.layout.decode(record), self.layout.decode_outputs(record)
        enabled: Sequence[int | None] = self.interpreter.enabled(values) or [None]
        self._same("processes that may step", self.direct.enabled(c), list(enabled))
        done = []
        driven: set[tuple[int | None, Picks]] = set()
        for process, outcome in islice(self.interpreter.successors(values, outputs), MAX_WAYS):
            picks, step = self._drive(c, process, outcome)
            after = self._judge(step, outcome)
            driven.add((process, picks))
            done.append((after, step, outcome))
        if len(done) < MAX_WAYS and not any(outcome.overflow for _, _, outcome in done):
            ways = {(process, picks) for process, picks, _ in islice(self.direct.successors(c), MAX_WAYS)}
            self._same("ways to step", ways, driven)
        return done

    def _drive(self, c: Configuration, process: int | None, outcome: Outcome) -> tuple[Picks, Step]:
        """The direct step with the choices that the lowered one made."""
        reads = [(self.kinds[n].input, v) for n, v in outcome.samples if self.kinds[n].kind == "read"]
        inputs = {self.kinds[n].input: v for n, v in outcome.samples if n in self.sampled}
        frees = {self.kinds[n].input: v for n, v in outcome.samples if n.endswith("#letter")}
        ages = {self.ages[n]: v for n, v in outcome.samples if n in self.ages}
        chosen = [(n.split("(")[0], v) for n, v in outcome.samples if self.kinds[n].kind == "choose"]
        picks: list[tuple[str, str, Scalar]] = []
        used: set[tuple[str, str]] = set()

        def choose(kind: str, name: str, allowed: Sequence[Scalar]) -> Scalar:
            if kind == "choose":
                if not chosen or chosen[0][0] != name:
                    raise MismatchError(f"direct chooses {name}, lowered {chosen[:1]} of {outcome.samples}")
                value = chosen.pop(0)[1]
                if max(allowed) - min(allowed) >= len(allowed):
                    value = allowed[value]  # a list with gaps: by its number
            elif kind == "age":
                value = max(self._pick("age", name, ages), allowed[0])
            elif kind == "input" and self.direct.profile.snapshot == "none" and name not in self.direct.stored:
                if not reads or reads[0][0] != name:
                    raise MismatchError(f"direct reads {name}, lowered {reads[:1]} of {outcome.samples}")
                value = reads.pop(0)[1]
            else:
                used.add((kind, name))
                value = self._pick(kind, name, frees if kind == "free" and name in frees else inputs)
            found = next((a for a in allowed if a == value), None)
            if found is None:
                raise MismatchError(f"{kind} {name} = {value}, direct allows {allowed}")
            picks.append((kind, name, found))
            return found

        if outcome.overflow:  # the lowered step stopped there: the rest of the direct one is of no interest

            def choose_anything(kind: str, name: str, allowed: Sequence[Scalar]) -> Scalar:
                try:
                    return choose(kind, name, allowed)
                except MismatchError:
                    return allowed[0]

            return tuple(picks), self.direct.step(c, process, choose_anything)
        step = self.direct.step(c, process, choose)
        seen = {name for _, name in used}
        unread = [
            *reads,
            *chosen,
            *(n for n in inputs if n not in seen),
            *(n for n in frees if ("free", n) not in used),
        ]
        if unread:
            raise MismatchError(f"lowered reads {unread}, direct does not: {outcome}")
        return tuple(picks), step

    def _pick(self, kind: str, name: str, given: Mapping[str, int]) -> int:
        if name not in given:
            raise MismatchError(f"direct chooses {kind} {name}, lowered has only {dict(given)}")
        return given[name]

    def _judge(self, step: Step, outcome: Outcome) -> tuple[Configuration, bytes] | None:
        if outcome.overflow:
            self._same("an integer left 64 bits", step.wide, True)
            return None
        site = None if outcome.fault is None else self.program.faults[outcome.fault]
        fault = None if site is None or site.span is None else (site.code, site.span.line)
        self._same("fault", step.fault, fault)
        names = [m.name for m in self.program.machines]
        events = [(k, names[m], self._arguments(k, a)) for k, m, a in outcome.events]
        if fault is None or events != list(step.events[:-1]):  # a lowered action tells of itself when it is over
            self._same("events", list(step.events), events)
        if step.after is None:
            return None
        self._same("configuration", self._observable(step.after), self._shown(outcome.values))
        self._same("cycle", int(step.after.cycle), outcome.outputs[self.program.cycle])
        if step.letter is not None:
            letter = {a.name: bool(outcome.outputs[a.output]) for a in self.program.atoms}
            self._same("letter", step.letter, letter)
        return step.after, self.layout.encode(outcome.values) + self.layout.encode_outputs(outcome.outputs)

    def _arguments(self, kind: str, arguments: tuple[int, ...]) -> tuple[int, ...]:
        """Those of an event; a fault and a refusal by their lines."""
        if kind not in ("faulted", "refused"):
            return arguments
        span = (self.program.faults if kind == "faulted" else self.program.refusals)[arguments[0]].span
        return arguments if span is None else (span.line,)

    def _same(self, what: str, direct: object, lowered: object) -> None:
        if direct != lowered:
            one, other = _difference(direct, lowered), _difference(lowered, direct)
            raise MismatchError(f"{what}:\n direct  {one}\n lowered {other}")


def _difference(one: object, other: object) -> object:
    if isinstance(one, set) and isinstance(other, set):
        return f"only here: {sorted(map(repr, one - other))}"
    if isinstance(one, tuple) and isinstance(other, tuple):
        return [x for x in one if x not in other]
    if isinstance(one, dict) and isinstance(other, dict):
        return {k: v for k, v in one.items() if k not in other or other[k] != v}
    return one


def _no_choice(kind: str, name: str, values: Sequence[Scalar]) -> Scalar:
    raise MismatchError(f"the first letter chooses {kind} {name}")


def same_words(full: Program, reduced: Program, limit: int) -> int:
    """Walk a program with all bits beside the one with dead bits removed: equal letters, faults and choices, and the
    reduced configuration depends on the full one only. The number of full configurations. Raises MismatchError."""
    interpreter, other = Interpreter(full), Interpreter(reduced)
    layout, short = Layout.of(full), Layout.of(reduced)
    image: dict[bytes, bytes] = dict(zip(layout.initial(4096), short.initial(4096), strict=True))
    queue = deque(image)
    while queue:
        record = queue.popleft()
        values, outputs = layout.decode(record), layout.decode_outputs(record)
        v, o = short.decode(image[record]), short.decode_outputs(image[record])
        if interpreter.enabled(values) != other.enabled(v):
            raise MismatchError(f"enabled {interpreter.enabled(values)}, reduced {other.enabled(v)}")
        for process, outcome in islice(interpreter.successors(values, outputs), MAX_WAYS):
            given = dict(outcome.samples)
            reply = other.step(v, o, process, lambda choice: _given(choice, given))  # noqa: B023
            _same_outcome(full, reduced, outcome, reply)
            if outcome.fault is not None or outcome.overflow:
                continue
            after = layout.encode(outcome.values) + layout.encode_outputs(outcome.outputs)
            target = short.encode(reply.values) + short.encode_outputs(reply.outputs)
            if after not in image and len(image) < limit:
                queue.append(after)
                image[after] = target
            if image.get(after, target) != target:
                raise MismatchError(f"one configuration, two reduced ones: {outcome.values}")
    return len(image)


def _given(choice: Choice, given: Mapping[str, int]) -> int:
    if choice.name not in given:
        raise MismatchError(f"only the reduced program reads {choice.name}")
    return given[choice.name]


def _same_outcome(full: Program, reduced: Program, one: Outcome, two: Outcome) -> None:
    sites = [None if o.fault is None else p.faults[o.fault] for p, o in ((full, one), (reduced, two))]
    if sites[0] != sites[1] or one.overflow != two.overflow or set(one.samples) != set(two.samples):
        raise MismatchError(f"{sites[0]} {one.samples}, reduced {sites[1]} {two.samples}")
    letters = [{a.name: o.outputs[a.output] for a in p.atoms} for p, o in ((full, one), (reduced, two))]
    if letters[0] != letters[1]:
        raise MismatchError(f"letter {letters[0]}, reduced {letters[1]}")
