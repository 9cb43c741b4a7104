"""Mutants of an arrangement: the same with one guard, action or order of transitions changed a little."""

from __future__ import annotations

import re
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

import yaml

Node = dict[str, object]

CHANGES: tuple[tuple[str, str], ...] = (
    (r"&&", "||"),
    (r"\|\|", "&&"),
    (r"\bnot (?!\()", ""),
    (r"\bnot \(", "("),
    (r"(?<![<>=!+\-*/%])==", "!="),
    (r"!=", "=="),
    (r"(?<![<>\-])>(?![=>])", ">="),
    (r"<(?![=<])", "<="),
    (r">=", ">"),
    (r"<=", "<"),
    (r"\+=", "-="),
    (r"-=", "+="),
    (r"\+\+", "--"),
    (r"(?<![\w.])true\b", "false"),
    (r"(?<![\w.])false\b", "true"),
)
"""Patterns of an operator, and what stands in its place. Numbers become one more, decimals a step,
which is a change of its own."""


@dataclass(frozen=True, slots=True)
class Mutant:
    name: str
    """Where it differs, and how."""
    text: str
    """The whole arrangement, machines inline."""


def inlined(path: Path) -> Node:
    """The arrangement of a file, all scalars as text, with its machines inline."""
    root = yaml.load(path.read_text(encoding="utf-8"), yaml.BaseLoader)
    models = [root["environment"]] if "environment" in root else []
    for machine in (*root["machines"].values(), *models):
        if "file" in machine:
            file = path.parent / machine.pop("file")
            machine["inline"] = yaml.load(file.read_text(encoding="utf-8"), yaml.BaseLoader)
    return root


def mutants(path: Path) -> Iterator[Mutant]:
    """All mutants of the first order, each machine that several instances share mutated in all of them at once."""
    root = inlined(path)
    seen: set[str] = set()
    for instance, machine in root["machines"].items():
        name = machine["inline"]["machine"]
        if name in seen:
            continue
        seen.add(name)
        users = [i for i, m in root["machines"].items() if m["inline"]["machine"] == name]
        for label, changed in _machines(machine["inline"]):
            copy = deepcopy(root)
            for user in users:
                copy["machines"][user]["inline"] = changed
            yield Mutant(f"{instance} {label}", yaml.safe_dump(copy, sort_keys=False, width=1000))


def _machines(machine: Node) -> Iterator[tuple[str, Node]]:
    names = [state["name"] for state in machine["states"]]
    for s, state in enumerate(machine["states"]):

        def changed(edit, s=s):
            copy = deepcopy(machine)
            edit(copy["states"][s])
            return copy

        for t, transition in enumerate(state.get("transitions", [])):
            for label, text in _texts(transition["when"]):
                yield (
                    f"{state['name']}/{t}: {label}",
                    changed(lambda c, t=t, x=text: c["transitions"][t].update(when=x)),
                )
            yield f"{state['name']}/{t}: never", changed(lambda c, t=t: c["transitions"][t].update(when="false"))
            if transition["when"] != "true":
                yield f"{state['name']}/{t}: always", changed(lambda c, t=t: c["transitions"][t].update(when="true"))
            for target in names:
                if target != transition["to"]:
                    yield (
                        f"{state['name']}/{t}: to {target}",
                        changed(lambda c, t=t, x=target: c["transitions"][t].update(to=x)),
                    )
            if t:
                yield (
                    f"{state['name']}/{t}: before {t - 1}",
                    changed(lambda c, t=t: c["transitions"].insert(t - 1, c["transitions"].pop(t))),
                )
        for action in ("on_entry", "on_exit", "internal", "on_suspend", "on_resume"):
            if action in state:
                for label, text in _texts(state[action]):
                    yield f"{state['name']}.{action}: {label}", changed(lambda c, a=action, x=text: c.update({a: x}))
                for statement in re.findall(r"[^;{}]+;", state[action]):
                    yield (
                        f"{state['name']}.{action}: without {' '.join(statement.split())}",
                        changed(lambda c, a=action, x=statement: c.update({a: c[a].replace(x, " ;", 1)})),
                    )


def _texts(text: str) -> Iterator[tuple[str, str]]:
    """Texts with one operator or number changed."""
    for pattern, instead in CHANGES:
        for place in re.finditer(pattern, text):
            yield _shown(text, place, instead)
    for place in re.finditer(r"(?<![\w.])\d+(?![\w.])", text):
        yield _shown(text, place, str(int(place[0]) + 1))
    for place in re.finditer(r"(?<![\w.])\d+\.\d+(?![\w.])", text):
        step = Decimal(1).scaleb(-len(place[0].partition(".")[2]))
        yield _shown(text, place, str(Decimal(place[0]) + step))


def _shown(text: str, place: re.Match[str], instead: str) -> tuple[str, str]:
    changed = text[: place.start()] + instead + text[place.end() :]
    start = text.rfind("\n", 0, place.start()) + 1
    line = changed[start:].split("\n", 1)[0].strip()
    return line, changed
