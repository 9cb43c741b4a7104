"""`--timings`: where the time of a check went."""

from __future__ import annotations

from tests.cli.running import LIGHTS, llfsm


def test_stages_are_told_and_add_up():
    done = llfsm("verify", LIGHTS, "-p", "a: G F ns@GREEN", "--timings", "--engine", "explicit", "-q")
    assert done.returncode == 0 and done.stdout.startswith("holds")
    title, *rows = done.stderr.splitlines()
    assert title.split() == ["where", "the", "time", "went", "CPU", "s", "wall", "s"]
    names = [row.split("  ")[0] for row in rows]
    assert names[0].startswith("starting") and names[-1] == "the whole process"
    assert {"reading the arrangement", "exploring", "compiling to machine code", "printing"} <= set(names)
    assert "looking for violations of a" in names
    cpu = [float(row[len(name) :].split()[0]) for name, row in zip(names, rows, strict=True)]
    assert sum(cpu[:-1]) <= cpu[-1] + 0.001 * len(cpu)
