"""The debugger: a run that one walks forwards and backwards, and what there is to see where one stands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from llfsm_verify import TraceStep
from llfsm_verify.extensions.debugger import MOST_STEPS
from llfsm_verify.extensions.debugger.guards import Evaluated, Guards
from llfsm_verify.extensions.debugger.paths import Free, StepPath, free_value
from llfsm_verify.extensions.debugger.watches import FormulaWatch
from llfsm_verify.plug import (
    VERDICT_WORDS,
    Arrangement,
    DebugError,
    Differs,
    Execution,
    FaultSite,
    MonitorVerdict,
    Move,
    NextStep,
    PathStart,
    StepResult,
    element_texts,
    lower,
    text,
    tick,
    value_text,
)  # fmt: skip

MOST_ASKED = 8
"""Formulas whose values were asked for and whose programs are kept."""


@dataclass(frozen=True, slots=True)
class TakenStep:
    """A step of the run: what it was told, the record after it, the frame that it belongs to (of a recording), and how
    many cycles were complete after it."""

    move: Move
    record: bytes
    frame: int | None
    cycles: int


@dataclass(frozen=True, slots=True)
class Went:
    """From which position to which a command has gone, and why it stopped there (None: it did what was asked)."""

    begin: int
    end: int
    reason: str | None = None


@dataclass(frozen=True, slots=True)
class Failed:
    """The step after the last position has no successor: `site` is the fault (None: a value left 64 bits)."""

    move: Move
    site: FaultSite | None
    frame: int | None

    @property
    def sentence(self) -> str:
        """What happened."""
        if self.site is None:
            return "a value leaves 64 bits in the next step: the executor cannot go on"
        where = f" ({self.site.span})" if self.site.span is not None else ""
        return f"the next step ends in a fault: {self.site.message}{where}"


class Debugger:
    """Walks along the steps of a path; position k is the configuration after k ringlets.

    Every step is performed by the executor, with all bits kept. What was walked over stays as it was: going back and
    forwards again leads through the same configurations, until inputs are set in between.
    """

    def __init__(
        self,
        arrangement: Arrangement,
        path: Callable[[Execution], StepPath],
        start: PathStart = PathStart(),  # noqa: B008 - it is frozen
        most: int = MOST_STEPS,
    ) -> None:
        self.arrangement = arrangement
        self.execution = Execution(lower(arrangement, keep_all_bits=True))
        self.program = self.execution.program
        """The step program that is walked."""
        self.path = path(self.execution)
        self.most = most
        self.position = 0
        self.history: list[TakenStep] = []
        self.failed: Failed | None = None
        """What comes after the last step of the history, if that is known to fail."""
        self.breaks: dict[int, FormulaWatch] = {}
        self._numbers = 0
        self.start = start
        self._first = start.record(self.execution)
        self._cycle = self.execution.layout.reader(self.program.cycle)
        self._pending: NextStep | None = None
        self._asked: dict[str, FormulaWatch] = {}
        self._stopped = False

    @cached_property
    def _guards(self) -> Guards:
        return Guards(self.arrangement)

    # ------------------------------------------------ where one stands

    def record(self, position: int | None = None) -> bytes:
        """The record at a position: here, unless one is given."""
        at = self.position if position is None else position
        return self.history[at - 1].record if at else self._first

    @property
    def cycles(self) -> int:
        """Cycles that are complete here, of all processes together."""
        return self.history[self.position - 1].cycles if self.position else 0

    @property
    def frame(self) -> int | None:
        """The frame of a recording to which the step that led here belongs, or in which an earlier run stood."""
        if self.position:
            return self.history[self.position - 1].frame
        return None if self.start.stood is None else self.start.stood.frame

    @property
    def states(self) -> dict[str, str]:
        """The state of each machine that takes turns."""
        record, found = self.record(), {}
        for slot in self.program.slots:
            info = self.program.machines[slot.machine]
            found[info.name] = info.states[self.execution.layout.get(record, slot.state)]
        return found

    @property
    def turns(self) -> dict[str, str]:
        """For each process that has not ended, the machine whose turn is next in it."""
        values, found = self.execution.layout.decode(self.record()), {}
        for number in self.execution.enabled(self.record()):
            process = self.program.processes[number]
            turn = values[process.turn]
            assert isinstance(turn, int)
            found[process.name] = self.program.machines[self.program.slots[process.slots[turn]].machine].name
        return found

    @property
    def clocks(self) -> dict[str, int]:
        """The clock of each machine whose `after` asks for it: cycles since its state was entered, or, of an untimed
        arrangement, how many of its state's bounds are over."""
        record, found = self.record(), {}
        kind = ".$clock" if self.arrangement.timing == "timed" else ".$age"
        for var in self.program.vars:
            if var.name.endswith(kind) and not var.output:
                found[var.name.removesuffix(kind)] = self.execution.layout.get(record, var.name)
        return found

    @property
    def variables(self) -> dict[str, str]:
        """Every variable that users know, elements of arrays one by one, with the text of its value."""
        values = self.execution.layout.decode(self.record())
        found: dict[str, str] = {}
        for var in self.program.vars:
            if not var.output and var.origin.kind != "control":
                found.update((name, text(value)) for name, value in element_texts(var, values[var.name]))
        return found

    @property
    def controls(self) -> dict[str, str]:
        """What else there is of machines: pending commands, whether they have finished or are loaded."""
        hidden = {*self.states, *self.variables}
        return {name: value for name, value in self.execution.shown(self.record()) if name not in hidden}

    @property
    def inputs(self) -> dict[str, str]:
        """What inputs and other choices will be in the next step; of what has happened, what they were in the last."""
        if isinstance(self.path, Free) and self.position == len(self.history):
            return {name: self.path.value(name) for name in self.path.settable}
        if not self.position:
            return {}
        move, found = self.history[self.position - 1].move, {}
        for choice in self.program.choices:
            if choice.name in move.choices:
                found[choice.source] = value_text(choice.type, choice.labels, move.choices[choice.name])
        return found

    def described(self, number: int) -> TraceStep:
        """The step `number` (from 1) as traces show it."""
        before, move = self.record(number - 1), self.history[number - 1].move
        return self.execution.describe(before, move, self.execution.step(before, move), ())

    def guards(self) -> tuple[Evaluated, ...]:
        """The guards that were evaluated in the step that led here; of a step that fails, once one stands before it.

        The values of their parts are those at the moment of evaluation, in the step itself: after `on_entry` has run
        and inputs were sampled. DebugError: no step has led here.
        """
        layout = self.execution.layout
        if self.failed is not None and self.position == len(self.history):
            before, move, after = self.record(), self.failed.move, None
        elif self.position:
            before, move = self.record(self.position - 1), self.history[self.position - 1].move
            after = layout.decode(self.record())
        else:
            raise DebugError("no step has been taken yet")
        if move.process is None:
            return ()
        return self._guards.of(layout.decode(before), layout.decode_outputs(before), move, after)

    # ------------------------------------------------ walking

    def stop(self) -> None:
        """End what is under way after its step, from another thread or where a signal is served."""
        self._stopped = True

    def step(self, count: int = 1) -> Went:
        """So many ringlets forwards."""
        goal = self.position + count
        return self._forwards(lambda: "" if self.position >= goal else None)

    def cycle(self, count: int = 1) -> Went:
        """Forwards until so many cycles more are complete."""
        goal = self.cycles + count
        return self._forwards(lambda: "" if self.cycles >= goal else None)

    def until(self, formula: str) -> Went:
        """Forwards until a state formula is true, or a monitor that begins here has decided a temporal one.

        DiagnosticError: it is no formula of this arrangement. DebugError: it is never decided.
        """
        watch = self._watch(formula)
        self._follow(watch)
        reason = None if watch.is_state else watch.stops(self.position)
        if reason:
            return Went(self.position, self.position, reason)

        def enough() -> str | None:
            self._follow(watch)
            return watch.stops(self.position)

        return self._forwards(enough)

    def run(self) -> Went:
        """Forwards to the next break point, or to the end. DebugError: nothing would stop it."""
        if not self.breaks and isinstance(self.path, Free):
            raise DebugError("there are no break points, so nothing stops the run; `break FORMULA` sets one")
        return self._forwards(lambda: None)

    def back(self, count: int = 1) -> Went:
        """So many ringlets backwards."""
        goal = max(0, self.position - count)
        return self._backwards(lambda: "" if self.position <= goal else None)

    def back_cycle(self, count: int = 1) -> Went:
        """Backwards to where the last cycle began, and so many before it."""
        goal = self.cycles - count + (0 if self._begins_cycle() else 1)
        return self._backwards(lambda: "" if self.cycles <= goal and self._begins_cycle() else None)

    def run_back(self) -> Went:
        """Backwards to a break point, or to the beginning."""
        return self._backwards(lambda: None)

    def until_back(self, formula: str) -> Went:
        """Backwards until a state formula is true. DebugError: the formula has temporal operators."""
        watch = self._watch(formula, begin=0)
        if not watch.is_state:
            raise DebugError("going backwards needs a state formula: monitors read only forwards")
        self._follow(watch)
        return self._backwards(lambda: watch.stops(self.position))

    def go(self, position: int) -> Went:
        """To a position, forwards or backwards, past all break points."""
        begin = self.position
        if position <= len(self.history):
            self.position = position
            return Went(begin, position)
        self.position = len(self.history)
        went = self._forwards(lambda: "" if self.position >= position else None, stops_on_violation=False)
        return Went(begin, went.end, went.reason)

    def _begins_cycle(self) -> bool:
        return self.position == 0 or bool(self._cycle(self.record()))

    def _forwards(self, enough: Callable[[], str | None], *, stops_on_violation: bool = True) -> Went:
        begin, self._stopped = self.position, False
        while True:
            tick()
            try:
                reason = "stopped" if self._stopped else self._forward()
                if reason is not None:
                    return Went(begin, self.position, reason)
                found = enough()
                broken = self._broken() if stops_on_violation else None
            except DebugError as error:
                if self.position == begin:
                    raise
                return Went(begin, self.position, str(error))
            if found is not None or broken is not None:
                return Went(begin, self.position, broken or found or None)

    def _backwards(self, enough: Callable[[], str | None]) -> Went:
        begin, self._stopped = self.position, False
        while self.position:
            if self._stopped:
                return Went(begin, self.position, "stopped")
            self.position -= 1
            found, broken = enough(), self._broken()
            if found is not None or broken is not None:
                return Went(begin, self.position, broken or found or None)
        return Went(begin, 0, "this is the beginning")

    def _forward(self) -> str | None:
        """One step forwards; why it cannot be taken."""
        if self.position < len(self.history):
            self.position += 1
            return None
        if self.failed is not None:
            return self.failed.sentence
        if len(self.history) >= self.most:
            return f"{self.most:,} steps are kept to go back to, and there is no room for more (--history N)"
        given = self._given()
        if isinstance(given, str):
            return given
        result = self._performed(given)
        self._pending = None
        if result.status:
            site = self.program.faults[result.status - 1] if result.status > 0 else None
            self.failed = Failed(given.move, site, given.frame)
            return self.failed.sentence
        if given.fails and self.path.kind == "recording":
            raise DebugError(
                "this is not a recording of this arrangement: the last step ended in a fault, and does not now"
            )
        cycles = self.cycles + (1 if given.move.process is not None and self._cycle(result.record) else 0)
        self.history.append(TakenStep(given.move, result.record, given.frame, cycles))
        self.position += 1
        return None

    def _given(self) -> NextStep | str:
        """The next step of the path: that which could not be taken, if there is one."""
        if self._pending is None:
            if isinstance(self.path, Free):
                self.path.last = self.history[-1].move.process if self.history else None
            try:
                given = self.path.next(self.record(), self.position + 1)
            except Differs as differs:
                raise DebugError(f"this is not a recording of this arrangement: {differs}") from None
            if isinstance(given, str) or isinstance(self.path, Free):
                return given
            self._pending = given
        return self._pending

    def _performed(self, given: NextStep) -> StepResult:
        """The step, performed. DebugError: it is not possible here."""
        move, record = given.move, self.record()
        enabled, number = self.execution.enabled(record), self.position + 1
        if (move.process not in enabled) if move.process is not None else enabled:
            raise DebugError(f"the {self.path.kind} does not fit: step {number:,} is one that cannot be taken here")
        result = self.execution.step(record, move)
        read = [self.program.choices[i] for i, _ in result.samples]
        missing = next((c.source for c in read if c.name not in move.choices), None)
        if missing is not None and not given.fails:
            raise DebugError(
                f"the {self.path.kind} does not fit: step {number:,} reads `{missing}`, and it gives no value for it"
            )
        return result

    # ------------------------------------------------ formulas

    def _watch(self, formula: str, begin: int | None = None) -> FormulaWatch:
        return FormulaWatch(self.arrangement, formula, self.start, self.position if begin is None else begin)

    def _follow(self, watch: FormulaWatch) -> None:
        while watch.length < self.position:
            tick()
            watch.follow(self.history[watch.length].move)

    def add_break(self, formula: str) -> int:
        """Stop where this becomes true, or where its monitor (which begins here) decides it; its number.

        Errors as for `until`.
        """
        watch = self._watch(formula)
        self._follow(watch)
        self._numbers += 1
        self.breaks[self._numbers] = watch
        return self._numbers

    def remove_break(self, number: int | None) -> None:
        """Take a break point away (None: all). DebugError: there is none of that number."""
        if number is None:
            self.breaks.clear()
        elif self.breaks.pop(number, None) is None:
            raise DebugError(f"there is no break point {number}")

    def _broken(self) -> str | None:
        for number, watch in list(self.breaks.items()):
            try:
                self._follow(watch)
                reason = watch.breaks(self.position)
            except DebugError as error:
                del self.breaks[number]
                raise DebugError(f"break point {number} was removed: {error}") from None
            if reason is not None:
                return f"break point {number}: {reason}"
        return None

    def value(self, formula: str) -> str:
        """``true``, ``false`` or ``unknown``: a state formula here; of others, what a monitor says that has read
        everything from the beginning to here (``satisfied``, ``violated``, ``undecided``). Errors as for `until`."""
        key = " ".join(formula.split())
        watch = self._asked.get(key)
        if watch is None:
            watch = self._watch(formula, begin=0)
            if len(self._asked) >= MOST_ASKED:
                del self._asked[next(iter(self._asked))]
            self._asked[key] = watch
        self._follow(watch)
        if not watch.is_state:
            verdict = watch.verdict(self.position)
            return VERDICT_WORDS[verdict if verdict in VERDICT_WORDS else MonitorVerdict.NOT_YET]
        return {True: "true", False: "false", None: "unknown"}[watch.value(self.position)]

    # ------------------------------------------------ inputs

    def set(self, name: str, value: str) -> int:
        """Give an input, or what a turn chooses, a value from here on; how many later steps this forgets.

        DebugError: there is no such input or value, or what is walked has happened (`fork` leaves it).
        """
        path = self._free_path("set inputs")
        number = free_value(self.program, name, value)
        if number is None:
            path.set(name, value)
            return self._cut()
        if self.position:
            raise DebugError(f"`{name}` never changes in a run: `goto 0` leads to where it can be set")
        if self.start.stood is not None:
            raise DebugError(f"`{name}` never changes in a run, and this run continues an earlier one")
        forgotten = self._cut()
        self.start = PathStart((*self.execution.free(self._first), (name, number)))
        self._first = self.start.record(self.execution)
        self.breaks = {k: FormulaWatch(self.arrangement, w.text, self.start, 0) for k, w in self.breaks.items()}
        self._asked.clear()
        return forgotten

    def release(self, name: str) -> int:
        """Take back what was set; as for `set`."""
        self._free_path("set inputs").release(name)
        return self._cut()

    def turn(self, process: str) -> int:
        """Say which process takes the next step; as for `set`."""
        path = self._free_path("choose who steps")
        names = [p.name for p in self.program.processes]
        if process not in names:
            raise DebugError(f"there is no process `{process[:60]}`, only {', '.join(names)}")
        if names.index(process) not in self.execution.enabled(self.record()):
            raise DebugError(f"process `{process}` has ended")
        path.turn = names.index(process)
        return self._cut()

    def fork(self) -> int:
        """Leave what has happened: from here on inputs can be set, and have the values of the last step until then.

        How many later steps this forgets. DebugError: inputs can be set already.
        """
        if isinstance(self.path, Free):
            raise DebugError("inputs can be set already: `set` forgets the steps after this one by itself")
        path = Free(self.execution)
        if self.position:
            last = self.history[self.position - 1].move.choices
            for name, choice in path.settable.items():
                given = last.get(choice.name, last.get(name))
                if given is not None and choice.kind in ("input", "read"):
                    path.held[name] = given
        self.path, self._pending = path, None
        return self._cut()

    def _free_path(self, what: str) -> Free:
        if isinstance(self.path, Free):
            return self.path
        raise DebugError(
            f"you cannot {what}: this {self.path.kind} has happened; `fork` leaves it here and continues with inputs "
            "that you set"
        )

    def _cut(self) -> int:
        """Forget what comes after this position; how many steps that were."""
        forgotten = len(self.history) - self.position
        del self.history[self.position :]
        self.failed = None
        for watch in (*self.breaks.values(), *self._asked.values()):
            watch.cut(self.position)
        return forgotten
