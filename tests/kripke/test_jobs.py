"""`--jobs N`: what a search finds, says and saves does not depend on the number of its threads."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from time import monotonic, sleep

import pytest

from benchmarks.ring import ring
from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import Source
from llfsm_verify.kripke.explore import Explorer
from llfsm_verify.limits import Budget, Limits
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.semantics.lowering import lower
from tests.cli.running import llfsm
from tests.kripke.threads import JOBS, Knobs, contents, counted, divided, run, timeless
from tests.models.cases import CASES, CaseStudy
from tests.quick import FRESH, examples, share

LARGE = {
    "komodo_arm", "reasoned_lights", "batman", "ball_conditions", "vacuum", "press", "fruit_picking",
    "takeover", "robocup",
}  # fmt: skip


@pytest.fixture
def busy() -> Iterator[None]:
    """Two processes beside this one that take what they get."""
    processes = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(2)]
    yield
    for process in processes:
        process.kill()
        process.wait()


@pytest.mark.slow
def test_random_arrangements() -> None:
    assert run(examples(60), kinds=("threads at work",))["cases"]


@pytest.mark.long
def test_many_random_arrangements() -> None:
    assert run(500 if FRESH else 45)["cases"]


@pytest.mark.slow
def test_random_arrangements_beside_busy_processes(busy: None) -> None:
    assert run(examples(4), kinds=("threads at work",))["cases"]


@pytest.mark.slow
@pytest.mark.parametrize("edges", [True, False])
@pytest.mark.parametrize("delay", [0, 12345])
def test_a_table_that_grows(edges: bool, delay: int) -> None:
    """Slots are moved by several threads; 44,955 configurations."""
    program = lower(load_arrangement_text(ring(5, 3)), ())
    found = list[list[dict[str, object]]]()
    with divided(Knobs(smallest=1000, entries=5000, stride=7, delay=delay)):
        for jobs in JOBS:
            found.append([])
            explorer = Explorer(program, Budget(Limits()), with_edges=edges, jobs=jobs)
            for nodes in (*range(2_000, 20_000, 3_000), None):
                explorer.explore(nodes)
                found[-1].append(contents(explorer))
            explorer.close()
    assert found[1:] == found[:1] * 2
    assert found[0][-1]["counts"][0] == 44_955  # type: ignore[index]


def _case_studies() -> Iterator[object]:
    for number, case in enumerate(CASES):
        for file in sorted(case.arrangement.parent.glob("*.yaml")):
            if ".machine." in file.name or not (file.stem == "arrangement" or file.stem.startswith("faulty")):
                continue
            is_long = case.model in LARGE or file.stem != "arrangement"
            if file.stem != "arrangement" and not share(number, 3):
                continue
            marks = pytest.mark.long if is_long else pytest.mark.slow
            yield pytest.param(case, file, marks=marks, id=f"{case.model}/{file.stem}")


@pytest.mark.parametrize(("case", "file"), [*_case_studies()])
def test_case_studies(case: CaseStudy, file: Path, tmp_path: Path) -> None:
    """Verdicts, traces and counts, as users see them."""
    said = []
    with divided(Knobs(smallest=64, entries=1 << 12)):
        for jobs in JOBS:
            traces = tmp_path / str(jobs)
            done = llfsm(
                "verify", str(file), str(case.property_file), "--engine", "explicit", "--jobs", str(jobs),
                "--format", "json", "--save-traces", str(traces), "--max-states", "300000",
            )  # fmt: skip
            texts = {path.name: path.read_text() for path in traces.glob("*")}
            said.append((done.returncode, timeless(json.loads(done.stdout)), {n: _here(t) for n, t in texts.items()}))
    assert said[1:] == said[:1] * 2
    assert said[0][0] in (0, 1)


def _here(text: str) -> str:
    """Without the way from the traces to the model."""
    return re.sub(r"(\.\./)+", "", text)


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc").exists(), reason="threads of a process are counted in /proc")
def test_a_search_ends_its_threads() -> None:
    before = len(list(Path("/proc/self/task").iterdir()))
    with divided(Knobs()):
        explorer = Explorer(lower(load_arrangement_text(ring(4, 3)), ()), Budget(Limits()), jobs=8)
        explorer.explore(None)
        explorer.close()
    end = monotonic() + 20  # a thread that has been joined may still be there for a moment
    while len(list(Path("/proc/self/task").iterdir())) > before and monotonic() < end:
        sleep(0.01)
    assert len(list(Path("/proc/self/task").iterdir())) <= before


BROAD = """
name: broad
observe: OBSERVE
whiteboard:
  i: {type: 0..11, init: 0, role: input}
  j: {type: 0..3, init: 0, role: input}
  x: {type: 0..40, init: 0}
  y: {type: 0..40, init: 0}
