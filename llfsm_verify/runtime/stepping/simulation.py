"""An arrangement that one steps through: by ringlets, by cycles, or a million ringlets at once."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from random import Random
from types import MappingProxyType
from typing import Self

from llfsm_verify.backends.native.executor import ENDED, OVERFLOW, Event, NativeProgram
from llfsm_verify.program.program import Choice, FaultSite, Input, Int, Program
from llfsm_verify.runtime.stepping.drawing import ANEW, Drawing, Draws, free_values, unknown_input
from llfsm_verify.values import Shown, ValueProblem, number_of, shown

__tracebackhide__ = True
"""For pytest: a step that a test cannot take fails in the line of the test, not here."""


class SimulationError(Exception):
    """The arrangement cannot take this step. The simulation stays where it was before."""


class SimulationFault(SimulationError):
    """The step ends in a fault of the model; `site` says which and where."""

    def __init__(self, site: FaultSite) -> None:
        self.site = site
        where = f"{site.span}: " if site.span is not None else ""
        super().__init__(f"{where}{site.message}")


class SimulationOverflow(SimulationError):
    """An unbounded integer left the 64 bits in which the executor holds it."""

    def __init__(self) -> None:
        super().__init__("an integer left 64 bits")


class Simulation:
    """Steps a program from its first initial configuration.

    Inputs that a call does not choose are drawn at random from `seed`, by `law`, those that never change once; without
    a seed they have their lowest values. Processes take turns likewise: drawn at random, or one after the other. Equal
    seeds give equal runs.
    """

    def __init__(self, program: Program | NativeProgram, seed: int | None = None, law: Drawing = ANEW) -> None:
        self._native = program if isinstance(program, NativeProgram) else NativeProgram(program, events=True)
        self.program = self._native.program
        self._layout = self._native.layout
        self._cycle = self._layout.reader(self.program.cycle)
        self._named: dict[str, dict[Choice, None]] = {}
        for choice in self.program.choices:
            for name in filter(None, (choice.input, choice.name)):
                self._named.setdefault(name, {})[choice] = None
        self._law = law
        self._begin(seed, {})

    def _begin(self, seed: int | None, free: Mapping[str, int]) -> None:
        self._random = None if seed is None else Random(seed)  # noqa: S311 - a reproducible sequence is wanted
        self._turn = 0
        self._draws = Draws(self._law, len(self.program.slots))
        drawn = {} if seed is None else free_values(self.program, {}, self._law, seed)
        self.record = self._layout.first({**drawn, **free})
        """Where the simulation stands (see `backends.native.layout`); may be set to go elsewhere."""
        self.events: tuple[Event, ...] = ()
        """What happened in the last ringlet or cycle: kind, index of the machine, arguments. Empty after `run`."""
        self.steps = 0
        """Ringlets taken so far."""

    def anew(self, seed: int | None = None, free: Mapping[str, Shown] = MappingProxyType({})) -> Self:
        """Another simulation of the same machine code, at its beginning.

        `free` gives values to inputs that have any value in the first configuration and keep it. ValueError: there is
        no such input, or it has no such value.
        """
        variables = {v.name: v for v in self.program.vars if v.free}
        numbers: dict[str, int] = {}
        for name, value in free.items():
            if name not in variables:
                raise ValueError(f"no input {name!r} is free at first, only {', '.join(variables) or 'none at all'}")
            var = variables[name]
            assert isinstance(var.type, Int), "inputs are bounded"
            numbers[name] = _number(Input(name, var.type, var.type.low, var.origin.labels), name, value)
        twin = copy(self)
        twin._begin(seed, numbers)
        return twin

    # ------------------------------------------------------------ looking

    @property
    def values(self) -> dict[str, Shown | tuple[Shown, ...]]:
        """The variables of the arrangement, with the names of enumerators, and by the name of each machine that of its
        state."""
        values = self._layout.decode(self.record)
        named: dict[str, Shown | tuple[Shown, ...]] = {}
        for v in self.program.vars:
            name = v.name.removesuffix(".$state")
            if v.output or "$" in name:
                continue
            value, labels = values[v.name], v.origin.labels
            if isinstance(value, tuple):
                named[name] = tuple(shown(v.type, labels, x) for x in value)
            else:
                named[name] = shown(v.type, labels, value)
        return named

    def state(self, machine: str) -> str:
        """The name of the state that a machine is in. KeyError: there is no such machine."""
        names = []
        for slot in self.program.slots:
            info = self.program.machines[slot.machine]
            if info.name == machine:
                return info.states[self._layout.get(self.record, slot.state)]
            names.append(info.name)
        raise KeyError(f"there is no machine {machine!r}, only {', '.join(names)}")

    @property
    def outputs(self) -> dict[str, int | tuple[int, ...]]:
        """The outputs of the last step (`ran`, `cycle`, atoms …), as numbers."""
        return self._layout.decode_outputs(self.record)

    @property
    def ended(self) -> bool:
        """No process is left; from here the arrangement only stutters."""
        return not self._native.enabled(self.record)

    @property
    def enabled(self) -> tuple[str, ...]:
        """The names of the processes that can step."""
        return tuple(self.program.processes[i].name for i in self._native.enabled(self.record))

    @property
    def stuttered(self) -> bool:
        """The last step was a stuttering one, of an arrangement that has ended."""
        return self.steps > 0 and not self._layout.reader(self.program.ran)(self.record)

    @property
    def cycle_complete(self) -> bool:
        """The last ringlet completed a cycle of its process; true before the first one."""
        return bool(self._cycle(self.record))

    # ------------------------------------------------------------ stepping

    def ringlet(self, inputs: Mapping[str, Shown] | None = None, process: str | None = None) -> None:
        """One ringlet of `process` (else of the one whose turn it is), with these values of inputs, by input's name.

        `inputs` may also name a choice of the program: the age of an untimed state, or a single read of an input.
        After the end it is a stuttering step. Raises SimulationFault, SimulationOverflow; ValueError for an unknown
        input or process, one that may not step, or a value that is not of the input's type.
        """
        self.events = self._ringlet(self.choices(inputs), process)

    def cycle(self, inputs: Mapping[str, Shown] | None = None, process: str | None = None) -> int:
        """Ringlets until one completes a cycle (of any process, unless `process` names one to run alone); their number.

        Errors as for `ringlet`; the simulation then stands before the ringlet that failed.
        """
        chosen, count = self.choices(inputs), 0
        events: list[Event] = []
        while True:
            stutters = self.ended
            events += self._ringlet(chosen, process)
            self.events = tuple(events)
            count += 1
            if stutters or self._cycle(self.record):
                return count

    def run(self, ringlets: int, inputs: Mapping[str, Shown] | None = None) -> int:
        """Up to `ringlets` ringlets in machine code, fewer when the arrangement ends; their number.

        Inputs are drawn at random (another sequence than that of `ringlet`), or have the values of `inputs`, else their
        lowest ones. Raises SimulationFault and SimulationOverflow; the simulation then stands before the ringlet that
        failed. ValueError: wrong inputs, or inputs for a simulation with a seed.
        """
        chosen = self._held(inputs)
        if self._random is None:
            result = self._native.run(self.record, ringlets, process=self._turn, choices=chosen)
        else:
            seed, chosen, table = self._random.getrandbits(64), *self._draws.in_code(self.program, self._random)
            result = self._native.run(self.record, ringlets, mode="random", seed=seed, choices=chosen, table=table)
            self._draws.note(self.program.choices, result.choices)
        self.record, self._turn, self.events = result.record, result.process, ()
        self.steps += result.steps
        if result.status != ENDED:
            self._raise(result.status)
        return result.steps

    def _ringlet(self, chosen: Mapping[str, int], process: str | None) -> tuple[Event, ...]:
        number = self._next_process(process)
        choices = dict(chosen)
        if self._random is not None:
            left = [choice for choice in self.program.choices if choice.name not in choices]
            choices |= self._draws.next(left, self._random)
        result = self._native.step(self.record, number, choices)
        self._raise(result.status)
        self.record = result.record
        self.steps += 1
        if number is not None:
            self._turn = (number + 1) % len(self.program.processes)
        return result.events

    def _next_process(self, name: str | None) -> int | None:
        enabled = self._native.enabled(self.record)
        names = [p.name for p in self.program.processes]
        if name is not None:
            if name not in names:
                raise ValueError(f"there is no process {name!r}, only {', '.join(names)}")
            if enabled and names.index(name) not in enabled:
                raise ValueError(f"process {name!r} has ended")
        if not enabled:
            return None
        if name is not None:
            return names.index(name)
        if self._random is not None:
            return self._random.choice(enabled)
        return min(enabled, key=lambda p: (p - self._turn) % len(names))

    def _raise(self, status: int) -> None:
        if status == OVERFLOW:
            raise SimulationOverflow
        if status > 0:
            raise SimulationFault(self.program.faults[status - 1])

    # ------------------------------------------------------------ inputs

    def _held(self, inputs: Mapping[str, Shown] | None) -> dict[str, int]:
        if inputs and self._random is not None:
            raise ValueError("a run with a seed draws its inputs: it takes none")
        return self.choices(inputs)

    def choices(self, inputs: Mapping[str, Shown] | None) -> dict[str, int]:
        """The choices that inputs stand for, with their values: each input has one choice, or one for each read.

        ValueError: an unknown input, or a value that is not of its type.
        """
        chosen: dict[str, int] = {}
        for name, value in (inputs or {}).items():
            choices = self._named.get(name, ())
            unread = [i for i in self.program.inputs if i.name == name]
            if not choices and not unread:
                if any(v.name == name and v.origin.kind == "input" for v in self.program.vars):
                    raise ValueError(unknown_input(self.program, name))
                known = sorted({c.source for c in self.program.choices} | {i.name for i in self.program.inputs})
                raise ValueError(f"there is no input {name!r}, only {', '.join(known) or 'none at all'}")
            for choice in choices:
                chosen[choice.name] = _number(choice, name, value)
            for one in unread:
                _number(one, name, value)  # one that nothing reads now is checked all the same
        return chosen


def _number(one: Choice | Input, name: str, value: Shown) -> int:
    kind = one.type
    if type(value) is int and (one.labels or kind.boolean) and kind.low <= value <= kind.high:
        return value
    try:
        return number_of(one, value)
    except ValueProblem as problem:
        raise ValueError(f"input {name!r}: {problem}") from None
