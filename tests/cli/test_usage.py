"""Options that do not go together, or ask for what there is not: the whole sentence, and exit code 2."""

from __future__ import annotations

import pytest

from tests.cli.running import LIGHTS, PROPERTIES, llfsm

VERIFY = ("verify", LIGHTS, PROPERTIES)
NEEDLESS = "--check-invariants searches for nothing and writes nothing: leave {} out"
EXPLICIT = "{} is for --engine explicit"
CASES = {
    ("verify", "-", "-"): "standard input can be read only once",
    ("verify", LIGHTS, "-", "-"): "standard input can be read only once",
    ("lint", "-", "-"): "standard input can be read only once",
    ("monitor", "-", "-"): "standard input can be read only once",
    ("kripke", "-", "-"): "standard input can be read only once",
    ("run", "-", "--monitor", "-"): "standard input can be read only once",
    ("check-recording", "run.rec", "-", "-"): "standard input can be read only once",
    ("whiteboard", "watch", "w", "--monitor", "-", "--arrangement", "-"): "standard input can be read only once",
    ("lint", LIGHTS, "--local", "--max-states", "9"): (
        "--max-states is for the reachable configurations, which --local leaves alone"
    ),
    (*VERIFY, "--checkpoint", ""): "--checkpoint needs the name of a file",
    (*VERIFY, "--jobs", "0"): "--jobs: '0' is not a whole number from 1",
    (*VERIFY, "--jobs", "-1"): "--jobs: '-1' is not a whole number from 1",
    (*VERIFY, "--jobs", "x"): "--jobs: 'x' is not a whole number from 1",
    (*VERIFY, "--jobs", "1000000000"): "--jobs: 1000000000 is more than 256, the largest number of jobs",
    (*VERIFY, "--resume"): "--resume goes on from the file that --checkpoint FILE names",
    (*VERIFY, "--checkpoint-every", "9"): (
        "--checkpoint-every says how often to save to the file that --checkpoint FILE names"
    ),
    (*VERIFY, "--certificate", ""): "--certificate and --check-certificate need the name of a file",
    (*VERIFY, "--check-certificate", "-"): "--certificate and --check-certificate need the name of a file",
    (*VERIFY, "--certificate", "a", "--check-certificate", "b"): (
        "--certificate writes a file and --check-certificate reads one: use one of them at a time"
    ),
    (*VERIFY, "--check-certificate", "a", "--format", "json"): (
        "--check-certificate answers in words: there is no --format json of that"
    ),
    (*VERIFY, "--check-certificate", "a", "--save-traces", "t"): (
        "--check-certificate writes nothing: leave --save-traces out"
    ),
    (*VERIFY, "--check-certificate", "a", "--save-invariants", "t"): (
        "--check-certificate writes nothing: leave --save-invariants out"
    ),
    (*VERIFY, "--certificate", "a", "--checkpoint", "./a"): "--certificate and --checkpoint name the same file",
    (*VERIFY, "--save-invariants", "-"): "--save-invariants and --check-invariants need the name of a file",
    (*VERIFY, "--check-invariants", ""): "--save-invariants and --check-invariants need the name of a file",
    (*VERIFY, "--save-invariants", "a", "--check-invariants", "b"): (
        "--save-invariants writes a file and --check-invariants reads one: use one of them at a time"
    ),
    (*VERIFY, "--save-invariants", "a", "--engine", "bmc"): (
        "--save-invariants is for --engine induction and pdr"
    ),
    (*VERIFY, "--check-invariants", "a", "--format", "json"): (
        "--check-invariants answers in words: there is no --format json of that"
    ),
    (*VERIFY, "--save-invariants", "a", "--certificate", "./a"): (
        "--save-invariants and --certificate name the same file"
    ),
    **{
        (*VERIFY, "--check-invariants", "a", *given.split()): NEEDLESS.format(name or given)
        for given, name in (
            ("--certificate b", "--certificate"),
            ("--check-certificate b", "--check-certificate"),
            ("--engine pdr", ""),
            ("--depth 9", "--depth"),
            ("--save-traces t", "--save-traces"),
            ("--all 2", "--all"),
            ("--strict", ""),
            ("--vacuity", ""),
            ("--accept-vacuity x", "--accept-vacuity"),
            ("--witness", ""),
            ("--max-states 9", "--max-states"),
            ("--keep-all-bits", ""),
            ("--cone off", ""),
            ("--compression off", ""),
            ("--labels off", ""),
            ("--jobs 2", "--jobs"),
            ("--checkpoint b", "--checkpoint"),
            ("--all-steps", ""),
        )
    },
    (*VERIFY, "--engine", "all", "--checkpoint", "a"): EXPLICIT.format("--checkpoint"),
    **{
        (*VERIFY, "--engine", engine, *given.split()): EXPLICIT.format(name or given)
        for engine in ("bmc", "induction", "pdr")
        for given, name in (
            ("--checkpoint b", "--checkpoint"),
            ("--all 2", "--all"),
            ("--cone on", ""),
            ("--jobs 2", "--jobs"),
            ("--compression on", ""),
            ("--labels off", ""),
            ("--witness", ""),
            ("--max-states 9", "--max-states"),
        )
    },
    (*VERIFY, "--engine", "bmc", "--vacuity"): (
        "--vacuity is for --engine explicit, induction and pdr"
    ),
    (*VERIFY, "--engine", "explicit", "--depth", "9"): "--depth is for --engine bmc, induction and pdr",
    (*VERIFY, "--accept-vacuity", "z", "--accept-vacuity", "y", "--accept-vacuity", "w", "--accept-vacuity", "x"): (
        "--accept-vacuity names no property: w, x, y, z"
    ),
    ("verify", "-", "--watch"): "--watch needs files, and standard input is not a file",
    (*VERIFY, "--watch", "--checkpoint", "a"): "--watch and --checkpoint do not go together",
    (*VERIFY, "--watch", "--format", "json"): "--watch reports as text",
    ("query", LIGHTS, "ns@RED", "--depth", "9", "--engine", "explicit"): (
        "--depth is for --engine bmc, induction and pdr"
    ),
    ("query", LIGHTS, "ns@RED", "--max-states", "9", "--engine", "bmc"): "--max-states is for --engine explicit",
    ("query", LIGHTS, "ns@RED", "--save", ""): "--save needs the name of a file",
    ("simulate", LIGHTS, "--set", "car"): "--set needs INPUT=VALUE, not `car`",
    ("simulate", LIGHTS, "--set", "car=0", "--set", "car=1"): "--set gives `car` twice: leave one out",
    ("run", LIGHTS, "--set", "car=0", "--set", "car=0"): "--set gives `car` twice: leave one out",
    ("simulate", LIGHTS, "--draw", "car"): "--draw needs INPUT=P, not `car`",
    ("simulate", LIGHTS, "--for", "300000000h"): (
        "--for: `300000000h` is longer than the longest time, 1,000,000,000 s"
    ),
}  # fmt: skip


@pytest.mark.parametrize(("arguments", "sentence"), CASES.items(), ids=[" ".join(case) for case in CASES])
def test_what_does_not_go_together(arguments: tuple[str, ...], sentence: str) -> None:
    done = llfsm(*arguments)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"error: {sentence}\n"
