"""Checks a certificate of `llfsm-verify --certificate` with the standard library and nothing of the model checker.

The certificate (docs/certificates.md) is not believed: the step program in it is executed here with exact integers, and
each claim is a set of states shown to be closed, a ranking shown never to rise, or a run that is taken step by step.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import reduce
from hashlib import sha256
from operator import or_
from pathlib import Path
from typing import Any, TypeVar

FORMAT = "llfsm-certificate 1"
SECTIONS = "format inputs program automata assumptions premises configurations steps faults properties"
PROVED, REJECTED, UNWRITTEN, NOT_CERTIFIED = 0, 1, 3, 4
WORD, MOST, LARGEST_FILE = 1 << 63, 1 << 12, 1 << 26
TRUSTED = "Believed, not checked: program, formulas and automata are those of the files (--check-certificate compares)."
T = TypeVar("T")
Values = tuple[int, ...]
AutomatonEdge = tuple[int, int, int | None, int]


class Rejected(Exception):
    """What is wrong with the certificate, in a sentence."""


class Faulted(Exception):
    """A step ends in the fault of this number."""


def typed(value: object, kind: type[T]) -> T:
    if type(value) is not kind:
        raise Rejected(f"something else stands where a {kind.__name__} should")
    return value


def inside(value: int, low: int, end: int) -> int:
    if not low <= value < end:
        raise Rejected(f"{str(value)[:30]} is none of the numbers from {low} to {end - 1} that are possible there")
    return value


def fields(value: object, keys: str) -> list[object]:
    if set(typed(value, dict)) != set(keys.split()):
        raise Rejected(f"there is no object with the keys {keys}")
    return [typed(value, dict)[key] for key in keys.split()]


items: Callable[[object], list[object]] = lambda value: typed(value, list)
rows: Callable[[object], list[list[object]]] = lambda value: [items(v) for v in items(value)]
natural: Callable[[object, int], int] = lambda value, end: inside(typed(value, int), 0, end)
at: Callable[[object, Sequence[object]], int] = lambda value, of: natural(value, len(of))
word: Callable[[object], int] = lambda value: inside(typed(value, int), -WORD, WORD)
without_waiting: Callable[[str, int], int] = lambda name, flags: os.open(name, flags | os.O_NONBLOCK | os.O_NOCTTY)
canonical: Callable[[object], str] = lambda value: json.dumps(value, sort_keys=True, separators=(",", ":"))

TEMPLATES = {
    "const": "w ({})", "get": "c s[{}]", "element": "cwe s[{0}+inside({2},0,{1})]", "neg": "e (-{})", "not": "e (1-{})",
    "abs": "e abs({})", "add": "ee ({}+{})", "sub": "ee ({}-{})", "mul": f"ee inside({{}}*{{}},{-WORD},{WORD})",
    "div": "ee div({},{})", "mod": "ee mod({},{})", "min": "ee min({},{})", "max": "ee max({},{})", "eq": "ee ({}=={})",
    "ne": "ee ({}!={})", "lt": "ee ({}<{})", "le": "ee ({}<={})", "gt": "ee ({}>{})", "ge": "ee ({}>={})",
    "and": "ee ({}&{})", "or": "ee ({}|{})", "xor": "ee ({}^{})", "ite": "eee ({1} if {0} else {2})",
    "wrap": "wwe (({2}-({0}))%({1}+1-({0}))+({0}))",
}  # fmt: skip
STATEMENTS = {
    "set": "ce s[{0}]=inside({1},*R[{0}])", "put": "cwee s[{0}+inside({2},0,{1})]=inside({3},*R[{0}])",
    "sample": "ck s[{}]=pick({})", "if": "ebb ({1} if {0} else {2})(s)", "switch": "etb {1}.get({0},{2})(s)",
    "fault": "fe if {1}: raise Faulted({0})", "do": "b {}(s)",
}  # fmt: skip
"""What expressions and statements become: the kinds of their operands (see `operands`), and Python."""
HELPERS: dict[str, Any] = {
    "div": lambda a, b: abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1),
    "mod": lambda a, b: abs(a) % abs(b) * (-1 if a < 0 else 1),
    "inside": inside, "Faulted": Faulted, "abs": abs, "min": min, "max": max, "__builtins__": {},
}  # fmt: skip


class Program:
    """The step program as Python functions, made of templates and numbers: no text of the file gets into them.

    A *node* is the values of a configuration; with `observe: cycle`, in the middle of a cycle, of the outputs too.
    """

    def __init__(self, data: object) -> None:
        _, observe, sizes, cells, choices, inputs, terms, blocks, processes, letter, fair, faults = fields(
            data, "name observe sizes cells choices inputs terms blocks processes letter fairness faults")  # fmt: skip
        self.whole_cycles = {"ringlet": False, "cycle": True}[typed(observe, str)]
        self.ranges = [(word(low), word(high) + 1) for _, low, high, _, _ in rows(cells)]
        self.inits = [inside(word(x), *r) for (*_, x, _), r in zip(rows(cells), self.ranges, strict=True)]
        self.width, self.kept = (natural(n, len(self.inits) + 1) for n in items(sizes))
        self.free = [typed(free, bool) for *_, free in rows(cells)][: self.width]
        self.starts = math.prod(end - low for (low, end), free in zip(self.ranges, self.free, strict=False) if free)
        self.choices = [range(word(low), word(high) + 1) for _, low, high, *_ in rows(choices)]
        self.faults, self.read, self.given = items(faults), dict[int, int](), dict[int, int]()
        operands: dict[str, Callable[[object], str]] = {
            "w": lambda x: str(word(x)), "c": lambda x: str(at(x, self.inits)), "k": lambda x: str(at(x, self.choices)),
            "f": lambda x: str(at(x, self.faults)), "e": lambda x: code[at(x, code)], "b": lambda x: made[at(x, made)],
            "t": lambda x: "{" + ",".join(f"{word(k)}:{made[at(b, made)]}" for k, b in rows(x)) + "}",
        }  # fmt: skip

        def python(data: list[object], templates: dict[str, str]) -> str:
            kinds, _, template = templates[typed(data[0], str)].partition(" ")
            return template.format(*(operands[kind](x) for kind, x in zip(kinds, data[1:], strict=True)))

        code, made, lines = list[str](), list[str](), list[str]()
        for i, e in enumerate(rows(terms)):
            code.append(python(e, TEMPLATES))
            if len(code[i]) > 300:  # neither long lines nor deep brackets
                lines.append(f"def e{i}(s): return {code[i]}")
                code[i] = f"e{i}(s)"
        for i, b in enumerate(items(blocks)):
            lines += [f"def b{i}(s):", *(f" {python(s, STATEMENTS)}" for s in rows(b)), " pass"]
            made.append(f"b{i}")
        pick = lambda k: self.read.setdefault(k, self.given.get(k, self.choices[k].start))
        atoms, shown, cycle, stutter = fields(letter, "first cells cycle stutter")
        firsts = "".join(f"({code[at(e, code)]}!=0)<<{i}|" for i, e in enumerate(items(atoms)))
        scope: dict[str, Any] = {**HELPERS, "pick": pick, "R": self.ranges}
        exec("\n".join([*lines, f"def first(s): return {firsts}0"]), scope)  # noqa: S102 - see above
        self.first_bits, self.stutter = scope["first"], scope[made[at(stutter, made)]]
        self.first_inputs = [(at(cell, self.inits), word(init)) for _, cell, init, *_ in rows(inputs)]
        self.cycle, self.shown = at(cycle, self.inits), [at(cell, self.inits) for cell in items(shown)]
        self.fair = [(None if p is None else at(p, self.shown), at(g, self.shown)) for _, p, g in rows(fair)]
        self.processes = [(None if ended is None else at(ended, self.inits), scope[made[at(block, made)]])
                          for _, ended, block in rows(processes)]  # fmt: skip

    def node(self, values: object) -> Values:
        """A node as the certificate writes it, each value inside the range of its variable."""
        known = self.ranges[: self.kept if self.whole_cycles and len(items(values)) > self.width else self.width]
        return tuple(inside(typed(x, int), *each) for x, each in zip(items(values), known, strict=True))

    def first_letter(self, node: Values) -> int | None:
        """The letter of an initial configuration, in which inputs have their `init`; None of another node."""
        s = [*node, *self.inits[len(node) :]]
        fits = len(node) == self.width and all(map(lambda x, y, free: free or x == y, node, self.inits, self.free))
        for cell, init in self.first_inputs:
            s[cell] = init
        return self.first_bits(s) if fits else None

    def enabled(self, node: Values) -> list[int | None]:
        return [i for i, (ended, *_) in enumerate(self.processes) if ended is None or not node[ended]] or [None]

    def step(self, node: Values, process: int | None, given: dict[int, int]) -> tuple[Values, int | None]:
        """The node after a step, and its letter or None; `read` are the choices that it has read. Raises Faulted."""
        self.given, self.read = given, {}
        node = node[: self.width] if process is None else node
        s = [*node, *self.inits[len(node) :]]
        (self.stutter if process is None else self.processes[process][1])(s)
        if self.whole_cycles and process is not None and not s[self.cycle]:
            return tuple(s[: self.kept]), None
        return tuple(s[: self.width]), sum(1 << i for i, cell in enumerate(self.shown) if s[cell])

    def successors(self, node: Values) -> Iterator[tuple[Values, int | None] | int]:
        """Every step (or the number of its fault): of each process, with all values of the choices that it reads."""
        for process in self.enabled(node):
            given: dict[int, int] | None = {}
            while given is not None:
                try:
                    yield self.step(node, process, given)
                except Faulted as end:
                    yield int(end.args[0])
                wheels, given = list(self.read.items()), None
                while wheels and given is None:  # the last wheel that can turns, those behind it begin anew
                    choice, value = wheels.pop()
                    if value + 1 in self.choices[choice]:
                        given = dict([*wheels, (choice, value + 1)])


def true_on(formula: object, letters: Sequence[int], back: int) -> bool:
    """Whether a formula is true of the word whose last letter is followed by number `back`, by the definition."""
    found: list[list[bool]] = []
    for op, x, y in rows(formula):
        a, b = ([], []) if op in ("atom", "true") else (found[at(x, found)], found[at(y, found)])
        if op in ("atom", "true"):
            row = [op == "true" or bool(letter >> natural(x, MOST) & 1) for letter in letters]
        elif op in ("not", "and"):
            row = [not p if op == "not" else p and q for p, q in zip(a, b, strict=True)]
        elif op == "X":
            row = [*a[1:], a[back]]
        else:  # two sweeps backwards: the second brings what the first has learned at `back` to the end
            row = [{"U": False, "R": True}[typed(op, str)]] * len(letters)
            for i, k in [*enumerate([*range(1, len(letters)), back])][::-1] * 2:
                row[i] = (b[i] or (a[i] and row[k])) if op == "U" else b[i] and (a[i] or row[k])
        found.append(row)
    return found[-1][0]


class Automata:
    """Generalised Büchi automata side by side; sets of edges: theirs, one of every letter, one per bit in `goals`."""

    def __init__(self, automata: Sequence[object], goals: Sequence[int]) -> None:
        self.bits, self.own, self.bad = [1 << g for g in goals], 0, set[int]()
        self.each: list[tuple[list[int], int, bool, list[list[AutomatonEdge]]]] = []
        self.known: dict[tuple[Values, int], list[tuple[Values, int]]] = {}
        for each in automata:
            _, atoms, sets, complete, bad, listed = fields(each, "about atoms sets complete bad edges")
            edges, states, most = list[list[AutomatonEdge]](), items(listed), 1 << natural(sets, MOST)
            for row in map(rows, states):
                edges.append([(natural(p, 1 << MOST), natural(n, 1 << MOST), None if t is None else at(t, states),
                               natural(acc, most)) for p, n, t, acc in row])  # fmt: skip
            self.each.append(([natural(a, MOST) for a in items(atoms)], self.own, typed(complete, bool), edges))
            self.bad, self.own = {at(q, edges) for q in items(bad)}, self.own + most.bit_length() - 1
        self.full = (1 << self.own + 1 + len(goals)) - 1

    def moves(self, states: Values | None, letter: int | None) -> list[tuple[Values, int]]:
        """(states, acceptance) of each common move (None: from the beginning); without a letter they stay."""
        states = (0,) * len(self.each) if states is None else states
        if letter is None or not all(edges for *_, edges in self.each):
            return [(states, 0)] if letter is None else []
        if (states, letter) not in self.known:
            marks = sum(1 << i for i, bit in enumerate(self.bits, self.own + 1) if letter & bit)
            found: list[tuple[Values, int]] = [((), 1 << self.own | marks)]
            for (atoms, shift, complete, edges), q in zip(self.each, states, strict=True):
                seen = sum(1 << i for i, bit in enumerate(atoms) if letter >> bit & 1)
                moves = [(t, acc << shift) for p, n, t, acc in edges[q] if p & ~seen == 0 == n & seen]
                if complete and not moves:
                    raise Rejected("an automaton does not say what it does with a letter that occurs")
                found = [((*to, t), acc | more) for to, acc in found for t, more in moves if t is not None]
            self.known[states, letter] = found
        return self.known[states, letter]


class Certificate:
    """What a certificate claims; making one checks its program, configurations and faults, `prove` a property."""

    def __init__(self, document: object) -> None:
        *whole, digests = fields(document, SECTIONS + " digests")
        sections = dict(zip(SECTIONS.split(), whole, strict=True))
        if whole[0] != FORMAT:
            raise Rejected(f"its format is not `{FORMAT}`, the only one that this program reads")
        if digests != {k: sha256(canonical(v).encode()).hexdigest() for k, v in sections.items()}:
            raise Rejected("a part of it is not the one whose hash it has")
        _, self.inputs, program, automata, assumed, premises, listed, steps, faults, self.properties = whole
        self.program, self.automata = Program(program), items(automata)
        self.assumed = [fields(a, "name text formula automaton") for a in items(assumed)]
        of_fairness = zip(items(premises), (p for p, _ in self.program.fair if p is not None), strict=True)
        around = [*(a[3] for a in self.assumed), *(k for k, _ in of_fairness)]
        self.around = [self.automata[at(k, self.automata)] for k in around]
        self.goals = [goal for premise, goal in self.program.fair if premise is None]
        self.edges, self.first = list[list[tuple[int, int | None]]](), list[tuple[int, int]]()
        self.closed, self.steps, self.faults = listed is not None, typed(steps, int), set[int]()
        if listed is not None:
            self._close(items(listed))
        verdict, reason, runs = fields(faults, "verdict reason runs")
        ends = [self._run(run)[2] == at(site, self.program.faults) for site, run in rows(runs)]
        proved = {"holds": self.closed and not self.faults and not ends, "violated": bool(ends)}
        if not all(ends) or (reason is None and not proved[typed(verdict, str)]):
            raise Rejected("what it says of faults is not proved")
        why = None if reason is not None else f"runs: {len(ends)}" if ends else "every step"
        self.about_faults = (f"{verdict}  faults{'' if why else f': {reason}'}", why)

    def _close(self, listed: list[object]) -> None:
        """All initial configurations are there, and all to which steps from one that is there lead."""
        nodes, left = {self.program.node(c): i for i, c in enumerate(listed)}, self.steps
        self.first = [(i, x) for c, i in nodes.items() for x in [self.program.first_letter(c)] if x is not None]
        for node in nodes:
            found = dict[tuple[int, int | None], None]()
            for step in self.program.successors(node):
                left -= 1
                if left < 0 or not (isinstance(step, int) or step[0] in nodes):
                    raise Rejected("a step leads to a configuration that is not there, or there are too many steps")
                if isinstance(step, int):
                    self.faults.add(step)
                else:
                    found[nodes[step[0]], step[1]] = None
            self.edges.append(list(found))
        if left or len(nodes) < len(listed) or len(self.first) != self.program.starts:
            raise Rejected("there are too few steps, an initial configuration is missing, or one is there twice")

    def _run(self, data: object) -> tuple[list[int], int | None, int | None]:
        """A run, taken again: its letters, the number of the first that is repeated, and the fault at its end."""
        first, steps, loop = fields(data, "initial steps loop")
        node, end = self.program.node(first), None
        letter = self.program.first_letter(node)
        if letter is None:
            raise Rejected("a run does not begin in an initial configuration")
        letters, places = [letter], [(node, 1)]
        for process, choices, values in rows(steps):
            given = [(at(k, self.program.choices), word(x)) for k, x in rows(choices)]
            if end is not None or isinstance(process, bool) or process not in self.program.enabled(node):
                raise Rejected("a run takes a step that is not possible there")
            try:
                node, letter = self.program.step(node, process, dict(given))
            except Faulted as faulted:
                end, letter = int(faulted.args[0]), None
            letters += [] if letter is None else [letter]
            possible = [*self.program.read.items()] == given and all(x in self.program.choices[k] for k, x in given)
            came = None if values is None else self.program.node(values)
            if not possible or came != (node if end is None else None):
                raise Rejected("a run does not come where it says, or reads other choices than it says")
            places.append((node, len(letters)))
        begin, back = (node, None) if loop is None else places[at(loop, places)]
        if begin != node or back == len(letters) or (loop is not None and end is not None):
            raise Rejected("the loop of a run does not come back, or shows nothing")
        return letters, back, end

    def _ranked(self, parts: Automata, proof: object, bad: set[int]) -> int:
        """The number of product states: they are closed, ranks never rise, and inside of each its set is missing."""
        joint, nodes, named = map(items, fields(proof, "joint nodes sets"))
        states = [tuple(at(q, edges) for q, (*_, edges) in zip(items(j), parts.each, strict=True)) for j in joint]
        sets = [1 << natural(k, parts.full.bit_length()) for k in named]
        triples = zip(nodes[::3], nodes[1::3], nodes[2::3], strict=True)
        rank = {(at(c, self.edges), states[at(j, states)]): at(r, sets) for c, j, r in triples}
        idle = len({*nodes[1::3]}) < len(joint) or len({*rank.values()}) < len(sets)
        if not self.closed or idle or 3 * len(rank) < len(nodes) or any(q[0] in bad for _, q in rank):
            raise Rejected("something is there twice or for nothing, or comes after a bad prefix")
        if any((c, q) not in rank for c, letter in self.first for q, _ in parts.moves(None, letter)):
            raise Rejected("an initial product state is missing")
        for (c, q), r in rank.items():
            for target, letter in self.edges[c]:
                for to, acceptance in parts.moves(q, letter):
                    after = rank.get((target, to), len(sets))
                    if after > r or (after == r and acceptance & sets[r]):
                        raise Rejected("a product state is missing, or the ranks do not prove what they should")
        return len(rank)

    def _accepted(self, parts: Automata, letters: list[int], back: int | None, trail: object) -> bool:
        """The automata can take these states, and a loop shows all sets; without a loop a bad prefix is at its end."""
        states, seen, taken = None, 0, [tuple(map(word, items(q))) for q in items(trail)]
        for i, (letter, after) in enumerate(zip(letters, taken, strict=True)):
            moves = [acceptance for to, acceptance in parts.moves(states, letter) if to == after]
            if not moves:
                raise Rejected("the automata do not go where they are said to")
            seen |= reduce(or_, moves) if back is not None and i >= back else 0
            states = after
        return taken[-1][0] in parts.bad if back is None else seen == parts.full and taken[-1] == taken[back - 1]

    def prove(self, data: object) -> tuple[str, str | None]:
        """The verdict of a property, in words, and what has proved it (None: it is not certified)."""
        name, kind, asked, formula, verdict, reason, violations, early, safe, prefix, lasso, run, trail = fields(
            data, "name kind text formula verdict reason violations early safe prefix lasso run trail")  # fmt: skip
        free = " on fault-free runs" if verdict == "holds" and self.faults else ""
        claim = f"{typed(verdict, str)}{free}  {typed(name, str)}  {'' if kind == 'ltl' else f'{kind} '}{asked}"
        if reason is not None:
            return f"{claim}: {typed(reason, str)}", None
        first, other = ([] if k is None else [self.automata[at(k, self.automata)]] for k in (early, violations))
        wrong = first if typed(safe, bool) else other
        whole, alone = Automata([*self.around, *wrong], self.goals), Automata(first, [])
        if verdict == "holds" and run is None is trail:
            parts = [(alone, prefix, alone.bad)] if first and not self.assumed else []
            parts += [] if parts and safe else [(whole, lasso, set[int]())]
            if wrong and len(parts) == (prefix is not None) + (lasso is not None):
                return claim, f"{sum(self._ranked(*part) for part in parts):,} product states"
        letters, back, end = self._run(run)
        fine = verdict == "violated" and prefix is None is lasso and end is None
        if back is None:
            fine = fine and bool(first) and not self.assumed and self._accepted(alone, letters, None, trail)
            loops = [[*letters, letter] for letter in {0, (1 << len(self.program.shown)) - 1, *letters}]
        else:
            fine = fine and bool(wrong) and self._accepted(whole, letters, back, trail)
            fine, loops = fine and all(f is None or true_on(f, letters, back) for *_, f, _ in self.assumed), [letters]
        if not fine or (formula is not None and any(true_on(formula, w, back or len(letters)) for w in loops)):
            raise Rejected("the run does not violate it")
        return claim, f"a run of {len(letters):,} letters"


def checked(path: Path, folder: Path) -> tuple[list[str], int]:
    """What a file proves, line by line, what is believed, and the exit code; `folder`: where the input files are."""
    try:
        document = json.loads(whole := path.read_text(encoding="utf-8"))
        if canonical(document) + "\n" != whole:
            raise Rejected("it is not in the one form of a certificate: keys in order, once each, no spaces")
        held = Certificate(document)
        files = [(folder / typed(name, str), digest) for name, _, digest in rows(held.inputs)]
        there = [(path, digest) for path, digest in files if path.exists() and path.stat().st_size < LARGEST_FILE]
        for name, digest in there:  # no pipe is waited for, nor a file that blocks in /proc: those have no size
            if not name.is_file():  # to open a device can already do something
                raise Rejected("an input is not a regular file")
            with open(name, "rb", opener=without_waiting) as file:
                if not name.is_file() or sha256(file.read(name.stat().st_size)).hexdigest() != digest:
                    raise Rejected("an input file is not the one of which it was made, or is not a regular file")
        claims = [*map(held.prove, items(held.properties)), held.about_faults]
    except Rejected as error:
        return [f"rejected: {error}"], REJECTED
    except (Exception, KeyboardInterrupt) as error:  # noqa: BLE001 - whatever fails, nothing is proved
        return [f"rejected: it cannot be read, is not well formed, or took too long ({error!r:.100})"], REJECTED
    lines = [f"{'proved' if why else 'not certified'}  {claim}{f'  ({why})' if why else ''}" for claim, why in claims]
    given = [f"assuming  {name}  {text}" for name, text, *_ in held.assumed]
    size = f"{len(held.edges):,} configurations, {held.steps:,} steps; {len(there)} of {len(files)} inputs compared"
    plain = ["".join(c if c.isprintable() else " " for c in x) for x in [*given, *lines, size, TRUSTED]]
    return plain, PROVED if all(why for _, why in claims) else NOT_CERTIFIED


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; its exit code: 0 all is proved, 1 rejected, 2 usage, 3 no answer could be written, 4 not all is
    certified."""
    parser = argparse.ArgumentParser("llfsm-check-certificate", description="Check a certificate of llfsm-verify.")
    parser.add_argument("certificate", metavar="FILE", type=Path, help="what llfsm-verify --certificate wrote")
    parser.add_argument("--inputs", metavar="DIR", help="where the input files are (default: where FILE says)")
    options = parser.parse_args(arguments)
    sys.setrecursionlimit(5_000)  # blocks inside blocks are calls inside calls
    lines, code = checked(options.certificate, Path(options.inputs or options.certificate.parent))
    try:
        print(*lines, sep="\n", flush=True)  # noqa: T201 - nothing, where standard output is closed
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # Python tries once more when it ends
        parser.exit(UNWRITTEN, f"the answer cannot be written: {error.strerror}\n")
    return code


if __name__ == "__main__":
    sys.exit(main())
