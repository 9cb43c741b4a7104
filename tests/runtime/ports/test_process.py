"""Ports that are programs: what they say and are told, and that none of their mistakes reaches the run."""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from llfsm_verify import load
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.runtime.ports.process import port as process_port
from llfsm_verify.runtime.ports.process.child import PIECE
from llfsm_verify.runtime.ports.process.port import ProcessPort
from tests.cli.running import LIGHTS
from tests.runtime.ports.bench import Bench, bench, declared
from tests.runtime.ports.picker import PICKER, picker, port

STAY = "for message in messages: pass\n"


@contextmanager
def run(folder: Path, program: str, keys: str = "", *, hello: str = '{"hello": 1}') -> Iterator[Bench]:
    text = port(folder, program, keys, hello=hello)
    with bench(*declared(text, folder, picker()), code=picker()) as made:
        yield made


def child_of(made: Bench) -> ProcessPort:
    ((_, found),) = made.ports._open
    assert isinstance(found, ProcessPort)
    return found


def counts(made: Bench, name: str) -> int:
    return int(getattr(made.ports.counts["p"], name))


def test_values_go_both_ways_and_the_end_is_said(tmp_path: Path) -> None:
    program = """
log = open("log", "w")
print(json.dumps(hello), file=log)
say(values={"level": 3})
for message in messages: print(json.dumps(message), file=log, flush=True)
print("closed", file=log)
"""
    keys = "safe: {doubled: 0}\npatience: 2min"
    with run(tmp_path, program, keys, hello='{"hello": 1, "values": {"level": 2}}') as made:
        made.turn()
        assert made.value("level") in (2, 3)  # before the first cycle
        made.until(made.has("doubled", 6))
        made.ports.serve(0)
        made.end("stopped")
        assert made.said == [] and counts(made, "taken") in (1, 2)
    lines = [json.loads(line) for line in (tmp_path / "log").read_text().splitlines()[:-1]]
    number = {"low": -3, "high": 4, "boolean": False, "digits": 0, "labels": []}
    assert lines[0]["inputs"] == {"level": number} and lines[0]["port"] == "p"
    assert [line["values"] for line in lines if "values" in line][-1] == {"doubled": 6}
    assert lines[-2:] == [{"safe": {"doubled": 0}}, {"end": "stopped"}]
    assert (tmp_path / "log").read_text().endswith("closed\n")


def test_a_child_is_an_ordinary_process(tmp_path: Path) -> None:
    """Of a run that ignores signals, it ignores none, has a group of its own, and no descriptor of the run."""
    program = (
        """
status = open("/proc/self/status").read()
field = lambda name: int(next(line for line in status.splitlines() if line.startswith(name)).split()[1], 16)
with open("seen", "w") as seen:
    descriptors = sorted(map(int, os.listdir("/proc/self/fd")))
    json.dump([field("SigIgn"), field("SigBlk"), os.getpgid(0) == os.getpid(), descriptors,
               os.sched_getscheduler(0), os.getcwd()], seen)
say(values={"level": 1})
"""
        + STAY
    )
    before = signal.signal(signal.SIGTTIN, signal.SIG_IGN)
    try:
        with run(tmp_path, program) as made:
            made.until(made.has("level", 1))
    finally:
        signal.signal(signal.SIGTTIN, before)
    ignored, blocked, own, descriptors, schedule, folder = json.loads((tmp_path / "seen").read_text())
    assert (blocked, own, schedule, folder) == (0, True, os.SCHED_OTHER, str(tmp_path.resolve()))
    found = {number for number in signal.valid_signals() if ignored >> number - 1 & 1}  # and not those of the C library
    assert found <= {signal.SIGPIPE, signal.SIGXFSZ}  # Python's own
    assert [one for one in descriptors if one > 2 and one not in (3, 4)] == []  # of `open` and `listdir`


