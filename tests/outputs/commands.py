"""What commands print and write, word by word; `python -m tests.outputs.commands` writes outputs.txt anew.

What a solver finds is not here: it may be said in other words another time. Seconds, sizes of memory, versions and
names of temporary folders are replaced.
"""

from __future__ import annotations

import io
import os
import re
import shlex
import sys
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest import mock

from llfsm_verify.cli import main, main_verify

KEPT = Path(__file__).with_name("outputs.txt")
OURS = "tests/outputs/pedestrian.yaml tests/outputs/pedestrian.ltl"
SHOP = "tests/outputs/workshop.yaml tests/outputs/workshop.ltl"
DOOR = "tests/outputs/door.yaml"
LIGHTS = "models/traffic_lights/arrangement.yaml"
BOTH = "G !(ns@GREEN && ew@GREEN)"
FAULTY = "models/traffic_lights/faulty.yaml"
HELP = (
    "",
    "verify",
    "simulate",
    "replay",
    "draw",
    "monitor",
    "guard",
    "kripke",
    "check",
    "lint",
    "coverage",
    "query",
    "init",
    "schema",
    "property",
    "knowledge",
)
QUESTIONS = ("classify", "translate", "accepts", "equivalent", "implies", "simplify", "print", "draw", "example")

COMMANDS = (
    *(f"llfsm {name} --help".replace("  ", " ") for name in HELP),
    *(f"llfsm property {name} --help" for name in QUESTIONS),
    *(f"llfsm knowledge {name} --help" for name in ("table", "explain", "equivalent")),
    f"llfsm verify --engine explicit {OURS}",
    f"llfsm verify --engine explicit --strict --vacuity --witness -q {OURS}",
    f"llfsm verify --engine explicit --format json {OURS}",
    f"llfsm verify --engine explicit --format junit {OURS}",
    f"llfsm verify --engine explicit --format sarif {OURS}",
    f"llfsm verify --engine explicit --all 3 {FAULTY} -p 'both: G !(ns@GREEN && ew@GREEN)'",
    f"llfsm verify --engine explicit --all-steps {FAULTY} -p 'forbid both: [ns@GREEN && ew@GREEN]'",
    f"llfsm verify --engine explicit --save-traces FOLDER {OURS} -q",
    f"llfsm verify --engine explicit --max-states 20 {LIGHTS} -p 'G F ns@GREEN'",
    f"llfsm verify --engine bmc --depth 12 -q {LIGHTS} -p 'G !(ns@GREEN && ew@GREEN)'",
    f"llfsm verify --engine explicit --cone on --compression on {LIGHTS} -p 'G F ns@GREEN' -p '{BOTH}'",
    "llfsm verify no/such.yaml -p 'G a'",
    f"llfsm verify {LIGHTS} -p 'G nothing' -p 'G (ns@RED'",
    f"llfsm verify {LIGHTS} --engine explicit --depth 3 -p 'G true'",
    f"llfsm verify {LIGHTS} --accept-vacuity nobody -p 'G true'",
    f"llfsm verify --engine explicit {LIGHTS} -p 'assume a: G F false' -p 'b: G ns@RED'",
    f"llfsm verify --engine explicit -q {LIGHTS} -p 'assume a: G F false' -p 'b: G ns@RED' --allow-contradiction",
    f"llfsm query {LIGHTS} 'ns@GREEN && timer.ran' --engine explicit",
    f"llfsm query {LIGHTS} 'ns@GREEN && ew@GREEN' --engine explicit --format json",
    f"llfsm query {OURS.split(maxsplit=1)[0]} 'light@FAILED' --engine explicit --save FOLDER/run.trace.yaml",
    f"llfsm query {LIGHTS} 'ns@GREEN' --engine explicit --save FOLDER/none/run.trace.yaml",
    f"llfsm verify --engine explicit --color always -q {FAULTY} -p '{BOTH}' -p 'G F ns@GREEN'",
    "llfsm lint tests/outputs/pedestrian.yaml --local",
    "llfsm lint tests/outputs/pedestrian.yaml --local --format json",
    "llfsm lint tests/outputs/pedestrian.yaml --local --format sarif",
    "llfsm lint models/microwave/arrangement.yaml --local",
    *(f"llfsm kripke {LIGHTS} --format {f} -o FOLDER/k.{f}" for f in ("json", "dot", "graphml", "aut")),
    f"llfsm kripke {LIGHTS} --format smv -p 'a: G F ns@GREEN' -p 'forbid b: [ns@GREEN && ew@GREEN]'",
    f"llfsm kripke {LIGHTS} --format promela -p 'a: G F ns@GREEN' -p 'b: G (ns@GREEN -> X !ew@GREEN)'",
    "llfsm kripke tests/outputs/pedestrian.yaml --format smv -p 'a: G (walk -> lamp == RED)'",
    "llfsm kripke tests/outputs/pedestrian.yaml --format promela -p 'assume b: G F walk' -p 'a: G F light@GO'",
    f"llfsm kripke {LIGHTS} --max-states 10",
    f"llfsm kripke {LIGHTS} --max-states 10 --partial --format aut",
    f"llfsm verify --engine explicit --witness --vacuity {SHOP}",
    f"llfsm verify --engine explicit --format json {SHOP}",
    f"llfsm verify --engine explicit --strict --all-steps {DOOR} -p 'a: G (door@OPEN -> F door@SHUT)'",
    f"llfsm verify --engine explicit --save-traces FOLDER {DOOR} -p 'a: G (door@OPEN -> open)' -q",
    *(f"llfsm kripke {DOOR} --format {f} -p 'a: G (sampled(height) < 9)'" for f in ("json", "dot", "graphml", "aut")),
    *(f"llfsm kripke {DOOR} --format {f} -p 'a: G F door@OPEN' -p 'b: door@SHUT W push'" for f in ("smv", "promela")),
    *(f"llfsm kripke {SHOP.split(maxsplit=1)[0]} --format {f} -p 'a: G F made > 0' -p 'assume b: G F stop'"
      for f in ("smv", "promela")),
    *(f"llfsm lint {SHOP.split(maxsplit=1)[0]} --format {f}" for f in ("text", "json", "sarif")),
    f"llfsm lint {DOOR} --traces",
    *(f"llfsm draw {SHOP.split(maxsplit=1)[0]} --format {f}" for f in ("dot", "mermaid")),
    f"llfsm draw {SHOP.split(maxsplit=1)[0]} --machine drill --format mermaid",
    f"llfsm draw {DOOR} --machine door --format dot",
    f"llfsm simulate {SHOP.split(maxsplit=1)[0]} --seed 5 --steps 25 --hold none",
    f"llfsm simulate {DOOR} --seed 2 --cycles 9 --hold none",
    f"llfsm query {SHOP.split(maxsplit=1)[0]} 'drill@DONE' --engine explicit",
    f"llfsm query {DOOR} 'door@STUCK && count == 2' --engine explicit --all-steps",
    f"llfsm monitor tests/outputs/workshop.ltl --arrangement {SHOP.split(maxsplit=1)[0]}",
    "llfsm draw tests/outputs/pedestrian.yaml --format dot",
    "llfsm draw tests/outputs/pedestrian.yaml --machine light --format dot",
    "llfsm draw tests/outputs/pedestrian.yaml --machine light --format mermaid",
    "llfsm draw tests/outputs/pedestrian.yaml --format mermaid",
    "llfsm draw tests/outputs/pedestrian.yaml --machine nobody",
    "llfsm monitor tests/outputs/pedestrian.ltl --arrangement tests/outputs/pedestrian.yaml",
    "llfsm monitor 'G (p -> F[0:3] q)' --as table",
    "llfsm monitor 'a: G !(p && q)' --as dot",
    f"llfsm monitor 'a: G !(ns@GREEN && ew@GREEN)' --arrangement {LIGHTS} --as machine",
    "llfsm monitor 'forbid a: p q' --as machine --set alarm",
    "llfsm simulate tests/outputs/pedestrian.yaml --seed 3 --steps 14",
    "llfsm simulate tests/outputs/pedestrian.yaml --seed 3 --cycles 4 --set button=true --set distance=5",
    "llfsm simulate tests/outputs/pedestrian.yaml --set nothing=1",
    *(f"llfsm property {q} tests/outputs/formulas.txt" for q in ("classify", "translate", "simplify", "example")),
    "llfsm property accepts tests/outputs/words.tsv",
    "llfsm property equivalent tests/outputs/pairs.tsv",
    "llfsm property implies tests/outputs/pairs.tsv",
    *(f"llfsm property print --to {s} tests/outputs/formulas.txt" for s in ("llfsm", "spot", "spin", "nusmv")),
    "llfsm property draw 'G (p -> F q)'",
    "llfsm property draw 'G F p && G F (q || !p)'",
    *(f"llfsm property {q} 'G (p -> (q U[0:3] r))'" for q in ("classify", "translate", "simplify", "example")),
    "llfsm property classify 'G p' --format json",
    "llfsm property classify 'G (p ->'",
    "llfsm property accepts 'G p' 'p;cycle{q}'",
    "llfsm property implies 'G p' 'F p'",
    "llfsm knowledge table models/ball_conditions/BallConditions.d",
    "llfsm knowledge explain models/microwave/MicrowaveCook.d timeLeft=true doorOpen=true",
    "llfsm knowledge equivalent models/microwave/MicrowaveCook.d timeLeft",
    *(f"llfsm schema {name}" for name in ("arrangement", "machine", "lint", "result")),
    *(f"llfsm {name}" for name in HELP[1:] if name not in ("verify", "check", "init")),
    f"llfsm verify {LIGHTS} --engine pdr --max-states 4 -p 'G true'",
    f"llfsm verify {LIGHTS} -p 'a: G true' -p 'a: G false'",
    f"llfsm verify {LIGHTS} --timeout -1 -p 'G true'",
    f"llfsm verify {LIGHTS} --format yaml -p 'G true'",
    f"llfsm verify {LIGHTS} no/such.ltl",
    f"llfsm kripke {LIGHTS} --format yaml",
    f"llfsm kripke {LIGHTS} -o no/such/folder/k.json",
    f"llfsm simulate {LIGHTS} --set car=maybe",
    f"llfsm simulate {LIGHTS} --steps 3 --cycles 3",
    "llfsm replay no/such.trace.yaml",
    f"llfsm lint {LIGHTS} --local --traces",
    "llfsm lint no/such.yaml",
    "llfsm monitor 'G (p ->'",
    "llfsm monitor no/such.ltl",
    "llfsm init FOLDER/crossing",
    "llfsm verify",
    "llfsm nothing",
    "llfsm-verify --help",
)  # fmt: skip
"""Command lines; FOLDER is an empty one, and every file that is written there is shown."""

