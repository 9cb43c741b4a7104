"""Random arrangements that ask random theories, each also with the truth tables of the theories written out.

A table is made by the second definition in `theories.py`. Where inputs may fault, or each read is a sample of its own
(`snapshot: none`), what stands for a theory is an action that first evaluates its inputs, in the order of the file.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from random import Random

from llfsm_verify.arrangement.formats import Given, read_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.arrangement.resolve.arrangement import resolve
from tests.knowledge.theories import DEFEATER, Plain, random_theory, tags

BOARD = """\
cycle_ms: 100
profile: {{base: llfsm, snapshot: {snapshot}}}
whiteboard:
  x: {{type: bool, role: input}}
  y: {{type: bool, role: input, changes: cycle}}
  n: {{type: 0..3, role: input}}
  few: {{type: {{array: bool, size: 3}}, init: [true, false, true]}}
  r: {{type: bool, role: output}}
  s: {{type: bool, role: output}}
"""
SAFE = ("x", "y", "n > 1", "n == 2", "v", "r", "few[1]", "m@B", "is_suspended(m)")
FAULTY = ("6 / n > 2", "few[n]", "n == 0 || 3 / n == 1")


@dataclass(frozen=True)
class Entry:
    """What a theory says under a name; `told` has its inputs, those that the answer depends on, in their order."""

    name: str
    theory: Plain
    atom: str
    told: Mapping[str, str]
    own: bool
    """It is the machine's."""

    def text(self) -> str:
        """Of the `.d` file."""
        lines = self.theory.text().splitlines()[:-2]
        return "\n".join((*lines, f'output {{b {self.atom}, "{self.atom}"}}.'))

    def line(self) -> str:
        inputs = ", ".join(f'{a}: "{e}"' for a, e in self.told.items())
        return f"{self.name}: {{file: {self.name}.d, inputs: {{{inputs}}}, output: {self.atom}}}"

    def table(self, told: Mapping[str, str]) -> str:
        """The rows in which the answer is true, where inputs are told this."""
        rows = []
        names = list(told)
        others = dict.fromkeys((a for a in self.theory.inputs if a not in told), False)
        for values in product((False, True), repeat=len(names)):
            valuation = dict(zip(names, values, strict=True))
            if self.atom in tags(self.theory, {a: (others | valuation)[a] for a in self.theory.inputs}).proved:
                row = [told[a] if value else f"!({told[a]})" for a, value in valuation.items()]
                rows.append(f"({' && '.join(f'({part})' for part in row) or 'true'})")
        return f"({' || '.join(rows)})" if rows else "false"


@dataclass(frozen=True)
class Asking:
    """An arrangement in two ways, and properties of both; `equal` are true of the first one."""

    inlined: Arrangement
    written: Arrangement
    properties: tuple[str, ...]
    equal: tuple[str, ...]
    alike: bool
    """Both also read inputs in the same order; else a table in a guard reads only what it needs."""


def asking(random: Random) -> Asking:
    """One that was drawn."""
    faulty, snapshot = random.random() < 0.4, random.choice(("none", "ringlet", "after_entry", "cycle"))
    entries: list[Entry] = []
    for number in range(random.randint(1, 3)):
        entries.append(_entry(random, number, entries, faulty=faulty))
    guards = not faulty and snapshot != "none"
    last = entries[-1]
    answers = _answers(entries) if guards else {}
    board = BOARD.format(snapshot=snapshot)
    files = {f"{e.name}.d": e.text() for e in entries}
    texts = []
    for knows in (True, False):
        guard = (last.name if knows else answers[last.name]) if guards else "r"
        acts = [f"r = {last.name};"] if knows else list(_action(entries, last, "r", "a"))
        inner = [f"s = {entries[0].name};"] if knows else list(_action(entries, entries[0], "s", "b"))
        lines = [*acts, "if (x) {", *inner, "}", "v = !v;"]
        shared, own = ([e for e in entries if e.own == mine] if knows else [] for mine in (False, True))
        texts.append(board + _section("", shared) + _machine(guard, lines, own))
    first = resolve(read_arrangement(Given("inlined.yaml", texts[0], files=files)))
    second = resolve(read_arrangement(Given("written.yaml", texts[1])))
    said = [f"m.{e.name}" if e.own else e.name for e in entries] if guards else []
    tables = [re.sub(r"\bv\b", "m.v", answers[e.name]) for e in entries] if guards else []
    equal = [f'G "{a} == {table}"' for a, table in zip(said, tables, strict=True)]
    equal += [f'G "{edge}({said[-1]}) == {edge}({tables[-1]})"' for edge in ("rose", "changed") if guards]
    more = ("G !(r && s)", "F r", "G (r -> F (s || m@B))", "G (rose(s) -> r)", "G (m@B -> !m.v)")
    return Asking(first, second, more, tuple(equal), not guards)


