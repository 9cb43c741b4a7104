"""The kind `prolog`: what its file says, looked at before SWI-Prolog is started."""

from __future__ import annotations

import difflib
import os
import re
import shutil
import sys
from collections.abc import Iterator, Mapping
from fractions import Fraction
from pathlib import Path

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.prolog.codes import NO_PROLOG, NO_TERM
from llfsm_verify.extensions.prolog.terms import OPEN, VALUE, NoTerm, Term, term
from llfsm_verify.plug import (
    CHILD_FIELDS,
    WRONG_PORT,
    Field,
    Json,
    Link,
    MappingNode,
    Node,
    Port,
    PortKind,
    ProcessSettings,
    Report,
    Scalar,
    Sequence,
    Single,
    Source,
    Span,
    Started,
    Table,
    Unopened,
    mark,
    patience_of,
)

LIMIT = 100
"""Milliseconds of a query."""
INSTALL = "install it: on Debian, apt-get install swi-prolog-nox"
HINTS = {
    "is not defined": "define it, or write `:- dynamic NAME/ARITY.` where that comes later",
    "has clauses": "leave its clauses out, or give the fact another name in the file of ports",
    "is not installed": "install it, or correct its name",
    "is not loaded within": "look for a directive `:- …` that does not end, or give it more time by `patience`",
    "Operator expected": "look for a missing `.` or `,` here or before",
}
"""By words of what is wrong with a program."""
SLIPS = {
    r"[A-Z_]\w*\(": "begin the name of a predicate with a small letter",
    r"\bnot\s+\w": "write `\\+ p` for `not p`",
    "<-|=>": "write `:-` between a head and its body",
}
"""What makes a line with an unexpected operator wrong, and what to write."""
LOADING = 10.0
"""Seconds that the bridge itself has to begin and to say that the program is not loaded within `patience`."""
_PLACED = re.compile(
    r"(?:`.*?`: )?(?P<file>.*?):(?P<line>\d+):(?P<column>\d+): (?P<code>E58\d): (?P<why>.*)", re.DOTALL
)
"""How the bridge says what is wrong with a program; of a term of the file of ports, `file` is the term."""


class Prolog(PortKind):
    """See the docstring of the folder."""

    table = Table(
        "a Prolog program, which SWI-Prolog runs: outputs are its facts, and answers to queries are inputs",
        (
            Field("file", "the program", Single(("string",)), required=True),
            Field("limit", f"how long each query may take; the default is `{LIMIT}ms`", Single(("string",))),
            Field("every", "how often queries are asked again while no fact changes", Single(("string",))),
            *CHILD_FIELDS,
        ),
    )
    keys, required = table.keys, table.required

    def settings(self, report: Report, found: Mapping[str, Node], what: str, folder: str) -> Started | None:
        """See `Kind`."""
        before = len(report.diagnostics)
        file = report.scalar(found["file"], "`file`")
        times = {key: _time(report, found.get(key), key) for key in ("limit", "every")}
        timing = patience_of(report, found, what)
        home = Path(folder).resolve()
        path = None if file is None else home / file.text
        if file is not None and path is not None and not os.path.isfile(path):  # noqa: PTH113 - any text is a path to it
            report.error(WRONG_PORT, f"there is no file `{file.text[:60]}`", mark(file), "name a Prolog program")
        facts = dict(_terms(report, found.get("outputs"), "fact"))
        queries = dict(_terms(report, found.get("inputs"), "query"))
        if len(report.diagnostics) > before or timing is None or path is None:
            return None
        limit = times["limit"]
        told: dict[str, Json] = {
            "file": str(path), "limit": float(LIMIT if limit is None else limit) / 1000,
            "every": None if times["every"] is None else float(times["every"]) / 1000,
            "values": dict(_texts(found.get("values"))), "patience": timing[0], "restart": timing[1],
        }  # fmt: skip
        at = mark(found.get("kind", found["file"]))
        run = (sys.executable, "-P", "-m", "llfsm_verify.extensions.prolog.bridge")

        def start(link: Link) -> Port:
            if shutil.which("swipl") is None:
                message = f"{what} needs SWI-Prolog, the program `swipl`"
                raise DiagnosticError(Diagnostic(NO_PROLOG, message, at, hint=INSTALL))
            types = link.hello({})
            told["facts"] = _typed(facts, types["outputs"], "fact")
            told["queries"] = _typed(queries, types["inputs"], "query")
            patience, restart = timing
            settings = ProcessSettings(run, str(home), told, patience + LOADING, restart, hint="correct the program")
            try:
                return settings.started.start(link)
            except Unopened as problem:
                placed = _PLACED.match(str(problem))
                if placed is None:
                    raise Unopened(str(problem).partition("`: ")[2] or str(problem), problem.hint) from None
                raise DiagnosticError(_diagnostic(placed, {**facts, **queries}, told["facts"], folder)) from None

        return Started(start)


