"""Running cases: in this process with an eye on what comes out, and in children whose time and memory are limited."""

from __future__ import annotations

import faulthandler
import io
import json
import os
import re
import resource
import select
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import chdir
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch
from xml.etree import ElementTree as ET

from llfsm_verify import certificate, cli
from tests.fuzzing.case import Case, case_of

CPU_SECONDS = 15.0
"""A case that takes more processor time hangs (the commands are given a limit of 5 s where they have one)."""
MEMORY = 2 << 30
"""A child may use so much more than its parent does."""
BLOCKED = 90.0
"""A child that has said nothing for so many seconds, and used no processor time, is blocked."""
DOCUMENTED = frozenset({0, 1, 2, 3, 4})
"""Exit codes, without those for our own mistakes: 5 and 70."""
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f]")


@dataclass(frozen=True, slots=True)
class Outcome:
    """What came of a case: `found` is None where it ended as documented, else what it has found, in a line."""

    code: int | None
    found: str | None
    detail: str = ""

    @property
    def place(self) -> str:
        """What findings of one cause have in common."""
        return re.sub(r"\d+", "N", self.found or "")


def run_case(case: Case) -> Outcome:
    """Run a case in this process, in a folder of its own."""
    with tempfile.TemporaryDirectory() as name, chdir(name):
        case.write(Path())
        streams = [
            io.TextIOWrapper(io.BytesIO(data), encoding="utf-8", errors=errors)
            for data, errors in ((case.stdin, "strict"), (b"", "strict"), (b"", "backslashreplace"))
        ]
        with (
            patch.object(sys, "stdin", streams[0]),
            patch.object(sys, "stdout", streams[1]),
            patch.object(sys, "stderr", streams[2]),
            patch.dict(os.environ, {cli.DEBUG: "1"}),
        ):
            try:
                code = PROGRAMS.get(case.arguments[0], cli.main)(case.arguments)
            except SystemExit as leaving:  # argparse's way
                code = int(leaving.code or 0)
            except Exception as error:  # noqa: BLE001 - this is what is looked for
                import traceback

                return Outcome(None, f"{type(error).__name__} {_where(error)}", traceback.format_exc())
        texts = []
        for stream in streams[1:]:
            stream.flush()
            texts.append(stream.buffer.getvalue().decode("utf-8", "replace"))
        return judge(case, code, *texts)


def judge(case: Case, code: int, output: str, errors: str) -> Outcome:
    """What is to be said of a command that has ended."""
    if code not in DOCUMENTED or re.search(
        r"^Traceback \(most recent", errors, re.MULTILINE
    ):  # an excerpt may quote one
        frames = re.findall(r'File ".*?(llfsm_verify/[^"]+)", line \d+, in (\w+)', errors)
        kinds = re.findall(r"^([\w.]*(?:Error|Exception|Disagreement)\w*)", errors, re.MULTILINE)
        where = ":".join(frames[-1]) if frames else ""
        return Outcome(code, f"exit code {code} {kinds[-1] if kinds else ''} {where}", errors)
    if "out of memory" in errors:
        return Outcome(code, "out of memory", errors)
    wrong = _malformed(case, code, output)
    if wrong is not None:
        return Outcome(code, wrong, output)
    control = None if "always" in case.arguments else _CONTROL.search(output + errors)
    if control is not None and case.arguments[0] not in ("kripke", "schema"):
        return Outcome(code, f"control character {control[0]!r} is printed by {case.arguments[0]}", output + errors)
    return Outcome(code, None)


def _malformed(case: Case, code: int, output: str) -> str | None:
    """What of the output is not in the format asked for."""
    wanted = dict(zip(case.arguments, case.arguments[1:], strict=False)).get("--format")
    try:
        if wanted in ("json", "sarif") and output:
            json.loads(output)
        elif wanted in ("junit", "graphml") and output:
            ET.fromstring(output)
    except (ValueError, ET.ParseError) as error:
        return f"what is written is no {wanted}: {type(error).__name__}"
    if wanted in ("json", "sarif") and not output and code not in (2, 4) and case.arguments[0] != "kripke":
        return f"nothing is written with --format {wanted} and exit code {code}"
    return None


def _where(error: BaseException) -> str:
    import traceback

    frames = [f for f in traceback.extract_tb(error.__traceback__) if "llfsm_verify" in f.filename]
    return f"{Path(frames[-1].filename).name}:{frames[-1].name}" if frames else ""


def _check_certificate(arguments: Sequence[str]) -> int:
    return certificate.main(arguments[1:])


def _update_trace(arguments: Sequence[str]) -> int:
    """What the pytest plugin does with a trace file: replay it, and rewrite what it expects."""
    from llfsm_verify.arrangement import load_arrangement
    from llfsm_verify.diagnostics import DiagnosticError
    from llfsm_verify.report.plain import plain_text
    from llfsm_verify.report.saving import update_trace_file
    from llfsm_verify.report.text import trace_text
    from llfsm_verify.verification.replay import replay_file

    try:
        done = replay_file(arguments[1], None, load_arrangement)
        if done.replay.trace is not None:
            plain_text(trace_text(done.replay.trace), 100)
        if done.found is None:
            return 3
        changed = update_trace_file(Path(arguments[1]), done.found, done.arrangement.digest)
        again = replay_file(arguments[1], None, load_arrangement)
    except DiagnosticError as error:
        for diagnostic in error.diagnostics:
            diagnostic.render()
        return 3
    assert again.file.expect == done.found, "what was rewritten reads back as something else"
    return int(changed)


