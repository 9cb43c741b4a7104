"""Places in SARIF: files by URIs relative to the folder that we are in, and regions of them."""

from __future__ import annotations

import os
from pathlib import Path
from urllib.parse import quote

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.diagnostics import Span
from llfsm_verify.jsonvalue import Json

ROOT = "%SRCROOT%"


def location(span: Span | None, arrangement: Arrangement, *, name: str = "", text: str = "") -> dict[str, Json]:
    """A place in a file. What was written on the command line is shown at the start of the arrangement."""
    uri = uri_of(name_of(span))
    if uri is None:
        uri, span = uri_of(arrangement.path), arrangement.span
    value: dict[str, Json] = {}
    if uri is not None:
        value["physicalLocation"] = physical_location(uri, span)
    if name:
        value["logicalLocations"] = [{"fullyQualifiedName": name, "name": name.rsplit(".", 1)[1]}]
    if text:
        value["message"] = {"text": text}
    return value


def physical_location(uri: str, span: Span | None) -> dict[str, Json]:
    """A region of a file, or the file."""
    value: dict[str, Json] = {"artifactLocation": {"uri": uri, **({} if ":" in uri else {"uriBaseId": ROOT})}}
    if span is not None:
        end_line, end_column = span.end_position
        value["region"] = {
            "startLine": span.line,
            "startColumn": span.column,
            "endLine": end_line,
            "endColumn": end_column,
        }
    return value


def name_of(span: Span | None) -> str:
    """The file that a span is in; empty: none."""
    return "" if span is None else span.source.name


def uri_of(name: str) -> str | None:
    """Relative to the folder that we are in; absolute outside of it; None for what is no file."""
    if not name or name.startswith("<"):
        return None
    path = Path(os.path.relpath(name))
    return Path(name).absolute().as_uri() if path.parts[:1] == ("..",) else quote(path.as_posix())