SHOWN = 130
"""Lines of a command's output that are kept as they are."""
_SECONDS = re.compile(r"\b\d+(?:\.\d+)? s\b|(?<=\"seconds\": )[\d.e-]+|(?<=time=\")[\d.]+")


def outputs() -> Iterator[tuple[str, str]]:
    """Each command with what it prints and writes."""
    for command in COMMANDS:
        yield command, said(command)


def said(command: str) -> str:
    """The exit code, standard output, standard error and the files of a command."""
    with TemporaryDirectory() as folder:
        name, *arguments = shlex.split(command)
        arguments = [a.replace("FOLDER", folder) for a in arguments]
        out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8") for _ in range(2))
        environment = {**os.environ, "COLUMNS": "80"}
        with (
            redirect_stdout(out),
            redirect_stderr(err),
            mock.patch.dict(os.environ, environment, clear=True),
            mock.patch.object(sys, "argv", [name, *arguments]),
        ):
            code = _code(name, arguments)
        printed, told = _text(out), _text(err)
        parts = [f"exit code {code}", *([printed] if printed else []), *(["standard error:", told] if told else [])]
        for path in sorted(Path(folder).rglob("*")):
            if path.is_file():
                parts += [f"{path.relative_to(folder)}:", path.read_text(encoding="utf-8")]
        return _settled("\n".join(part.rstrip() for part in parts), folder)


