"""A trace file is rewritten in two places only."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.report.saving import update_trace_file

TEXT = "# first\nexpect: 'violated' # why\nother: {expect: violated, digest: 1}\ndigest: \"abc\"\nlast: é\n"


@pytest.mark.parametrize("bom", [b"", b"\xef\xbb\xbf"], ids=["plain", "with a mark of the byte order"])
@pytest.mark.parametrize("ends", ["\n", "\r\n"], ids=["LF", "CRLF"])
def test_all_other_bytes_stay(tmp_path: Path, bom: bytes, ends: str) -> None:
    path, link = tmp_path / "a.trace.yaml", tmp_path / "link"
    path.write_bytes(bom + TEXT.replace("\n", ends).encode())
    link.symlink_to(path)
    assert update_trace_file(link, "holds", "12345") is True
    expected = TEXT.replace("'violated' #", "'holds' #").replace("abc", "12345").replace("\n", ends)
    assert path.read_bytes() == bom + expected.encode() and link.is_symlink()
    before = path.stat().st_mtime_ns, path.stat().st_ino
    assert update_trace_file(path, "holds", "12345") is False
    assert (path.stat().st_mtime_ns, path.stat().st_ino) == before


@pytest.mark.parametrize(
    ("text", "key"),
    [("a: &x violated\nexpect: *x\ndigest: abc\n", "expect"), ("expect: violated\ndigest: &x abc\nb: *x\n", "digest")],
)
def test_what_stands_behind_an_anchor_is_not_touched(tmp_path: Path, text: str, key: str) -> None:
    path = tmp_path / "a.trace.yaml"
    path.write_text(text)
    with pytest.raises(DiagnosticError) as refused:
        update_trace_file(path, "holds", "12")
    (found,) = refused.value.diagnostics
    assert (found.code, found.hint) == ("E463", f"write `{key}: …` without `&` and `*`")
    assert found.message == f"`{key}` has an anchor, so it cannot be rewritten"
    assert found.span is not None and found.span.line == (1 if key == "expect" else 2)
    assert path.read_text() == text


def test_a_file_that_cannot_be_written_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.trace.yaml"
    path.write_text(TEXT)

    def replace(*_: object) -> None:
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(Path, "replace", replace)
    with pytest.raises(DiagnosticError) as refused:
        update_trace_file(path, "holds", "12")
    (found,) = refused.value.diagnostics
    assert (found.code, found.message, found.file) == (
        "E405", f"the trace cannot be rewritten: {os.strerror(28)}", str(path),
    )  # fmt: skip
    assert path.read_text() == TEXT and list(tmp_path.iterdir()) == [path]