MISBEHAVES = {
    "garbage": ('print("\\x00\\x01 not json"); say(values={"level": 1})', "is not JSON"),
    "a list": ("print([1]); say(values={'level': 1})", "not an object"),
    "no UTF-8": ("os.write(1, bytes([255, 10])); say(values={'level': 1})", "not UTF-8"),
    "a line without an end": ("os.write(1, b'x' * 100_000 + b'\\n'); say(values={'level': 1})", "longer than 65,536"),
    "no message": ("say(colour='red'); say(values={'level': 1})", "is not a message"),
    "values that are none": ("say(values=[1]); say(values={'level': 1})", "`values` is not a mapping"),
    "another field": ("say(values={'colour': 1}); say(values={'level': 1})", "none of the fields level"),
    "a second hello": ("say(hello=1); say(values={'level': 1})", "is not a message"),
    "an answer to nothing": ("say(answer=7); say(values={'level': 1})", "has a number for which nothing waits: 7"),
    "a number that is none": ("say(answer='x'); say(values={'level': 1})", "`answer` is not a whole number"),
    "a truth value as number": ("say(answer=True); say(values={'level': 1})", "`answer` is not a whole number"),
    "a state that is none": ("say(state=3, of=1); say(values={'level': 1})", "`state` is not a text"),
    "a cycle": ("say(cycle=0); say(values={'level': 1})", "no `clock: external`"),
    "deep": ("print('[' * 60_000); say(values={'level': 1})", "is not JSON"),
    "a huge number": (
        "print('{\"values\": {\"level\": ' + '9' * 5000 + '}}'); say(values={'level': 1})",
        "is not JSON",
    ),
}


@pytest.mark.parametrize("name", MISBEHAVES)
def test_what_is_wrong_is_counted_and_said_once(name: str, tmp_path: Path) -> None:
    program, told = MISBEHAVES[name]
    with run(tmp_path, f"{program}\n{program}\n{STAY}") as made:
        made.until(made.has("level", 1))
        made.until(lambda: counts(made, "malformed") == 2)
        assert len(made.said) == 1 and told in made.said[0]


@pytest.mark.parametrize("what", ["answer", "state", "of", "values", "colour", "level"])
def test_no_depth_of_brackets_ends_a_port(what: str, tmp_path: Path) -> None:
    """Whichever depth is the first that Python cannot read, or write."""
    field = '{"values": {"level": %s}}' if what == "level" else f'{{"of": 1, "{what}": %s}}'
    said = f"next(messages)\nfor n in range(700, 1100): print({field!r} % ('[' * n + ']' * n))\n"
    with run(tmp_path, said + "say(values={'level': 1})\n" + STAY) as made:
        made.until(made.has("level", 1))
        assert counts(made, "malformed") + counts(made, "refused") == 400
        assert len(made.said) <= 3 and not any("the port has failed" in one for one in made.said)


def test_what_the_child_says_steers_no_terminal_and_floods_none(tmp_path: Path) -> None:
    program = """
next(messages)
for n in range(500):
    say(**{f"\\x1b[2J{n}": 1}); say(answer=n); say(state=f"S{n}", of=n); say(say=f"\\ud800\\x1b[31m{n}")
    say(lost=["level"], why="\\x1b\\n" * 99); say(values={"level": f"\\x9b{n}" * 5000})
say(values={"level": 1})
"""
    with run(tmp_path, program + STAY) as made:
        made.until(made.has("level", 1))
        assert len(made.said) <= 104 and counts(made, "malformed") == 1500 and counts(made, "refused") == 500
        said = "".join(made.said)
        assert said.isprintable() and said.encode() and max(map(len, made.said)) < 1100


def test_a_value_that_is_no_number_spoils_only_its_field(tmp_path: Path) -> None:
    program = 'print(\'{"values": {"level": NaN, "x": {"speed": 0.25}}}\')\n' + STAY
    text = port(tmp_path, program, "").replace("{level: level}", "{level: level, speed: x.speed}")
    with bench(*declared(text, tmp_path, picker()), code=picker()) as made:
        made.until(lambda: str(made.value("speed")) == "0.25")
        assert counts(made, "refused") == 1 and "NaN" in made.said[0]


