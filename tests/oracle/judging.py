"""Verdicts about random arrangements beside those of the direct interpreter and of searches in plain Python.

Every arrangement has records, arrays or inputs of either, and half of them `snapshot: after_entry`, where entering a
state keeps what an input was. Some of the rules are what a run of the arrangement shows, or nearly that.
`python -m tests.oracle.judging PAIRS SEED` compares so many and prints what it has seen.
"""

from __future__ import annotations

import random
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce

import pytest
from hypothesis import HealthCheck, Phase, given, reject, seed, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.verdict import Options, PropertyResult, Result, Verdict
from llfsm_verify.diagnostics import DiagnosticError, Fragment, Source
from llfsm_verify.engines.unrolled.options import UnrolledOptions
from llfsm_verify.language import typed
from llfsm_verify.language.atoms import PropertyScope, check_atom
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.testing import arrangements as drawing
from llfsm_verify.testing.properties import state_formulas
from llfsm_verify.testing.texts import Names, Pen
from llfsm_verify.verification.verify import verify
from tests.oracle.direct import nodes
from tests.oracle.formulas import Tree, regular_text, text
from tests.oracle.graph import Graph, Letter, TooLargeError, explore
from tests.oracle.rules import Rule
from tests.oracle.temporal import Search
from tests.quick import each, spread

CONFIGURATIONS, STEPS = 150, 2_000
LIMITS = Limits(max_states=100_000)
COMPOUND = ("record", "records", "array", "bools", "input record", "input array")
"""Shapes of variables, one or two of which each arrangement has."""
FORMULAS, RULES, SHOWN = 3, 2, 6
"""Properties of each arrangement: LTL, rules, and rules about what a run shows."""


class _Composer(drawing._Composer):
    """More of what is rare in `arrangements()`."""

    def document(self) -> drawing.Document:
        document = super().document()
        order, profile = document.get("schedule", []), document["profile"]
        held = isinstance(profile, dict) and profile.get("snapshot") == "cycle"
        if len(order) == 2 and not {"observe", "environment"} & set(document) and not held and self.pen.one_in(2):
            del document["schedule"]
            document["processes"] = {"first": order[:1], "second": order[1:]}
        return document

    def _whiteboard(self) -> drawing.Document:
        found = super()._whiteboard()
        for i in range(self.pen.number(1, 2)):
            found[f"v{i}"] = self._variable(f"v{i}", self.pen.pick(COMPOUND), False)
        return {**found, "was": {"type": "bool"}}

    def _state(self, name: str, kind: drawing._Kind, names: Names) -> drawing.Document:
        state = super()._state(name, kind, names)
        if kind.suspends and self.pen.one_in(2):
            given = [p.text for p in self.places if p.kind == "bool" and not p.writable and not p.size]
            state["on_entry"] = f"was = {self.pen.pick(given)}; {state.get('on_entry', '')}"
        return state

    def _profile(self, single: bool) -> object:
        drawn = super()._profile(single)
        if self.pen.one_in(2):
            base = drawn if isinstance(drawn, str) else drawn["base"]
            return {**(drawn if isinstance(drawn, dict) else {}), "base": base, "snapshot": "after_entry"}
        return drawn


@st.composite
def compound_arrangements(draw: st.DrawFn) -> drawing.Document:
    """Documents of one or two small machines."""
    document = _Composer(Pen(draw), 2, 3).document()
    try:
        build_arrangement(document)
    except DiagnosticError as error:
        if {d.code for d in error.diagnostics} <= drawing.FORESEEN:
            reject()
        raise
    return document


def state_trees(names: list[str]) -> st.SearchStrategy[Tree]:
    """State formulas over a few atoms."""
    one = st.sampled_from(names).map(lambda n: ("atom", n))
    two = st.tuples(st.sampled_from(("&&", "||", "->")), one, one)
    return st.one_of(one, one, st.tuples(st.just("!"), one), two)


def rules(names: list[str]) -> st.SearchStrategy[Tree]:
    """Regular expressions over a few letters."""
    letter = st.tuples(st.just("letter"), st.one_of(state_trees(names), state_trees(names), st.just(("true",))))
    counts = st.sampled_from(((0, None), (1, None), (0, 1), (2, 2), (1, 3), (2, None)))
    return st.recursive(
        letter,
        lambda r: st.one_of(
            st.tuples(st.just("seq"), r, r),
            st.tuples(st.just("alt"), r, r),
            st.tuples(st.just("repeat"), r, counts).map(lambda t: (*t[:2], *t[2])),
        ),
        max_leaves=5,
    )


