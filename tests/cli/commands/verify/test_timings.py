"""`--timings`: where the time of a check went."""

from __future__ import annotations

from pathlib import Path

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


def test_groups_of_properties_are_told(tmp_path: Path) -> None:
    text = (
        "name: inputs\nwhiteboard: {a: &i {type: bool, role: input}, b: *i, c: *i, d: *i}\n"
        "machines: {m: {inline: {machine: M, states: [{name: A}]}}}\nschedule: [m]\n"
    )
    (tmp_path / "i.yaml").write_text(text, encoding="utf-8")
    properties = [part for name in "abcd" for part in ("-p", f"p{name}: G ({name} -> m@A)")]
    done = llfsm("verify", str(tmp_path / "i.yaml"), *properties, "--timings", "-q")
    assert done.returncode == 0, done.stderr
    rows = done.stderr.splitlines()
    at = next(i for i, row in enumerate(rows) if row.startswith("the whole process"))
    assert [row.split("  ")[0] for row in rows[at + 1 :]] == [
        "group 1 of 2: pd (d)",
        "group 2 of 2: pa, pb, pc (a, b, c)",
    ]