machines:
  m:
    inline:
      machine: M
      states:
        - {name: A, on_entry: x = (x + i / 4 + 5 * (j / 3)) % 41;, transitions: [{when: "true", to: B}]}
        - {name: B, transitions: [{when: "true", to: A}]}
  n:
    inline:
      machine: N
      states:
        - {name: A, on_entry: y = (y * 3 + j / 2 + x + i) % 41;, transitions: [{when: "true", to: B}]}
        - {name: B, transitions: [{when: "true", to: A}]}
schedule: [m, n]
"""
"""Of a configuration with 48 steps some lead to equal ones, with equal or with other letters."""


@pytest.mark.slow
@pytest.mark.parametrize("observe", ["ringlet", "cycle"])
@pytest.mark.parametrize("buffer", [300, 1 << 15])
@pytest.mark.parametrize("arena", [1 << 11, 1 << 20])
def test_many_successors_that_are_equal(observe: str, buffer: int, arena: int) -> None:
    """Small arenas undo chunks, and small buffers end in the middle of a node."""
    arrangement = load_arrangement_text(BROAD.replace("OBSERVE", observe))
    lines = parse_properties([Source("broad.ltl", "p: G (i > 5 -> F x == 2)\nq: G !(j == 1 && y == 7)")])
    program = lower(arrangement, bind(arrangement, lines).atoms, keep_all_bits=True)
    found, tally = [], Counter[str]()
    with divided(Knobs(smallest=64, entries=3000, stride=5, arena=arena, buffer=buffer)), counted(tally):
        for jobs in JOBS:
            explorer = Explorer(program, Budget(Limits()), jobs=jobs)
            explorer.explore(None)
            found.append(contents(explorer))
            explorer.close()
    assert found[1:] == found[:1] * 2
    assert tally["threads at work"] > 4


FAULTS = """
name: faults
whiteboard:
  a: {type: 0..63, init: 0, role: input}
  b: {type: 0..31, init: 0, role: input}
  x: {type: 0..63, init: 0}
  y: {type: 0..31, init: 0}
  w: {type: 0..3, init: 0}
machines:
  m:
    inline:
      machine: M
      states:
        - name: DRAW
          internal: x = a; y = b;
          transitions: [{when: x + y > 0, to: FAULT}]
        - name: FAULT
          internal: if ((x + y) % 3 == 1) w = 3 + x % 64; if ((x + y) % 3 == 2) w = 6 / (y - y);
schedule: [m]
"""


@pytest.mark.slow
@pytest.mark.parametrize("stride", [1, 5, 11])
def test_the_first_of_many_that_fault(stride: int) -> None:
    """Several threads meet the same faults in one chunk."""
    program = lower(load_arrangement_text(FAULTS), ())
    found = []
    with divided(Knobs(stride=stride)):
        for jobs in JOBS:
            explorer = Explorer(program, Budget(Limits()), jobs=jobs)
            explorer.explore(None)
            found.append((contents(explorer), len(explorer.graph.faults)))
            explorer.close()
    assert found[1:] == found[:1] * 2
    assert found[0][1] == 2
