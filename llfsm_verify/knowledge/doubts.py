"""What is doubtful in a theory that can be read: warnings.

Oven.d:9:11: warning[W004]: `cook` is neither proved nor refuted where `doorOpen` is true: it is false then
  hint: `C1` and `C2` block each other: write `C1 > C2.` or `C2 > C1.`
Oven.d:3:8: warning[W006]: no output depends on input `hot`
  hint: write a rule with `hot` in its body, or remove the input
Oven.d:6:5: warning[W006]: no output depends on `Cook`
  hint: did you mean `cook`?
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import islice

from llfsm_verify.diagnostics import Diagnostic
from llfsm_verify.knowledge import codes
from llfsm_verify.knowledge.explaining import explained
from llfsm_verify.knowledge.tables import MAX_INPUTS, undecided
from llfsm_verify.knowledge.theory import Literal, Output, Theory, asked
from llfsm_verify.language.scope import near_names

MOST = 20
"""Warnings about what no output depends on."""


def undecided_output(theory: Theory, output: Output) -> Iterator[Diagnostic]:
    """Where the output is not either true or false: W004 and W005."""
    literal = Literal(output.atom)
    found = undecided(theory, literal)
    if found.neither is not None:
        message = f"`{literal}` is neither proved nor refuted{_where(found.neither)}: it is false then"
        hint = _way_out(theory, literal, found.neither)
        yield Diagnostic(codes.NEITHER, message, output.span, hint=hint)
    if found.both is not None:
        message = f"`{literal}` and `{literal.complement}` are both proved{_where(found.both)}: it is true then"
        hint = "write `=>` in one of the strict rules that contradict"
        yield Diagnostic(codes.BOTH, message, output.span, hint=hint)
    if not found.looked:
        message = f"`{literal}` depends on more than {MAX_INPUTS} inputs, so it is not known where it is undecided"
        yield Diagnostic(codes.NEITHER, message, output.span, hint="name some parts, as theories of their own")


def _where(valuation: Mapping[str, bool]) -> str:
    told = [f"`{name}` is {str(value).lower()}" for name, value in valuation.items()]
    return " where " * bool(told) + " and ".join([", ".join(told[:-1])] * bool(told[1:]) + told[-1:])


def _way_out(theory: Theory, literal: Literal, inputs: Mapping[str, bool]) -> str:
    """What to write where neither the literal nor its complement is proved."""
    fates = explained(theory, literal, inputs).decisions[-1].fates
    blocked = next((fate for fate in fates if fate.outcome == "blocked"), None)
    if blocked is None:
        return f"add a rule for what holds by default, such as `{{}} => {literal.complement}.`"
    pair = (blocked.rule, blocked.by[0])
    rules = [theory.rules[number] for number in pair]
    first, second = (rule.label or " ".join(rule.span.text.split())[:60] for rule in rules)
    mutual = rules[1].proves
    what = f"`{first}` and `{second}` block each other" if mutual else f"`{second}` blocks `{first}`"
    if not all(rule.label for rule in rules):
        return f"{what}: give them labels, and write which is stronger, as in `C1 > C0.`"
    ways = [] if _is_stronger(theory, pair[1], pair[0]) else [f"`{first} > {second}.`"]
    ways += [f"`{second} > {first}.`"] if mutual and not _is_stronger(theory, *pair) else []
    if not ways:
        return f"`{second}` is stronger than `{first}`, but concludes nothing: write `=>` in it for `{rules[1].head}`"
    return f"{what}: write {' or '.join(ways)}"


def _is_stronger(theory: Theory, strong: int, weak: int) -> bool:
    """Whether priorities say so, directly or through others."""
    stronger, stack = theory.stronger(), [weak]
    found = set(stack)
    while stack:
        new = set(stronger.get(stack.pop(), ())) - found
        found |= new
        stack += new
    return strong in found


def without_influence(theory: Theory) -> Iterator[Diagnostic]:
    """Inputs, and what rules conclude, for which no body and no output asks: W006, at most MOST of them."""
    wanted = asked(theory.rules, theory.outputs)
    concluded = {rule.head.atom: rule for rule in reversed(theory.rules)}
    places = {**theory.inputs, **{atom: rule.span for atom, rule in reversed(concluded.items())}}
    for atom in islice((atom for atom in places if atom not in wanted), MOST):
        if atom in theory.inputs:
            what, hint = f"input `{atom}`", f"write a rule with `{atom}` in its body, or remove the input"
        else:
            near = near_names(atom, [name for name in wanted if name not in theory.inputs])
            what, hint = f"`{atom}`", near or f"write `{atom}` in the body of a rule, or `output {{b {atom}}}.`"
        yield Diagnostic(codes.UNASKED, f"no output depends on {what}", places[atom], hint=hint)