def _entry(random: Random, number: int, earlier: list[Entry], *, faulty: bool) -> Entry:
    theory = random_theory(random)
    proved = [r.head for r in theory.rules if r.arrow != DEFEATER and not r.head.startswith("~")]
    while not proved:
        theory = random_theory(random)
        proved = [r.head for r in theory.rules if r.arrow != DEFEATER and not r.head.startswith("~")]
    atom = random.choice(proved)
    own = bool(earlier and earlier[-1].own) or random.random() < 0.5
    parts = [p for p in SAFE if own or p != "v"] + (list(FAULTY) if faulty else [])
    names = [e.name for e in earlier if own or not e.own]
    told = {a: _condition(random, parts, names) for a in theory.inputs if a in _needed(theory, atom)}
    return Entry(f"k{number}", theory, atom, told, own)


def _needed(theory: Plain, atom: str) -> set[str]:
    """The inputs on which an atom depends, through the bodies of rules."""
    found, todo = set[str](), [atom]
    while todo:
        one = todo.pop()
        if one not in found:
            found.add(one)
            todo += (b.removeprefix("~") for r in theory.rules if r.head.removeprefix("~") == one for b in r.body)
    return found & set(theory.inputs)


def _condition(random: Random, parts: list[str], names: list[str]) -> str:
    chosen = [random.choice(names if names and random.random() < 0.4 else parts) for _ in range(random.randint(1, 2))]
    chosen = [f"!({p})" if random.random() < 0.2 else f"({p})" for p in chosen]
    return random.choice((" && ", " || ", " != ")).join(chosen)


def _answers(entries: list[Entry]) -> dict[str, str]:
    """The answer of each entry as a condition over variables."""
    found: dict[str, str] = {}
    for entry in entries:
        found[entry.name] = entry.table({a: _with(e, found) for a, e in entry.told.items()})
    return found


def _with(text: str, answers: Mapping[str, str]) -> str:
    return re.sub(r"\bk\d\b", lambda word: answers[word[0]], text)


def _action(entries: list[Entry], asked: Entry, target: str, mark: str) -> Iterator[str]:
    """Statements that store the answer of an entry: those that it asks for first, each once."""
    used = {asked.name}
    for entry in reversed(entries):
        if entry.name in used:
            used |= {word for e in entry.told.values() for word in re.findall(r"\bk\d\b", e)}
    answers = {e.name: f"{e.name}{mark}" for e in entries}
    for entry in (e for e in entries if e.name in used):
        told = {a: f"{entry.name}{mark}_{a}" for a in entry.told}
        for a, e in entry.told.items():
            yield f"bool {told[a]} = {_with(e, answers)};"
        yield f"bool {answers[entry.name]} = {entry.table(told)};"
    yield f"{target} = {answers[asked.name]};"


def _section(indent: str, entries: list[Entry]) -> str:
    lines = [f"{indent}knowledge:", *(f"{indent}  {e.line()}" for e in entries)] if entries else []
    return "".join(f"{line}\n" for line in lines)


def _machine(guard: str, lines: list[str], own: list[Entry]) -> str:
    block = "".join(f"            {line}\n" for line in lines)
    return (
        "machines:\n  m:\n    inline:\n      machine: M\n      variables: {v: {type: bool}}\n"
        f"{_section('      ', own)}      states:\n"
        f"        - name: A\n          internal: |\n{block}"
        f"          transitions: [{{when: '{guard}', to: B}}]\n"
        f"        - name: B\n          on_entry: |\n{block}"
        f"          transitions: [{{when: '!({guard})', to: A}}]\nschedule: [m]\n"
    )
