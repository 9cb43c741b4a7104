"""llfsm-verify on a task: the whole command as a shell starts it, and in a second process the search alone.

`python -m benchmarks.ours ARRANGEMENT PROPERTIES [OPTIONS]` is that second process, with the command's options. It
first checks a tiny ring, so that nothing is loaded any more while the clock runs, and prints a JSON object with seconds
`wall` and `cpu` from the loaded arrangement to all verdicts, and `build`, processor time for the step program and its
machine code.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.children import expect, run
from benchmarks.measure import Measurement, Wrong
from benchmarks.ring import ring
from benchmarks.tasks import Task

TIMEOUT = 900
NAME = "llfsm-verify"
SHARED = f"{NAME}, 2 jobs"
TINY = "tiny: G (m0@OFF -> F !m0@OFF)\n"


def measure(task: Task, folder: Path, root: Path, *, shared: bool = False) -> Measurement:
    """One measurement, of two threads where it is `shared`; files go to `folder`. Raises Wrong and ChildFailed."""
    options = (*task.options, "--jobs", "2") if shared else task.options
    if isinstance(task.arrangement, Path):
        arrangement = str(task.arrangement)
    else:
        arrangement = str(_write(folder / "arrangement.yaml", task.arrangement))
    properties = str(_write(folder / "properties.ltl", task.properties))
    command = [sys.executable, "-m", "llfsm_verify", "verify", arrangement, properties, *options]
    # The idle run comes first: it compiles the kernels, should they be new.
    idle = _idle(folder, root, bool(task.properties), options)
    whole = expect(run([*command, "--format", "json"], timeout=TIMEOUT, cwd=root), command, 0, 1)
    answer = json.loads(whole.output)
    search = [sys.executable, "-m", "benchmarks.ours", arrangement, properties, *options]
    alone = json.loads(expect(run(search, timeout=TIMEOUT, cwd=root), search, 0).output)
    verdicts = judge(task, answer)
    if alone["states"] != answer["states"]:
        raise Wrong(f"{task.key}: {NAME} found {alone['states']} states instead of {answer['states']} from Python")
    counted = answer["complete"] and answer["counted"]
    states, transitions = (answer["states"], answer["transitions"]) if counted else (0, 0)
    return Measurement(
        SHARED if shared else NAME, states, transitions, verdicts, whole.wall, whole.cpu,
        alone["wall"], alone["cpu"], alone["build"], max(0, whole.peak - idle),
    )  # fmt: skip


def judge(task: Task, answer: Mapping[str, Any]) -> dict[str, str]:
    """The verdicts in a result as JSON. Raises Wrong when it is not as the task expects."""
    verdicts = {item["name"]: item["verdict"] for item in answer["properties"]}
    if answer["faults"]["verdict"] != "holds":
        raise Wrong(f"{task.key}: {NAME} says of faults: {answer['faults']['verdict']}")
    if task.states is not None:
        if answer["engine"] != "explicit" or not answer["complete"]:
            raise Wrong(f"{task.key}: {NAME} did not search everything")
        if answer["states"] != task.states:
            raise Wrong(f"{task.key}: {NAME} found {answer['states']} states instead of {task.states}")
    if verdicts != task.verdicts:
        raise Wrong(f"{task.key}: {NAME} says {verdicts} instead of {dict(task.verdicts)}")
    return verdicts


def _write(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def _idle(folder: Path, root: Path, with_properties: bool, options: tuple[str, ...]) -> int:
    """The command's resident memory when there is next to nothing to search, in bytes."""
    arrangement = _write(folder / "tiny.yaml", ring(2, 2))
    properties = _write(folder / "tiny.ltl", TINY if with_properties else "")
    command = [sys.executable, "-m", "llfsm_verify", "verify", str(arrangement), str(properties), *options]
    return expect(run(command, timeout=TIMEOUT, cwd=root), command, 0, 1).peak


def main(arguments: list[str]) -> None:
    from llfsm_verify.arrangement.loader import load_arrangement, load_arrangement_text
    from llfsm_verify.backends.native.executor import NativeProgram
    from llfsm_verify.checking.problem import bind
    from llfsm_verify.checking.verdict import Options
    from llfsm_verify.cli.commands import verify_parser
    from llfsm_verify.diagnostics import Source
    from llfsm_verify.engines.explicit.options import ExplicitOptions
    from llfsm_verify.logic.properties import parse_properties
    from llfsm_verify.semantics.lowering import lower
    from llfsm_verify.verification.verify import verify

    text = Path(arguments[1]).read_text(encoding="utf-8")
    asked = verify_parser().parse_args(arguments)
    options = Options(
        keep_all_bits=asked.keep_all_bits,
        own=(ExplicitOptions(cone=asked.cone, compression=asked.compression, jobs=asked.jobs),),
    )
    verify(load_arrangement_text(ring(2, 2)), parse_properties([Source("tiny.ltl", TINY)]), options, asked.engine)
    arrangement = load_arrangement(arguments[0])
    properties = parse_properties([Source(arguments[1], text)])
    begin = time.process_time()
    NativeProgram(
        lower(arrangement, bind(arrangement, properties).atoms, keep_all_bits=options.keep_all_bits)
    ).compile()
    build = time.process_time() - begin
    wall, cpu = time.perf_counter(), time.process_time()
    result = verify(arrangement, properties, options, asked.engine)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    print(json.dumps({"states": result.exploration.states, "wall": wall, "cpu": cpu, "build": build}))


if __name__ == "__main__":
    main(sys.argv[1:])