def test_a_flood_leaves_time_for_others(tmp_path: Path) -> None:
    """Each round takes so many bytes at most, however much is there; in the end all of it has come."""
    program = (
        'next(messages)\nfor n in range(20_000): os.write(1, b\'{"values": {"level": %d}}\\n\' % (n % 4))\n'
        "say(values={'level': -3})\n" + STAY
    )
    with run(tmp_path, program) as made:
        most = taken = 0
        while made.value("level") != -3:
            made.turn()
            most, taken = max(most, counts(made, "taken") - taken), counts(made, "taken")
        assert taken == 20_001 and most <= PIECE / len('{"values": {"level": 0}}\n') + 1


def test_a_child_that_dies_is_started_again_and_told_the_newest_values(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(process_port, "RESTART", 0.0)
    program = """
say(values={"level": len(open("lives").read()) if os.path.exists("lives") else 0})
open("lives", "a").write("x")
if len(open("lives").read()) < 3:
    next(messages)
    os._exit(7)
for message in messages:
    if "values" in message: open("told", "w").write(json.dumps(message["values"]))
"""
    with run(tmp_path, program) as made:
        made.until(made.has("doubled", 4))
        assert "port p: it has ended with code 7: `level` keeps its last value" in made.said
        assert counts(made, "failures") == 2
        made.until(lambda: (tmp_path / "told").exists() and '"doubled": 4' in (tmp_path / "told").read_text())


ENDS = {
    "os._exit(3)": "it has ended with code 3",
    "os.kill(os.getpid(), 9)": "SIGKILL has ended it",
    "os.write(1, b'{\"values'); os._exit(0)": "it has ended with code 0",
    "os.close(0); os.close(1); os.close(2); import time; time.sleep(600)": "it has closed its standard input or output",
}


@pytest.mark.parametrize("program", ENDS)
def test_a_child_that_ends_fails_with_its_inputs(program: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process_port, "STOPPING", 0.05)
    with run(tmp_path, f"next(messages)\n{program}", "restart: false") as made:
        made.until(lambda: counts(made, "failures") == 1)
        assert ENDS[program] in made.said[-1]
        made.turn()
        assert made.ports.patience <= 0.02
        made.end("stopped")


def test_a_child_that_reads_nothing_is_not_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process_port, "LEAVING", 0.05)
    monkeypatch.setattr(process_port, "STOPPING", 0.05)
    ignore = (
        "import signal, time\nsignal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
        "say(values={'level': 1})\ntime.sleep(600)\n"
    )
    with run(tmp_path, ignore) as made:
        made.until(made.has("level", 1))
        child = child_of(made)._child
        assert child is not None
        pid = child._process.pid
        for _ in range(3):
            made.turn()
        made.end("stopped")
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


def test_what_a_child_has_started_ends_with_it(tmp_path: Path) -> None:
    program = (
        "import subprocess\nother = subprocess.Popen(['sleep', '600'])\nsay(values={'level': 1})\n"
        "open('pid', 'w').write(str(other.pid))\nsay(values={'level': 2})\n" + STAY
    )
    with run(tmp_path, program) as made:
        made.until(made.has("level", 2))
        pid = int((tmp_path / "pid").read_text())
        made.end("stopped")
    while Path(f"/proc/{pid}/stat").exists() and Path(f"/proc/{pid}/stat").read_text().split()[2] != "Z":
        time.sleep(0.001)


def test_the_child_says_what_failed_and_what_users_shall_know(tmp_path: Path) -> None:
    program = "say(say='the arm is cold'); say(say='the arm is cold'); say(lost=['level'], why='no sensor')\n" + STAY
    with run(tmp_path, program) as made:
        made.until(lambda: counts(made, "failures") == 1)
        assert made.said == ["port p: the arm is cold", "port p: no sensor: `level` keeps its last value"]


