"""The number of a file's format is judged in one place, whatever the file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from llfsm_verify.arrangement import load_arrangement_text
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.fileformat import FORMAT, judge_format
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.verification.tracefile import read_trace_file

MACHINE = "{machine: M, %s, states: [{name: A}]}"


def read_arrangement(text: str) -> object:
    machine = MACHINE % "suspend: A"
    return load_arrangement_text(f"{text}\nmachines: {{m: {{inline: {machine}}}}}\nschedule: [m]")


def read_machine(text: str) -> object:
    return load_arrangement_text(f"machines: {{m: {{inline: {MACHINE % text}}}}}\nschedule: [m]")


def read_properties(text: str) -> object:
    return parse_properties([Source("p.ltl", f"{text}\nG true\n")])


def read_trace(text: str) -> object:
    path = Path("wrong.trace.yaml")
    rest = "arrangement: a.yaml\ndigest: 00\nexpect: holds\nfault: {code: F001, message: x}\nsteps: []\n"
    path.write_text(f"{text}\n{rest}")
    return read_trace_file(path)


READERS: dict[str, tuple[Callable[[str], object], str, str]] = {
    "E097": (read_arrangement, "the arrangement", "format"),
    "E097 of a machine": (read_machine, "the machine", "format"),
    "E316": (read_properties, "the file", "# format"),
    "E401": (read_trace, "the trace", "trace"),
}


@pytest.mark.parametrize("code", READERS)
@pytest.mark.parametrize("number", ["0", "01", "2", "12", "9" * 9, "9" * 10])
def test_every_file_is_judged_alike(code: str, number: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    read, what, key = READERS[code]
    with pytest.raises(DiagnosticError) as caught:
        read(f"{key}: {number}")
    (found,) = caught.value.diagnostics
    assert found.code == code[:4] and found.span is not None and found.span.text == number
    assert (found.message, found.hint) == judge_format(number, what, key)
    assert read(f"{key}: {FORMAT}") is not None


def test_what_is_said() -> None:
    assert judge_format("1", "the file", "format") is None
    later = "the file is of format 2, but this version of llfsm-verify knows only 1"
    assert judge_format("2", "the file", "format") == (later, "install a later version of llfsm-verify")
    for wrong in ("0", "01", "-1", "", "one", "²", "9" * 10):
        assert judge_format(wrong, "the file", "format") == (
            f"there is no format `{wrong}` of files",
            "write `format: 1`",
        )
