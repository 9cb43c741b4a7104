"""The suite for targets: ours passes, and what is wrong fails in a named case."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Callable, Mapping
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import pytest

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.extensions.c.target import C99
from llfsm_verify.plug import Entry, Made, TargetWanted
from llfsm_verify.targets.images import image_of
from llfsm_verify.testing.conformance import Case, target_cases
from llfsm_verify.testing.conformance.known import TARGETED
from llfsm_verify.testing.conformance.targets import Rows, _cycles
from llfsm_verify.values import text
from tests.outside import needs

WORDS = ("true", "false")


def spoken(value: str) -> str:
    """A value in JSON."""
    return value if value in WORDS or value.lstrip("-").replace(".", "").isdigit() else f'"{value}"'


def run(folder: Path, _: Arrangement, rows: Rows) -> Rows:
    """By gcc, and lines of JSON."""
    sources = [path.name for path in folder.glob("*.c")]
    subprocess.run(["gcc", "-std=c99", *sources, "-o", "program"], cwd=folder, check=True)
    lines = ["{" + ", ".join(f'"{name}": {spoken(value)}' for name, value in row.items()) + "}\n" for row in rows]
    done = subprocess.run(
        ["./program", "--lines"], cwd=folder, input="".join(lines), capture_output=True, text=True, check=False
    )
    said = [json.loads(line, parse_float=Decimal) for line in done.stdout.splitlines()]
    found = [{n: text(value) for n, value in row.items() if n not in ("cycle", "end")} for row in said]
    return found[:-1] if said[-1]["end"] == "stopped" else found


def failures(cases: list[Case]) -> dict[str, str]:
    """What the failed cases found, by their names."""
    return {case.name: outcome.wrong for case in cases if not (outcome := case()).passed}


@needs("gcc")
@pytest.mark.slow
def test_ours_passes():
    cases = target_cases("c", ["posix", "none"], run)
    assert [case.name for case in cases] == ["declares", "makes", "repeats", "names", "runs"]
    assert failures(cases) == {}


def test_what_is_run_ends_in_a_fault_and_takes_each_state():
    given, wanted = _cycles(image_of(build_arrangement(TARGETED["mixer"])))
    assert 15 < len(given) == len(wanted) < 60
    assert wanted[-1]["speed"] == "-1.25"
    assert len({row["turns"] for row in wanted}) == 4


class Planted:
    """Ours with one change."""

    worlds: Mapping[str, Entry] = C99.worlds
    mark = C99.mark

    def __init__(self, change: Callable[[dict[str, str], Arrangement], Mapping[str, str]]) -> None:
        self.change = change

    def make(self, arrangement: Arrangement, wanted: TargetWanted) -> Made:
        made = C99.make(arrangement, wanted)
        return replace(made, files=self.change(dict(made.files), arrangement))


COUNT = iter(range(10**6))


def changed(old: str, new: str) -> Planted:
    def change(files: dict[str, str], _: Arrangement) -> Mapping[str, str]:
        return {name: content.replace(old, new) for name, content in files.items()}

    return Planted(change)


def words(files: dict[str, str], arrangement: Arrangement) -> Mapping[str, str]:
    if arrangement.name == "class":
        raise KeyError("class")
    return files


class Nowhere(Planted):
    worlds: Mapping[str, Entry] = {}


no_files = Planted(lambda _files, _: {})
no_mark = changed(C99.mark, "")
no_end = Planted(lambda files, _: {name: content.rstrip() for name, content in files.items()})
a_path = Planted(lambda files, _: {f"../{name}": content for name, content in files.items()})
one_name = Planted(lambda files, _: {**files, "README.md": C99.mark + "\n", "readme.MD": C99.mark + "\n"})
another_each_time = Planted(lambda files, _: {n: f"{t}/* {next(COUNT)} */\n" for n, t in files.items()})
always_the_same = Planted(lambda _files, _: {"a.c": C99.mark + "\n"})
falls_over_words = Planted(words)
nowhere = Nowhere(lambda files, _: files)
no_safe_values = changed("state->outputs.speed = (-125);", "")
another_sign = changed("% 7", "* 7")
early = changed("m.clock_ > 3", "m.clock_ > 2")
PLANTED = {
    "nowhere": ("declares", "it is for no world"), "no_files": ("makes", "it makes no file"),
    "no_mark": ("makes", "the first line of lamp.h is without its mark"), "no_end": ("makes", "lamp.h ends within a"),
    "a_path": ("makes", "`../lamp.h` cannot be the name"), "one_name": ("makes", "two files differ in case only"),
    "another_each_time": ("repeats", "the same arrangement gives other files"),
    "always_the_same": ("repeats", "two arrangements give the same files"),
    "falls_over_words": ("names", "KeyError: 'class'"),
    **dict.fromkeys(("no_safe_values", "another_sign", "early"), ("runs", "cycles of `mixer` outputs are")),
}  # fmt: skip


@needs("gcc")
@pytest.mark.slow
@pytest.mark.parametrize("name", PLANTED)
def test_what_is_wrong_fails_in_its_case(name):
    case, wrong = PLANTED[name]
    entry = Entry(name, f"{__name__}:{name}", "planted")
    cases = target_cases(entry, ["posix"], run if case == "runs" else None)
    found = failures([each for each in cases if each.name == case])
    assert wrong in found.get(case, "")
