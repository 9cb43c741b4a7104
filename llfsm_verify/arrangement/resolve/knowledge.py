"""What theories of plausible logic say: each entry of `knowledge` becomes a condition, in which all is defined once.

    knowledge:
      cook: {file: MicrowaveCook.d, inputs: {timeLeft: time_left > 0, doorOpen: door}}

`cook` is then a condition in guards, actions and properties. An entry has the definitions of the entries that its
inputs ask for, in the order of the file, its inputs, the proofs of its theory, and its answer, so that a chain of
theories stays linear. The inputs on which the output depends, through the bodies of rules, are evaluated wherever the
entry is asked for: all of them, each once, in the order of the theory. Messages:

    a.yaml:5:45: error[E166]: theory `MicrowaveCook` has no input `doorOpn`
      hint: did you mean `doorOpen`?
    a.yaml:5:3: error[E167]: input `timeLeft` of theory `MicrowaveCook` is told nothing, and no variable is called so
      hint: write `inputs: {timeLeft: …}` with a condition
    a.yaml:5:60: error[E168]: what a theory is told cannot ask for the time
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from llfsm_verify.arrangement.draft import KnowledgeDraft, Unreadable
from llfsm_verify.diagnostics import DiagnosticError, Fragment, Span
from llfsm_verify.knowledge.compiled import compiled
from llfsm_verify.knowledge.doubts import undecided_output, without_influence
from llfsm_verify.knowledge.reading import read_theory
from llfsm_verify.knowledge.theory import Literal, Output, Theory
from llfsm_verify.language import syntax, typed
from llfsm_verify.language.expressions import BOOL, ExpressionChecker, a_type
from llfsm_verify.language.parser import parse_guard
from llfsm_verify.language.scope import CHOOSE, Scope, did_you_mean
from llfsm_verify.language.types import BoolType
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import mark, written


@dataclass(frozen=True, slots=True)
class KnowledgeText:
    """An entry, its theory read and its inputs parsed."""

    name: str
    theory: Theory
    output: Output
    inputs: Mapping[str, syntax.ParsedExpression]
    """Those that are told something."""
    span: Span

    @property
    def words(self) -> Iterator[str]:
        """The texts that it reads."""
        yield from (parsed.fragment.text for parsed in self.inputs.values())
        yield from (name for name in self.theory.inputs if name not in self.inputs)


def parse_knowledge(report: Report, drafts: Iterable[KnowledgeDraft]) -> tuple[tuple[KnowledgeText, ...], set[str]]:
    """The entries, and the names of those that are wrong."""
    drafts = tuple(drafts)
    report.distinct(draft.name for draft in drafts)
    theories: dict[int, Theory | None] = {}
    found: list[KnowledgeText] = []
    broken: set[str] = set()
    for draft in drafts:
        name = report.name(draft.name, "the name of what a theory says")
        theory = None
        if not isinstance(draft.theory, Unreadable):
            if id(draft.theory) not in theories:
                try:
                    theories[id(draft.theory)] = theory = read_theory(draft.theory)
                    report.diagnostics += without_influence(theory)
                except DiagnosticError as e:
                    theories[id(draft.theory)] = None
                    report.add(e)
            theory = theories[id(draft.theory)]
        text = None if name is None or theory is None else _text(report, draft, name, theory)
        if text is None:
            broken.add(draft.name.text)
        else:
            report.diagnostics += undecided_output(text.theory, text.output)
            found.append(text)
    return tuple(found), broken


def _text(report: Report, draft: KnowledgeDraft, name: str, theory: Theory) -> KnowledgeText | None:
    output = _output(report, draft, name, theory)
    inputs: dict[str, syntax.ParsedExpression] = {}
    fine = output is not None
    report.distinct(key for key, _ in draft.inputs)
    for key, node in draft.inputs:
        if key.text not in theory.inputs:
            message = f"theory `{theory.name}` has no input `{key.text[:60]}`"
            report.error("E166", message, mark(key), did_you_mean(key.text, theory.inputs) or "it has no inputs")
            fine = False
            continue
        parsed = report.guard(node, key.text)
        fine = fine and parsed is not None
        if parsed is not None:
            inputs[key.text] = parsed
    return KnowledgeText(name, theory, output, inputs, draft.name.span) if fine and output is not None else None


def _output(report: Report, draft: KnowledgeDraft, name: str, theory: Theory) -> Output | None:
    names = [output.text for output in theory.outputs]
    if draft.output is not None:
        asked = report.scalar(draft.output, "`output`")
        found = None if asked is None else theory.output(asked.text)
        if asked is not None and found is None:
            message = f"theory `{theory.name}` has no output `{asked.text[:60]}`"
            report.error("E166", message, mark(asked), did_you_mean(asked.text, names))
        return found
    found = theory.output(name) or theory.output()
    if found is None:
        message = f"theory `{theory.name}` has {len(names)} outputs, and none of them is called `{name}`"
        report.error("E166", message, draft.name.span, f"write `output: {names[0]}`, for example")
    return found


def check_knowledge(
    report: Report,
    texts: Iterable[KnowledgeText],
    scope: Scope,
    broken: Collection[str],
    taken: Callable[[str, Span], bool],
) -> tuple[dict[str, typed.LetIn], set[str]]:
    """What the entries stand for in this scope, and the names of those that are wrong.

    `broken` are names whose declaration is wrong. `taken` says whether a name would hide something, and reports that.
    """
    known: dict[str, typed.LetIn] = {}
    wrong: set[str] = set()
    for text in texts:
        checker = _EntryChecker(report, text, replace(scope, knowledge={**scope.knowledge, **known}))
        entry = None if taken(text.name, text.span) else checker.entry({*broken, *wrong})
        if entry is None:
            wrong.add(text.name)
        else:
            known[text.name] = entry
    return known, wrong


class _EntryChecker:
    """Makes the condition of one entry."""

    def __init__(self, report: Report, text: KnowledgeText, scope: Scope) -> None:
        self.report, self.text, self.scope = report, text, scope
        self.used: dict[typed.Local, typed.Expression] = {}
        """The definitions of the entries that inputs ask for."""

    def entry(self, broken: Collection[str]) -> typed.LetIn | None:
        text, theory = self.text, self.text.theory
        proof = compiled(theory, Literal(text.output.atom), prefix=f"{text.name}.")
        atoms = theory.atoms(text.output.atom)
        needed = {literal.atom for rule in theory.rules if rule.head.atom in atoms for literal in rule.body}
        inputs: list[tuple[typed.Local, typed.Expression]] = []
        fine = True
        for name in (n for n in theory.inputs if n in needed or n in text.inputs):
            told, used = self._input(name, broken)
            fine = fine and told is not None
            if told is not None and name in needed:
                self.used |= dict(definition for entry in used for definition in entry.definitions)
                inputs.append((typed.Local(f"{text.name}.{name}", BOOL), told))
        if not fine:
            return None
        answer, order = typed.Local(text.name, BOOL), {name: n for n, name in enumerate(self.scope.knowledge)}
        first = sorted(self.used.items(), key=lambda known: order[known[0].key.partition(".")[0]])
        definitions = (*first, *inputs, *proof.definitions, (answer, proof.value))
        return typed.LetIn(definitions, typed.ReadLocal(answer, BOOL, text.span), BOOL, text.span)

    def _input(self, name: str, broken: Collection[str]) -> tuple[typed.Expression | None, Sequence[typed.LetIn]]:
        """What an input is told, and the entries that it asks for."""
        text, scope = self.text, self.scope
        parsed = text.inputs.get(name)
        if parsed is None:
            own = scope.variables.get(name) or scope.constants.get(name) or scope.knowledge.get(name)
            if own is None or not isinstance(own.type, BoolType):
                why = "no variable is called so" if own is None else f"the variable of its name is {a_type(own.type)}"
                message = f"input `{name}` of theory `{text.theory.name}` is told nothing, and {why}"
                if own is not None or name not in broken:
                    hint = f"write `inputs: {{{name}: …}}` with a condition"
                    self.report.error("E167", message, text.span, hint)
                return None, ()
            place = text.theory.inputs[name]
            parsed = parse_guard(written(place.source, place.start, place.end).fragment)
        checker = _InputChecker(scope, parsed.fragment)
        try:
            return checker.boolean(parsed.root), checker.used
        except DiagnosticError as e:
            self.report.keep(e.diagnostics, broken)
            return None, ()


class _InputChecker(ExpressionChecker):
    """Checks what an input is told: the answers of other entries are locals, and nothing asks for the time."""

    def __init__(self, scope: Scope, fragment: Fragment) -> None:
        super().__init__(scope, fragment)
        self.used: list[typed.LetIn] = []

    def known(
        self, entry: typed.LetIn, node: syntax.Path, steps: tuple[syntax.Member | syntax.Subscript, ...]
    ) -> typed.Expression:
        asked = super().known(entry, node, steps)
        self.used.append(entry)
        return replace(entry.value, span=asked.span)

    def call(self, node: syntax.Call) -> typed.Expression:
        name = node.function.name.text
        if name in ("after", "after_ms", CHOOSE):
            what = "choose" if name == CHOOSE else "ask for the time"
            hint = "let the machine keep it in a variable, and give the theory that"
            raise self.fail("E168", f"what a theory is told cannot {what}", node, hint)
        return super().call(node)
