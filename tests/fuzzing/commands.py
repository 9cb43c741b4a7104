"""Whole commands as processes of their own: mutated files, standard input, closed streams, readers that leave early."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from random import Random

from tests.fuzzing.case import Case
from tests.fuzzing.readers import make
from tests.fuzzing.running import CPU_SECONDS, Outcome, judge

ADDRESS_SPACE = 8 << 30
START = 10.0
"""Seconds of processor time for starting Python, beside those of the work."""
CLOSED, FULL, LEFT = "closed", "/dev/full", "left"
STREAMS = ("kept", "kept", "kept", "kept", CLOSED, FULL, LEFT)
"""What becomes of standard output or error; `left`: a pipe that nobody reads."""
TIMEOUT = 600
MODULES = {"check-certificate": "llfsm_verify.certificate"}
WRITTEN_FOR_PYTEST = "update-trace"


def command_case(seed: int, number: int, names: Sequence[str]) -> tuple[Case, dict[str, str]]:
    """A case for a process, and what becomes of each of its streams."""
    random = Random(f"{seed} command {number}")
    case = make(names[number % len(names)], seed, number)
    if case.arguments[0] == WRITTEN_FOR_PYTEST:
        case = replace(case, arguments=("replay", *case.arguments[1:]))
    files = dict(case.files)
    places = [i for i, argument in enumerate(case.arguments) if argument in files and i > 0]
    streams = {name: random.choice(STREAMS) for name in ("stdout", "stderr")}
    streams["stdin"] = "kept"
    if places and random.random() < 0.35 and "." in case.arguments[places[0]]:
        place = random.choice(places)
        arguments = (*case.arguments[:place], "-", *case.arguments[place + 1 :])
        case = replace(case, arguments=arguments, stdin=files[case.arguments[place]])
        streams["stdin"] = random.choice(("kept", "kept", CLOSED))
    return case, streams


def run_process(case: Case, streams: dict[str, str]) -> Outcome:
    """The outcome of a command in a process of its own, whose processor time and memory are limited."""
    module = MODULES.get(case.arguments[0], "llfsm_verify")
    arguments = case.arguments[1:] if case.arguments[0] in MODULES else case.arguments

    def prepare() -> None:
        seconds = int(CPU_SECONDS + START)
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 5))
        resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE, ADDRESS_SPACE))
        for number, name in enumerate(("stdin", "stdout", "stderr")):
            if streams[name] == CLOSED:
                os.close(number)

    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        case.write(folder)
        stdin = stack.enter_context(tempfile.TemporaryFile())
        stdin.write(case.stdin)
        stdin.seek(0)
        outputs = {name: stack.enter_context(tempfile.TemporaryFile()) for name in ("stdout", "stderr")}
        given: dict[str, int] = {}
        for name, output in outputs.items():
            if streams[name] == FULL and Path(FULL).exists():
                given[name] = stack.enter_context(open(FULL, "wb")).fileno()
            elif streams[name] == LEFT:
                reading, writing = os.pipe()
                os.close(reading)
                stack.callback(os.close, writing)
                given[name] = writing
            else:
                given[name] = output.fileno()
        code = subprocess.run(
            [sys.executable, "-m", module, *arguments],
            stdin=stdin,
            cwd=folder,
            env={**os.environ, "PYTHONPATH": str(Path(__file__).parents[2]), "LLFSM_DEBUG": "1"},
            preexec_fn=prepare,
            check=False,
            timeout=TIMEOUT,
            **given,
        ).returncode
        texts = []
        for output in outputs.values():
            output.seek(0)
            texts.append(output.read().decode("utf-8", "replace"))
    if code < 0:
        return Outcome(code, f"ended by signal {-code}", texts[1])
    if any(kind != "kept" for kind in streams.values()):
        # What is written is not all that there is.
        case = replace(case, arguments=tuple(a for a in case.arguments if a != "--format"))
    return judge(case, code, *texts)


def run_commands(count: int, seed: int, start: int, names: Sequence[str]) -> int:
    """Run so many commands and print what came of them; 1 when something was found."""
    codes: Counter[str] = Counter()
    failed = 0
    for number in range(start, start + count):
        case, streams = command_case(seed, number, names)
        outcome = run_process(case, streams)
        codes[f"{case.arguments[0]} {outcome.code}"] += 1
        if outcome.found is not None:
            failed = 1
            told = f"{number}: {outcome.found}\n  {streams}\n  llfsm {' '.join(case.arguments)[:300]}\n"
            sys.stdout.write((told + outcome.detail[-900:]).encode("utf-8", "replace").decode() + "\n")
            sys.stdout.flush()
    sys.stdout.write(f"{count} commands; " + ", ".join(f"{code}: {n}" for code, n in sorted(codes.items())) + "\n")
    return failed
