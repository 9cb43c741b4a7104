"""Searches by one, two and three threads on random arrangements: what they find, keep, save and say is the same.

`python -m tests.kripke.threads CASES SEED` compares so many cases and prints what came.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from random import Random

import pytest
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.verdict import Options, Result
from llfsm_verify.diagnostics import Source
from llfsm_verify.engines.explicit.options import ExplicitOptions
from llfsm_verify.jsonvalue import Json
from llfsm_verify.kripke import sharing, tables
from llfsm_verify.kripke.checkpoint import Section
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.kripke.export.formats import STRUCTURES
from llfsm_verify.kripke.kernels import blocks
from llfsm_verify.kripke.kernels.shared_blocks import NODES_EACH
from llfsm_verify.kripke.labels.wide import labels_of
from llfsm_verify.kripke.structure import structure
from llfsm_verify.limits import Budget, Limits
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.program.program import Program
from llfsm_verify.report.json import result_object
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.testing.arrangements import Document, arrangements
from llfsm_verify.testing.properties import properties
from llfsm_verify.verification.verify import verify
from tests.arrangement.requests.drawn import asking
from tests.quick import each, spread

JOBS = (1, 2, 3)
MOST = 3_001
"""Configurations of a space: larger ones are cut there."""
KINDS = (
    "complete", "cut by states", "cut by steps", "threads at work", "edges dropped", "no edges", "chains", "cycles",
    "several roots", "faults", "overflow", "equal successors", "saved", "holds", "violated", "unknown", "exported",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Knobs:
    """How threads divide the work. Each has an own order of tasks (`stride`), and waits at random places (`delay`)."""

    smallest: int = 1
    entries: int = 1 << 17
    """Successors of a chunk."""
    arena: int = 1 << 20
    """Successors for which a thread has room; a chunk with more is undone."""
    alone: int = 1 << 13
    """Slots of a table that one thread moves: at least twice those that are kept (`memory.KEPT`)."""
    buffer: int = 1 << 15
    """Bytes of the buffer of steps: a small one ends in the middle of a node."""
    stride: int = 1
    delay: int = 0


@contextmanager
def divided(knobs: Knobs) -> Iterator[None]:
    """Within, small spaces are explored by several threads."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sharing, "SMALLEST", knobs.smallest)
        patch.setattr(sharing, "FEWEST", NODES_EACH)
        patch.setattr(sharing, "CHUNK_ENTRIES", knobs.entries)
        patch.setattr(sharing, "ARENA_ENTRIES", knobs.arena)
        patch.setattr(sharing, "SPREAD_ALONE", knobs.alone)
        patch.setattr(tables, "BUFFER_BYTES", knobs.buffer)
        patch.setattr(sharing, "STRIDE", knobs.stride)
        patch.setattr(sharing, "DELAY", knobs.delay)
        yield


@contextmanager
def counted(tally: Counter[str]) -> Iterator[None]:
    """Within, chunks are counted that threads have expanded together."""
    kept = sharing.Sharing._keep

    def keep(self: sharing.Sharing, *given: object) -> None:
        tally["threads at work"] += 1
        kept(self, *given)  # type: ignore[arg-type]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sharing.Sharing, "_keep", keep)
        yield


# ---------------------------------------------------------------- what is drawn


