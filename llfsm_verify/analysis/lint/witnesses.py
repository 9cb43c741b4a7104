"""Witnesses: runs performed by the executor and confirmed by the interpreter, and the values that matter in them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Protocol

from llfsm_verify.analysis.lint.finding import Proof, Witness
from llfsm_verify.analysis.lint.local import Locally, Situation
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.reference import Interpreter
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.replay.confirm import Schedule
from llfsm_verify.checking.replay.replayer import Replayer
from llfsm_verify.checking.trace import Trace
from llfsm_verify.diagnostics import Disagreement
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import AtState, Expression, Index, Literal, Read
from llfsm_verify.program.program import Choice
from llfsm_verify.semantics.probes import Outcome, Probe
from llfsm_verify.semantics.storage import element_names as all_element_names
from llfsm_verify.semantics.walk import elements as element_names
from llfsm_verify.transforms.probing import Probed, probed
from llfsm_verify.values import Value, elements, text, value_text


class Runs(Protocol):
    """Something that has runs of a probed program, by the outcomes of their last steps."""

    @property
    def probed(self) -> Probed: ...

    @property
    def complete(self) -> bool:
        """It has every outcome that can come out."""
        ...

    def has(self, outcome: Outcome) -> bool: ...

    def run_to(self, outcome: Outcome) -> Schedule: ...


class Known:
    """Answers about the outcomes of a probed program (a wide one)."""

    def __init__(self, probed: Probed, locally: Locally, reaches: Sequence[Runs]) -> None:
        """`reaches`: runs of this program, or of the same one with fewer probes."""
        self.probed = probed
        self._locally = locally
        self._reaches = reaches

    @property
    def complete(self) -> bool:
        """All reachable configurations are known."""
        return any(r.complete for r in self._reaches)

    def never(self, probe: Probe, value: int = 1) -> Proof | None:
        """How it is known that this never comes out; None: it can, or that is not known."""
        outcome = Outcome(probe, value)
        if outcome not in self.probed.outputs or outcome in self._locally.impossible:
            return "local"
        searched = (r for r in self._reaches if r.complete and outcome in r.probed.outputs)
        return "reachable" if any(not r.has(outcome) for r in searched) else None

    def shown(self, probe: Probe, value: int = 1) -> Runs | None:
        """What has a run in which this comes out."""
        return next((r for r in self._reaches if r.has(Outcome(probe, value))), None)

    def somewhere(self, probe: Probe, value: int = 1) -> Situation | None:
        """A configuration inside the ranges, which need not be reachable, in whose turn this comes out."""
        return self._locally.possible.get(Outcome(probe, value))


MOST_VALUES = 12
"""Variables, and inputs, that a witness shows."""


class Shower:
    """Makes the witnesses of one arrangement."""

    def __init__(self, arrangement: Arrangement) -> None:
        self._arrangement = arrangement
        self._replayer = Replayer(Problem(arrangement))
        self._programs: dict[bool, tuple[Probed, Interpreter]] = {}

    def fits(self, schedule: Schedule) -> bool:
        """Whether all values of a run of the wide program stay in the 64 bits in which the executor holds them."""
        try:
            self._interpreted(schedule, wide=True)
        except OverflowError:
            return False
        return True

    def of_run(self, schedule: Schedule, outcome: Outcome, wide: bool, read: Iterable[Expression | Read]) -> Witness:
        """The run `schedule`, whose last step has the outcome. Disagreement: it has not."""
        situation, _, outputs = self._interpreted(schedule, wide)
        name = self._program(wide)[0].outputs[outcome]
        if not outputs.get(name):
            raise Disagreement(f"lint: the interpreter does not see {_what(outcome)}")
        trace = self._performed(schedule, _what(outcome))
        self._compare(trace, outcome)
        return self._witness(situation, read, trace)

    def of_start(self, schedule: Schedule, machine: str, state: str) -> Witness:
        """The run `schedule`, after which `machine` is in `state`. Disagreement: it is not."""
        _, values, _ = self._interpreted(schedule, wide=False)
        trace = self._performed(schedule, f"{machine}@{state}")
        info = next(m for m in self._program(False)[0].program.machines if m.name == machine)
        number = values[f"{machine}.$state"]
        texts = dict(trace.initial) | {c.variable: c.after for s in trace.steps for c in s.changes}
        if not isinstance(number, int) or info.states[number] != state or texts[machine] != state:
            raise Disagreement(f"lint: the run does not lead {machine} to {state}")
        return Witness((), (), trace)

    def of_start_anywhere(self, schedule: Schedule) -> Witness:
        """The run `schedule`, which the interpreter can also follow."""
        self._interpreted(schedule, wide=False)
        return Witness((), (), self._performed(schedule, "a run"))

    def of_ranges(self, situation: Situation, read: Iterable[Expression | Read]) -> Witness:
        """Values that need not be reachable."""
        return self._witness(situation, read, None)

    # ------------------------------------------------ runs

    def _program(self, wide: bool) -> tuple[Probed, Interpreter]:
        if wide not in self._programs:
            made = probed(self._arrangement, wide=wide, keep_all_bits=True)
            self._programs[wide] = made, Interpreter(made.program)
        return self._programs[wide]

    def _interpreted(
        self, schedule: Schedule, wide: bool
    ) -> tuple[Situation, Mapping[str, Value], Mapping[str, Value]]:
        """By the interpreter: what is before the last step (if there is one), and variables and outputs after it.

        OverflowError: a value leaves 64 bits, as none does in runs that an exploration has found.
        """
        program, interpreter = self._program(wide)
        values: dict[str, Value] = {v.name: v.init for v in program.program.vars if not v.output}
        outputs: dict[str, Value] = {v.name: v.init for v in program.program.vars if v.output}
        values |= dict(schedule.free)
        before, samples = values, dict[str, int]()
        for number, move in enumerate(schedule.ringlets, 1):

            def choose(choice: Choice, given: Mapping[str, int] = move.choices, step: int = number) -> int:
                if choice.name not in given:
                    raise Disagreement(f"lint: step {step} reads `{choice.name}`, which the search did not")
                return given[choice.name]

            outcome = interpreter.step(values, outputs, move.process, choose)
            if outcome.overflow:
                raise OverflowError(f"step {number} leaves 64 bits")
            before, samples = values, dict(outcome.samples)
            values, outputs = outcome.values, outcome.outputs
        return Situation(before, samples), values, outputs

    def _performed(self, schedule: Schedule, what: str) -> Trace:
        """By the executor: the run on the arrangement's own program."""
        return self._replayer.perform(schedule, frozenset(), f"lint: {what}", ()).trace

    def _compare(self, trace: Trace, outcome: Outcome) -> None:
        """The arrangement's own run does what the probe says, where a trace shows that."""
        probe, last = outcome.probe, trace.steps[-1]
        program = self._program(False)[0].program
        info = next(m for m in program.machines if m.name == probe.machine)
        # A fault that unloads its machine leaves no fault in the trace, and no transition.
        unloads = self._arrangement.machine(probe.machine).on_fault == "unload"
        gone = unloads and any(c.variable == f"{probe.machine}.loaded" and c.after == "false" for c in last.changes)
        if probe.kind == "fault":
            fine = gone or trace.fault == program.faults[probe.number] if outcome.value else True
        elif probe.kind == "fired" and trace.fault is None and not gone:
            fine = last.fired == info.transition_text(probe.state, probe.number)
        else:
            # Of a step that faults the state before its commands is shown.
            fine = trace.fault is not None or probe.state < 0 or last.state == info.states[probe.state]
        if not fine or last.machine != probe.machine:
            raise Disagreement(f"lint: the executor does not show {_what(outcome)}")

    # ------------------------------------------------ values

    def _witness(self, situation: Situation, read: Iterable[Expression | Read], trace: Trace | None) -> Witness:
        program = self._program(False)[0].program
        wanted = dict.fromkeys(name for root in read for name in self._read(root))
        texts = {
            name: text(value)
            for v in program.vars
            if v.name in situation.values
            for name, value in elements(v, situation.values[v.name])
        }
        variables = [(_shown_name(n), texts[n]) for n in wanted if n in texts]
        choices = {c.name: c for c in program.choices}
        inputs: dict[str, str] = {}
        for name, number in situation.samples.items():
            choice = choices.get(name)
            if choice is not None and choice.input in wanted:
                inputs[choice.input] = value_text(choice.type, choice.labels, number)
        return Witness(tuple(variables[:MOST_VALUES]), tuple(inputs.items())[:MOST_VALUES], trace)

    def _read(self, root: Expression | Read) -> Iterator[str]:
        """The scalars, states and inputs that an expression reads."""
        for part in of_kind(root, Read):
            fixed = all(isinstance(s.value, Literal) for s in part.path if isinstance(s, Index))
            names = (
                element_names(part)
                if fixed
                else [n for n, _ in all_element_names(part.variable.name, part.variable.type)]
            )
            yield from names
        for at in of_kind(root, AtState):
            yield f"{at.machine}.$state"


def _shown_name(name: str) -> str:
    return name.removesuffix(".$state")


def _what(outcome: Outcome) -> str:
    probe = outcome.probe
    place = "" if probe.span is None else f" at {probe.span}"
    return f"outcome {outcome.value} of {probe.kind} of {probe.machine}{place}"