def formulas(names: list[str]) -> st.SearchStrategy[Tree]:
    """LTL with few leaves, often of the shapes that need fairness."""
    one = state_trees(names)
    return st.one_of(
        one.map(lambda f: ("G", ("F", f))),
        one.map(lambda f: ("F", f)),
        st.tuples(one, one).map(lambda fs: ("G", ("->", fs[0], ("F", fs[1])))),
        _any_formulas(names),
    )


def _any_formulas(names: list[str]) -> st.SearchStrategy[Tree]:
    return st.recursive(
        state_trees(names),
        lambda f: st.one_of(
            st.tuples(st.sampled_from(("X", "F", "G", "!")), f),
            st.tuples(st.sampled_from(("U", "W", "R", "M", "->", "&&", "||")), f, f),
        ),
        max_leaves=3,
    )


@dataclass(frozen=True)
class Problem:
    """An arrangement, LTL and rules about it, for the LTL now and then an assumption, and how runs are chosen of which
    more rules speak."""

    arrangement: Arrangement
    names: list[str]
    ltl: list[Tree]
    rules: list[tuple[str, Tree]]
    assumption: Tree | None
    runs: int


@st.composite
def problems(draw: st.DrawFn) -> Problem:
    arrangement = build_arrangement(draw(compound_arrangements()))
    names = draw(st.lists(st.sampled_from(state_formulas(arrangement)), min_size=2, max_size=4, unique=True))
    names += [n for n in ("was",) if n not in names]
    kinds = st.sampled_from(("enforce", "forbid", "forbid initially"))
    ltl = draw(st.lists(formulas(names), min_size=FORMULAS, max_size=FORMULAS))
    ruled = draw(st.lists(st.tuples(kinds, rules(names)), min_size=RULES, max_size=RULES))
    assumption = draw(formulas(names)) if draw(st.integers(0, 2)) == 0 else None
    return Problem(arrangement, names, ltl, ruled, assumption, draw(st.integers(0, (1 << 32) - 1)))


def shown_rules(graph: Graph, names: list[str], chance: random.Random) -> list[tuple[str, Tree]]:
    """Rules against what some run shows at its beginning or later, in half of them with one atom the other way."""
    found = []
    for _ in range(SHOWN):
        at, letter = chance.choice(graph.roots)
        word = [letter]
        while graph.edges[at] and len(word) < 12:
            edge = chance.choice(list(graph.edges[at]))
            word.append(edge.letter)
            at = edge.target
        kept = [frozenset(n for n in names if n in letter) for letter in word]
        word = [letter for i, letter in enumerate(kept) if i == 0 or letter != kept[i - 1]][:7]
        kind = chance.choice(("forbid", "forbid initially"))
        if kind == "forbid":
            word = word[-3:]
        if chance.random() < 0.5:
            changed = chance.randrange(len(word))
            word[changed] ^= {chance.choice(names)}
        found.append((kind, reduce(lambda r, s: ("seq", r, s), (("letter", _exactly(x, names)) for x in word))))
    return found


def _exactly(letter: Letter, names: list[str]) -> Tree:
    literals: list[Tree] = [("atom", n) if n in letter else ("!", ("atom", n)) for n in names]
    return reduce(lambda f, g: ("&&", f, g), literals)


def ask(arrangement: Arrangement, lines: list[str], engine: str = "explicit", depth: int | None = None) -> Result:
    properties = parse_properties([Source("judging.ltl", "\n".join(lines))])
    return verify(
        arrangement, properties, Options(LIMITS, allow_contradiction=True, own=(UnrolledOptions(depth=depth),)), engine
    )


