"""Names are resolved for one instance, types are inferred, and the typed tree says what the text means."""

from __future__ import annotations

from fractions import Fraction

import pytest

from llfsm_verify.arrangement.loader import build_arrangement, load_arrangement_text
from llfsm_verify.arrangement.model import State
from llfsm_verify.diagnostics import DiagnosticError, Fragment, Source
from llfsm_verify.language import typed
from llfsm_verify.language.atoms import PropertyScope, check_atom
from llfsm_verify.language.parser import parse_guard
from llfsm_verify.language.types import BoolType, EnumType, FixedType, IntType, RangeType
from tests.bad_input.cases import ACTION, GUARD
from tests.bad_input.property_cases import BOARD_OF_PROPERTIES


def guard(text: str) -> typed.Expression:
    return load_arrangement_text(GUARD(text)).machine("m").states[0].transitions[0].guard


def action(text: str) -> tuple[typed.Statement, ...]:
    return load_arrangement_text(ACTION(text)).machine("m").states[0].on_entry[1:]


def test_enumerators_take_the_type_of_the_other_side() -> None:
    for text in ("light == RED", "RED == light", "light == (car ? RED : GREEN)", "light == Colour.RED"):
        e = guard(text)
        assert isinstance(e, typed.Binary)
        assert isinstance(e.left.type, EnumType)
        assert e.left.type == e.right.type
        assert e.left.type.name == "Colour"


def test_a_value_of_one_enumeration_only_needs_no_other_side() -> None:
    e = guard("ON == ON")
    assert isinstance(e, typed.Binary)
    assert isinstance(e.left, typed.Literal)
    assert str(e.left.type) == "Signal"


def test_words_and_signs_mean_the_same() -> None:
    def shape(e: typed.Expression) -> object:
        if isinstance(e, typed.Binary):
            return e.op, shape(e.left), shape(e.right)
        return (e.op, shape(e.operand)) if isinstance(e, typed.Unary) else type(e)

    assert shape(guard("not car and car or not (car or car)")) == shape(guard("!car && car || !(car || car)"))


def test_parameters_are_replaced() -> None:
    e = guard("n < limit")
    assert isinstance(e, typed.Binary)
    assert e.right == typed.Literal(5, RangeType(0, 9), e.right.span)
    assert e.span.text == "n < limit"


def test_after() -> None:
    cases = {"after(3)": Fraction(3000), "after(0.25)": Fraction(250), "after_ms(limit * 2)": Fraction(10)}
    for text, bound in cases.items():
        e = guard(text)
        assert isinstance(e, typed.After)
        assert e.bound == bound
    varying = guard("after(n + 1)")
    assert isinstance(varying, typed.After)
    assert isinstance(varying.bound, typed.Binary)
    assert varying.scale == 1000


def test_machines() -> None:
    found = guard("other@IDLE")
    assert found == typed.AtState("other", 0, BoolType(), found.span)
    state = guard("self@B && m@__suspend")
    assert isinstance(state, typed.Binary)
    assert isinstance(state.left, typed.AtState)
    assert isinstance(state.right, typed.AtState)
    assert (state.left.machine, state.left.state, state.right.state) == ("m", 1, -1)
    query = guard("is_running(other)")
    assert isinstance(query, typed.Query)
    assert query.kind == "running"


def test_commands() -> None:
    found = action("suspend(other); resume(self); restart(other); suspend_all();")
    assert [(c.kind, c.machine) for c in found if isinstance(c, typed.Command)] == [
        ("suspend", "other"),
        ("resume", "m"),
        ("restart", "other"),
        ("suspend", "other"),
    ]


def test_paths() -> None:
    (store,) = action("ball.x += a[n % 4];")
    assert isinstance(store, typed.Assign)
    assert isinstance(store.target, typed.Read)
    assert store.op == "add"
    assert store.target.path == (typed.Field("x", 0),)
    assert store.target.type == FixedType(8, True)
    assert isinstance(store.value, typed.Read)
    (index,) = store.value.path
    assert isinstance(index, typed.Index)
    assert index.size == 4
    assert index.value.type == IntType()


def test_whole_records_and_arrays() -> None:
    (store,) = action("ball = ball2;")
    assert isinstance(store, typed.Assign)
    assert store.target.type == store.value.type
    assert isinstance(guard("ball == ball2 && a != a"), typed.Binary)


def test_statements() -> None:
    text = (
        "int k = 0; bool flag = n > 3; 0..15 z = 2; Colour c = RED; -5..5 w = -1;"
        " if (flag) k++; else if (c == RED) { k -= 2; } else { n = z; }"
        " for (int i = 0; i < 4; i++) { int q = i; a[i] = q % 4; }"
        " for (uint8 i = 1; i <= 3; i += 1) u = i; for (j in limit - 5..3) { int q = j; u *= q; }"
        " ; // nothing\n            /* nothing */ --n;"
    )
    found = action(text)
    kinds = [type(s).__name__ for s in found]
    assert kinds == [*["Declare"] * 5, "IfElse", "For", "For", "For", "Assign"]
    loops = [s for s in found if isinstance(s, typed.For)]
    assert [(f.first, f.last) for f in loops] == [(0, 3), (1, 3), (0, 3)]
    keys = [s.local.key for s in found if isinstance(s, typed.Declare)]
    inner = [b.local.key for f in loops for b in f.body if isinstance(b, typed.Declare)]
    assert len(set(keys + inner + [f.local.key for f in loops])) == len(keys) + len(inner) + len(loops)


