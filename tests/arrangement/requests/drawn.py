"""Random arrangements that ask services and actions, with plants, what a port needs to know, and what may be proved."""

from __future__ import annotations

from dataclasses import dataclass
from random import Random

from llfsm_verify.arrangement.requests import IDLE, STATES, UNDER_WAY, RequestKind

Document = dict[str, object]
ANSWERS: tuple[object, ...] = ("bool", "0..3", "-2..1", {"decimal": 0.1, "range": "0.0..0.3"}, "Colour")
TIMES = ("100ms", "250ms", "600ms")


@dataclass(frozen=True)
class Asking:
    document: Document
    requests: dict[str, Document]
    """As a file of ports has them."""
    properties: tuple[str, ...]


class _Pen:
    """`small`: with as few configurations as there may be."""

    def __init__(self, rng: Random, small: bool) -> None:
        self.rng, self.small = rng, small
        self.types: dict[str, list[str]] = {"Colour": ["RED", "GREEN", "BLUE"]}
        self.whiteboard: dict[str, Document] = {"halt": {"type": "bool", "role": "input"}}
        self.plants: dict[str, Document] = {}
        self.requests: dict[str, Document] = {}
        self.count = 1 if small else rng.choice([1, 1, 2])

    def one_in(self, number: int) -> bool:
        return self.rng.randrange(number) == 0

    def request(self, number: int) -> None:
        rng = self.rng
        kind: RequestKind = rng.choice(["service", "action"])
        states = list(STATES[kind])

        def alike(state: str) -> list[str]:
            under_way = state in UNDER_WAY[kind]
            return [s for s in states if s not in (IDLE, state) and (s in UNDER_WAY[kind]) == under_way]

        lacking = []
        for state in list(states) if self.one_in(2) else ():
            if state != IDLE and self.one_in(3) and alike(state):
                states.remove(state)
                lacking.append(state)
        plant: Document = {"use": kind, "ask": f"ask{number}", "state": f"st{number}"}
        told: Document = {}
        if lacking:
            plant["values"] = {state: rng.choice(alike(state)) for state in lacking}
        self.types[f"T{number}"] = rng.sample(states, len(states))
        self.whiteboard[f"ask{number}"] = {"type": "bool"}
        self.whiteboard[f"st{number}"] = {"type": f"T{number}", "role": "input", "init": IDLE}
        answers = [f"a{number}{i}" for i in range(rng.randrange(2 if self.small else 3))]
        for name in answers:
            self.whiteboard[name] = {"type": rng.choice(ANSWERS), "role": "input"}
        if answers:
            plant["answers"] = answers
            told["answers"] = {name: f"result.{name}" for name in answers}
        if kind == "action" and self.one_in(2):
            name = f"f{number}"
            self.whiteboard[name] = {"type": "bool", "role": "input"}
            plant["feedback"] = told["feedback"] = [name]
        if not self.small and self.one_in(2):
            plant["timeout"] = rng.choice(TIMES)
        self.plants[f"r{number}"], self.requests[f"r{number}"] = plant, told

    def guard(self) -> str:
        rng, number = self.rng, self.rng.randrange(self.count)
        fed = [name for name in self.whiteboard if name[0] in "af" and not name.startswith("ask")]
        match rng.randrange(5):
            case 0 if fed:
                name = rng.choice(fed)
                kind = self.whiteboard[name]["type"]
                return name if kind == "bool" else f"{name} == GREEN" if kind == "Colour" else f"{name} > 0"
            case 1:
                return "halt"
            case 2:
                return f"after({rng.randrange(1, 2 if self.small else 5)})"
        return f"st{number} {rng.choice(['==', '!='])} {rng.choice(self.types[f'T{number}'])}"

    def machine(self, name: str, asked: range) -> Document:
        rng, names = self.rng, [f"S{i}" for i in range(self.rng.randrange(2, 4 if self.small else 6))]
        states: list[Document] = []
        for state in names:
            action = "".join(f"ask{i} = {rng.choice(['true', 'false'])}; " for i in asked if not self.one_in(3))
            guards = [self.guard() for _ in range(rng.randrange(1, 3))]
            transitions = [{"when": guard, "to": rng.choice(names)} for guard in guards]
            kind = rng.choice(["on_entry", "on_entry", "internal", "on_exit"])
            states.append({"name": state, kind: f"{action}grip = {rng.randrange(4)};", "transitions": transitions})
        return {"inline": {"machine": name, "states": states}}

    def property(self) -> str:
        rng, i = self.rng, self.rng.randrange(self.count)
        one, other = (f"st{i} == {rng.choice(self.types[f'T{i}'])}" for _ in range(2))
        return rng.choice([
            f"G ({one} -> X !({other}))", f"G !({one} && grip == {rng.randrange(4)})", f"G (rose(ask{i}) -> {one})",
            f"G (ask{i} -> F[0:{rng.randrange(1, 30)}] st{i} != {IDLE})", f"G ({one} -> ({one} W {other}))",
            f"G (ask{i} && {one} -> F[0:{rng.randrange(1, 40)}] {other})", f"G (changed(st{i}) -> !changed(grip))",
            f"G (m0@S0 -> !({one}))", f"G F {one}",
        ])  # fmt: skip


def asking(rng: Random, *, small: bool = False, properties: int = 20) -> Asking:
    """One or two requests, one or two machines, now and then an operator who lets a machine enter states."""
    pen = _Pen(rng, small)
    for number in range(pen.count):
        pen.request(number)
    pen.whiteboard["grip"] = {"type": "0..3"}
    machines = {"m0": pen.machine("M0", range(pen.count))}
    if not small and pen.one_in(3):
        machines["m1"] = pen.machine("M1", range(1, pen.count))
    document: Document = {
        "name": "asking", "cycle_ms": 100, "types": pen.types, "whiteboard": pen.whiteboard,
        "environment": pen.plants, "machines": machines, "schedule": list(machines),
    }  # fmt: skip
    if pen.one_in(2):
        document["operators"] = {"enter": ["m0"]}
    return Asking(document, pen.requests, tuple(pen.property() for _ in range(properties)))
