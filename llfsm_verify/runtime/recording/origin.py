"""The arrangement of a recording, made again from the texts in it."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import reduce
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory

from llfsm_verify.arrangement.formats import Given, read_arrangement
from llfsm_verify.arrangement.granting import policy_digest
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.arrangement.replacing import Change, NewPolicy, Replacement, with_change
from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source
from llfsm_verify.jsonvalue import Json
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.logic.reading import GivenLines
from llfsm_verify.logic.syntax_names import SYNTAXES
from llfsm_verify.program.program import Int, Program
from llfsm_verify.runtime.live.loop import LiveCode
from llfsm_verify.runtime.live.plan import monitored, runnable, safe_values
from llfsm_verify.runtime.recording import OTHER, UNREADABLE
from llfsm_verify.runtime.recording.file import Recording

Load = Callable[[str], Arrangement]
DEPTH = "d"
"""A folder for each level by which a file lies above the arrangement."""


def header_of(
    sources: tuple[Source, ...],
    arrangement: Arrangement,
    *,
    simulated: bool,
    seed: int | None,
    free: Mapping[str, int],
    properties: Sequence[Source] = (),
    syntax: str = "llfsm",
    digest: str | None = None,
    loaded: Sequence[Json] = (),
    external: bool = False,
) -> dict[str, Json]:
    """What a recording says of the run: the texts of the arrangement and of monitored properties, and how it ran.

    `loaded`: machines that took the places of others, each with its instance, the name and the text of its file, and
    whether it was not checked; policies, in the same way without an instance. `digest` is then that of `sources`.
    `external`: cycles began when a port said so.
    """
    folder, path = Path(arrangement.path).parent, arrangement.path
    files: dict[str, Json] = {os.path.relpath(source.name, folder): source.text for source in sources}
    return {
        "name": arrangement.name,
        "arrangement": "-" if path == "-" else Path(path).name,
        "digest": digest or arrangement.digest,
        "files": files,
        "simulated": simulated,
        "cycle_ms": str(arrangement.cycle_ms),
        "seed": seed,
        "free": dict(free),
        "properties": [
            [source.name, list(source.texts) if isinstance(source, GivenLines) else source.text]
            for source in properties
        ],
        "syntax": syntax,
        "loaded": list(loaded),
        "policy": policy_digest(arrangement),
        "version": version("llfsm-verify"),
        **({"clock": "external"} if external else {}),
    }


def arrangement_of(
    recording: Recording, load: Load, instead: str | None = None, *, modelled: bool = False
) -> Arrangement:
    """The arrangement that a recording was made of, as it ran; `instead`: another file in its place; `modelled`: with
    the models of the surroundings also where it ran in the world.

    DiagnosticError (E481, E482): the recording has no such texts, or other ones than its frames were made with.
    """
    header = recording.header
    cycle = header.get("cycle_ms")
    try:
        length = None if cycle is None else Fraction(str(cycle))
    except (ValueError, ZeroDivisionError):
        raise damaged(recording, "its cycle has no length") from None
    loaded = loaded_into(recording)
    if instead is not None and loaded:
        message = (
            "machines or policies were loaded into the run of this recording, which another arrangement does not have"
        )
        raise DiagnosticError([Diagnostic(OTHER, message, file=str(recording.path), hint="leave out --arrangement")])
    found = load(instead) if instead is not None else _from_texts(recording, load, loaded)
    return runnable(found, simulated=modelled or bool(header.get("simulated")), cycle_ms=length)


def loaded_into(recording: Recording) -> list[Change]:
    """The machines and policies that took the places of others before this recording begins. DiagnosticError (E481)."""
    given = recording.header.get("loaded", [])
    found: list[Change] = []
    for entry in given if isinstance(given, list) else [None]:
        match entry:
            case [str(machine), str(name), str(text), bool()]:
                found.append(Replacement(machine, name, text))
            case [str(name), str(text), bool()]:
                found.append(NewPolicy(name, text))
            case _:
                raise damaged(recording, "it does not say what was loaded")
    return found


def code_of(recording: Recording, arrangement: Arrangement) -> LiveCode:
    """The machine code that a recording was made with, its monitors included. DiagnosticError (E481)."""
    given, syntax = recording.header.get("properties", []), recording.header.get("syntax", "llfsm")
    if not isinstance(given, list) or not isinstance(syntax, str) or syntax not in SYNTAXES:
        raise damaged(recording, "its properties cannot be read")
    sources: list[Source] = []
    for pair in given:
        match pair:
            case [str(name), str(text)]:
                sources.append(Source(name, text))
            case [str(name), [*texts]] if texts and all(isinstance(text, str) for text in texts):
                sources.append(GivenLines(name, [str(text) for text in texts]))
            case _:
                raise damaged(recording, "its properties cannot be read")
    try:
        program, monitors, _ = monitored(arrangement, parse_properties(sources, syntax))
    except DiagnosticError as error:
        raise damaged(recording, f"its properties are wrong: {error.diagnostics[0].message}") from None
    return LiveCode(program, monitors, safe_values(arrangement))


def free_of(recording: Recording, program: Program) -> dict[str, int]:
    """The values of inputs that never change, as they were in the run. DiagnosticError (E481)."""
    given = recording.header.get("free", {})
    known = {v.name: v.type for v in program.vars if v.free}
    if not isinstance(given, Mapping):
        raise damaged(recording, "it has no free inputs")
    found: dict[str, int] = {}
    for name, value in given.items():
        kind = known.get(name)
        if not isinstance(kind, Int) or not isinstance(value, int) or not kind.low <= value <= kind.high:
            raise damaged(recording, f"`{name[:60]}` has no such value at first")
        found[name] = value
    return found


def _from_texts(recording: Recording, load: Load, loaded: Sequence[Change]) -> Arrangement:
    files, name = recording.header.get("files"), recording.header.get("arrangement")
    if (
        not isinstance(files, Mapping)
        or not all(isinstance(t, str) for t in files.values())
        or not isinstance(name, str)
    ):
        raise damaged(recording, "it has no arrangement")
    above = max((Path(path).parts.count("..") for path in files), default=0)
    with TemporaryDirectory(prefix="llfsm-") as folder:
        root = Path(folder).resolve()
        home = root.joinpath(*[DEPTH] * above)
        for path, text in files.items():
            place = Path(os.path.normpath(home / path))
            if Path(path).is_absolute() or not place.is_relative_to(root):
                raise damaged(recording, f"it names a file at `{path[:60]}`")
            try:
                place.parent.mkdir(parents=True, exist_ok=True)
                place.write_text(str(text), encoding="utf-8")
            except (OSError, ValueError):
                raise damaged(recording, f"it names a file `{path[:60]!a}`, or that has no text") from None
        if name not in files:
            raise damaged(recording, "the file of its arrangement is not in it")
        if loaded:
            try:
                draft = read_arrangement(Given(str(home / name)))
                digest, found = draft.digest, resolve(reduce(with_change, loaded, draft))
            except KeyError as error:
                raise damaged(recording, f"it has no machine {str(error)[:60]}") from None
            except DiagnosticError as error:
                raise damaged(recording, f"what was loaded does not fit: {error.diagnostics[0].message}") from None
        else:
            found = load(str(home / name))
            digest = found.digest
    if digest != recording.header.get("digest"):
        message = "the texts in this recording are not those that it was made with"
        raise DiagnosticError(
            [Diagnostic(OTHER, message, file=str(recording.path), hint="name the arrangement with --arrangement")]
        )
    return replace(found, path=name)


def damaged(recording: Recording, what: str) -> DiagnosticError:
    """E481: `what` in it cannot be."""
    message = f"the recording is damaged: {what}"
    return DiagnosticError([Diagnostic(UNREADABLE, message, file=str(recording.path), hint="record again")])
