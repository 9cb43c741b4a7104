"""Guards outside on the command line: `llfsm guard --outside`, and `llfsm whiteboard watch` with commands."""

from __future__ import annotations

from pathlib import Path

import pytest

from llfsm_verify.arrangement.loader import load_arrangement
from tests.cli.running import llfsm
from tests.runtime.whiteboard.test_server import boards, served, tidy  # noqa: F401 - fixtures

SUBSUMPTION = "models/recipes/subsumption.yaml"
APART = "apart: G (obstacle -> motor == STOP)"
LAMP = """\
name: lamp
cycle_ms: 1
whiteboard: {go: {type: bool, role: input}, lamp: {type: bool, role: output}}
machines:
  m:
    inline:
      machine: M
      suspend: "OFF"
      states:
        - {name: "ON", internal: lamp = true;, stays: true}
        - {name: "OFF", on_entry: lamp = false;}
schedule: [m]
operators: {suspend: [m], enter: [m]}
"""


@pytest.fixture
def lamp(tmp_path: Path) -> str:
    path = tmp_path / "lamp.yaml"
    path.write_text(LAMP)
    return str(path)


@pytest.mark.slow
def test_the_bound_is_computed_and_proved(tmp_path: Path) -> None:
    given = ("guard", SUBSUMPTION, "-p", APART, "--outside", "unload wander")
    done = llfsm(*given, "--every", "2", "--looks", "2", "-o", str(tmp_path / "out"), "--engine", "explicit")
    assert done.returncode == 0
    assert done.stdout.splitlines() == [
        "when the guard looks once in any 2 cycles of the arrangement, and commands 1 look after the one that sees it:",
        "`unload wander`: at most 5 cycles after the frame that violates a property",
        "proved    at most 5 cycles",
        "violated  at most 4 cycles",
    ]
    files = [str(tmp_path / "out" / name) for name in ("subsumption.yaml", "reaction.ltl")]
    lines = llfsm("verify", *files, "-q", "--engine", "explicit").stdout.splitlines()
    assert [line.split()[:2] for line in lines] == [
        ["holds", "within_5"], ["violated", "within_4"], ["holds", "faults"],
    ]  # fmt: skip
    done = llfsm(*given, "--engine", "explicit", "--max-states", "3")
    assert done.returncode == 4
    assert "unknown   at most 2 cycles" in done.stdout


@pytest.mark.parametrize(
    ("options", "code", "said"),
    [
        (("--outside", "stop wander"), 2, "`stop wander` is not a command of a guard"),
        (("--outside", "unload avoid"), 3, "does not declare unload of `avoid`, only unload(wander), load(wander)"),
        (("--outside", "unload wander", "--fallback", "motor=STOP"), 2, "leave out --fallback"),
        (("--fallback", "motor=STOP", "--every", "2"), 2, "--every and --looks are for a guard outside"),
    ],
)
def test_what_is_wrong(options: tuple[str, ...], code: int, said: str) -> None:
    done = llfsm("guard", SUBSUMPTION, "-p", APART, *options)
    assert done.returncode == code
    assert said in done.stderr
    assert not done.stdout


def test_a_property_that_no_frame_violates_is_not_late(lamp: str) -> None:
    done = llfsm("guard", lamp, "-p", "fine: G (m@{ON, OFF})", "--outside", "suspend m", "--engine", "explicit")
    assert done.returncode == 0
    assert "no run is as late as the first bound allows" in done.stdout


@pytest.mark.slow
def test_a_watcher_gives_commands(lamp: str) -> None:
    watch = ("whiteboard", "watch", "board", "--arrangement", lamp, "-p", "dark: G !lamp")
    with served(load_arrangement(lamp)):
        for options, code, said in (
            (("--command", "restart m"), 3, "`restart m` would be refused: `operators:` does not declare restart"),
            (("--command", "enter m DIM"), 3, "`enter m DIM` would be refused: m: `DIM` is not one of ON, OFF"),
            (("--command", "enter m"), 2, "`enter m` is not a command of a guard: write"),
            (("--post", "lamp=true"), 3, "there is no input `lamp`, only go"),
            (("--command", "m suspend"), 2, "`m suspend` is not a command of a guard"),
            (("--post", "go"), 2, "--post needs INPUT=VALUE"),
            (("--every", "3"), 2, "--every is for commands"),
        ):
            done = llfsm(*watch, *options)
            assert (done.returncode, done.stdout) == (code, ""), done
            assert said in done.stderr
        done = llfsm("whiteboard", "watch", "board", "--command", "suspend m")
        assert (done.returncode, done.stdout) == (2, "")
        done = llfsm(*watch, "--command", "suspend m", "--every", "100000")
    assert done.returncode == 1, done
    first, missed, violated, acted, *_ = done.stdout.splitlines()
    assert first == (
        "when a property is violated: `suspend m`, at most 100,001 cycles (100.001 s) after the frame that violates "
        "it, if each frame is looked at within 100,000 cycles"
    )
    assert missed.startswith("up to 99,967 frames at once may be missed")
    assert violated.endswith("dark is violated; sent: suspend m")
    assert "suspend m is in force" in acted
    assert "violated  dark  G !lamp" in done.stdout