def _text(stream: io.TextIOWrapper) -> str:
    stream.flush()
    assert isinstance(stream.buffer, io.BytesIO)
    return stream.buffer.getvalue().decode("utf-8")


def _code(name: str, arguments: list[str]) -> object:
    try:
        return main(arguments) if name == "llfsm" else main_verify(arguments)
    except SystemExit as stop:
        return stop.code


def _settled(text: str, folder: str) -> str:
    """The text without what is different each time; of a long one its beginning, and a hash of all of it."""
    way = os.path.relpath(Path.cwd(), Path(folder).resolve())
    for found, name in ((way, "ROOT"), (folder, "FOLDER"), (str(Path.cwd()), "ROOT")):
        text = text.replace(found, name)
    lines = [line.rstrip() for line in _SECONDS.sub("…", text).split("\n")]
    if len(lines) > SHOWN:
        digest = sha256("\n".join(lines).encode()).hexdigest()[:16]
        lines[SHOWN:] = [f"… {len(lines):,} lines in all, {digest}"]
    return "\n".join(lines)


def kept(path: Path = KEPT) -> dict[str, str]:
    """What a file says, by command."""
    blocks = path.read_text(encoding="utf-8").split("\n$ ")
    return {command: text.rstrip("\n") for command, _, text in (block.partition("\n") for block in blocks[1:])}


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else KEPT
    with target.open("w", encoding="utf-8") as file:
        file.write("What commands print and write. Do not edit: `python -m tests.outputs.commands` writes this anew.\n")
        for command, text in outputs():
            file.write(f"\n$ {command}\n{text}\n")
