"""Words of properties by hand: what was sampled, what has been entered, what changed. Random ones: see the lockstep."""

from __future__ import annotations

from collections import Counter

import pytest
from hypothesis import HealthCheck, settings

from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.verdict import Options, Verdict
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.language.types import ArrayType, BoolType, RecordType
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.testing.arrangements import Document, arrangements
from llfsm_verify.verification.verify import verify
from tests.quick import AtLeast, examples, spread

LIMITED = Options(Limits(max_states=600))
STAY = [{"when": "false", "to": "S"}]


def two(profile: object = "llfsm", **more: object) -> dict[str, object]:
    """`one` reads `b`; `two` reads `d` in V only, and never `b`."""
    board = {
        "b": {"type": "bool", "role": "input"},
        "d": {"type": "uint16", "role": "input", "init": 7},
        "lit": {"type": "bool"},
        "n": {"type": "0..3"},
    }
    one = {"machine": "One", "states": [{"name": "S", "internal": "lit = b;", "transitions": STAY}]}
    other = {
        "machine": "Two",
        "states": [
            {"name": "W", "on_entry": "n = 0;", "transitions": [{"when": "lit", "to": "V"}]},
            {"name": "V", "on_entry": "n = 1;", "transitions": [{"when": "d < 30", "to": "W"}]},
        ],
    }
    machines = {"one": {"inline": one}, "two": {"inline": other}}
    return {"whiteboard": board, "machines": machines, "schedule": ["one", "two"], "profile": profile, **more}


def verdicts(document: dict[str, object], text: str, engine: str = "explicit") -> dict[str, str]:
    lines = parse_properties([Source("p", text)])
    result = verify(build_arrangement(document), lines, Options(), engine)
    return {p.name: p.verdict.value for p in result.properties}


def test_the_world_and_the_sample() -> None:
    text = """
missed: G (b -> F lit)
seen:   G (rose(sampled(b)) -> F lit)
same:   G (one.ran -> (sampled(b) <-> lit))
kept:   G (two.ran -> (sampled(b) <-> lit))
mine:   G (one.sampled(b) <-> sampled(b))
other:  G !two.sampled(b)
"""
    found = verdicts(two(), text)
    assert found == {
        "missed": "violated", "seen": "holds", "same": "holds", "kept": "holds", "mine": "holds", "other": "holds",
    }  # fmt: skip


def test_what_is_sampled_before_anything_is() -> None:
    text = "start: sampled(d) == 7\nstays: G (!two.read(d) && two@W -> true)\nnever: G sampled(d) == 7"
    assert verdicts(two(), text) == {"start": "holds", "stays": "holds", "never": "violated"}


def test_the_sample_of_a_state_is_taken_whatever_is_evaluated() -> None:
    text = "there: G (two.ran && Y two.entered(V) -> two.read(d))\nelsewhere: G (two.read(d) -> two.ran)"
    assert verdicts(two(), text) == {"there": "holds", "elsewhere": "holds"}
    assert verdicts(two(), "first: G !two.read(b)\nsecond: G (one.ran -> one.read(b))") == {
        "first": "holds",
        "second": "holds",
    }


@pytest.mark.parametrize("profile", [{"base": "llfsm", "snapshot": s} for s in ("none", "cycle", "after_entry")])
def test_other_snapshots(profile: object) -> None:
    text = "same: G (one.ran -> (sampled(b) <-> lit))\nmine: G (one.sampled(b) <-> sampled(b))\nnot_all: G !one.read(b)"
    assert verdicts(two(profile), text) == {"same": "holds", "mine": "holds", "not_all": "violated"}


def apart(machine: dict[str, object], snapshot: str) -> dict[str, object]:
    """`idle`, which mentions no input, takes the first turn of each cycle, and `m` the second."""
    board = {"i": {"type": "bool", "role": "input", "init": True}, "o": {"type": "bool"}}
    idle = {"machine": "Idle", "states": [{"name": "S", "stays": True}]}
    machines = {"idle": {"inline": idle}, "m": {"inline": {"machine": "M", **machine}}}
    profile = {"base": "llfsm", "snapshot": snapshot}
    return {"whiteboard": board, "machines": machines, "schedule": ["idle", "m"], "profile": profile}


