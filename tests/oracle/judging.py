"""Verdicts about random arrangements beside those of the direct interpreter and of searches in plain Python.

Every arrangement has records, arrays or inputs of either, and half of them `snapshot: after_entry`.
`python -m tests.oracle.judging PAIRS SEED` compares so many and prints what it has seen.
"""

from __future__ import annotations

import sys
from collections import Counter

import pytest
from hypothesis import HealthCheck, Phase, given, reject, seed, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.verdict import Limits, Options, PropertyResult, Result, Verdict
from llfsm_verify.checking.verify import verify
from llfsm_verify.diagnostics import DiagnosticError, Fragment, Source
from llfsm_verify.language import typed
from llfsm_verify.language.atoms import PropertyScope, check_atom
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.testing import arrangements as drawing
from llfsm_verify.testing.properties import state_formulas
from llfsm_verify.testing.texts import Pen
from tests.oracle.direct import nodes
from tests.oracle.formulas import Tree, atoms, regular_text, text
from tests.oracle.graph import Graph, TooLargeError, explore
from tests.oracle.rules import Rule
from tests.oracle.temporal import Search

CONFIGURATIONS, STEPS = 150, 2_000
LIMITS = Limits(max_states=100_000)
COMPOUND = ("record", "records", "array", "bools", "input record", "input array")
"""Shapes of variables, one or two of which each arrangement has."""
FORMULAS, RULES = 2, 3
"""Properties of each arrangement."""


class _Composer(drawing._Composer):
    """More of what is rare in `arrangements()`."""

    def _whiteboard(self) -> drawing.Document:
        found = super()._whiteboard()
        for i in range(self.pen.number(1, 2)):
            found[f"v{i}"] = self._variable(f"v{i}", self.pen.pick(COMPOUND), False)
        return found

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
    """LTL with at most four leaves."""
    return st.recursive(
        state_trees(names),
        lambda f: st.one_of(
            st.tuples(st.sampled_from(("X", "F", "G", "!")), f),
            st.tuples(st.sampled_from(("U", "W", "R", "M", "->", "&&", "||")), f, f),
        ),
        max_leaves=3,
    )


@st.composite
def problems(draw: st.DrawFn) -> tuple[Arrangement, list[Tree], list[tuple[str, Tree]], Tree | None]:
    """An arrangement, LTL and rules about it, and for the LTL now and then an assumption."""
    arrangement = build_arrangement(draw(compound_arrangements()))
    names = draw(st.lists(st.sampled_from(state_formulas(arrangement)), min_size=2, max_size=4, unique=True))
    kinds = st.sampled_from(("enforce", "forbid", "forbid initially"))
    ltl = draw(st.lists(formulas(names), min_size=FORMULAS, max_size=FORMULAS))
    ruled = draw(st.lists(st.tuples(kinds, rules(names)), min_size=RULES, max_size=RULES))
    return arrangement, ltl, ruled, draw(formulas(names)) if draw(st.integers(0, 2)) == 0 else None


def ask(arrangement: Arrangement, lines: list[str], engine: str = "explicit") -> Result:
    properties = parse_properties([Source("judging.ltl", "\n".join(lines))])
    return verify(arrangement, properties, Options(LIMITS), engine)


class Judge:
    """Compares, and counts what it has compared."""

    def __init__(self) -> None:
        self.seen: Counter[str] = Counter()

    def __call__(self, problem: tuple[Arrangement, list[Tree], list[tuple[str, Tree]], Tree | None]) -> None:
        arrangement, ltl, ruled, assumption = problem
        scope = PropertyScope.of(arrangement)
        trees = [*ltl, *(r for _, r in ruled), *([] if assumption is None else [assumption])]
        names = dict.fromkeys(n for t in trees for n in atoms(t))
        expressions = {n: check_atom(Fragment.whole(Source("<atom>", n)), scope) for n in names}
        try:
            graph = explore(arrangement, expressions, CONFIGURATIONS, STEPS)
        except TooLargeError:
            self.seen["too large"] += 1
            return
        self.seen["arrangements"] += 1
        self.seen["after_entry"] += arrangement.profile.snapshot == "after_entry"
        self.seen["arrangements with faults"] += bool(graph.faults)
        self.rules(arrangement, ruled, graph)
        self.ltl(arrangement, ltl, assumption, graph)

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
            if not violated and found.verdict is Verdict.VIOLATED and graph.faults:
                # A run that cannot go on is no infinite one, but what has happened before it ends counts.
                assert assumption is None and found.trace is not None and found.trace.loop is None, found.text
                self.seen["LTL violated before a fault"] += 1
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


def run(pairs: int, start: int | None = None) -> Counter[str]:
    """So many arrangements; `start`: drawn from that seed, or as the tests' profile says."""
    judge = Judge()
    checked = settings(QUIET, max_examples=pairs)(given(problems())(judge.__call__))
    (checked if start is None else seed(start)(checked))()
    return judge.seen


if __name__ == "__main__":
    for key, count in sorted(run(int(sys.argv[1]), int(sys.argv[2])).items()):
        sys.stdout.write(f"{count:6} {key}\n")
