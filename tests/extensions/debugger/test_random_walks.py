"""Random walks of a debugger, against the reference interpreter and what the executor tells of guards."""

from __future__ import annotations

import random
from collections import Counter

import pytest
from hypothesis import HealthCheck, Phase, settings

from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.backends.reference import Interpreter
from llfsm_verify.extensions.debugger.debugger import Debugger
from llfsm_verify.extensions.debugger.paths import Free
from llfsm_verify.program.program import Choice
from llfsm_verify.testing.arrangements import Document, arrangements
from llfsm_verify.values import Value
from tests.quick import each, examples, many, spread

MOVES = 12


class Walk:
    """One debugger walks at random; every configuration is that of the reference interpreter, whichever way it came."""

    def __init__(self) -> None:
        self.seen: Counter[str] = Counter()

    def __call__(self, document: Document) -> None:
        arrangement = build_arrangement(document)
        debugger = Debugger(arrangement, Free)
        interpreter, layout = Interpreter(debugger.program), debugger.execution.layout
        told = NativeProgram(debugger.program, events=True)
        source = random.Random(arrangement.digest)
        at: list[tuple[dict[str, Value], dict[str, Value]]] = [
            (layout.decode(debugger.record()), layout.decode_outputs(debugger.record()))
        ]
        for _ in range(MOVES):
            self.set_something(debugger, source)
            del at[len(debugger.history) + 1 :]
            if source.random() < 0.4:
                debugger.back(source.randint(1, 3))
                self.seen["back"] += 1
            else:
                debugger.step(source.randint(1, 4))
            for taken in debugger.history[len(at) - 1 :]:
                given = taken.move.choices

                def choose(choice: Choice) -> int:
                    return given[choice.name]  # noqa: B023 - it is called in this turn

                outcome = interpreter.step(*at[-1], taken.move.process, choose)
                assert outcome.fault is None and not outcome.overflow
                at.append((outcome.values, outcome.outputs))
                self.seen["steps"] += 1
            for position, (values, outputs) in enumerate(at):
                assert layout.decode(debugger.record(position)) == values
                assert layout.decode_outputs(debugger.record(position)) == outputs
            if debugger.position:
                self.same_guards(debugger, told)
            if debugger.failed is not None:
                self.seen["failed"] += 1
        self.same_formulas(debugger, source)

    def same_formulas(self, debugger: Debugger, source: random.Random) -> None:
        """Formulas, whose programs take the steps once more, say of each position what stands there."""
        machine, state = source.choice(list(debugger.states.items()))
        for position in range(len(debugger.history) + 1):
            debugger.go(position)
            stands = debugger.states[machine] == state and debugger.value(f"{machine}.loaded") == "true"
            assert (
                debugger.value(f"{machine}@{state}") == str(stands).lower()
            )  # a machine that is not loaded is nowhere
            if position:
                ran = debugger.described(position).machine == machine
                assert debugger.value(f"{machine}.ran") == str(ran).lower()
                self.seen["formulas"] += 1

    def set_something(self, debugger: Debugger, source: random.Random) -> None:
        assert isinstance(debugger.path, Free)
        if not debugger.path.settable or source.random() < 0.5:
            return
        name = source.choice(list(debugger.path.settable))
        kind = debugger.path.settable[name].type
        debugger.path.held[name] = source.randint(kind.low, kind.high)
        debugger.release(name) if source.random() < 0.2 else debugger._cut()
        self.seen["set"] += 1

    def same_guards(self, debugger: Debugger, told: NativeProgram) -> None:
        """Those that the machine code of the plain program evaluates, in the same order and with the same values."""
        guards = debugger.guards()
        if debugger.failed is not None and debugger.position == len(debugger.history):
            return
        move = debugger.history[debugger.position - 1].move
        known = {c.name: move.choices[c.name] for c in debugger.program.choices}
        result = told.step(debugger.record(debugger.position - 1), move.process, known)
        names = debugger.program.machines
        events = [
            (names[m].name, names[m].states[a[0]], a[1] + 1, bool(a[2])) for k, m, a in result.events if k == "guard"
        ]
        assert [(g.machine, g.state, g.number, g.value) for g in guards] == events
        self.seen["guards"] += len(guards)
        self.seen["parts"] += sum(len(g.parts) for g in guards)


def walk(count: int) -> Walk:
    check = Walk()
    quiet = [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.large_base_example]
    phases = (Phase.explicit, Phase.generate, Phase.shrink)
    chosen = settings(max_examples=count, deadline=None, suppress_health_check=quiet, phases=phases)
    spread(
        check, chosen, arrangements(), until=each(check.seen, ("back", "steps", "set", "guards", "parts", "formulas"))
    )
    return check


@pytest.mark.slow
def test_walks_are_those_of_the_reference_interpreter() -> None:
    walk(examples(16))


@pytest.mark.long
def test_many_walks_are_those_of_the_reference_interpreter() -> None:
    assert walk(many(1000)).seen["failed"] > 0
