"""The words of guards, actions and properties that stand for no name: what editors say of each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from llfsm_verify.plug import CALLS

ACTIONS: Final = ("on_entry", "on_exit", "internal", "on_suspend", "on_resume")
COMMANDS: Final = {
    "suspend": "suspends a machine: it stays in its suspend state until it is resumed",
    "resume": "lets a suspended machine go on in the state in which it was",
    "restart": "puts a machine into its initial state",
    "load": "loads a machine of the pool",
    "unload": "unloads a machine: it takes no turns",
    "load_suspended": "loads a machine of the pool, suspended",
    "suspend_all": "suspends all other machines",
}
QUERIES: Final = {
    "is_running": "whether a machine is loaded and not suspended",
    "is_suspended": "whether a machine is suspended",
    "done": "whether a machine that this state runs has finished",
}
FUNCTIONS: Final = {
    "abs": "the absolute value",
    "min": "the smaller of two numbers",
    "max": "the larger of two numbers",
    "floor": "the whole number at or below a decimal",
    "ceil": "the whole number at or above a decimal",
    "round": "the nearest whole number; halves away from zero",
}
OF_TEXTS: Final = {
    "after": "true when strictly more than so many seconds have passed since the first turn in the state",
    "after_ms": "true when strictly more than so many milliseconds have passed since the first turn in the state",
    "sqrt": "the square root, rounded down",
    "all_done": "whether all machines that this state runs have finished",
    "choose": "in a model: any of the values",
    "true": "the truth value",
    "false": "the truth value",
    "and": "both hold; also `&&`",
    "or": "one holds, or both; also `||`",
    "not": "it does not hold; also `!`",
}
STATEMENTS: Final = {
    "if": "`if (CONDITION) STATEMENT else STATEMENT`",
    "else": "the other branch of `if`",
    "for": "`for (i in 0..3) STATEMENT`",
}
OF_PROPERTIES: Final = {
    "refused": "whether a command or write of the machine was refused in the last step",
    "faulted": "whether a fault unloaded the machine",
    "sampled": "the value that an input had when a machine sampled it last",
    "rose": "a condition is true, and was false in the step before",
    "fell": "a condition is false, and was true in the step before",
    "changed": "a value is another one than in the step before",
    "cycle": "the last step ended a cycle",
    "true": "the truth value",
    "false": "the truth value",
}
OBSERVATIONS: Final = {
    "ran": "the last step was a ringlet of the machine",
    "entered": "the last step entered a state of the machine",
    "suspended": "the machine is suspended",
    "loaded": "the machine is loaded",
    "finished": "the machine has finished",
    "fired": "`m.fired(STATE, 0)`: the last step took this transition of the state",
    "read": "`m.read(x)`: the last step sampled the input",
}
TEMPORAL: Final = {
    "G": "`G p`: always, from here on. `G[0:5] p`: in the next 5 steps, `G[<=5s] p`: for 5 s",
    "F": "`F p`: here or later. `F[0:5] p`: within 5 steps, `F[<=5s] p`: within 5 s",
    "X": "`X p`: in the next step",
    "U": "`p U q`: q comes, and until then p holds",
    "W": "`p W q`: p holds until q comes, which may be never",
    "R": "`p R q`: q holds until and including the step in which p does, which may be never",
    "M": "`p M q`: q holds until and including a step in which p does, which comes",
    "Y": "`Y p`: p held in the step before, and there was one",
    "Z": "`Z p`: p held in the step before, or there was none",
    "O": "`O p`: p holds, or did before",
    "H": "`H p`: p holds, and always did",
    "S": "`p S q`: q was so, and since then p holds",
    "T": "`p T q`: the past form of R",
    "initially": "`initially p`: p holds in the initial configuration",
}
KINDS: Final = {
    "assume": "`assume NAME: formula`: only runs that satisfy it count",
    "enforce": "`enforce NAME: expression`: every run begins with a word of the regular expression, again and again",
    "forbid": "`forbid NAME: expression`: no part of a run is a word of the regular expression",
    "automaton": "`automaton NAME: file.hoa`: every run is accepted by the automaton",
    "define": "`define NAME: formula`: a name for a formula",
}
IN_TEXTS: Final[Mapping[str, str]] = {**COMMANDS, **QUERIES, **FUNCTIONS, **OF_TEXTS, **STATEMENTS}
IN_PROPERTIES: Final[Mapping[str, str]] = {**TEMPORAL, **QUERIES, **FUNCTIONS, **OF_PROPERTIES, **KINDS}
OF_MACHINES: Final = (*COMMANDS, *QUERIES, "refused", "faulted")
"""Functions whose argument is a machine."""


def explained(word: str, *, properties: bool) -> str | None:
    """What is said of a word; None: it is none of ours."""
    known = {**OBSERVATIONS, **IN_PROPERTIES} if properties else IN_TEXTS
    found = known.get(word)
    call = CALLS.get(word) if word not in TEMPORAL else None
    return None if found is None else f"`{call or word}`: {found}"
