"""The whiteboard section: typed variables with their roles and how often the environment may change them."""

from __future__ import annotations

from typing import Literal, cast

from llfsm_verify.arrangement.fields import Report
from llfsm_verify.arrangement.initial import read_value
from llfsm_verify.arrangement.model import Suppression, WhiteboardVariable
from llfsm_verify.arrangement.nodes import Node
from llfsm_verify.arrangement.suppressions import KEY, read_suppressions
from llfsm_verify.arrangement.type_table import TypeTable
from llfsm_verify.language.scope import STEP_WORDS, Scope
from llfsm_verify.language.typed import Variable
from llfsm_verify.language.types import default_value, has_int

WHITEBOARD_KEYS = ("type", "init", "role", "changes", KEY)
ROLES = ("input", "output", "shared")
CHANGES = ("step", "cycle", "never")


def read_whiteboard(
    report: Report, node: Node | None, types: TypeTable, scope: Scope
) -> tuple[tuple[WhiteboardVariable, ...], set[str], list[Suppression]]:
    """The variables, the names of those whose declaration is wrong, and the findings of lint that they accept.

    `scope` knows the types only.
    """
    mapping = None if node is None else report.mapping(node, "`whiteboard`")
    found: list[WhiteboardVariable] = []
    broken: set[str] = set()
    suppressions: list[Suppression] = []
    for key, value in mapping.items if mapping else ():
        name = report.name(key, "the name of a variable")
        what = f"whiteboard variable `{key.text[:60]}`"
        fields = report.fields(value, what, WHITEBOARD_KEYS, ("type",))
        kind = None if fields is None else types.read(fields["type"], "the type of a variable")
        if name is None or fields is None or kind is None:
            broken.add(key.text)
            continue
        suppressions += read_suppressions(report, fields.get(KEY), value, name=key)
        if name in STEP_WORDS:
            message = f"`{name}` is a word of the property language and cannot be the name of a whiteboard variable"
            report.error("E119", message, key.span, "choose another name")
        if name in scope.enumerators:
            message = f"`{name}` is a value of the enumeration {scope.enumerators[name][0]}"
            report.error("E118", message, key.span, "choose another name")
        role = report.choice(fields.get("role"), "`role`", ROLES, "shared")
        changes = report.choice(fields.get("changes"), "`changes`", CHANGES, "step")
        if "changes" in fields and role != "input":
            report.error("E055", "only an input `changes` by itself", fields["changes"].span, "write `role: input`")
        if role == "input" and has_int(kind):
            message = f"the input `{name}` has values without end: `int` has no range"
            hint = "write the range of what is measured, such as `type: 0..1000`, or a fixed width, such as `int16`"
            report.error("E056", message, fields["type"].span, hint)
            broken.add(name)
            continue
        init = default_value(kind)
        if "init" in fields:
            given = read_value(report, fields["init"], kind, scope, f"`{name}`")
            init = given if given is not None else init
        variable = Variable(name, kind, init, "whiteboard", key.span)
        found.append(
            WhiteboardVariable(
                variable,
                cast('Literal["input", "output", "shared"]', role),
                cast('Literal["step", "cycle", "never"]', changes),
                role == "input" and changes == "never" and "init" not in fields,
            )
        )
    return tuple(found), broken, suppressions