class _Pen:
    """An arrangement with many successors of each configuration, and with much that happens seldom."""

    def __init__(self, rng: Random) -> None:
        self._rng = rng
        self._tops = {f"v{i}": rng.choice((3, 5, 7, 9)) for i in range(rng.randint(3, 4))}
        self._faulty = rng.random() < 0.3
        """Many steps fault, so that several threads meet a fault at a time."""
        self._inputs = {"i0": 1} | {f"i{n}": rng.choice((2, 3, 7)) for n in range(1, rng.randint(1, 3))}

    def document(self) -> Document:
        rng = self._rng
        board: Document = {name: {"type": f"0..{top}", "init": "0"} for name, top in self._tops.items()}
        board |= {name: {"type": f"0..{top}", "init": "0", "role": "input"} for name, top in self._inputs.items()}
        board["t"] = {"type": "int", "init": "0"}
        if rng.random() < 0.4:
            board["c"] = {"type": f"0..{rng.choice((1, 4, 60))}", "role": "input", "changes": "never"}
            self._inputs["c"] = 1
        machines: Document = {f"m{i}": {"inline": self._machine(f"M{i}")} for i in range(rng.randint(2, 3))}
        document: Document = {
            "name": "wide", "whiteboard": board, "machines": machines, "schedule": list(machines)
        }  # fmt: skip
        if rng.random() < 0.25:
            document["observe"] = "cycle"
        return document

    def _machine(self, name: str) -> Document:
        count = self._rng.randint(1, 3)
        states: list[Document] = []
        for number in range(count):
            to = [self._rng.randrange(count) for _ in range(self._rng.randint(1, 3))]
            moves = [{"when": self.condition(), "to": f"S{state}"} for state in to]
            what = self._rng.choice(("on_entry", "internal", "internal"))
            states.append({"name": f"S{number}", what: self._statements(), "transitions": moves})
        return {"machine": name, "states": states}

    def _statements(self) -> str:
        grows = f"{(name := self._rng.choice(list(self._tops)))} = ({name} + i0 + 1) % {self._tops[name] + 1};"
        return " ".join([grows, *(self._statement() for _ in range(self._rng.randint(1, 4)))])

    def _statement(self) -> str:
        rng, name = self._rng, self._rng.choice(list(self._tops))
        size = self._tops[name] + 1
        kind = 0 if self._faulty and rng.random() < 0.3 else rng.randrange(16)
        if kind == 0:  # may fault
            return f"if ({self.condition()} && {self.condition()}) {name} = {name} + {rng.choice((1, 2))};"
        if kind == 1:
            other = rng.choice(list(self._tops))
            return f"if ({self.condition()} && {self.condition()}) {name} = (6 / {other}) % {size};"
        if kind == 2:  # may overflow
            return f"if ({self.condition()} && {self.condition()}) {{ t = 4611686018427387904 * {name}; t = 0; }}"
        if kind < 8:
            return f"{name} = {rng.choice(list(self._inputs))} % {size};"
        if kind < 12:
            return f"if ({self.condition()}) {name} = {rng.randrange(size)};"
        other = rng.choice([*self._tops, *self._inputs])
        return f"{name} = ({name} + {other} + {rng.randrange(size)}) % {size};"

    def condition(self) -> str:
        rng = self._rng
        name = rng.choice([*self._tops, *self._tops, *self._inputs])
        top = {**self._tops, **self._inputs}[name]
        return f"{name} {rng.choice(('==', '!=', '<', '>='))} {rng.randint(0, top)}"

    def property(self) -> str:
        a, b = self.condition(), self.condition()
        forms = ("G !({} && {})", "G ({} -> F ({}))", "G ({} -> X ({}))", "G F ({})", "({}) W ({})", "G ({} || {})")
        return self._rng.choice(forms).format(a, b)


@dataclass(frozen=True, slots=True, repr=False)
class Case:
    """An arrangement with properties, and what is asked of both."""

    arrangement: Arrangement
    lines: PropertySet
    knobs: Knobs
    targets: tuple[int, ...]
    """Nodes at which the exploration pauses."""
    limits: Limits
    edges: str
    chains: bool
    stops: int
    """Nodes after which the exploration is saved."""
    own: ExplicitOptions

    def __repr__(self) -> str:
        return f"{self.arrangement.digest[:8]}: {self.knobs}, {self.limits}, {self.edges}, {self.targets}, {self.stops}"


