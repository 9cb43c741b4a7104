"""Saving the traces of a result, one file each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from llfsm_verify.arrangement.files import read_source
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.trace import Trace
from llfsm_verify.checking.verdict import PropertyResult, Result
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.files import replacing, special_kind
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.program.program import FaultSite
from llfsm_verify.verification.tracefile import Expected, SavedProperty, document_of, may_be_replaced, saved_text
from llfsm_verify.yaml.compose import YamlMapping, YamlScalar, compose

if TYPE_CHECKING:
    from llfsm_verify.verification.differential import EnginesDisagree

SUFFIX = ".trace.yaml"
"""What the name of a trace file ends in."""


def trace_documents(
    result: Result, arrangement: Arrangement, properties: PropertySet, directory: Path, expect: Expected = "violated"
) -> Iterator[tuple[str, SavedProperty | FaultSite, str]]:
    """Of every trace of `result` the name of its file (without ``.trace.yaml``), what it shows, and its text,
    for a file in `directory`."""
    for name, of, trace in named_runs(result):
        what = of if isinstance(of, FaultSite) else SavedProperty(of.name, of.kind, saved_text(of, directory))
        yield name, what, document_of(trace, arrangement, what, properties, directory, expect)


def named_runs(result: Result) -> Iterator[tuple[str, PropertyResult | FaultSite, Trace]]:
    """Every trace of `result` with the name of its file (without ``.trace.yaml``), and what it shows."""
    for item in result.properties:
        yield from ((name, item, trace) for name, trace in _named_traces(item))
    escaped = next(filter(result.escape_of, result.properties), None)
    if escaped is not None and result.escape is not None:
        yield f"{escaped.name}.escape", escaped, result.escape
    for number, finding in enumerate(result.faults.findings, 1):
        yield f"fault-{number}-{finding.site.code}", finding.site, finding.trace


def _named_traces(item: PropertyResult) -> Iterator[tuple[str, Trace]]:
    if item.trace is not None:
        yield item.name, item.trace
    for number, trace in enumerate(item.more, 2):
        yield f"{item.name}.{number}", trace
    if item.witness is not None:
        yield f"{item.name}.witness", item.witness


def save_disagreement(
    error: EnginesDisagree, arrangement: Arrangement, properties: PropertySet, directory: Path
) -> list[Path]:
    """Write ``ENGINE/result.json`` and the traces of each engine, as `save_traces` does."""
    from llfsm_verify.report.json import result_json

    written = []
    for engine, result in error.results.items():
        folder = directory / engine
        refuse_special([folder], folders=True)
        written += write_traces([(folder / "result.json", result_json(result) + "\n")], folder)
        written += save_traces(result, arrangement, properties, folder)
    return written


def save_traces(result: Result, arrangement: Arrangement, properties: PropertySet, directory: Path) -> list[Path]:
    """Write `NAME.trace.yaml` for every property with a trace and ``fault-N-CODE.trace.yaml`` for every fault.

    Other counterexamples of a property are ``NAME.2.trace.yaml`` and so on, its witness ``NAME.witness.trace.yaml``. A
    run that escapes the assumptions is ``NAME.escape.trace.yaml``, for the first property that holds.

    `properties` are those that were checked. The directory is made when it is not there. Returns the files
    written; raises DiagnosticError (E405) when that is not possible, or would replace a file that is no trace.
    """
    documents = trace_documents(result, arrangement, properties, directory)
    files = [(directory / f"{name}{SUFFIX}", text) for name, _, text in documents]
    refuse_others(path for path, _ in files)
    return write_traces(files, directory)


def refuse_others(paths: Iterable[Path]) -> None:
    """Raises DiagnosticError (E405) when a trace at one of these paths would replace a file that is no trace."""
    for path in paths:
        if not may_be_replaced(path):
            message = "this file is not a trace, and a trace would replace it"
            raise DiagnosticError(Diagnostic("E405", message, hint="name another file, or remove it", file=str(path)))


def refuse_special(paths: Iterable[Path], *, folders: bool = False) -> None:
    """Raises DiagnosticError (E405) when a file of a name that was chosen here would be written through a link, or into
    a pipe or device. `folders`: they are folders to write in. Raises OSError."""
    for path in paths:
        try:
            kind = special_kind(path.lstat().st_mode)
        except FileNotFoundError:
            continue
        if kind is not None and not (folders and kind == "a directory"):
            what = "a folder" if folders else "a file"
            message = f"this is {kind}, but a trace needs {what} of that name"
            raise DiagnosticError(Diagnostic("E405", message, hint="name another folder, or remove it", file=str(path)))


def write_traces(documents: Sequence[tuple[Path, str]], directory: Path) -> list[Path]:
    """Write trace files, given by path and text, into a directory that is made when it is not there.

    Returns the files written; DiagnosticError (E405) when that is not possible, or a link, pipe or device is there.
    """
    try:
        if documents:
            directory.mkdir(parents=True, exist_ok=True)
        refuse_special(path for path, _ in documents)
        for path, text in documents:
            with replacing(path) as file:
                file.write(text.encode())
    except OSError as e:
        raise unsaved(e, directory) from None
    return [path for path, _ in documents]


def unsaved(error: OSError, directory: Path) -> DiagnosticError:
    """E405: traces cannot be written to `directory`."""
    reason = error.strerror or "input/output error"
    return DiagnosticError(Diagnostic("E405", f"traces cannot be saved there: {reason}", file=str(directory)))


_BOM = b"\xef\xbb\xbf"


def update_trace_file(path: Path, expect: Expected, digest: str) -> bool:
    """Make the file at `path`, which is a trace file, expect this and name this arrangement; whether that changed it.

    Only the characters of the two values are replaced: comments, quotes, order and line ends stay. Raises
    DiagnosticError when the file cannot be written (E405), or when a value is an anchor or alias (E463).
    """
    source, data = read_source(path)
    root = compose(source, [])
    assert isinstance(root, YamlMapping)
    nodes = {key.text: node for key, node in root.items}
    text = source.text
    places: list[tuple[int, int, str]] = []
    for key, value in (("expect", expect), ("digest", digest)):
        node = nodes[key]
        assert isinstance(node, YamlScalar)
        if node.anchored:
            message = f"`{key}` has an anchor, so it cannot be rewritten"
            raise DiagnosticError(Diagnostic("E463", message, node.span, hint=f"write `{key}: …` without `&` and `*`"))
        places.append((node.fragment.offsets[0], node.fragment.offsets[-1], value))
    for start, end, value in sorted(places, reverse=True):
        text = text[:start] + value + text[end:]
    if text == source.text:
        return False
    try:
        with replacing(path.resolve()) as file:  # a link stays one
            file.write((_BOM if data.startswith(_BOM) else b"") + text.encode())
    except OSError as error:
        reason = error.strerror or "input/output error"
        raise DiagnosticError(Diagnostic("E405", f"the trace cannot be rewritten: {reason}", file=str(path))) from None
    return True
