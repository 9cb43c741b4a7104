"""Programs that forget beside those that keep all bits: the same letters, faults and ends, in both directions.

The first direction takes each step of the program with all bits, and has the other one follow with the values that were
drawn last; the second takes runs of the one that forgets, and has their moves performed with all bits.
"""

from __future__ import annotations

import random
from collections import Counter, deque
from collections.abc import Mapping
from itertools import islice
from typing import Any

from hypothesis import strategies as st

from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.backends.reference import Interpreter, Outcome
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Choice, Program
from llfsm_verify.testing.arrangements import Document, arrangements
from llfsm_verify.transforms.forgetting import Forgetting
from llfsm_verify.values import Value

WAYS, RUNS, STEPS = 40, 4, 25


class Differs(AssertionError):
    """The two programs differ."""


def compare(full: Program, found: Forgetting, limit: int, tally: Counter[str]) -> None:
    """Raises Differs."""
    if Layout.of(full).initial_count() > 64:
        return
    _followed(full, found, limit, tally)
    for number in range(RUNS):
        _performed(full, found, random.Random(number), tally)


def _shown(program: Program, outcome: Outcome) -> tuple[object, ...]:
    site = None if outcome.fault is None else program.faults[outcome.fault]
    if site is not None or outcome.overflow:
        return site, outcome.overflow
    fair = [n for f in program.fairness for n in (f.premise, f.goal) if n is not None]
    names = [program.cycle, *(a.output for a in program.atoms), *fair]
    return tuple(outcome.outputs[n] for n in names)


def _same(what: str, one: object, other: object) -> None:
    if one != other:
        raise Differs(f"{what}: all bits {one}, forgetting {other}")


def _starts(program: Program) -> list[dict[str, Value]]:
    layout = Layout.of(program)
    return [dict(layout.decode(record)) for record in layout.initial(64)]


def _followed(full: Program, found: Forgetting, limit: int, tally: Counter[str]) -> None:
    interpreter, other = Interpreter(full), Interpreter(found.program)
    fresh = {v.name: v.init for v in full.vars if v.output}
    own = {v.name: v for v in found.program.vars if not v.output}
    queue: deque[tuple[Any, Any, Any, Any, dict[tuple[int, str], int]]] = deque()
    for values in _starts(full):
        start = {n: values[n] if v.free else v.init for n, v in own.items()}
        queue.append((values, fresh, start, fresh, {}))
    seen: set[object] = set()
    while queue and len(seen) < limit:
        values, outputs, v, o, last = queue.popleft()
        _same("enabled", interpreter.enabled(values), other.enabled(v))
        for process, outcome in islice(interpreter.successors(values, outputs), WAYS):
            given = dict(outcome.samples)
            drawn = last | {(p, n): given[n] for n, p in found.moved.items() if p == process and n in given}

            def choose(choice: Choice) -> int:
                if choice.name in found.moved:
                    return drawn[found.moved[choice.name], choice.name]  # noqa: B023
                if choice.name not in given:  # noqa: B023
                    raise Differs(f"only the program that forgets reads {choice.name}")
                return given[choice.name]  # noqa: B023

            reply = other.step(v, o, process, choose)
            _same(f"a step of {process} with {outcome.samples}", _shown(full, outcome), _shown(found.program, reply))
            tally["steps"] += 1
            tally["draws saved"] += len(outcome.samples) - len(reply.samples)
            if outcome.fault is not None or outcome.overflow:
                tally["faults"] += 1
                continue
            tally["ended"] += process is None
            key = (tuple(outcome.values.items()), tuple(outcome.outputs.items()), tuple(reply.values.items()))
            if key not in seen:
                seen.add(key)
                tally["forgotten"] += any(reply.values[n] != outcome.values[n] for n in own if n in outcome.values)
                queue.append((outcome.values, outcome.outputs, reply.values, reply.outputs, drawn))


def _performed(full: Program, found: Forgetting, chosen: random.Random, tally: Counter[str]) -> None:
    other, interpreter = Interpreter(found.program), Interpreter(full)
    fresh = {v.name: v.init for v in full.vars if v.output}
    start = chosen.choice(_starts(found.program))
    values, outputs = start, fresh
    moves: list[Move] = []
    shown: list[tuple[object, ...]] = []
    for _ in range(STEPS):
        process = chosen.choice(list(other.enabled(values)) or [None])
        outcome = other.step(values, outputs, process, lambda c: chosen.randint(c.type.low, c.type.high))
        moves.append(Move(process, dict(outcome.samples)))
        shown.append(_shown(found.program, outcome))
        if outcome.fault is not None or outcome.overflow:
            break
        values, outputs = outcome.values, outcome.outputs
    free = {v.name for v in found.program.vars if v.free}
    whole: Mapping[str, Value] = {
        v.name: start[v.name] if v.name in free else v.init for v in full.vars if not v.output
    }
    outputs = fresh
    for move, expected in zip(found.whole(moves, None), shown, strict=True):

        def choose(choice: Choice) -> int:
            if choice.name not in move.choices:  # noqa: B023
                raise Differs(f"a run of the program that forgets does not give {choice.name}")
            return move.choices[choice.name]  # noqa: B023

        outcome = interpreter.step(whole, outputs, move.process, choose)
        _same(f"a run's step {move}", _shown(full, outcome), expected)
        whole, outputs = outcome.values, outcome.outputs
        tally["carried"] += bool(found.moved)


# ---------------------------------------------------------------- random arrangements


@st.composite
def storing(draw: st.DrawFn, max_machines: int = 3, max_states: int = 3) -> Document:
    """Arrangements with inputs that are held, all of them or some, and plants that overwrite theirs in each cycle."""
    document = draw(arrangements(max_machines=max_machines, max_states=max_states))
    plant = document.get("environment")
    for name, entry in document["whiteboard"].items():
        if entry.get("role") != "input" or entry.get("changes"):
            continue
        if plant is None or name not in str(plant):
            if draw(st.integers(0, 3)):
                entry["changes"] = "cycle"
        elif entry["type"] in ("bool", "0..2"):
            for state in plant["inline"]["states"]:
                state["internal"] = f"{name} = choose({entry['type']}); {state.get('internal', '')}"
    if "schedule" in document and not draw(st.integers(0, 2)):
        profile = document.get("profile", "llfsm")
        base = profile if isinstance(profile, dict) else {"base": profile}
        document["profile"] = {**base, "snapshot": "cycle"}
    if "schedule" in document and draw(st.booleans()):
        document["observe"] = "cycle"
    return document
