"""Rewriting what a trace file expects, and no other byte of it."""

from __future__ import annotations

from pathlib import Path

from llfsm_verify.arrangement.files import read_source
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.files import replacing
from llfsm_verify.verification.tracefile import Expected
from llfsm_verify.yaml.compose import YamlMapping, YamlScalar, compose

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
