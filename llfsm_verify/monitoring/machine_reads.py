"""What a monitor machine reads: its atoms as expressions of a machine, and the parameters that these need."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace

from llfsm_verify.arrangement.formats.writing import Value
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment, Span, counted
from llfsm_verify.language import syntax
from llfsm_verify.language.atoms import EDGES, OBSERVATIONS, PropertyScope, check_atom
from llfsm_verify.language.parser import parse_guard
from llfsm_verify.language.scope import RESERVED
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import Read
from llfsm_verify.language.types import ArrayType, DecimalType, RecordType, Type, decimal_text
from llfsm_verify.monitoring.codes import NOT_THERE, UNREADABLE, UNTYPED

_MACHINE = "machine"
MOST_PLACES = 3
"""Other places that a warning names."""


@dataclass(frozen=True, slots=True)
class Reads:
    """`parameters`: name and kind as a machine declares it (`machine`, `{"whiteboard": "bool"}`), in order of reading.

    `expressions`: the text by which the machine evaluates each atom. `samples`: inputs that several atoms read, which
    the machine reads once: the local variable, its type, and the text of the read.
    """

    parameters: Mapping[str, Value]
    expressions: Mapping[str, str]
    samples: tuple[tuple[str, Value, str], ...]

    @property
    def machines(self) -> tuple[str, ...]:
        """The machines that are read."""
        return tuple(name for name, kind in self.parameters.items() if kind == _MACHINE)

    @property
    def variables(self) -> tuple[str, ...]:
        """The whiteboard variables that are read."""
        return tuple(name for name, kind in self.parameters.items() if kind != _MACHINE)


def reads(atoms: Mapping[str, Fragment], arrangement: Arrangement | None) -> Reads:
    """How a machine reads `atoms`. DiagnosticError with all that it cannot read (E430), whose type is not known without
    an arrangement (E431), or that is wrong in the arrangement (as for `check_atom`)."""
    reader = _Reader(arrangement)
    for key, fragment in atoms.items():
        try:
            reader.atom(key, fragment)
        except DiagnosticError as error:
            reader.problems += error.diagnostics
    if reader.problems:
        raise DiagnosticError(reader.problems)
    return reader.result()


@dataclass(frozen=True, slots=True)
class _Edit:
    start: int
    end: int
    text: str


class _Reader:
    def __init__(self, arrangement: Arrangement | None) -> None:
        self.problems: list[Diagnostic] = []
        self._arrangement = arrangement
        self._scope = None if arrangement is None else PropertyScope.of(arrangement)
        self._inputs = (
            frozenset(w.variable.name for w in arrangement.whiteboard if w.role == "input")
            if arrangement
            else frozenset()
        )
        self._parameters: dict[str, Value] = {}
        self._atoms: dict[str, tuple[str, list[_Edit]]] = {}
        self._sampled: dict[str, list[tuple[str, _Edit]]] = {}
        """Reads of inputs by their text: the atom, and the place in it."""
        self._types: dict[str, Value] = {}

    def atom(self, key: str, fragment: Fragment) -> None:
        """Note what one atom reads."""
        root = parse_guard(fragment).root
        if self._scope is not None:
            check_atom(fragment, self._scope)
        edits: list[_Edit] = []
        for node in expressions_in(root):
            match node:
                case syntax.StateTest():
                    self._need(node.machine.text, _MACHINE, fragment)
                    edits += [_unquoted(n) for n in (node.machine, *node.states) if n.quoted]
                case syntax.Call():
                    self._call(node, fragment)
                case syntax.Path():
                    self._path(node, node is root, key, fragment, edits)
        self._atoms[key] = (fragment.text, edits)

    def _need(self, name: str, kind: Value, fragment: Fragment) -> None:
        """Make a parameter. DiagnosticError (E430): no parameter can have the name, or one of another kind has it."""
        if self._scope is not None and name in self._scope.surroundings:
            raise DiagnosticError(_not_there(UNREADABLE, name, fragment.span(0, len(fragment.text))))
        if name in RESERVED or self._parameters.get(name, kind) != kind:
            what = "a word of the language" if name in RESERVED else "both a machine and a variable"
            span = fragment.span(0, len(fragment.text))
            raise DiagnosticError(Diagnostic(UNREADABLE, f"`{name}` is {what} here", span, hint="choose another name"))
        self._parameters[name] = kind

    def _call(self, node: syntax.Call, fragment: Fragment) -> None:
        name = node.function.name.text
        if node.function.steps or name in ("refused", "faulted", "sampled", *EDGES):
            raise self._unreadable(node, fragment)
        if name in ("is_running", "is_suspended"):
            (argument,) = node.arguments
            assert isinstance(argument, syntax.Path)
            self._need(argument.name.text, _MACHINE, fragment)

    def _path(self, node: syntax.Path, whole: bool, key: str, fragment: Fragment, edits: list[_Edit]) -> None:
        name = node.name.text
        scope = self._scope
        if name == "cycle" and not node.steps:
            raise self._unreadable(node, fragment)
        step = node.steps[0] if node.steps else None
        if scope is None:
            if isinstance(step, syntax.Member) and len(node.steps) == 1 and step.name.text in OBSERVATIONS:
                self._observation(node, step.name.text, fragment, edits)
            elif step is not None or not whole:
                span = fragment.span(node.start, node.end)
                message = f"the type of `{span.text}` is not known here"
                raise DiagnosticError(Diagnostic(UNTYPED, message, span, hint="give --arrangement FILE"))
            else:
                self._need(name, {"whiteboard": "bool"}, fragment)
        elif name in scope.machines and name not in scope.whiteboard:
            if name in scope.surroundings:
                self._need(name, _MACHINE, fragment)
            assert isinstance(step, syntax.Member)
            self._observation(node, step.name.text, fragment, edits)
        elif name in scope.whiteboard:
            self._need(name, {"whiteboard": self._declared(scope.whiteboard[name].type)}, fragment)
            if name in self._inputs:
                edit = _Edit(node.start, node.end, "")
                self._sampled.setdefault(fragment.text[node.start : node.end], []).append((key, edit))
                self._note_type(node, fragment)
        elif name in scope.knowledge and self._samples_again(name):
            raise self._unreadable(node, fragment)
        if node.name.quoted:
            edits.append(_unquoted(node.name))

    def _samples_again(self, name: str) -> bool:
        """What the theory is told is read beside what the atoms read: it may be another value."""
        assert self._scope is not None
        assert self._arrangement is not None
        read = {r.variable.name for r in of_kind(self._scope.knowledge[name], Read)}
        return self._arrangement.profile.snapshot == "none" and not read.isdisjoint(self._inputs)

    def _observation(self, node: syntax.Path, what: str, fragment: Fragment, edits: list[_Edit]) -> None:
        if what != "suspended" or len(node.steps) != 1:
            raise self._unreadable(node, fragment)
        self._need(node.name.text, _MACHINE, fragment)
        edits.append(_Edit(node.start, node.end, f"is_suspended({node.name.text})"))

    def _unreadable(self, node: syntax.Node, fragment: Fragment) -> DiagnosticError:
        span = fragment.span(node.start, node.end)
        message = f"a machine cannot read `{span.text}`"
        hint = (
            "it reads whiteboard variables, `m@STATE`, `m.suspended` and `is_running(m)`; use --as table for the rest"
        )
        return DiagnosticError(Diagnostic(UNREADABLE, message, span, hint=hint))

    def _note_type(self, node: syntax.Path, fragment: Fragment) -> None:
        """The type of the scalar that a path reads."""
        assert self._scope is not None
        kind = self._scope.whiteboard[node.name.text].type
        for step in node.steps:
            if isinstance(step, syntax.Subscript):
                assert isinstance(kind, ArrayType)
                kind = kind.element
            else:
                assert isinstance(kind, RecordType)
                kind = dict(kind.fields)[step.name.text]
        if isinstance(kind, ArrayType | RecordType):
            span = fragment.span(node.start, node.end)
            message = f"a monitor machine reads an input in parts, and `{span.text}` is {kind}"
            raise DiagnosticError(Diagnostic(UNREADABLE, message, span, hint="compare its parts one by one"))
        self._types[fragment.text[node.start : node.end]] = self._declared(kind)

    def _declared(self, kind: Type) -> Value:
        assert self._arrangement is not None
        return declared_type(kind, self._arrangement)

    def result(self) -> Reads:
        """Inputs that are read more than once get a local variable, so that all atoms see one value of it."""
        samples: list[tuple[str, Value, str]] = []
        taken = set(self._parameters)
        extra: dict[str, list[_Edit]] = {}
        for text, places in self._sampled.items():
            if len(places) > 1:
                name = free_name(f"input_{len(samples)}", taken, self._arrangement)
                samples.append((name, self._types[text], text.replace('"', "")))
                for key, place in places:
                    extra.setdefault(key, []).append(_Edit(place.start, place.end, name))
        expressions = {}
        for key, (text, edits) in self._atoms.items():
            expressions[key] = _edited(text, [*extra.get(key, []), *edits])
        return Reads(dict(self._parameters), expressions, tuple(samples))


def declared_type(kind: Type, arrangement: Arrangement) -> Value:
    """A type as declarations have it."""
    for name, known in arrangement.types.items():
        if known == kind:
            return name
    if isinstance(kind, ArrayType):
        return {"array": declared_type(kind.element, arrangement), "size": str(kind.size)}
    if isinstance(kind, RecordType):
        return {"record": {name: declared_type(field, arrangement) for name, field in kind.fields}}
    if isinstance(kind, DecimalType):
        return {"decimal": decimal_text(1, kind.digits), "range": str(kind)}
    return str(kind)


def surroundings_in(atoms: Mapping[str, Fragment], arrangement: Arrangement) -> Diagnostic | None:
    """A warning (W003) where atoms speak of the model of the surroundings, which is not there at run time: one for all
    of them, at the first place."""
    called = PropertyScope.of(arrangement).surroundings
    named = [pair for fragment in atoms.values() if called and (pair := _named_in(fragment, called))]
    if not named:
        return None
    found, others = _not_there(NOT_THERE, *named[0]), [str(place) for _, place in named[1:]]
    more = f" and {counted(len(others) - MOST_PLACES, 'more place')}" if len(others) > MOST_PLACES else ""
    return replace(found, notes=(f"also at {', '.join(others[:MOST_PLACES])}{more}",) if others else ())


def _named_in(fragment: Fragment, called: tuple[str, ...]) -> tuple[str, Span] | None:
    """The first of these names that an atom speaks of, and its place."""
    for node in expressions_in(parse_guard(fragment).root):
        name = node.machine if isinstance(node, syntax.StateTest) else getattr(node, "name", None)
        if isinstance(name, syntax.Name) and name.text in called:
            return name.text, fragment.span(node.start, node.end)
    return None


def _not_there(code: str, name: str, span: Span) -> Diagnostic:
    message = f"`{name}` is the model of the surroundings, which is absent when the arrangement runs"
    return Diagnostic(code, message, span, hint="ask for the inputs that it writes")


def free_name(wanted: str, taken: set[str], arrangement: Arrangement | None) -> str:
    """`wanted`, or the first `wanted_2`, `wanted_3`, … that means nothing yet; it is added to `taken`."""
    known = set(taken)
    if arrangement is not None:
        known |= {w.variable.name for w in arrangement.whiteboard} | {m.name for m in arrangement.texts}
        known |= set(arrangement.types) | {value for e in arrangement.enumerations for value in e.values}
    name, number = wanted, 2
    while name in known:
        name, number = f"{wanted}_{number}", number + 1
    taken.add(name)
    return name


def _unquoted(name: syntax.Name) -> _Edit:
    return _Edit(name.start, name.end, name.text)


def _edited(text: str, edits: list[_Edit]) -> str:
    """The text with places replaced; of places that overlap the first given counts."""
    done: list[_Edit] = []
    for edit in edits:
        if all(edit.end <= other.start or edit.start >= other.end for other in done):
            done.append(edit)
    for edit in sorted(done, key=lambda e: -e.start):
        text = text[: edit.start] + edit.text + text[edit.end :]
    return text


def expressions_in(root: syntax.Expression | tuple[syntax.Statement, ...]) -> Iterator[syntax.Node]:
    """The nodes of a tree; names of functions, and machines that a call names, are part of the call."""
    stack: list[object] = [root]
    while stack:
        node = stack.pop()
        if isinstance(node, tuple):
            stack.extend(reversed(node))
            continue
        if not isinstance(node, syntax.Node):
            continue
        yield node
        if isinstance(node, syntax.Call):
            if node.function.name.text not in ("is_running", "is_suspended"):
                stack.append(node.arguments)
        elif is_dataclass(node):
            stack.extend(getattr(node, f.name) for f in reversed(fields(node)))