@st.composite
def cases(draw: st.DrawFn) -> Case:
    """Most are wide; the others use all of the language, or have plants of requests."""
    rng = Random(draw(st.integers(0, 1 << 40)))
    kind = rng.random()
    if kind < 0.6:
        pen = _Pen(rng)
        document, texts = pen.document(), [pen.property() for _ in range(rng.randint(1, 3))]
        assumed = [pen.property()] if rng.random() < 0.2 else []
        arrangement = build_arrangement(document)
    elif kind < 0.75:
        made = asking(rng, small=True, properties=2)
        arrangement, texts, assumed = build_arrangement(made.document), list(made.properties), []
    else:
        arrangement = build_arrangement(draw(arrangements(max_machines=3, max_states=3)))
        texts, assumed = [draw(properties(arrangement)) for _ in range(2)], []
    lines = [f"p{i}: {text}" for i, text in enumerate(texts)] + [f"assume a: {text}" for text in assumed]
    # One portion at a time, an odd one, as users' limits are.
    states = rng.choice((None, rng.randint(1, MOST), rng.randint(60, 700)))
    return Case(
        arrangement,
        parse_properties([Source("random.ltl", "\n".join(lines))]),
        Knobs(
            rng.choice((1, 1, 100, 700)), rng.choice((128, 1000, 1 << 17)), rng.choice((1 << 9, 1 << 12, 1 << 20)),
            rng.choice((1 << 13, 1 << 17)), rng.choice((300, 1 << 11, 1 << 15)), rng.randint(1, 1000),
            rng.choice((0, 0, rng.randint(1, 1 << 30))),
        ),
        tuple(sorted(rng.randint(1, MOST) for _ in range(rng.randint(0, 3)))),
        Limits(MOST if states is None else states, max_steps=rng.choice((100_000, 100_000, rng.randint(1, 3_000)))),
        rng.choice(("kept", "kept", "none", "dropped")),
        rng.random() < 0.15 and arrangement.observe == "ringlet",
        rng.randint(1, MOST),
        ExplicitOptions(
            rng.choice(("auto", "on", "off")), rng.random() < 0.8, "off" if rng.random() < 0.7 else "on",
        ),
    )  # fmt: skip


# ---------------------------------------------------------------- what is compared


def contents(explorer: Explorer) -> dict[str, object]:
    """All that an exploration leaves: numbers of nodes, edges and letters, parents, and why it ended."""
    graph = explorer.graph
    found: dict[str, object] = {
        "counts": (graph.count, graph.expanded, graph.configurations, graph.edge_count, graph.transitions, graph.depth),
        "ended": (graph.complete, graph.stopped, graph.faults, graph.overflow, explorer.steps),
        "level": explorer._tables.block[blocks.LEVEL_END],
        "alphabet": tuple(graph.alphabet),
        "keys": graph.keys.read(0, 8 * graph.words * graph.count),
        "parents": graph.parents.read(0, 4 * graph.count),
        "sources": graph.letter_sources.read(0, 4 * len(graph.alphabet)),
    }
    if graph.with_edges:
        found["first"] = graph.first.read(0, 8 * (graph.expanded + 1))
        found["targets"] = graph.targets.read(0, 4 * graph.edge_count)
        found["labels"] = graph.labels.read(0, 4 * graph.edge_count)
    if graph.sequences is not None:
        found["words"] = graph.sequences.pairs().tobytes()
    return found


def explored(case: Case, program: Program, jobs: int) -> Iterator[object]:
    """What an exploration leaves at each of its pauses."""
    labels = labels_of(program, Budget(Limits())) if case.own.labels else None
    with_edges = case.edges != "none" or program.observe == "cycle"
    explorer = Explorer(
        program, Budget(case.limits), with_edges=with_edges, chains=case.chains, labels=labels, jobs=jobs
    )  # fmt: skip
    try:
        for number, target in enumerate((*case.targets, None)):
            explorer.explore(target)
            yield contents(explorer)
            if number == 0 and case.edges == "dropped" and program.observe == "ringlet" and not case.chains:
                explorer.drop_edges()
        if case.chains:
            yield explorer.count(), explorer.graph.configurations, explorer.graph.transitions
    finally:
        explorer.close()


def saved(case: Case, program: Program, jobs: int, then: int) -> Iterator[object]:
    """What is saved of an exploration that is cut short, and what another one leaves that goes on with it."""
    labels = labels_of(program, Budget(Limits())) if case.own.labels else None
    limits = Limits(max_states=MOST, max_steps=100_000)

    def begun(threads: int) -> Explorer:
        return Explorer(program, Budget(limits), chains=case.chains, labels=labels, jobs=threads)

    first, second = begun(jobs), begun(then)
    try:
        first.explore(case.stops)
        if first.graph.stopped is not None or not first.finish_batch(60):
            return
        numbers, sections = first.saved()
        texts = [region.read(0, size) for region, size in sections]
        yield numbers.header(), texts

        def read(wanted: Sequence[Section], _: Budget) -> None:
            for (region, _size), text in zip(wanted, texts, strict=True):
                region.write(text)

        second.restore(numbers.header(), read)
        second.explore(None)
        # Where a letter was met first is not known of those that were read.
        yield {key: value for key, value in contents(second).items() if key != "sources"}
    finally:
        first.close()
        second.close()


