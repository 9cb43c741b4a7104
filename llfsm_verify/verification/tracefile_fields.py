"""The fields of a trace file."""

from __future__ import annotations

from typing import get_args

from llfsm_verify.checking.verdict import GoalKind
from llfsm_verify.yaml.tables import ByName, Field, Schema, Several, Single, Table, Words, schema_of

EXPECTED = ("violated", "holds")
KINDS: tuple[GoalKind, ...] = get_args(GoalKind)
_WORD = Single(("string", "integer", "boolean"))
_WORDS = ByName(_WORD, least=0)
_POSITIVE = Single(("integer",), least=1)

GOAL = Table(
    "what the run violates; not together with `fault`",
    (
        Field("name", "the property's name", _WORD, required=True),
        Field("kind", "how the text is to be read", Words(KINDS), required=True),
        Field(
            "text",
            "the formula, the regular expression, or the automaton's file, relative to the trace file",
            _WORD,
            required=True,
        ),
    ),
)
FAULT = Table(
    "the fault that the run ends in; not together with `property`",
    (
        Field("code", "the fault's stable code", _WORD, required=True),
        Field("message", "what went wrong", _WORD, required=True),
    ),
)
STEP = Table(
    "one ringlet",
    (
        Field("step", "its number; for the reader", _POSITIVE),
        Field("process", "the process that takes the step", _WORD),
        Field("ended", "the arrangement has ended and its last configuration repeats", Words(("true",), texts=False)),
        Field("machine", "the machine whose ringlet it was; for the reader", _WORD),
        Field("state", "the state in which the ringlet was spent; for the reader", _WORD),
        Field("fired", "the transition that fired; for the reader", _WORD),
        Field("choices", "what the step read that nothing determines, by name: inputs, ages", _WORDS),
        Field("changes", "what the step changed; for the reader", _WORDS),
    ),
    one=("process", "ended"),
)
TRACE = Table(
    "a file `NAME.trace.yaml`: a run that `llfsm replay` takes again",
    (
        Field("trace", "the version of this format", Words(("1",), texts=False), required=True),
        Field(
            "arrangement",
            "the arrangement's path, relative to this file; `<stdin>` when it had none",
            Single(("string",)),
            required=True,
        ),
        Field(
            "digest",
            "SHA-256 of the arrangement's and its machines' files, in hexadecimal digits",
            Single(("string", "integer")),
            required=True,
        ),
        Field("profile", "the profile in which the run was found, each choice by its name", _WORDS),
        Field("property", GOAL.about, GOAL),
        Field("fault", FAULT.about, FAULT),
        Field("assumptions", "name and formula of each assumption", _WORDS),
        Field("syntaxes", "the syntax of formulas that are in another tool's, by the names of their lines", _WORDS),
        Field(
            "expect",
            "what `llfsm replay` is to find: that the failure still happens, or that it does not any more",
            Words(EXPECTED),
            required=True,
        ),
        Field("initial", "the first configuration; for the reader", _WORDS),
        Field(
            "free",
            "the values, as numbers, of inputs that never change and have no `init`",
            ByName(Single(("integer",)), least=0),
        ),
        Field(
            "loop",
            "the number of the step from which on the steps repeat forever; without it the run is finite",
            _POSITIVE,
        ),
        Field("steps", "the steps in order", Several(STEP, least=0, different=False), required=True),
    ),
    one=("property", "fault"),
)


def schema(name: str) -> Schema:
    """The JSON Schema of a trace file."""
    return schema_of(name, "Trace of llfsm verify", TRACE)
