"""What the suites know, from `known.yaml` beside this file: arrangements so small that their answers can be checked by
hand, with every kind of property, fault and timing, and what each step of some schedules shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from pathlib import Path
from string import Template
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import Any

import yaml

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.program.program import Program


@dataclass(frozen=True, slots=True)
class Known:
    """An arrangement, properties of it, and what is true of them."""

    name: str
    about: str
    """What it looks at, in a sentence without its full stop."""
    arrangement: str
    properties: str
    holds: Mapping[str, bool]
    """Whether each property holds, by its name."""
    faults: frozenset[str] = frozenset()
    """The codes of the faults in which runs end."""
    open: frozenset[str] = frozenset()
    """Names of properties (`faults`: of those) that an engine may leave unknown, although it claims to decide them."""
    contradictory: bool = False
    """No run satisfies the assumptions: what holds is to be said with a note."""
    files: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    """Files beside the property file, by their names."""

    def problem(self) -> Problem:
        """A new one, with nothing lowered."""
        arrangement = load_arrangement_text(self.arrangement, f"{self.name}.yaml")
        with TemporaryDirectory() as folder:
            for name, text in self.files.items():
                Path(folder, name).write_text(text, encoding="utf-8")
            return bind(arrangement, parse_properties([Source(str(Path(folder, "known.ltl")), self.properties)]))


@dataclass(frozen=True, slots=True)
class Run:
    """A schedule, and what each of its steps shows."""

    name: str
    about: str
    arrangement: str
    atoms: str
    """State formulas, separated by `;`."""
    steps: Sequence[tuple[int | None, Mapping[str, int], str]]
    """The process (None: the stutter), the inputs, and the atoms that hold afterwards, separated by `;`; or `!` and the
    code of the fault, or `!64` where the step leaves 64 bits."""
    free: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))

    def program(self) -> Program:
        lines = "\n".join(f"p{i}: {atom.strip()}" for i, atom in enumerate(self.atoms.split(";")))
        return Known(self.name, self.about, self.arrangement, lines, {}).problem().program(keep_all_bits=True)


_TEXT = files("llfsm_verify.testing.conformance").joinpath("known.yaml").read_bytes()
_FILE: dict[str, Any] = yaml.load(_TEXT, getattr(yaml, "CSafeLoader", yaml.SafeLoader))  # noqa: S506 - both are safe


def arrangement_text(name: str, **values: str) -> str:
    """The arrangement of this name, with `values` where its text has `$key`. KeyError: a name or value is missing."""
    return Template(_FILE["arrangements"][name]).substitute(values)


def _known(case: Mapping[str, Any]) -> Known:
    """A case of the file. Its `answers` are words such as `a+` and `b-`: a holds, b does not."""
    return Known(
        case["name"],
        case["about"],
        arrangement_text(case["arrangement"], **case.get("with", {})),
        case["properties"],
        {word[:-1]: word.endswith("+") for word in case["answers"].split()},
        frozenset(case.get("faults", ())),
        frozenset(case.get("open", ())),
        case.get("contradictory", False),
        {name: _FILE["automata"][name] for name in case.get("automata", ())},
    )


KNOWN = tuple(map(_known, _FILE["cases"]))
"""Every kind of property, with both answers."""
ENDLESS = _known(_FILE["endless"])


def _run(case: Mapping[str, Any]) -> Run:
    text = arrangement_text(case["arrangement"], **case.get("with", {}))
    return Run(case["name"], case["about"], text, case["atoms"], case["steps"], case.get("free", {}))


def _calculation(expression: str, value: int) -> Run:
    text = arrangement_text("counter", type="-300..300", action=f"n = {expression};")
    about = "quotients are cut towards zero, and remainders have the sign of the dividend"
    return Run(f"arithmetic: {expression}", about, text, f"n == {value}", [(0, {}, f"n == {value}")])


RUNS = (*map(_run, _FILE["runs"]), *(_calculation(*each) for each in _FILE["arithmetic"].items()))
SAMPLES: Mapping[str, Mapping[str, object]] = _FILE["samples"]
"""Documents of arrangements with which writers and reports are tried."""
TARGETED: Mapping[str, Mapping[str, object]] = _FILE["targeted"]
"""Documents of arrangements that targets write for other machines."""
