"""The switch: the only machine that writes the outputs that are routed."""

from __future__ import annotations

from collections.abc import Iterable

from llfsm_verify.guarding.editing import quoted
from llfsm_verify.guarding.wanted import Names, Wanted, as_wished


def switch_machine(names: Names, wanted: Wanted) -> str:
    """The text of its machine file. DiagnosticError: an expression is none."""
    wishes = [f"{output} = {names.wishes[output]};" for output in wanted.fallbacks]
    instead = [f"{output} = {as_wished(text, names.wishes)};" for output, text in wanted.fallbacks.items()]
    if wanted.until is None:
        states = [
            "  - name: SWITCH",
            *_action("internal", [f"if ({names.alarm}) {{", *_deeper(instead), "} else {", *_deeper(wishes), "}"]),
            "    stays: true",
        ]
    else:
        # One that is not finished yet is not begun anew by a load alone.
        again = (f"unload({monitor}); load({monitor});" for monitor in names.monitors)
        anew = [f"{names.alarm} = false;", *again]
        until = quoted(as_wished(wanted.until, names.wishes))
        states = [
            "  - name: WISHED",
            *_action("internal", wishes),
            *_action("on_exit", instead),
            f"    transitions: [{{when: {names.alarm}, to: INSTEAD}}]",
            "  - name: INSTEAD",
            *_action("internal", instead),
            *_action("on_exit", [*instead, *anew]),
            f"    transitions: [{{when: {until}, to: WISHED}}]",
        ]
    outputs = " and ".join(f"`{output}`" for output in wanted.fallbacks)
    what = f"# What is wished goes to {outputs}; where `{names.alarm}` is set, something else goes there."
    return "\n".join([what, "machine: Switch", "states:", *states]) + "\n"


def _deeper(lines: Iterable[str]) -> list[str]:
    return [f"  {line}" for line in lines]


def _action(kind: str, lines: Iterable[str]) -> list[str]:
    return [f"    {kind}: |", *(f"      {line}" for line in lines)]
