"""`llfsm property`: questions about formulas over free atoms, without an arrangement."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TypeVar

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge
from llfsm_verify.automata.boolean import Guards
from llfsm_verify.automata.files import AUTOMATA, HOA
from llfsm_verify.cli.drawing_format import drawing_format
from llfsm_verify.cli.formulas import Line, Results, lines_of, source_of
from llfsm_verify.cli.io.files import ready_beside, write_whole
from llfsm_verify.cli.io.output import Output
from llfsm_verify.cli.opening import COMMAND_LINE, limits_of
from llfsm_verify.cli.parser import UsageError
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment, Source
from llfsm_verify.limits import Budget, LimitReached
from llfsm_verify.logic import codes
from llfsm_verify.logic.formula import to_text
from llfsm_verify.logic.reading import read_source
from llfsm_verify.report.drawing import UNWRITABLE
from llfsm_verify.report.drawing.formats import DRAWINGS
from llfsm_verify.report.drawing.graph import Edge, Graph, Node, shorten, summarise

BAD_INPUT, FALSE, UNKNOWN = 3, 1, 4

Question = Callable[[Line, Namespace, Results], None]
T = TypeVar("T")
LABEL_WIDTH = 80


def run(options: Namespace) -> int:
    """Answers line by line. Returns 3 when a line is wrong, else 1 when an equivalence or implication is false, else 4
    when an answer is not known, else 0; raises DiagnosticError when a file cannot be read."""
    question, columns = QUESTIONS[options.question]
    if len(options.input) not in (1, columns):
        raise UsageError(f"`{options.question}` takes one argument" + (f", or {columns}" if columns > 1 else ""))
    if options.question == "draw":
        return _draw_all(options)
    results = Results(Output().plain)
    with _budget(options):
        for line in _lines(options, columns):
            _ask(question, columns, line, options, results)
    results.flush()
    return _code(results)


def _budget(options: Namespace) -> Budget:
    """What `--timeout` allows, from now on."""
    return Budget(limits_of(options))


def _code(results: Results) -> int:
    return BAD_INPUT if results.wrong else FALSE if results.denied else UNKNOWN if results.unknown else 0


def _ask(question: Question, columns: int, line: Line, options: Namespace, results: Results) -> None:
    """Put the question to one line; what goes wrong there is said, and the rest still runs."""
    try:
        if len(line.columns) < columns:
            whole = line.columns[0]
            raise DiagnosticError(
                Diagnostic(codes.FOREIGN, f"a line holds {_contents(options)}", whole.span(0, len(whole.text)))
            )
        for extra in line.columns[columns:]:
            if extra.text.strip():
                message = f"a line holds {_contents(options)}, and here another tab follows"
                span = extra.span(0, len(extra.text))
                raise DiagnosticError(Diagnostic(codes.FOREIGN, message, span, hint="write blanks inside a formula"))
        question(line, options, results)
    except DiagnosticError as error:
        results.refuse(_with_place(error, line))
    except (AutomatonTooLarge, LimitReached, MemoryError) as limit:
        results.give_up(
            line,
            str(limit) or "the memory ran out",
            "unknown",
            *([line.text()] if options.question == "classify" else []),
        )


def _contents(options: Namespace) -> str:
    """What a line holds for the question."""
    if options.question == "accepts":
        return "a formula, a tab and a word"
    return "one formula" if QUESTIONS[options.question][1] == 1 else "two formulas, with a tab between"


def _with_place(error: DiagnosticError, line: Line) -> DiagnosticError:
    """What a printer has to say has no place of its own: it is about the line."""
    whole = line.columns[0]
    span = whole.span(0, len(whole.text))
    return DiagnosticError(
        d if d.span is not None or d.file is not None else Diagnostic(d.code, d.message, span, d.notes, d.hint)
        for d in error.diagnostics
    )


def _lines(options: Namespace, columns: int) -> Iterator[Line]:
    arguments: list[str] = options.input
    if columns > 1 and len(arguments) == columns:
        parts = [Source(COMMAND_LINE, text) for text in arguments]
        yield Line(tuple(Fragment.whole(part) for part in parts), options.syntax)
        return
    source = source_of(arguments[0])
    lines = lines_of(source, options.syntax)
    if source.name == COMMAND_LINE:
        first = next(lines, None)
        if first is None:
            raise DiagnosticError(Diagnostic(codes.EMPTY, "there is no formula", Fragment.whole(source).span(0, 0)))
        yield first
    yield from lines


# ---------------------------------------------------------------- the questions


def _classify(line: Line, _: Namespace, results: Results) -> None:
    letter = _told(line, lambda: results.answers.class_of(line.formula()))
    if letter is None:
        results.give_up(line, "its automata are too large", "unknown", line.text())
    else:
        results.add(letter.value, line.text())


def _translate(line: Line, options: Namespace, results: Results) -> None:
    from llfsm_verify.automata.omega.products import is_deterministic, transitions

    automaton = _told(line, lambda: results.answers.automaton(line.formula(), buchi=options.buchi))
    if options.stats:
        states, edges = max(1, len(automaton.edges)), transitions(automaton)
        sets = automaton.acceptance_sets
        results.add(str(states), str(edges), str(sets), "true" if is_deterministic(automaton) else "false")
    else:
        results.add(AUTOMATA.load(HOA).write(automaton, line.text()).rstrip("\n"))


def _accepts(line: Line, _: Namespace, results: Results) -> None:
    from llfsm_verify.logic.formula import TIMED, operators
    from llfsm_verify.logic.lasso import evaluate
    from llfsm_verify.logic.regular import ExpressionTooLarge
    from llfsm_verify.logic.wordtext import parse_word

    formula = line.formula()
    if operators(formula) & TIMED:
        raise _untranslated(line, "a word of letters tells no time")
    stem, loop = parse_word(line.columns[1])
    try:
        results.add("true" if evaluate(formula, stem, loop) else "false")
    except ExpressionTooLarge as limit:
        results.give_up(line, str(limit), "unknown")


def _equivalent(line: Line, _: Namespace, results: Results) -> None:
    _compare(line, results, both=True)


def _implies(line: Line, _: Namespace, results: Results) -> None:
    _compare(line, results, both=False)


def _compare(line: Line, results: Results, *, both: bool) -> None:
    """`true`, or `false` with a word of one formula (the left one, when it implies) of which the other is false."""
    from llfsm_verify.logic.wordtext import write_word

    left, right = line.formula(0), line.formula(1)
    for one, other in ((left, right), (right, left)) if both else ((left, right),):
        word = _told(line, partial(results.answers.difference, one, other))
        if word is not None:
            results.denied = True
            results.add("false", write_word(*word))
            return
    results.add("true")


def _simplify(line: Line, options: Namespace, results: Results) -> None:
    from llfsm_verify.logic.rewriting.simplify import simplify_any
    from llfsm_verify.logic.syntaxes import print_in

    results.add(print_in(options.to or line.syntax, simplify_any(line.formula())))


def _print(line: Line, options: Namespace, results: Results) -> None:
    from llfsm_verify.logic.syntaxes import print_in

    results.add(print_in(options.to or line.syntax, line.formula()))


def _draw(line: Line, options: Namespace, results: Results) -> None:
    automaton = _told(line, lambda: results.answers.automaton(line.formula(), buchi=options.buchi))
    _keep(_drawing(automaton, line.text(), options.format), options, results)


def _draw_all(options: Namespace) -> int:
    """Drawings of all lines, or of all automata of a file in the format HOA, written as a whole."""
    options.format = drawing_format(options.format, options.output)
    ready_beside(options.input, options.output, UNWRITABLE, "the drawing")
    pieces: list[str] = []
    options.pictures = []
    results = Results(pieces.append)
    with _budget(options):
        if options.input[0].endswith(".hoa"):
            _draw_file(options.input[0], options, results)
        else:
            for line in _lines(options, 1):
                _ask(_draw, 1, line, options, results)
    results.flush()
    if results.count > 1 and options.format != "dot" and options.output not in (None, "-"):
        raise UsageError(f"a file of the format {options.format} holds one drawing, and there are {results.count}")
    if pieces or options.pictures:
        drawn = options.pictures[0] if options.pictures else "".join(pieces)
        write_whole(drawn, options.output, UNWRITABLE, "the drawing")
    return _code(results)


def _draw_file(path: str, options: Namespace, results: Results) -> None:
    """Drawings of all automata of a file in the format HOA."""
    source = read_source(path)
    automata = AUTOMATA.load(HOA).read(source)
    if not automata:
        raise DiagnosticError(Diagnostic(codes.HOA_NUMBER, "this file holds no automaton", file=source.name))
    for found in automata:
        _keep(_drawing(found.automaton, found.name or Path(path).name, options.format), options, results)


def _keep(drawn: str | bytes, options: Namespace, results: Results) -> None:
    if isinstance(drawn, str):
        results.add(drawn.rstrip("\n"))
    else:
        options.pictures.append(drawn)
        results.count += 1


def _drawing(automaton: Automaton, title: str, wanted: str) -> str | bytes:
    """The automaton in one of `DRAWINGS`; a large one is summarised. DiagnosticError (E406): no library."""
    graph, _ = summarise(_graph(automaton, title))
    return DRAWINGS.load(wanted)(graph)


def _graph(automaton: Automaton, title: str) -> Graph:
    """The graph; a transition in acceptance sets 0 and 2 ends in `{0,2}`."""
    guards = Guards(automaton.atoms)
    nodes = [Node("start", "", (), "initial")]
    nodes += [Node(f"s{q}", str(q), (), "state") for q in range(len(automaton.edges))]
    edges = [Edge("start", "s0", "", "start")] if automaton.edges else []
    for q, row in enumerate(automaton.edges):
        labels: dict[tuple[int, int], list[str]] = {}
        for e in row:
            text = to_text(guards.formula(guards.cube(e.positive, e.negative)))
            labels.setdefault((e.target, e.acceptance), []).append(text)
        for (target, acceptance), cubes in labels.items():
            sets = ",".join(str(k) for k in range(automaton.acceptance_sets) if acceptance >> k & 1)
            label = shorten(" || ".join(cubes), LABEL_WIDTH) + (f" {{{sets}}}" if sets else "")
            edges.append(Edge(f"s{q}", f"s{target}", label, "transition"))
    return Graph(shorten(title, LABEL_WIDTH), tuple(nodes), tuple(edges), "machine")


def _example(line: Line, _: Namespace, results: Results) -> None:
    """An accepted and a rejected word; nothing in the place of one that there is not."""
    from llfsm_verify.logic.wordtext import write_word

    formula = line.formula()
    words = (_told(line, partial(results.answers.word, formula, negate=n)) for n in (False, True))
    results.add(*("" if word is None else write_word(*word) for word in words))


def _told(line: Line, ask: Callable[[], T]) -> T:
    """The answer to a question about automata; DiagnosticError (E335): there are bounds in time."""
    from llfsm_verify.automata.ltl.translation import Untranslatable

    try:
        return ask()
    except Untranslatable as reason:
        raise _untranslated(line, str(reason)) from None


def _untranslated(line: Line, message: str) -> DiagnosticError:
    whole = line.columns[0]
    return DiagnosticError(Diagnostic(codes.UNTRANSLATED, message, whole.span(0, len(whole.text))))


QUESTIONS: dict[str, tuple[Question, int]] = {
    "classify": (_classify, 1),
    "translate": (_translate, 1),
    "accepts": (_accepts, 2),
    "equivalent": (_equivalent, 2),
    "implies": (_implies, 2),
    "simplify": (_simplify, 1),
    "print": (_print, 1),
    "draw": (_draw, 1),
    "example": (_example, 1),
}
"""What can be asked, and how many columns a line has for it."""