class Judge:
    """Compares, and counts what it has compared."""

    def __init__(self) -> None:
        self.seen: Counter[str] = Counter()

    def __call__(self, problem: Problem) -> None:
        arrangement = problem.arrangement
        scope = PropertyScope.of(arrangement)
        expressions = {n: check_atom(Fragment.whole(Source("<atom>", n)), scope) for n in problem.names}
        try:
            graph = explore(arrangement, expressions, CONFIGURATIONS, STEPS)
        except TooLargeError:
            self.seen["too large"] += 1
            return
        self.seen["arrangements"] += 1
        self.seen["after_entry"] += arrangement.profile.snapshot == "after_entry"
        self.seen["arrangements with faults"] += bool(graph.faults)
        shown = shown_rules(graph, problem.names, random.Random(problem.runs))
        self.rules(arrangement, [*problem.rules, *shown], graph)
        self.ltl(arrangement, problem.ltl, problem.assumption, graph)

    def rules(self, arrangement: Arrangement, ruled: list[tuple[str, Tree]], graph: Graph) -> None:
        lines, expected = [], []
        for number, (kind, expression) in enumerate(ruled):
            rule, line = Rule(kind, expression), f"{kind} r{number}: {regular_text(expression)}"
            if rule.void is None:
                lines.append(line)
                expected.append((kind, rule.shortest(graph)))
                continue
            self.seen[f"rules that are errors: {rule.void}"] += 1
            with pytest.raises(DiagnosticError, match=rule.void):
                ask(arrangement, [line])
        result = ask(arrangement, lines)
        self.faults(result, graph)
        for (kind, steps), found in zip(expected, result.properties, strict=True):
            self.compare(kind, found, graph, violated=steps is not None)
            if steps is not None:
                assert found.trace is not None and found.trace.loop is None, found.text
                assert sum(s.observed for s in found.trace.steps) == steps, found.text

    def ltl(self, arrangement: Arrangement, ltl: list[Tree], assumption: Tree | None, graph: Graph) -> None:
        if arrangement.timing == "untimed" and any(nodes(arrangement.machines, typed.After)):
            self.seen["left out: LTL where ages are fair"] += 1
            return
        fair = arrangement.fairness == "processes"
        lines = [f"p{i}: {text(f)}" for i, f in enumerate(ltl)]
        if assumption is not None:
            lines.append(f"assume a: {text(assumption)}")
        result = ask(arrangement, lines)
        self.faults(result, graph)
        for f, found in zip(ltl, result.properties, strict=True):
            wrong: Tree = ("!", f) if assumption is None else ("&&", assumption, ("!", f))
            violated = Search(wrong, graph, fair=fair).found()
            if not violated and found.verdict is Verdict.VIOLATED and (graph.faults or graph.wide):
                # A run that cannot go on is not infinite, but what has happened before it ends counts.
                assert assumption is None and found.trace is not None and found.trace.loop is None, found.text
                self.seen["LTL violated before a run ends"] += 1
                continue
            self.compare("LTL" if assumption is None else "LTL with an assumption", found, graph, violated=violated)

    def faults(self, result: Result, graph: Graph) -> None:
        expected = Verdict.VIOLATED if graph.faults else Verdict.UNKNOWN if graph.wide else Verdict.HOLDS
        assert result.faults.verdict is expected, graph.faults
        self.seen[f"faults {expected.value}"] += 1

    def compare(self, kind: str, found: PropertyResult, graph: Graph, *, violated: bool) -> None:
        expected = Verdict.VIOLATED if violated else Verdict.UNKNOWN if graph.wide else Verdict.HOLDS
        if kind.startswith("LTL") and graph.wide:
            assert found.verdict is not (Verdict.HOLDS if violated else Verdict.VIOLATED), found.text
        else:
            assert found.verdict is expected, f"{found.text}: {found.verdict} instead of {expected}"
        self.seen[f"{kind} {found.verdict.value}"] += 1


QUIET = settings(deadline=None, suppress_health_check=list(HealthCheck), phases=[Phase.generate, Phase.shrink])


def run(pairs: int, start: int | None = None, kinds: Sequence[str] = ()) -> Counter[str]:
    """So many arrangements, and more until each of the kinds has come; `start`: drawn from that seed, or as the tests'
    profile says."""
    judge = Judge()
    if start is None:
        amount = settings(QUIET, max_examples=pairs)
        spread(judge.__call__, amount, problems(), until=each(judge.seen, kinds))
    else:
        seed(start)(settings(QUIET, max_examples=pairs)(given(problems())(judge.__call__)))()
    return judge.seen


if __name__ == "__main__":
    for key, count in sorted(run(int(sys.argv[1]), int(sys.argv[2])).items()):
        sys.stdout.write(f"{count:6} {key}\n")