def test_a_dangling_else_belongs_to_the_nearest_if() -> None:
    (outer,) = action("if (car) if (n > 3) n = 1; else n = 2;")
    assert isinstance(outer, typed.IfElse)
    assert outer.otherwise == ()
    assert isinstance(outer.then[0], typed.IfElse)
    assert outer.then[0].otherwise != ()


def test_an_empty_loop() -> None:
    (loop,) = action("for (i in 3..2) n = i;")
    assert isinstance(loop, typed.For)
    assert loop.last < loop.first


def depth(e: object) -> int:
    parts = [getattr(e, n, None) for n in ("left", "right", "operand", "condition", "then", "otherwise")]
    return 1 + max((depth(p) for p in parts if p is not None and not isinstance(p, tuple)), default=0)


@pytest.mark.slow
@pytest.mark.parametrize("operator", ["&&", "||"])
def test_long_chains_become_shallow_trees(operator: str) -> None:
    assert depth(guard(f" {operator} ".join(["car", "n > 3"] * 2500))) <= 15


@pytest.mark.slow
def test_long_sums_become_shallow_trees() -> None:
    assert depth(guard("0 < " + " - ".join(["n"] * 5000))) <= 25


def test_integer_guards_follow_c() -> None:
    states = [{"name": "A", "transitions": [{"when": "n && !go || n > 1 ? n : go", "to": "A"}]}]
    machine = {"machine": "M", "variables": {"n": {"type": "int32"}, "go": {"type": "int32"}}, "states": states}
    arrangement = build_arrangement({"machines": {"m": {"inline": machine}}, "schedule": ["m"]}, integer_guards=True)
    found = arrangement.machines[0].states[0].transitions[0].guard
    assert isinstance(found, typed.Binary)
    assert found.op == "ne"
    assert isinstance(found.type, BoolType)


# ---------------------------------------------------------------- atoms


@pytest.fixture(scope="module")
def scope() -> PropertyScope:
    return PropertyScope.of(load_arrangement_text(BOARD_OF_PROPERTIES))


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("ns@GREEN", typed.AtState),
        ("ns@__suspend", typed.AtState),
        ("5 == counter", typed.Binary),
        ("ns.n > counter * 2 - 1", typed.Binary),
        ("ns.RED.k == 0", typed.Binary),
        ("ball.x == a[2]", typed.Binary),
        ("counter / 2 % 3 == 1", typed.Binary),
        ("light == RED", typed.Binary),
        ("RED != light", typed.Binary),
        ("car", typed.Read),
        ('"car"', typed.Read),
        ("ns.ran", typed.Observe),
        ("ns.suspended", typed.Observe),
        ("ns.loaded", typed.Observe),
        ("timer.finished", typed.Observe),
        ("ns.fired(RED, 1)", typed.Observe),
        ("refused(ns)", typed.Observe),
        ("is_suspended(ns)", typed.Query),
        ("is_running(ns)", typed.Query),
        ("cycle", typed.Observe),
        ('ns."finished"', typed.Read),
        ("!car && (ns.ran || abs(ns.n) == 1)", typed.Binary),
    ],
)
def test_atoms(scope: PropertyScope, text: str, kind: type) -> None:
    found = check_atom(Fragment.whole(Source("p", text)), scope)
    assert isinstance(found, kind)
    assert found.type == BoolType()


def test_fired_names_state_and_transition(scope: PropertyScope) -> None:
    found = check_atom(Fragment.whole(Source("p", "ns.fired(RED, 1)")), scope)
    assert isinstance(found, typed.Observe)
    assert (found.kind, found.machine, found.state, found.transition) == ("fired", "ns", 0, 1)


def test_an_atom_quoted_as_a_whole_is_the_variable(scope: PropertyScope) -> None:
    name = "ns.finished"
    source = Source("p", f'G "{name}"')
    found = check_atom(Fragment(name, source, range(3, 3 + len(name) + 1)), scope)
    assert isinstance(found, typed.Read)
    bare = Fragment(name, Source("p", f"G {name}"), range(2, 2 + len(name) + 1))
    with pytest.raises(DiagnosticError, match="E147"):
        check_atom(bare, scope)


def test_states_have_spans_in_the_file() -> None:
    state: State = load_arrangement_text(GUARD("car")).machine("m").states[0]
    assert state.span.text == "A"
    assert state.transitions[0].span.line == state.transitions[0].guard.span.line - 1


def test_an_unknown_character_is_shown_where_it_stands() -> None:
    for text in ("$a", "a $", "a && $"):
        with pytest.raises(DiagnosticError) as raised:
            parse_guard(Fragment.whole(Source("g", text)))
        (found,) = raised.value.diagnostics
        assert found.span is not None and (found.code, found.span.start) == ("E102", text.index("$"))
