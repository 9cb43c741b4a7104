"""Hypothesis strategies for what may be asked of an arrangement: state formulas, and LTL texts over them."""

from __future__ import annotations

from hypothesis import strategies as st

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.language.types import ArrayType, BoolType, EnumType, RecordType, Type, Value


def state_formulas(arrangement: Arrangement) -> list[str]:
    """One state formula or two about everything that a property can see of `arrangement`, the simplest first."""
    found = [f"{m.name}@{s.name}" for m in arrangement.texts for s in m.states]
    for w in arrangement.whiteboard:
        found += _about(w.variable.name, w.variable.type, w.variable.init)
        found.append(f"changed({w.variable.name})")
    found.append("cycle")
    for m in arrangement.machines:
        if m.suspend is None:
            found.append(f"{m.name}@__suspend")
        found += [f"{m.name}.{word}" for word in ("ran", "suspended", "finished", "loaded")]
        found += [f"{m.name}.entered({s.name})" for s in m.states[:1]]
        found += [f"{m.name}@{{{', '.join(s.name for s in m.states[:2])}}}", f"rose({m.name}@{m.states[-1].name})"]
        for w in (w for w in arrangement.whiteboard if w.role == "input"):
            found.append(f"{m.name}.read({w.variable.name})")
            found += _about(w.variable.name, w.variable.type, w.variable.init, f"{m.name}.sampled({{}})")
        found += [f"is_running({m.name})", f"is_suspended({m.name})", f"refused({m.name})", f"faulted({m.name})"]
        found += [f"{m.name}.fired({s.name}, {i})" for s in m.states for i in range(len(s.transitions))]
    for m in arrangement.texts:
        found.append(f"{m.name}.entered")
        variables = (*m.variables, *(v for s in m.states for v in s.variables))
        found += [text for v in variables for text in _about(v.name, v.type, v.init)]
    for w in (w for w in arrangement.whiteboard if w.role == "input"):
        about = _about(w.variable.name, w.variable.type, w.variable.init, "sampled({})")
        found += [*about, *(f"fell({text})" for text in about[:1])]
    return found


def _about(name: str, kind: Type, init: Value, written: str = "{}") -> list[str]:
    """`written`: how a scalar stands in the formula."""
    if isinstance(kind, RecordType):
        assert isinstance(init, tuple)
        return [t for (f, k), v in zip(kind.fields, init, strict=True) for t in _about(f"{name}.{f}", k, v, written)]
    if isinstance(kind, ArrayType):
        assert isinstance(init, tuple)
        return [t for i in range(kind.size) for t in _about(f"{name}[{i}]", kind.element, init[i], written)]
    if isinstance(kind, BoolType):
        return [written.format(name)]
    name = written.format(name)
    if isinstance(kind, EnumType):
        assert isinstance(init, int)
        return [f"{name} == {kind.name}.{kind.values[init]}"]
    return [f"{name} == {init}", f"{name} > {init}"]


def atoms(arrangement: Arrangement) -> st.SearchStrategy[str]:
    """State formulas that name one thing of `arrangement` each."""
    return st.sampled_from(state_formulas(arrangement))


_UNARY = ("G ({})", "F ({})", "X ({})", "!({})", "G F ({})")
_BINARY = ("({}) && ({})", "({}) || ({})", "({}) -> ({})", "({}) U ({})", "({}) W ({})", "({}) R ({})", "({}) M ({})")


def properties(arrangement: Arrangement, max_leaves: int = 4) -> st.SearchStrategy[str]:
    """LTL texts over the atoms of `arrangement`, with at most `max_leaves` of them."""

    def larger(inner: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
        return st.one_of(
            st.builds(str.format, st.sampled_from(_UNARY), inner),
            st.builds(str.format, st.sampled_from(_BINARY), inner, inner),
        )

    return st.recursive(atoms(arrangement), larger, max_leaves=max_leaves)


_SHAPES = (
    "({0})*", "{0} {1}", "({0} {1})*", "{0} | {1}", "({0} {1}* {2})+", "true* {0} {1}?", "({0} | {1} {2})*",
    "{0}{{2,3}}", "{0}", "{0}+ {1}", "({0} {1} {0})* {2}",
)  # fmt: skip
_LETTERS = ("[{}]", "[!({})]", "[{} && {}]", "[{} || !({})]")


@st.composite
def regular_properties(draw: st.DrawFn, arrangement: Arrangement) -> tuple[str, str]:
    """A kind (`enforce`, `forbid`, `forbid initially`) and a regular expression over atoms of `arrangement`."""
    chosen = draw(st.lists(atoms(arrangement), min_size=1, max_size=3, unique=True))
    letter = st.builds(str.format, st.sampled_from(_LETTERS), st.sampled_from(chosen), st.sampled_from(chosen))
    kind = draw(st.sampled_from(("enforce", "forbid", "forbid initially")))
    return kind, draw(st.sampled_from(_SHAPES)).format(draw(letter), draw(letter), draw(letter))