@pytest.mark.parametrize("asked", ["", "\nfirst: F idle.read(i)"])
def test_with_one_sample_a_cycle_the_first_machine_takes_it_whoever_is_asked_about(asked: str) -> None:
    document = apart({"states": [{"name": "S", "internal": "unload(idle);", "stays": True}]}, "cycle")
    document["whiteboard"] = {"i": {"type": "bool", "role": "input", "changes": "never"}}
    found = verdicts(document, f"later: G (m.read(i) -> Y O m.ran)\nnever: G !m.read(i){asked}")
    assert found == {"later": "holds", "never": "violated"} | ({"first": "holds"} if asked else {})


def test_with_one_sample_a_cycle_a_machine_without_samples_has_sampled_what_is_stored() -> None:
    text = "unread: G !m.read(i)\nconstant: G m.sampled(i)\nstored: G (m.sampled(i) <-> i)\nany: G (sampled(i) <-> i)"
    found = verdicts(apart({"states": [{"name": "S", "stays": True}]}, "cycle"), text)
    assert found == {"unread": "holds", "constant": "violated", "stored": "holds", "any": "holds"}


@pytest.mark.parametrize(
    ("kind", "sampled"),
    [("on_entry", True), ("on_suspend", True), ("on_resume", True), ("internal", False), ("on_exit", False)],
)
def test_a_sample_after_the_entry_is_for_the_next_entry_into_any_state(kind: str, sampled: bool) -> None:
    """`m` mentions the input only in a state in which it never is."""
    states = [
        {"name": "S", "stays": True},
        {"name": "T", "transitions": [{"when": "false", "to": "S"}], kind: "o = i;"},
    ]
    found = verdicts(apart({"states": states}, "after_entry"), "every: G (m.ran -> m.read(i))\nunread: G !m.read(i)")
    assert found == ({"every": "holds", "unread": "violated"} if sampled else {"every": "violated", "unread": "holds"})


def test_with_a_letter_a_cycle() -> None:
    text = (
        "same: G (sampled(b) <-> lit)\nread: X G one.read(b)\nworld: G (b <-> lit)\nrise: G (rose(lit) -> changed(lit))"
    )
    found = verdicts(two(observe="cycle"), text)
    assert found == {"same": "holds", "read": "holds", "world": "holds", "rise": "holds"}


def test_entered() -> None:
    text = """
at:      G (two@V -> n == 1)
entered: G (two.entered(V) -> n == 1)
same:    G (two.entered(V) <-> two@V && two.entered)
some:    G (two@{V, W})
once:    F (two@V && !two.entered)
"""
    found = verdicts(two(), text)
    assert found == {"at": "violated", "entered": "holds", "same": "holds", "some": "holds", "once": "violated"}


def test_an_empty_entry_also_has_to_run() -> None:
    """Without the question, a state whose entry does nothing counts as entered at once."""
    states = [{"name": "A", "transitions": [{"when": "true", "to": "B"}]}, {"name": "B", "transitions": STAY[:0]}]
    document = {"machines": {"m": {"inline": {"machine": "M", "states": states}}}, "schedule": ["m"]}
    found = verdicts(document, "first: !m.entered\nthen: X (m@B && !m.entered)\nlast: X X m.entered(B)")
    assert found == {"first": "holds", "then": "holds", "last": "holds"}


def test_edges() -> None:
    text = """
zero:  !rose(true) && !changed(n) && !fell(lit)
up:    G (rose(lit) <-> lit && Y !lit)
down:  G (fell(lit) <-> !lit && Y lit)
any:   G (changed(lit) <-> rose(lit) || fell(lit))
n:     G (changed(n) -> two.ran)
whole: G (rose(two@V && lit) -> two@V && lit && !Y (two@V && lit))
twice: G !(rose(rose(lit)) && Y rose(lit))
forbid word: [rose(lit)] [!rose(lit) && !lit]
"""
    names = ("zero", "up", "down", "any", "n", "whole", "twice", "word")
    assert verdicts(two(), text) == dict.fromkeys(names, "holds")


def test_an_input_that_never_changes_has_not_changed_at_the_beginning() -> None:
    document = two()
    board = document["whiteboard"]
    assert isinstance(board, dict)
    board["fixed"] = {"type": "0..3", "role": "input", "changes": "never"}
    text = "still: G !changed(fixed)\nsum: G !(changed(fixed + n) && !two.ran)\nflag: G !rose(fixed == 2)"
    assert verdicts(document, text) == dict.fromkeys(("still", "sum", "flag"), "holds")


