"""Arrangements that ask theories do what the truth tables of these say: in every engine, step by step, in runs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from random import Random, SystemRandom

import pytest

from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.backends.reference import Interpreter
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.verdict import Options, Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.language import typed
from llfsm_verify.language.trees import of_kind
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.program.program import Program
from llfsm_verify.semantics.expressions import Code
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.verification.verify import checker
from tests.knowledge.asking import asking
from tests.quick import FRESH, examples, many
from tests.verification.agreeing import agree

STEPS = 40


def seeds(count: int, first: int = 0) -> list[int]:
    """Of so many arrangements."""
    return [SystemRandom().getrandbits(32) if FRESH else first + number for number in range(count)]


def run_both(seed: int, tally: Counter[str]) -> None:
    """A random run of both by the definition of step programs, and of the first one in machine code."""
    random = Random(seed)
    made = asking(random)
    programs: list[Program] = [lower(a, keep_all_bits=True) for a in (made.inlined, made.written)]
    interpreters = [Interpreter(p) for p in programs]
    native = NativeProgram(programs[0], events=True, effort="quick")
    record = native.layout.first()
    names = [v.name for v in programs[0].vars if not v.output]
    assert names == [v.name for v in programs[1].vars if not v.output]
    states = [
        ({v.name: v.init for v in p.vars if not v.output}, {v.name: v.init for v in p.vars if v.output})
        for p in programs
    ]
    for _ in range(STEPS):
        drawn: dict[str, int] = {}
        outcomes = [
            i.step(*state, 0, lambda c: drawn.setdefault(c.name, random.randint(c.type.low, c.type.high)))  # noqa: B023
            for i, state in zip(interpreters, states, strict=True)
        ]
        one, other = outcomes
        assert one.values == other.values
        assert one.samples == other.samples or not made.alike
        assert (one.fault is None) == (other.fault is None)
        result = native.step(record, 0, drawn)
        assert result.status == (0 if one.fault is None else one.fault + 1)
        if one.fault is not None:
            sites = [p.faults[o.fault] for p, o in zip(programs, outcomes, strict=True) if o.fault is not None]
            assert sites[0].code == sites[1].code
            tally[f"fault {sites[0].code}"] += 1
            return
        assert native.layout.decode(result.record) == one.values
        record, states = result.record, [(o.values, o.outputs) for o in outcomes]
    tally["steps"] += STEPS
    tally["samples"] += max(len(s) for s in (one.samples, other.samples))


def decide_both(seed: int, tally: Counter[str]) -> None:
    """The explicit engine decides the same of both, and what a theory says equals its table in each letter."""
    made = asking(Random(seed))
    texts = [Source("both.ltl", "\n".join(f"p{i}: {p}" for i, p in enumerate(made.properties)))]
    results = [
        checker("explicit")(bind(a, parse_properties(texts)), Options(Limits(max_states=20_000)))
        for a in (made.inlined, made.written)
    ]
    found = [
        ([p.verdict for p in r.properties], r.faults.verdict, sorted({f.site.code for f in r.faults.findings}))
        for r in results
    ]
    assert found[0] == found[1]
    tally.update(v.value for v in found[0][0])
    tally[f"faults {found[0][1].value}"] += 1
    if made.equal:
        texts = [Source("equal.ltl", "\n".join(f"e{i}: {p}" for i, p in enumerate(made.equal)))]
        result = checker("explicit")(bind(made.inlined, parse_properties(texts)), Options(Limits(max_states=20_000)))
        assert {p.verdict for p in result.properties} == {Verdict.HOLDS}, made.equal
        tally["equal"] += len(made.equal)


@pytest.mark.slow
def test_runs_are_those_of_the_truth_tables() -> None:
    tally = Counter[str]()
    for seed in seeds(examples(240)):
        run_both(seed, tally)
    assert {"fault F002", "fault F003", "steps", "samples"} <= tally.keys()


@pytest.mark.slow
def test_verdicts_are_those_of_the_truth_tables() -> None:
    tally = Counter[str]()
    for seed in seeds(examples(80), 1000):
        decide_both(seed, tally)
    assert {"holds", "violated", "faults violated", "equal"} <= tally.keys()


def _where_needed(e: typed.LetIn) -> typed.LetIn:
    """Definitions stand where they are read, as often as they are."""
    known: dict[str, typed.Expression] = {}

    def put(node: typed.Expression) -> typed.Expression:
        match node:
            case typed.ReadLocal():
                return known[node.local.key]
            case typed.Unary():
                return replace(node, operand=put(node.operand))
            case typed.Binary():
                return replace(node, left=put(node.left), right=put(node.right))
        return node

    for local, value in e.definitions:
        known[local.key] = put(value)
    return replace(e, definitions=(), value=put(e.value))


def _backwards(e: typed.LetIn) -> typed.LetIn:
    """What is told is evaluated in another order."""
    told = [d for d in e.definitions if not any(of_kind(d[1], typed.ReadLocal))]
    return replace(e, definitions=(*reversed(told), *(d for d in e.definitions if d not in told)))


def _twice(e: typed.LetIn) -> typed.LetIn:
    """What is told is evaluated again."""
    return replace(e, definitions=(*e.definitions[:1], *e.definitions))


@pytest.mark.slow
@pytest.mark.parametrize("mistake", [_where_needed, _backwards, _twice], ids=lambda m: m.__name__.strip("_"))
def test_mistakes_are_noticed(mistake: Callable[[typed.LetIn], typed.LetIn], monkeypatch: pytest.MonkeyPatch) -> None:
    lowered = Code._let_in
    monkeypatch.setattr(Code, "_let_in", lambda self, e: lowered(self, mistake(e)))

    def run() -> None:
        for number in range(100):
            run_both(number, Counter())

    with pytest.raises(AssertionError):
        run()


@pytest.mark.long
def test_engines_agree() -> None:
    tally = Counter[str]()
    for seed in seeds(many(500), 2000):
        random = Random(seed)
        made = asking(random)
        lines = (random.choice(made.properties), *made.equal[-1:])
        sources = [Source("all.ltl", "\n".join(f"p{i}: {p}" for i, p in enumerate(lines)))]
        agree((made.inlined, bind(made.inlined, parse_properties(sources))), tally)
    assert {"explicit violated", "explicit holds", "bmc violated", "induction holds", "pdr holds"} <= tally.keys()
