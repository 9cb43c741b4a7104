"""The whiteboard: typed variables with their roles and how often the environment may change them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import cast, get_args

from llfsm_verify.arrangement.draft import Unreadable, WhiteboardDraft
from llfsm_verify.arrangement.model import Changes, Role, Suppression, WhiteboardVariable
from llfsm_verify.arrangement.resolve.initial import read_value
from llfsm_verify.arrangement.resolve.type_table import TypeTable
from llfsm_verify.arrangement.suppressions import resolve_suppressions
from llfsm_verify.language.scope import STEP_WORDS, Scope
from llfsm_verify.language.typed import Variable
from llfsm_verify.language.types import default_value, has_int
from llfsm_verify.yaml.fields import Report


def resolve_whiteboard(
    report: Report, drafts: Iterable[WhiteboardDraft], types: TypeTable, scope: Scope
) -> tuple[tuple[WhiteboardVariable, ...], set[str], list[Suppression]]:
    """The variables, the names of those whose declaration is wrong, and the findings of lint that they accept.

    `scope` knows the types only.
    """
    found: list[WhiteboardVariable] = []
    broken: set[str] = set()
    suppressions: list[Suppression] = []
    for draft in drafts:
        name = report.name(draft.name, "the name of a variable")
        kind = None if isinstance(draft.type, Unreadable) else types.read(draft.type, "the type of a variable")
        if name is None or kind is None or isinstance(draft.type, Unreadable):
            broken.add(draft.name.text)
            continue
        suppressions += resolve_suppressions(report, draft.lint)
        if name in STEP_WORDS:
            message = f"`{name}` is a word of the property language and cannot be the name of a whiteboard variable"
            report.error("E119", message, draft.name.span, "choose another name")
        if name in scope.enumerators:
            message = f"`{name}` is a value of the enumeration {scope.enumerators[name][0]}"
            report.error("E118", message, draft.name.span, "choose another name")
        role = report.choice(draft.role, "`role`", get_args(Role), "shared")
        changes = report.choice(draft.changes, "`changes`", get_args(Changes), "step")
        if draft.changes is not None and role != "input":
            report.error("E055", "only an input `changes` by itself", draft.changes.span, "write `role: input`")
        if role == "input" and has_int(kind):
            message = f"the input `{name}` has infinitely many values: `int` has no range"
            hint = "write the range of what is measured, such as `type: 0..1000`, or a fixed width, such as `int16`"
            report.error("E056", message, draft.type.span, hint)
            broken.add(name)
            continue
        init = default_value(kind)
        if draft.init is not None:
            given = read_value(report, draft.init, kind, scope, f"`{name}`")
            init = given if given is not None else init
        safe = None
        if draft.safe is not None:
            if role == "output":
                safe = read_value(report, draft.safe, kind, scope, f"`{name}`")
            else:
                hint = "write `role: output`, or leave `safe` out"
                report.error("E057", "only an output has a `safe` value", draft.safe.span, hint)
        variable = Variable(name, kind, init, "whiteboard", draft.name.span)
        found.append(
            WhiteboardVariable(
                variable,
                cast(Role, role),
                cast(Changes, changes),
                role == "input" and changes == "never" and draft.init is None,
                safe=safe,
            )
        )
    return tuple(found), broken, suppressions