def test_states_with_the_names_of_operators_and_sets_of_states_as_letters() -> None:
    text = "a: G (two.entered(W) || two.entered(V) || !two.entered)\nenforce b: (two@{W, V})*\nc: G !two.fired(W, 0)"
    assert verdicts(two(), text) == {"a": "holds", "b": "holds", "c": "violated"}


def test_causes_show_what_was_sampled() -> None:
    lines = parse_properties([Source("p", "G !(one.sampled(b) && two@V)")])
    trace = verify(build_arrangement(two()), lines, Options(), "explicit").properties[0].trace
    assert trace is not None
    assert [dict(c.variables) for c in trace.steps[-1].causes if "sampled" in c.atom] == [{"one.sampled(b)": "true"}]


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["bmc", "pdr", "induction", "all"])
def test_other_engines_agree(engine: str) -> None:
    text = "at: G (two@V -> n == 1)\nentered: G (two.entered(V) -> n == 1)\nseen: G (one.ran -> (sampled(b) <-> lit))"
    expected = {"at": "violated", "entered": "holds", "seen": "holds"}
    found = verdicts(two(), text, engine)
    assert {k: v for k, v in found.items() if v != "unknown"}.items() <= expected.items()
    assert found["at"] == ("violated" if engine != "induction" else found["at"])
    assert engine == "bmc" or (found["entered"], found["seen"]) == ("holds", "holds")


def test_a_condition_over_a_sample_keeps_classes_of_values() -> None:
    arrangement = build_arrangement(two())
    program = lower(
        arrangement, bind(arrangement, parse_properties([Source("p", "G (sampled(d) < 30 -> n < 3)")])).atoms
    )
    hidden = [(v.name, v.type) for v in program.vars if v.name.startswith(("$held", "$any"))]
    assert [(name, kind.high) for name, kind in hidden] == [("$held.0", 1)]  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("atom", "code", "text"),
    [
        ("sampled(n)", "E154", "n"),
        ("sampled(b && lit)", "E330", "b && lit"),
        ("two.read(lit)", "E154", "lit"),
        ("two.entered(Q)", "E112", "Q"),
        ("two.entered(1)", "E112", "1"),
        ("rose(n)", "E120", "n"),
        ("two.seen(b)", "E113", "two.seen"),
        ("two.fired", "E117", "two.fired"),
        ("two@{W, Q}", "E112", "Q"),
        ("sampled(d)", "E120", "sampled(d)"),
        ("rose(b, lit)", "E117", "rose(b, lit)"),
    ],
)
def test_mistakes(atom: str, code: str, text: str) -> None:
    with pytest.raises(DiagnosticError) as caught:
        bind(build_arrangement(two()), parse_properties([Source("p", f"G ({atom})")]))
    (found,) = caught.value.diagnostics
    assert found.span is not None
    assert (found.code, found.span.text) == (code, text)


def test_a_definition_does_not_hide_a_variable() -> None:
    with pytest.raises(DiagnosticError) as caught:
        bind(build_arrangement(two()), parse_properties([Source("p", "define lit: b\nG lit")]))
    (found,) = caught.value.diagnostics
    message = "`lit` is a variable of the arrangement, and this gives it another meaning"
    assert (found.code, found.message) == ("E317", message)


@pytest.mark.parametrize(
    ("text", "name", "what"),
    [
        ("define one: b\nG b", "one", "a machine of the arrangement"),
        ("define cycle: b\nG b", "cycle", "a word of properties"),
        ("define rose: b\nG b", "rose", "a word of properties"),
        ("define entered: b\nG b", "entered", "a word of properties"),
        ("for n in {1, 2}: a: G (n != 3)", "n", "a variable of the arrangement"),
        ("for two in {one}: a: G two.ran", "two", "a machine of the arrangement"),
    ],
)
def test_other_names_that_mean_something(text: str, name: str, what: str) -> None:
    with pytest.raises(DiagnosticError) as caught:
        bind(build_arrangement(two()), parse_properties([Source("p", text)]))
    found = caught.value.diagnostics[0]
    assert found.span is not None
    assert (found.code, found.span.text) == ("E317", name)
    assert found.message == f"`{name}` is {what}, and this gives it another meaning"


def test_the_members_of_a_family_share_a_mistake() -> None:
    with pytest.raises(DiagnosticError) as caught:
        bind(build_arrangement(two()), parse_properties([Source("p", "for i in 0..9: a: G (m == i)")]))
    assert [d.code for d in caught.value.diagnostics] == ["E110"]


