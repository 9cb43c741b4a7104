"""Random arrangements with random properties of every kind."""

from __future__ import annotations

from hypothesis import reject
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.testing.arrangements import arrangements
from llfsm_verify.testing.properties import properties, regular_properties


@st.composite
def problems(draw: st.DrawFn) -> tuple[Arrangement, PropertySet]:
    """Up to two machines, and one to four lines of properties."""
    arrangement = build_arrangement(draw(arrangements(max_machines=2, max_states=3)))
    texts = draw(st.lists(properties(arrangement), min_size=1, max_size=2))
    lines = [f"p{i}: {text}" for i, text in enumerate(texts)]
    if draw(st.booleans()):
        kind, text = draw(regular_properties(arrangement))
        lines.append(f"{kind} r: {text}")
    if draw(st.integers(0, 3)) == 0:
        lines.append(f"assume a: {draw(properties(arrangement))}")
    try:
        drawn = parse_properties([Source("random.ltl", "\n".join(lines))])
        goals_of(bind(arrangement, drawn))
    except DiagnosticError:  # a rule that nothing could break
        reject()
    return arrangement, drawn
