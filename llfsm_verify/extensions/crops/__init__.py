"""State machines of CROPS: transition files as arrangements, and states in Python that run by them.

The source is a thesis on the state machine of the CROPS project (Umeå, 2012), whose names are kept in snake_case.
`StateMachine` says how a program looks; `transitions.py` says what a transition file means.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from llfsm_verify.plug import Entry

if TYPE_CHECKING:
    from llfsm_verify.extensions.crops.data import Data, DataTypeError, LeftState
    from llfsm_verify.extensions.crops.machine import StateMachine
    from llfsm_verify.extensions.crops.states import ActionClient, SimpleActionState, State

ENTRIES = {
    "llfsm_verify.codes": (Entry("crops", f"{__name__}.codes:CODES", "State machines of CROPS"),),
    "llfsm_verify.arrangements": (
        Entry(
            "crops", f"{__name__}.format:read_transition_file", "a transition file of CROPS",
            begins=r"""(?:\s|#.*|---.*|%.*)*+-\s+(?:\{\s*)?(["']?)state\1[ \t]*:""",
        ),
    ),
}  # fmt: skip
_PLACES = {
    "Data": "data", "DataTypeError": "data", "LeftState": "data", "StateMachine": "machine", "ActionClient": "states",
    "SimpleActionState": "states", "State": "states",
}  # fmt: skip
__all__ = ["ActionClient", "Data", "DataTypeError", "LeftState", "SimpleActionState", "State", "StateMachine"]


def __getattr__(name: str) -> object:
    """The classes, imported when they are first asked for: each command looks at the entries."""
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_PLACES[name]}"), name)
