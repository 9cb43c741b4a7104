"""What writers and reports are tried with: documents of arrangements, and what there is to report of them."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType

from llfsm_verify.arrangement.granting import policy_digest
from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.diagnostics import Source
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.report.formats import Style
from llfsm_verify.semantics.lowering import lower

SAMPLES: Mapping[str, Mapping[str, object]] = MappingProxyType({
    "lamp": {
        "name": "lamp",
        "whiteboard": {"button": {"type": "bool", "role": "input"}, "lit": {"type": "bool", "role": "output"}},
        "machines": {
            "m": {"inline": {"machine": "Lamp", "states": [
                {"name": "OFF", "on_entry": "lit = false;", "transitions": [{"when": "button", "to": "ON"}]},
                {"name": "ON", "on_entry": "lit = true;\n// x\n", "transitions": [{"when": "after(2)", "to": "OFF"}]},
            ]}},
        },
        "schedule": ["m"],
        "cycle_ms": 500,
    },
    "counter": {
        "name": "counter",
        "types": {"mode": ["LOW", "HIGH"]},
        "whiteboard": {"n": {"type": "0..3", "init": 1}, "mode": {"type": "mode", "init": "HIGH"}},
        "machines": {
            "a": {"inline": {"machine": "Up", "parameters": {"other": "machine"}, "states": [
                {"name": "RUN", "internal": "n = n + 1;", "transitions": [{"when": "other@STOP", "to": "STOP"}]},
                {"name": "STOP"},
            ]}, "parameters": {"other": "b"}},
            "b": {"inline": {"machine": "Down", "states": [
                {"name": "RUN", "transitions": [{"when": "n == 0 && mode == HIGH", "to": "STOP"}]},
                {"name": "STOP"},
            ]}},
        },
        "schedule": ["a", "b"],
    },
})  # fmt: skip


def subjects(kind: str) -> Mapping[str, Callable[[], tuple[object, ...]]]:
    """What reports of a kind are made of, by a name: two of them are different. KeyError: no such kind."""
    return _SUBJECTS[kind]()


def _with_style(*of: object) -> tuple[object, ...]:
    return *of, Style()


def _arrangements() -> Mapping[str, Arrangement]:
    return {name: build_arrangement(document) for name, document in SAMPLES.items()}


def _properties(text: str) -> PropertySet:
    return parse_properties([Source("asked.ltl", text)])


def _results() -> dict[str, Callable[[], tuple[object, ...]]]:
    from llfsm_verify.checking.verdict import Options
    from llfsm_verify.verification.verify import verify

    lamp, counter = _arrangements().values()
    asked = {
        "holds": (lamp, "a: G !(m@ON && m@OFF)"), "violated": (lamp, "a: G !lit"), "faults": (counter, "a: F a@STOP"),
        "nothing": (lamp, ""),
    }  # fmt: skip
    found = {name: (verify(of, _properties(text), Options()), of) for name, (of, text) in asked.items()}
    return {name: partial(_with_style, *pair) for name, pair in found.items()}


def _lints() -> dict[str, Callable[[], tuple[object, ...]]]:
    from llfsm_verify.analysis.lint.run import lint

    found = {name: (lint(of, Limits()), of) for name, of in _arrangements().items()}
    return {name: partial(_with_style, *pair) for name, pair in found.items()}


def _queries() -> dict[str, Callable[[], tuple[object, ...]]]:
    from llfsm_verify.checking.verdict import Options
    from llfsm_verify.verification.query import ask, parse_query

    lamp, _ = _arrangements().values()
    asked = {"reached": "lit", "never": "lit && m@OFF"}
    found = {name: ask(lamp, parse_query(text, "asked"), Options()) for name, text in asked.items()}
    return {name: partial(_with_style, answer, lamp) for name, answer in found.items()}


def _accesses() -> dict[str, Callable[[], tuple[object, ...]]]:
    def made(of: Arrangement) -> tuple[object, ...]:
        return of, policy_digest(of)

    return {name: partial(made, of) for name, of in _arrangements().items()}


def _simulations() -> dict[str, Callable[[], tuple[object, ...]]]:
    from llfsm_verify.runtime.stepping.random_run import RandomRun, Script, Simulated

    def made(of: Arrangement, seed: int) -> tuple[object, ...]:
        program = lower(of, keep_all_bits=True)
        run = RandomRun(Execution(program), Script(), random.Random(seed))  # noqa: S311 - no secrets
        return Simulated(of, program, run, seed, False, {}, None, 9, None), Style(width=100)

    lamp, counter = _arrangements().values()
    return {"a run": partial(made, lamp, 1), "a fault": partial(made, counter, 1), "another": partial(made, lamp, 2)}


def _monitors() -> dict[str, Callable[[], tuple[object, ...]]]:
    from llfsm_verify.monitoring.machine import Action
    from llfsm_verify.monitoring.properties import monitor_properties
    from llfsm_verify.report.monitor import Monitors

    def made(text: str) -> tuple[object, ...]:
        lines = _properties(text)
        found = [monitor_properties(line, ()) for line in lines.goals]
        return Monitors(found, lines, None, None, Action()), lambda _: None

    return {"never": partial(made, "a: G !x"), "once": partial(made, "b: F (y && X x)")}


_SUBJECTS: Mapping[str, Callable[[], Mapping[str, Callable[[], tuple[object, ...]]]]] = MappingProxyType({
    "result": _results, "lint": _lints, "query": _queries, "access": _accesses, "simulation": _simulations,
    "monitor": _monitors,
})  # fmt: skip
