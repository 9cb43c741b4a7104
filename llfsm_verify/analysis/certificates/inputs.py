"""The files that a certificate is about, and their hashes."""

from __future__ import annotations

import os
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path

from llfsm_verify.arrangement.files import MAX_FILE_BYTES
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.diagnostics import Source, Span
from llfsm_verify.files import read_regular
from llfsm_verify.jsonvalue import Json
from llfsm_verify.language.trees import nodes
from llfsm_verify.logic.properties import PropertySet


def input_files(arrangement: Arrangement, properties: PropertySet) -> Iterator[tuple[str, Source | Path]]:
    """Kind and text of each input, once: the arrangement, its machine files, theories, property files, automata."""
    seen: set[str] = set()
    spans = [("arrangement", arrangement.span)]
    spans += [("machine", s.span) for m in arrangement.texts for s in m.states]
    known = (e for k in (arrangement.knowledge, *(m.knowledge for m in arrangement.texts)) for e in k.values())
    places = (getattr(node, "span", None) for entry in known for node in nodes(entry))
    spans += [("theory", place) for place in places if isinstance(place, Span)]
    spans += [("properties", p.span) for p in properties]
    for kind, span in spans:
        if span.source.name not in seen:
            seen.add(span.source.name)
            yield kind, span.source
    for line in properties:
        if line.file is not None:
            path = Path(line.span.source.name).parent / line.file
            if str(path) not in seen:
                seen.add(str(path))
                yield "automaton", path


def inputs_json(arrangement: Arrangement, properties: PropertySet, folder: Path) -> list[Json]:
    """[name, kind, SHA-256] of each input; names of files are relative to `folder`, where the certificate will be."""
    found: list[Json] = []
    for kind, what in input_files(arrangement, properties):
        path = what if isinstance(what, Path) else Path(what.name)
        try:
            data: bytes | None = read_regular(path, MAX_FILE_BYTES + 1)
        except (OSError, ValueError):  # standard input, a pipe, or a line of the command line
            data = None
        if isinstance(what, Source) and (data is None or _text(data) != what.text):
            # What was read is what counts, even if the file is another one by now.
            name, data = (what.name if data is None else _relative(path, folder)), what.text.encode()
        else:
            name = _relative(path, folder)
        found.append([name, kind, sha256(data or b"").hexdigest()])
    return found


def _text(data: bytes) -> str | None:
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return None


def _relative(path: Path, folder: Path) -> str:
    return Path(os.path.relpath(path, folder)).as_posix()