def said(result: Result) -> Json:
    """A result as `--format json` has it, without its seconds."""
    found = result_object(result)
    return timeless(found)


def timeless(value: Json) -> Json:
    """Without seconds, and without what is looked for within some seconds."""
    if isinstance(value, dict):
        return {key: timeless(each) for key, each in value.items() if key not in ("seconds", "vacuity")}
    return [timeless(each) for each in value] if isinstance(value, list) else value


def exported(case: Case, jobs: int) -> bytes:
    """The structure as JSON; a part of it where a limit cuts it short."""
    problem = bind(case.arrangement, case.lines)
    found = structure(case.arrangement, problem, budget=Budget(case.limits), labels=case.own.labels, jobs=jobs)
    pieces = STRUCTURES.load("json")(found)
    return b"".join(piece if isinstance(piece, bytes) else piece.encode() for piece in pieces)


def compare(case: Case, tally: Counter[str]) -> None:
    """AssertionError: something depends on the number of threads."""
    program = lower(case.arrangement, bind(case.arrangement, case.lines).atoms)
    with divided(case.knobs), counted(tally):
        alone, *others = [list(explored(case, program, jobs)) for jobs in JOBS]
        assert all(other == alone for other in others)
        saves = list(saved(case, program, 1, 1))
        assert list(saved(case, program, 2, 3)) == saves == list(saved(case, program, 3, 2))
        answers = [verified(case, jobs) for jobs in JOBS]
        assert answers[1:] == answers[:1] * 2
        files = [exported(case, jobs) for jobs in JOBS]
        assert files[1:] == files[:1] * 2
    _note(case, program, alone, tally)
    tally.update(str(p["verdict"]) for p in answers[0]["properties"])  # type: ignore[call-overload, index, union-attr]
    tally["saved"] += bool(saves)
    tally["exported"] += bool(files[0])


def verified(case: Case, jobs: int) -> dict[str, Json]:
    """What a check says."""
    options = Options(case.limits, own=(replace(case.own, jobs=jobs),), allow_contradiction=True)
    found = said(verify(case.arrangement, case.lines, options, engine="explicit"))
    assert isinstance(found, dict)
    return found


def _note(case: Case, program: Program, found: Sequence[object], tally: Counter[str]) -> None:
    last = next(each for each in reversed(found) if isinstance(each, dict))
    complete, stopped, faults, overflow, _ = last["ended"]
    counts = last["counts"]
    tally["complete"] += complete
    tally["cut by states"] += "configurations" in (stopped or "")
    tally["cut by steps"] += "steps was" in (stopped or "")
    tally["edges dropped"] += case.edges == "dropped" and "first" not in last
    tally["no edges"] += case.edges == "none"
    tally["chains"] += case.chains
    tally["cycles"] += program.observe == "cycle"
    tally["several roots"] += any(v.free for v in program.vars)
    tally["faults"] += bool(faults)
    tally["overflow"] += overflow is not None
    tally["equal successors"] += counts[3] > counts[4]
    tally["cases"] += 1


def run(number: int, start: int | None = None, kinds: Sequence[str] = KINDS) -> Counter[str]:
    """So many cases, and more until each kind has come; `start`: from that seed, else as the tests draw."""
    tally: Counter[str] = Counter()
    amount = settings(
        max_examples=number, deadline=None, suppress_health_check=list(HealthCheck), phases=[Phase.generate]
    )

    def compared(case: Case) -> None:
        compare(case, tally)

    if start is None:
        spread(compared, amount, cases(), size=10, until=each(tally, kinds))
    else:
        seed(start)(amount(given(cases())(compared)))()
    return tally


if __name__ == "__main__":
    for key, count in sorted(run(int(sys.argv[1]), int(sys.argv[2])).items()):
        sys.stdout.write(f"{count:6} {key}\n")