PROGRAMS: dict[str, Callable[[Sequence[str]], int]] = {
    "check-certificate": _check_certificate,
    "update-trace": _update_trace,
}
"""What is not a command of `llfsm`."""


# ---------------------------------------------------------------- children


def run_all(makers: Sequence[Callable[[], Case]], batch: int = 40) -> Iterator[tuple[Case | None, Outcome]]:
    """Each case with its outcome, in order (no case: making it has ended the child).

    Each batch is made and run in a child, as is what is left of it after a crash.
    """
    start = 0
    while start < len(makers):
        for found in _batch(makers[start : start + batch]):
            yield found
            start += 1


def run_alone(case: Case) -> Outcome:
    """The outcome of a case that runs in a child of its own."""
    ((_, outcome),) = run_all([lambda: case])
    return outcome


def _batch(makers: Sequence[Callable[[], Case]]) -> Iterator[tuple[Case | None, Outcome]]:
    """The first cases and outcomes: all, or those up to one that has ended the child."""
    reading, writing = os.pipe()
    with tempfile.TemporaryFile() as traces:
        child = os.fork()
        if child == 0:
            os.close(reading)
            _serve(makers, writing, traces.fileno())
        os.close(writing)
        known, case = 0, None
        try:
            for line in _lines(reading, child):
                told = json.loads(line)
                if "arguments" in told:
                    case = case_of(line.decode())
                else:
                    yield case, Outcome(**told)
                    known, case = known + 1, None
        finally:
            os.close(reading)
            if known < len(makers):
                _kill(child)
            _, status = os.waitpid(child, 0)
        if known < len(makers):
            traces.seek(0)
            yield case, _ended(status, traces.read().decode("utf-8", "replace"))


def _kill(child: int) -> None:
    """End a child of ours that is blocked; one that has ended already is left alone."""
    if os.waitid(os.P_PID, child, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None:
        time.sleep(0.2)
        if os.waitid(os.P_PID, child, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None:
            os.kill(child, signal.SIGKILL)


def _ended(status: int, traces: str) -> Outcome:
    number = os.WTERMSIG(status) if os.WIFSIGNALED(status) else 0
    frames = re.findall(r'File ".*?(llfsm_verify/[^"]+)", line \d+ in (\w+)', traces)
    where = ":".join(frames[0]) if frames else ""
    names = {signal.SIGPROF: f"takes more than {CPU_SECONDS:.0f} s of processor time", signal.SIGKILL: "is blocked"}
    said = names.get(signal.Signals(number)) if number else None
    what = said or (f"ended by {signal.Signals(number).name}" if number else f"child ended with status {status}")
    return Outcome(None, f"{what} {where}", traces)


def _serve(makers: Sequence[Callable[[], Case]], writing: int, traces: int) -> None:
    """The child: run the cases and tell each outcome."""
    code = 1
    try:
        with open("/proc/self/statm") as file:
            used = int(file.read().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, used + MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        faulthandler.enable(file=traces)
        signal.signal(signal.SIGPROF, signal.SIG_DFL)
        faulthandler.register(signal.SIGPROF, file=traces, chain=True)
        for make in makers:
            signal.setitimer(signal.ITIMER_PROF, CPU_SECONDS)
            case = make()
            _tell(writing, case.to_json(indent=None).encode())
            signal.setitimer(signal.ITIMER_PROF, CPU_SECONDS)
            outcome = run_case(case)
            signal.setitimer(signal.ITIMER_PROF, 0)
            line = json.dumps({"code": outcome.code, "found": outcome.found, "detail": outcome.detail[-6000:]})
            _tell(writing, line.encode() + b"\n")
        code = 0
    finally:
        os._exit(code)


def _tell(writing: int, data: bytes) -> None:
    while data:
        data = data[os.write(writing, data) :]


def _lines(reading: int, child: int) -> Iterator[bytes]:
    """What a child tells, until it ends or is blocked."""
    buffer, last = b"", _processor_time(child)
    while True:
        ready, _, _ = select.select([reading], [], [], BLOCKED)
        if not ready:
            now = _processor_time(child)
            if now - last < 0.5:
                return
            last = now
            continue
        piece = os.read(reading, 1 << 16)
        if not piece:
            return
        *lines, buffer = (buffer + piece).split(b"\n")
        yield from lines


def _processor_time(child: int) -> float:
    """Of a child and those that it has waited for, in seconds."""
    try:
        fields = Path(f"/proc/{child}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return sum(map(int, fields[11:15])) / os.sysconf("SC_CLK_TCK")