def test_an_edge_of_a_value_outside_64_bits_is_unknown() -> None:
    document = two()
    board = document["whiteboard"]
    assert isinstance(board, dict)
    board["big"] = {"type": "int", "init": "9223372036854775806"}
    for atom in ("changed(big + d)", "changed(big * big)"):
        assert verdicts(document, f"a: G !{atom}") == {"a": "unknown"}


def test_a_finished_machine_that_is_restarted_is_not_finished() -> None:
    """`finished: keep`: it keeps its turn, and the flag says what its last turn found."""
    a = {"machine": "A", "states": [{"name": "S", "transitions": [{"when": "b", "to": "E"}]}, {"name": "E"}]}
    c = {"machine": "C", "states": [
        {"name": "S", "transitions": [{"when": "a@E", "to": "T"}]},
        {"name": "T", "on_entry": "restart(a);", "transitions": [{"when": "true", "to": "S"}]},
    ]}  # fmt: skip
    document = {
        "whiteboard": {"b": {"type": "bool", "role": "input"}},
        "machines": {"a": {"inline": a}, "c": {"inline": c}},
        "schedule": ["a", "c"],
        "finished": "keep",
    }
    text = """
flag: G (a.ran && a@S && !a.fired(S, 0) -> !a.finished)
ends: G !a.finished
back: G (a.finished -> F !a.finished)
"""
    assert verdicts(document, text) == {"flag": "holds", "ends": "violated", "back": "holds"}


@pytest.mark.long
def test_world_and_sample_of_random_arrangements() -> None:
    """What is true of both in all arrangements in which a machine samples once, when its turn begins."""
    met: Counter[str] = Counter()

    def compare(document: Document) -> None:
        arrangement = build_arrangement({**document, "profile": "llfsm", "observe": "ringlet"})
        names = [m.name for m in arrangement.machines]
        kinds = {w.variable.name: w.variable.type for w in arrangement.whiteboard if w.role == "input"}
        lines = []
        for x, kind in kinds.items():
            if isinstance(kind, ArrayType | RecordType):
                continue
            same = "<->" if isinstance(kind, BoolType) else "=="
            someone = " || ".join(f"{m}.read({x})" for m in names)
            lines.append(f"G (({someone}) -> (sampled({x}) {same} {x}))")
            lines.append(f"G (changed(sampled({x})) -> {someone})")
            for m in names:
                lines.append(f"G ({m}.read({x}) -> {m}.ran && ({m}.sampled({x}) {same} {x}))")
                lines.append(f"G (changed({m}.sampled({x})) -> {m}.read({x}))")
                lines.append(f"!{m}.read({x}) W {m}.ran")
        # What no property can be true of everywhere: somebody reads, and the world changes unseen.
        lines += [f"seen_{m}_{x}: G !{m}.read({x})" for x in kinds for m in names]
        if not lines:
            return
        result = verify(arrangement, parse_properties([Source("p", "\n".join(lines))]), LIMITED, "explicit")
        for found in result.properties:
            if found.name.startswith("seen_"):
                met["read"] += found.verdict is Verdict.VIOLATED
                continue
            assert found.verdict is not Verdict.VIOLATED, found.text
            met["held"] += found.verdict is Verdict.HOLDS

    amount = settings(max_examples=examples(60), deadline=None, suppress_health_check=list(HealthCheck))
    enough = AtLeast(met, {"held": examples(60), "read": examples(60) // 6})
    spread(compare, amount, arrangements(max_machines=2, max_states=3), size=10, until=enough)


def test_inputs_of_properties_are_declared_in_the_order_of_their_names() -> None:
    """A set has another order in each process, and a program must not: what is saved would not fit it any more."""
    names = ["d", "b", "f", "a", "e", "c", "h", "g"]
    inputs = {name: {"type": "bool", "role": "input"} for name in names}
    machine = {"inline": {"machine": "M", "states": [{"name": "S", "stays": True}]}}
    document = {"observe": "cycle", "whiteboard": inputs, "machines": {"m": machine}, "schedule": ["m"]}
    lines = parse_properties([Source("test", f"p: G ({' || '.join(names)})")])
    program = bind(build_arrangement(document), lines).program()
    declared = [v.name.removesuffix(".$sampled") for v in program.vars if v.name.endswith(".$sampled")]
    assert declared == sorted(names)