UNOPENED = {
    "[no-such-program]": ("No such file or directory", '{"hello": 1}', ""),
    "[./child.py]": ("Permission denied", '{"hello": 1}', ""),
    "": ("it has ended with code 4", "", "os._exit(4)"),
    " ": ("version 2 of the protocol", '{"hello": 2}', STAY),
    "  ": ("it says no hello", "good day", STAY),
    "   ": ("it says no hello", '{"values": {"level": 1}}', STAY),
    "    ": ("it has not said hello within 0.2 s", "", STAY),
    "     ": ("it says no hello: `values` is not a mapping", '{"hello": 1, "values": [1]}', STAY),
    "      ": ("version True of the protocol", '{"hello": true}', STAY),
    "       ": ("version ? of the protocol", '{"hello": ' + "[" * 900 + "]" * 900 + "}", STAY),
    "        ": ("it says no hello: it has `colour`", '{"colour": ' + "[" * 900 + "]" * 900 + "}", STAY),
}


@pytest.mark.parametrize("line", UNOPENED)
def test_a_child_that_cannot_be_used_is_said_before_the_run(line: str, tmp_path: Path) -> None:
    why, hello, program = UNOPENED[line]
    text = port(tmp_path, program, "patience: 200ms" if line == "    " else "patience: 2min", hello=hello)
    if line.strip():
        text = text.replace(text[text.index("[") : text.index("]") + 1], line)
    with pytest.raises(DiagnosticError) as caught, bench(*declared(text, tmp_path, picker()), code=picker()):
        pass
    (found,) = caught.value.diagnostics
    assert found.code == "E495" and why in found.message and found.hint and found.span is not None
    assert (found.span.line, found.span.column) == (2, 3)


@pytest.mark.parametrize("run_as", ["sh 'child one.sh' \"two words\"", "[sh, child one.sh, two words]"])
def test_a_program_in_another_language(run_as: str, tmp_path: Path) -> None:
    said = 'echo "{\\"values\\": {\\"level\\": ${#1}}}" | sed s/9/4/'
    (tmp_path / "child one.sh").write_text(f"read -r line\necho '{{\"hello\": 1}}'\n{said}\ncat > /dev/null\n")
    words = run_as if run_as[0] == "[" else json.dumps(run_as)
    text = f"ports: {{p: {{kind: process, run: {words}, on_failure: stale, inputs: [level]}}}}"
    with bench(*declared(text, tmp_path, picker()), code=picker()) as made:
        made.until(made.has("level", 4))


@pytest.mark.parametrize("language", ["python", "shell"])
def test_the_examples_let_a_car_pass(language: str) -> None:
    """In both languages the same: the car comes, and has its turn."""
    run = load(LIGHTS).run(ports=f"examples/ports/{language}.ports.yaml", rate=50)
    with run:
        while run.values()["ew_light"] != "GREEN":
            time.sleep(0.001)
        while run.values()["car"] is not False:
            time.sleep(0.001)
    assert run.said == []


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_a_program_ends_with_its_run(number: signal.Signals, tmp_path: Path) -> None:
    """Also where the supervisor is killed and the program does not look whether its input has ended."""
    ready = "open('pid', 'w').write(str(os.getpid()))\nos.rename('pid', 'ready')\n"
    program = f"import time\n{ready}time.sleep(600)\n"
    (tmp_path / "a.ports.yaml").write_text(port(tmp_path, program, ""))
    (tmp_path / "a.yaml").write_text(json.dumps(PICKER))
    words = ["run", str(tmp_path / "a.yaml"), "--ports", str(tmp_path / "a.ports.yaml"), "--set", "gain=1"]
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-m", "llfsm_verify", *words], stderr=pipe, stdout=pipe, text=True) as run:
        while not (tmp_path / "ready").exists():
            assert run.poll() is None, run.stderr and run.stderr.read()
            time.sleep(0.01)
        ended = os.pidfd_open(int((tmp_path / "ready").read_text()))
        run.send_signal(number)
        assert select.select([ended], [], [])[0]
        os.close(ended)
