"""Chains of steps without a choice: the same answers and counts as without, from fewer stored configurations."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement, load_arrangement_text
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.verdict import Options, Result, Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.engines.explicit import engine as explicit
from llfsm_verify.engines.explicit.options import Checkpointing, ExplicitOptions
from llfsm_verify.engines.explicit.search import Search
from llfsm_verify.kripke import chains as chains_module
from llfsm_verify.kripke import product_search as search
from llfsm_verify.kripke.checkpoint import Section
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.kripke.graph import Graph
from llfsm_verify.kripke.kernels.chain_blocks import MAX_CHAIN
from llfsm_verify.limits import Budget, LimitReached, Limits
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.program.program import Program
from llfsm_verify.report.json import result_object
from llfsm_verify.report.wording import summary_text
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.testing.arrangements import arrangements
from llfsm_verify.testing.properties import properties
from llfsm_verify.verification.verify import verify
from tests.quick import AtLeast, examples, many, spread

LIMITS = Limits(max_states=3_000)
CHECKS = [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large, HealthCheck.large_base_example]
FAST = settings(max_examples=examples(50), suppress_health_check=CHECKS, phases=[Phase.generate, Phase.shrink])
SLOW = settings(FAST, max_examples=many(2_000))

Problem = tuple[Arrangement, PropertySet]


@st.composite
def problems(draw: st.DrawFn) -> Problem:
    """Arrangements whose ringlets are observed, and one or two properties, perhaps with an assumption."""
    document = draw(arrangements(max_machines=3, max_states=3))
    document.pop("observe", None)
    arrangement = build_arrangement(document)
    texts = draw(st.lists(properties(arrangement), min_size=1, max_size=2))
    lines = [f"p{i}: {text}" for i, text in enumerate(texts)]
    if draw(st.booleans()):
        lines.append(f"assume a: {draw(properties(arrangement))}")
    return arrangement, parse_properties([Source("random.ltl", "\n".join(lines))])


def answers(result: Result) -> tuple[object, ...]:
    return (
        tuple((p.name, p.verdict, p.trace, p.reason, p.notes) for p in result.properties),
        result.faults.verdict,
        tuple((f.site, f.trace) for f in result.faults.findings),
        (result.complete, result.exploration.states, result.exploration.transitions),
    )


def compared(problem: Problem, found: Counter[str]) -> None:
    arrangement, lines = problem
    off = verify(
        arrangement, lines, Options(LIMITS, own=(ExplicitOptions(cone="off", compression="off"),)), engine="explicit"
    )
    if not off.complete:
        return
    on = verify(
        arrangement, lines, Options(LIMITS, own=(ExplicitOptions(cone="off", compression="on"),)), engine="explicit"
    )
    assert answers(on) == answers(off)
    assert off.exploration.stored is None
    assert on.exploration.stored is not None
    assert on.exploration.counted
    assert on.exploration.stored <= on.exploration.states
    found["compared"] += 1
    found["fewer"] += on.exploration.stored < on.exploration.states
    found["half"] += 2 * on.exploration.stored <= on.exploration.states
    found.update(p.verdict.value for p in on.properties)
    found["faults"] += bool(on.faults.findings)


def same_answers(amount: settings) -> None:
    found: Counter[str] = Counter()
    met = AtLeast(found, {"compared": 0.7 * amount.max_examples, "fewer": 0.25 * amount.max_examples})
    spread(lambda problem: compared(problem, found), amount, problems(), size=4, until=met)


@pytest.mark.slow
def test_chains_change_no_answer() -> None:
    same_answers(FAST)


@pytest.mark.long
def test_chains_change_no_answer_many() -> None:
    same_answers(SLOW)


# ---------------------------------------------------------------- graphs


@dataclass
class Room:
    """A budget in which only so many bytes may be asked for at a time."""

    most: int = 1 << 60
    max_states: int | None = None
    max_steps: int | None = None
    asked: int = 0

    def check(self, more: int = 0) -> None:
        self.asked = max(self.asked, more)
        if more > self.most:
            raise LimitReached("no memory")


def program_of(text: str, property_text: str = "") -> Program:
    arrangement = load_arrangement_text(text, "test.yaml")
    return lower(arrangement, bind(arrangement, parse_properties([Source("test.ltl", property_text)])).atoms)


def explored(program: Program, *, chains: bool, room: Room | None = None) -> Explorer:
    explorer = Explorer(program, room or Room(), chains=chains)
    explorer.explore(None)
    assert explorer.graph.stopped is None
    return explorer


def numbers(explorer: Explorer) -> tuple[int, int]:
    assert explorer.count()
    return explorer.graph.configurations, explorer.graph.transitions


def relay(followers: int, modulus: int, *, reads: bool) -> str:
    """A machine that reads an input (or takes turns by itself), and others that pass on what it does."""
    when = "go" if reads else "w0 == w0"
    lines = ["name: relay\nwhiteboard:\n  go: {type: bool, init: false, role: input}\n"]
    lines += [f"  w{i}: {{type: 0..{modulus - 1}, init: 0}}\n" for i in range(followers + 1)]
    lines.append(
        f"machines:\n  m0:\n    inline:\n      machine: First\n      states:\n"
        f"        - {{name: LOW, on_entry: w0 = 0;, transitions: [{{when: {when}, to: HIGH}}]}}\n"
        f"        - {{name: HIGH, on_entry: w0 = 1;, transitions: [{{when: {when}, to: LOW}}]}}\n"
    )
    for i in range(1, followers + 1):
        lines.append(
            f"  m{i}:\n    inline:\n      machine: Follower{i}\n      states:\n"
            f"        - {{name: A, internal: w{i} = (w{i} + w{i - 1}) % {modulus};, "
            f"transitions: [{{when: w{i - 1} == {i % modulus}, to: B}}]}}\n"
            f"        - {{name: B, internal: w{i} = (w{i} + 1) % {modulus};, "
            f"transitions: [{{when: w{i - 1} != {i % modulus}, to: A}}]}}\n"
        )
    return "".join([*lines, f"schedule: [{', '.join(f'm{i}' for i in range(followers + 1))}]\n"])


def counter(size: int) -> str:
    """One machine without inputs, whose only run is a loop of `size` configurations."""
    return (
        f"name: counter\nwhiteboard:\n  n: {{type: 0..{size - 1}, init: 0}}\n"
        "machines:\n  c:\n    inline:\n      machine: Counter\n      states:\n"
        f"        - {{name: S, internal: n = (n + 1) % {size};, transitions: [{{when: false, to: S}}]}}\n"
        "schedule: [c]\n"
    )


def into_a_loop(stem: int, loop: int) -> str:
    """One machine without inputs, whose only run comes after `stem` configurations to a loop of `loop`."""
    end = stem + loop
    return (
        f"name: lasso\nwhiteboard:\n  n: {{type: 0..{end - 1}, init: 0}}\n"
        "machines:\n  c:\n    inline:\n      machine: Counter\n      states:\n"
        f"        - name: S\n          internal: 'n = n == {end - 1} ? {stem} : n + 1;'\n"
        "          transitions: [{when: false, to: S}]\n"
        "schedule: [c]\n"
    )


LASSOS = [into_a_loop(stem, loop) for stem in (1, 2, 5, 40) for loop in (1, 2, 3, 4, 7, 11, 30)]


@pytest.mark.parametrize("text", [relay(4, 2, reads=True), relay(4, 2, reads=False), *LASSOS])
def test_edges_are_chains_of_the_plain_graph(text: str) -> None:
    watched = "p: G (w2 == 1 -> F m3@B)" if "relay" in text else "p: G (n == 2 || n == 3 || n == 5)\nq: G n != 7"
    program = program_of(text, watched)
    plain, short = explored(program, chains=False).graph, explored(program, chains=True).graph
    place = {plain.key(n): n for n in range(len(plain))}
    keys = [short.key(n) for n in range(len(short))]
    assert len(set(keys)) == len(keys) <= max(3, len(plain) / 2)
    assert set(keys) <= set(place)
    for node, key in enumerate(keys):
        begun = set()
        for target, label in short.arcs(node):
            letters = short.shown(label)
            assert isinstance(letters, tuple)
            assert 1 <= len(letters) <= MAX_CHAIN
            firsts = [t for t, x in plain.edges(place[key]) if x == letters[0]]
            ends = [t for t in firsts if followed(plain, t, letters[1:]) == place[keys[target]]]
            assert ends
            begun |= {(t, letters[0]) for t in ends}
        assert begun == set(plain.edges(place[key]))


def followed(plain: Graph, node: int, letters: Sequence[int]) -> int | None:
    """Where the only steps from a node lead that show these letters; None: there is a choice, or they show others."""
    for letter in letters:
        steps = list(plain.edges(node))
        if len(steps) != 1 or steps[0][1] != letter:
            return None
        node = steps[0][0]
    return node


@pytest.mark.slow
def test_counts_in_one_pass_and_in_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chains_module, "FEWEST", 64)
    program = program_of(relay(7, 3, reads=True))
    expected = numbers(explored(program, chains=False))
    whole = explored(program, chains=True)
    assert len(whole.graph) < expected[0] / 3
    room = Room()
    parts = explored(program, chains=True, room=room)
    passes = 0
    run = chains_module.Chains._count_class

    def counted(self: chains_module.Chains, *arguments: object) -> bool:
        nonlocal passes
        passes += 1
        return run(self, *arguments)

    monkeypatch.setattr(chains_module.Chains, "_count_class", counted)
    assert numbers(whole) == expected
    assert passes == 1
    room.most = 100_000
    assert numbers(parts) == expected
    assert passes > 10


def test_without_memory_nothing_is_counted_and_that_is_said() -> None:
    room = Room()
    explorer = explored(program_of(relay(7, 3, reads=True)), chains=True, room=room)
    stored = len(explorer.graph)
    room.most = 0
    assert not explorer.count()
    assert not explorer.counted
    assert explorer.graph.configurations == stored


@pytest.mark.parametrize("size", [2, 3, 63, 64, 65, 700, 5_000, 100_000])
def test_a_run_without_choices(size: int) -> None:
    """Loops shorter and longer than a chain can be, with milestones and without."""
    program = program_of(counter(size), "p: G n == 0")
    explorer = explored(program, chains=True)
    assert len(explorer.graph) <= 8 + size // 32
    assert explorer.graph.edge_count <= len(explorer.graph)
    assert numbers(explorer) == numbers(explored(program, chains=False))


def test_without_edges_the_same_nodes_are_stored() -> None:
    program = program_of(relay(4, 2, reads=True))
    found = []
    for with_edges in (True, False):
        explorer = Explorer(program, Room(), chains=True, with_edges=with_edges)
        explorer.explore(None)
        found.append([explorer.graph.key(n) for n in range(len(explorer.graph))])
        assert numbers(explorer) == numbers(explored(program, chains=False))
    assert found[0] == found[1]


def test_whole_cycles_have_no_chains() -> None:
    program = program_of(relay(2, 2, reads=True) + "observe: cycle\n")
    with pytest.raises(ValueError, match="whole cycles"):
        Explorer(program, Room(), chains=True)


def test_a_saved_exploration_goes_on() -> None:
    program = program_of(relay(5, 2, reads=True), "p: G (w2 == 1 -> F m3@B)")
    whole = explored(program, chains=True)
    first = Explorer(program, Room(), chains=True)
    first.explore(len(whole.graph) // 2)
    assert first.finish_batch(10)
    saved, sections = first.saved()
    data = [region.read(0, size) for region, size in sections]

    def read(sections: Sequence[Section], _: Budget) -> None:
        for (region, size), part in zip(sections, data, strict=True):
            assert size == len(part)
            region.write(part)

    second = Explorer(program, Room(), chains=True)
    second.restore(saved.header(), read)
    assert 0 < second.graph.expanded < len(whole.graph)
    second.explore(None)

    def graph(explorer: Explorer) -> list[object]:
        g = explorer.graph
        return [(g.key(n), [(t, g.shown(x)) for t, x in g.arcs(n)]) for n in range(len(g))]

    assert graph(second) == graph(whole)
    assert numbers(second) == numbers(whole)


# ---------------------------------------------------------------- the engine


def found_nothing(self: Search, names: object, faults: object, most: int) -> None:
    """What a limit does to the search for a trace without chains."""


@pytest.mark.slow
@settings(FAST, max_examples=examples(25))
@given(problems(), st.booleans())
def test_walks_along_chains_are_traces_themselves(problem: Problem, by_python: bool) -> None:
    """Each trace is confirmed by the executor and by an evaluation of its letters before the engine gives it."""
    arrangement, lines = problem
    off = verify(
        arrangement, lines, Options(LIMITS, own=(ExplicitOptions(cone="off", compression="off"),)), engine="explicit"
    )
    if not off.complete:
        return
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Search, "find", found_nothing)
        if by_python:
            patch.setattr(search, "MAX_SETS", -1)
        on = verify(
            arrangement, lines, Options(LIMITS, own=(ExplicitOptions(cone="off", compression="on"),)), engine="explicit"
        )
    assert [p.verdict for p in on.properties] == [p.verdict for p in off.properties]
    assert [f.site for f in on.faults.findings] == [f.site for f in off.faults.findings]
    for p, shortest in zip(on.properties, off.properties, strict=True):
        assert (p.trace is None) == (shortest.trace is None)
        if p.trace is not None and shortest.trace is not None and p.trace.loop is None and shortest.trace.loop is None:
            assert len(p.trace.steps) >= len(shortest.trace.steps)


Check = Callable[..., Result]


def checked(text: str, property_text: str, limits: Limits | None = None, **own: Any) -> Result:
    """`own`: what the engine is told."""
    properties_of = parse_properties([Source("test.ltl", property_text)])
    options = Options(limits or Limits(), own=(ExplicitOptions(**own),))
    return verify(load_arrangement_text(text, "test.yaml"), properties_of, options, engine="explicit")


def test_a_bad_prefix_ends_inside_a_chain(monkeypatch: pytest.MonkeyPatch) -> None:
    off = checked(counter(5_000), "p: G n != 20", compression="off")
    monkeypatch.setattr(Search, "find", found_nothing)
    on = checked(counter(5_000), "p: G n != 20", compression="on")
    for result in (off, on):
        trace = result.properties[0].trace
        assert trace is not None
        assert trace.loop is None
        assert len(trace.steps) == 20


@pytest.mark.slow
@pytest.mark.parametrize("reads", [True, False])
def test_auto_takes_chains_where_most_configurations_have_one_step(
    monkeypatch: pytest.MonkeyPatch, reads: bool
) -> None:
    text, lines = relay(5, 2, reads=reads), "p: G (w2 == 1 -> F m3@B)"
    small = checked(text, lines, cone="off")
    assert small.exploration.stored is None
    monkeypatch.setattr(explicit, "REDUCE_FROM", 8)
    large = checked(text, lines, cone="off")
    assert large.exploration.stored is not None
    assert answers(large) == answers(small)
    assert checked(text, lines, compression="off").exploration.stored is None


def test_auto_does_not_where_few_have() -> None:
    everyone_reads = (
        "name: eyes\nwhiteboard: {a: {type: bool, role: input}, b: {type: bool, role: input}}\nmachines:\n"
        + "".join(
            f"  {m}:\n    inline:\n      machine: M{m}\n      states:\n"
            f"        - {{name: S, transitions: [{{when: {m}, to: T}}]}}\n"
            f"        - {{name: T, transitions: [{{when: not {m}, to: S}}]}}\n".replace(
                f"when: {m}", f"when: {i}"
            ).replace(f"not {m}", f"not {i}")
            for m, i in (("x", "a"), ("y", "b"))
        )
        + "schedule: [x, y]\n"
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(explicit, "REDUCE_FROM", 2)
        assert checked(everyone_reads, "p: G (x@S -> F y@S)").exploration.stored is None


@pytest.mark.slow
def test_with_the_cone_of_influence() -> None:
    text, lines = relay(5, 2, reads=True), "p: G (w2 == 1 -> F m2@B)"
    cone = checked(text, lines, cone="on", compression="off")
    both = checked(text, lines, cone="on", compression="on")
    assert cone.exploration.left_out
    assert both.exploration.left_out == cone.exploration.left_out
    assert answers(both) == answers(cone)
    assert both.exploration.stored is not None
    assert both.exploration.stored < both.exploration.states


def test_whole_cycles_are_searched_without_chains() -> None:
    text = relay(3, 2, reads=True) + "observe: cycle\n"
    on = checked(text, "p: G w2 == 0", compression="on")
    assert on.exploration.stored is None
    assert answers(on) == answers(checked(text, "p: G w2 == 0", compression="off"))


def test_reports_say_how_many_are_stored() -> None:
    text = relay(4, 2, reads=True)
    on, off = (checked(text, "p: G (w2 == 1 -> F m3@B)", compression=when) for when in ("on", "off"))
    assert (off.exploration.stored, off.exploration.counted) == (None, True)
    assert on.exploration.stored is not None
    assert on.exploration.stored < on.exploration.states == off.exploration.states
    assert result_object(on)["stored"] == on.exploration.stored
    seen = on.exploration
    found = f"{seen.states:,} configurations ({seen.stored:,} stored), {seen.transitions:,} tr"
    assert summary_text(on).startswith(found)
    assert "stored" not in summary_text(off)


def test_a_limit_while_counting_changes_no_verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*_: object) -> None:
        raise LimitReached("the time limit of 1 s was reached")

    monkeypatch.setattr(chains_module.Chains, "count", stopped)
    result = checked(relay(4, 2, reads=True), "p: G w2 != 5", compression="on")
    assert result.properties[0].verdict is Verdict.HOLDS
    assert not result.exploration.counted
    assert result.exploration.states == result.exploration.stored
    assert summary_text(result).startswith(f"at least {result.exploration.states:,} configurations")


def test_ctrl_c_while_counting_keeps_the_verdicts(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(chains_module.Chains, "count", interrupted)
    result = checked(relay(4, 2, reads=True), "p: G w2 != 5", compression="on")
    assert result.properties[0].verdict is Verdict.HOLDS
    assert result.exit_code == 130
    assert not result.exploration.counted


@pytest.mark.slow
def test_a_search_by_chains_in_pieces(tmp_path: Path) -> None:
    arrangement = load_arrangement_text(relay(5, 3, reads=True), "test.yaml")
    lines = parse_properties([Source("test.ltl", "a: G w2 != 5\nb: G (w2 == 1 -> F m3@B)\nc: G F m3@B")])
    whole = verify(arrangement, lines, Options(own=(ExplicitOptions(compression="on"),)), engine="explicit")
    for most in range(300, 100_000, 300):
        saved = Checkpointing(tmp_path / "relay.checkpoint", 1e9, resume=True)
        result = verify(
            arrangement,
            lines,
            Options(Limits(max_states=most), own=(ExplicitOptions(compression="on", checkpoint=saved),)),
            engine="explicit",
        )
        if result.complete:
            break
    assert most > 600
    # Its traces are those of a search without chains that the limit lets come so far.
    assert [p.verdict for p in result.properties] == [p.verdict for p in whole.properties]
    assert (result.exploration.states, result.exploration.transitions, result.exploration.stored) == (
        whole.exploration.states,
        whole.exploration.transitions,
        whole.exploration.stored,
    )


def test_limits_end_a_search_by_chains() -> None:
    result = checked(relay(7, 3, reads=True), "p: G w2 != 5", compression="on", limits=Limits(max_states=200))
    assert not result.complete
    assert not result.exploration.counted
    assert result.properties[0].verdict is Verdict.UNKNOWN
    assert result.properties[0].reason == "the limit of 200 configurations was reached"