def _time(report: Report, node: Node | None, key: str) -> Fraction | None:
    """In milliseconds; a number without a unit is an error, since it could mean milliseconds or seconds."""
    text = node.text if isinstance(node, Scalar) else ""
    found = report.time(node, f"`{key}`", WRONG_PORT)
    if found is not None and node is not None and not text[-1:].isalpha():
        report.error(WRONG_PORT, f"`{key}: {text[:40]}` has no unit", mark(node), "write one, as in `500ms` or `2s`")
    return found


_UNDEFINED = re.compile(r"`(.*?)` is not defined")
_OTHER = re.compile(r"Unknown procedure: (?P<asked>\S+) However, there are definitions for: (?P<has>\S+)$")
Terms = Mapping[str, tuple[Scalar, Term]]
"""By their texts: where they are written, and what they are."""


def _terms(report: Report, node: Node | None, what: str) -> Iterator[tuple[str, tuple[Scalar, Term]]]:
    values = [value for _, value in node.items] if isinstance(node, MappingNode) else []
    values += list(node.items) if isinstance(node, Sequence) else []
    for scalar in (
        value for value in values if isinstance(value, Scalar) and value.text.strip()
    ):  # of others it was said
        try:
            found = term(scalar.text)
            others = sorted(found.variables - {VALUE}) if what == "fact" else []
            if others:
                raise NoTerm(f"it has the variable `{others[0]}`")
            yield scalar.text, (scalar, found)
        except NoTerm as why:
            hint = f"write a name, or one such as `light(ns, {VALUE})`, with `{VALUE}` for the value"
            if "(" in scalar.text and str(why) == OPEN:
                hint = (
                    f'write it in quotes, such as "light(ns, {VALUE})": a comma within `{{ }}` ends a text without them'
                )
            report.error(NO_TERM, f"`{scalar.text[:60]}` is not a {what}: {why}", mark(scalar), hint)


def _typed(terms: Terms, types: Json, what: str) -> Json:
    """The terms as Prolog reads them. DiagnosticError: one has no `Value`, and is no truth value."""
    found: dict[str, Json] = {}
    for field, (scalar, made) in terms.items():
        lacks = VALUE not in made.variables and not _boolean(types, field)
        if lacks and not made.bare:
            message = f"`{field[:60]}` has no `{VALUE}`, and is the {what} of a number or an enumerator"
            raise DiagnosticError(Diagnostic(NO_TERM, message, scalar.span, hint=f"write `{VALUE}` for the value"))
        found[field] = made.asks_value().text if lacks else made.text
    return found


def _boolean(types: Json, field: str) -> bool:
    of = types.get(field) if isinstance(types, dict) else None
    return isinstance(of, dict) and bool(of["boolean"])


def _texts(node: Node | None) -> Iterator[tuple[str, str]]:
    for key, value in node.items if isinstance(node, MappingNode) else ():
        if isinstance(value, Scalar):
            yield key.text, value.text


def _diagnostic(placed: re.Match[str], terms: Terms, facts: Json, folder: str) -> Diagnostic:
    """What the bridge has said, at its place."""
    file, line, column = placed["file"], int(placed["line"]), int(placed["column"])
    code, why = placed["code"], placed["why"].strip()
    if file in terms:
        hint = "define it in the program, or write another name"
        if (other := _OTHER.search(why)) is not None:
            asked, has = (one.partition("/") for one in (other["asked"], other["has"]))
            why = f"the program has `{other['has']}`, and no `{other['asked']}`"
            hint = f"did you mean `{other['has']}`?"
            if has[0] == asked[0]:
                hint = (
                    f"write `{has[0]}`, without arguments"
                    if has[2] == "0"
                    else f"write as many arguments as `{other['has']}`"
                )
        return Diagnostic(code, f"`{file}`: {why}", terms[file][0].span, hint=hint)
    hint = next((hint for words, hint in HINTS.items() if words in why), "correct the program")
    path = Path(folder, file)
    if (missing := _UNDEFINED.match(why)) is not None:
        hint = _given(missing[1], terms, facts) or hint
    if not line or not path.is_file():
        return Diagnostic(code, why, file=str(path), hint=hint)
    source = Source(str(path), path.read_text(encoding="utf-8", errors="replace"))
    lines = source.text.split("\n")
    if "Operator expected" in why and line <= len(lines):
        hint = next((said for slip, said in SLIPS.items() if re.search(slip, lines[line - 1])), hint)
    start = sum(len(one) + 1 for one in lines[: line - 1]) + max(0, column - 1)
    return Diagnostic(code, why, Span(source, start, min(start + 1, len(source.text))), hint=hint)


def _given(missing: str, terms: Terms, facts: Json) -> str | None:
    """A hint, where a fact of the file of ports has almost the name that the program asks."""
    assert isinstance(facts, dict)
    arities = {field: terms[field][1].arity or ("(" in str(text)) + 0 for field, text in facts.items()}
    given = {f"{str(text).partition('(')[0]}/{arities[field]}": field for field, text in facts.items()}
    near = difflib.get_close_matches(missing, given, n=1)
    return f"the file of ports gives `{near[0]}`, by `{given[near[0]]}`: did you mean that?" if near else None


KIND = Prolog()
