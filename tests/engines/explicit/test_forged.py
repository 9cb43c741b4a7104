"""Whatever a checkpoint says, going on from it ends in a diagnostic, in what was confirmed, or in a marked verdict."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from random import Random

import pytest

from benchmarks.ring import ring
from llfsm_verify.checking.reach import FIRST_LOOK
from llfsm_verify.engines.explicit.checkpoints import MOST_TARGET
from llfsm_verify.kripke import checkpoint
from llfsm_verify.kripke.compiled import kernels
from tests.cli.running import FAULTY, llfsm
from tests.engines.explicit.forging import NUMBERS, Check, Forged, mutations, write_line
from tests.quick import many, share

RING = "never: G !(m0@ON && m1@ON && m2.n == 2)\nback: G (m0@ON -> F m0@OFF)\nalone: G !(m0@ON && m1@ON)\n"
SINGLE = """\
name: single
cycle_ms: 200
whiteboard:
  go: {type: bool, init: false, role: input}
  wide: {type: 0..999, init: 0, role: input}
  at: {type: 0..2, init: 0}
  cells: {type: {array: 0..4, size: 3}, init: [0, 0, 0]}
  n: {type: 0..20, init: 0}
machines:
  m:
    inline:
      machine: M
      states:
        - name: WORK
          internal: "cells[at] = (cells[at] + 1) % 5; at = (at + 1) % 3; n = min(20, n + (wide > 500 ? 2 : 1));"
          transitions: [{when: "go && n > 10", to: REST}, {when: "after(1)", to: REST}]
        - {name: REST, internal: "n = 8 / (4 - cells[at]);", transitions: [{when: "go", to: WORK}]}
schedule: [m]
"""


@pytest.fixture(scope="module", autouse=True)
def compiled() -> None:
    """All kernels are there before a child has to compile them in its time."""
    kernels().load_all()


@pytest.fixture
def lights(tmp_path: Path) -> Check:
    """The check of the traffic lights whose mistake `both` shows."""
    (tmp_path / "both.ltl").write_text("both: G !(ns@GREEN && ew@GREEN)\n")
    return Check((FAULTY, str(tmp_path / "both.ltl")), tmp_path / "g.ckpt", 3, frozenset({"both"}))


@pytest.mark.slow
def test_a_checkpoint_that_nobody_changed_is_gone_on_from(lights: Check) -> None:
    forged = lights.saved()
    forged.write(lights.path)
    assert lights.outcome() == "violated"


@pytest.mark.slow
def test_sections_of_ones(lights: Check) -> None:
    forged = lights.saved()
    for number, section in enumerate(forged.sections):
        forged.with_section(number, b"\xff" * len(section)).write(lights.path)
        assert lights.outcome() == "refused", number


@pytest.mark.slow
@pytest.mark.parametrize(("turn", "value"), list(enumerate([*NUMBERS, True, None, "5", 1.0, [], "x" * 1000])))
def test_every_number(lights: Check, turn: int, value: object) -> None:
    forged = lights.saved()
    for number, (key, before) in enumerate(forged.header["numbers"].items(), turn):
        if not share(number, 3):
            continue
        forged.with_number(key, value).write(lights.path)
        found = lights.outcome()
        assert found == "refused" or (type(value) is type(before) and found in ("violated", "unknown")), (key, value)
    for key in ("target", "violations", "search", "program", "numbers"):
        Forged({**forged.header, key: value}, forged.sections).write(lights.path)
        fits = key == "target" and type(value) is int and FIRST_LOOK <= value <= MOST_TARGET
        assert lights.outcome() == ("violated" if fits else "refused"), key


@pytest.mark.parametrize(
    "header",
    [b"[" * 200_000, b'{"a":' * 100_000, b"[]", b"5", b"null", b'"x"', b"\xff\xfe", b"{", b"1" * 10_000,
     b'{"version": NaN}', b"x" * ((1 << 24) + 5)],
)  # fmt: skip
def test_a_line_that_is_no_header(lights: Check, header: bytes) -> None:
    write_line(lights.path, header)
    done = llfsm(*lights.run("--resume"))
    assert (done.returncode, done.stderr.count("error[E41")) == (3, 1), done.stderr


def test_a_checkpoint_of_the_first_format_belongs_to_another_version(lights: Check) -> None:
    lights.path.write_bytes(checkpoint.KIND + b"1\n{}\n")
    done = llfsm(*lights.run("--resume"))
    assert done.returncode == 3
    assert "error[E414]: the checkpoint belongs to another version of llfsm-verify" in done.stderr


def checks(folder: Path) -> dict[str, Check]:
    """Checks of several kinds, with what is true of each."""
    files = {"ring.yaml": ring(3, 3), "cycles.yaml": ring(3, 3) + "\nobserve: cycle\n", "single.yaml": SINGLE,
             "ring.ltl": RING,
             "single.ltl": "low: G (n < 12)\nrests: G F m@WORK\nsum: G !(cells[0] == 3 && at == 2 && n < 4)\n",
             "fair.ltl": "assume often: G F go0\n" + RING,
             "held.ltl": "steps: G (m0@ON -> F (m0@ON || !go0))\n" + RING}  # fmt: skip
    for name, text in files.items():
        (folder / name).write_text(text)
    kinds = {
        "plain": (("ring.yaml", "ring.ltl", "--cone", "off", "--chains", "off"), 60),
        "faults only": (("ring.yaml",), 60),
        "cycles": (("cycles.yaml", "ring.ltl"), 60),
        "chains": (("ring.yaml", "ring.ltl", "--chains", "on"), 40),
        "cone and chains": (("ring.yaml", "ring.ltl", "--cone", "on", "--chains", "on"), 30),
        "fair": (("ring.yaml", "fair.ltl", "--vacuity"), 60),
        "timed, one machine": (("single.yaml", "single.ltl"), 100),
        "witnesses": (("ring.yaml", "held.ltl", "--witness", "--all", "2"), 60),
    }
    found = {}
    for kind, (arguments, most) in kinds.items():
        named = tuple(str(folder / a) if a in files else a for a in arguments)
        true = json.loads(llfsm("verify", *named, "--format", "json").stdout)
        violated = {p["name"] for p in true["properties"] if p["verdict"] == "violated"}
        if true["faults"]["verdict"] == "violated":
            violated.add("faults")
        assert true["complete"]
        found[kind] = Check(named, folder / f"{kind}.ckpt", most, frozenset(violated))
    return found


@pytest.mark.long
def test_random_forgeries(tmp_path: Path) -> None:
    """Every outcome of a search that goes on from a changed checkpoint is one that `Check.outcome` allows."""
    random, count = Random(12), many(300)
    for kind, check in checks(tmp_path).items():
        original = check.saved()
        outcomes = Counter[str]()
        for number, forged in enumerate(mutations(original, random, count)):
            forged.write(check.path)
            try:
                outcomes[check.outcome()] += 1
            except AssertionError as error:
                error.add_note(f"{kind}, mutation {number}")
                raise
        assert outcomes["refused"] > count // 4
