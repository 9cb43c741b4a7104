"""The examples of `llfsm explain`: a diagnostic that a wrong text gets, or what a command says of some files.

`python -m tests.outputs.examples` writes them again, and a test compares them with what is said today.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Collection, Mapping
from contextlib import chdir
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.ring import ring
from llfsm_verify.report.codes import OF_OTHERS, SECTIONS
from tests.bad_input.messages import wrong
from tests.cli.running import llfsm
from tests.outputs.provoking import BUILD, GO, LAMP, Provoked, does, model, states

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "llfsm_verify" / "report" / "examples.json"
PRINTED = re.compile(r"^(?![ │|]).*?\b(?:error|warning|note)\[([A-Z]\d{3})\]: .*(?:\n {2,}.*)*", re.MULTILINE)
"""A diagnostic: its line, and those below that are indented."""
RECORD = "llfsm run a.yaml --rate 0 --for 1s --set go=true --record lamp.rec"
HEATER = does("heat = not warm;", "warm: {type: bool, role: input}, heat: {type: bool, role: output}")
HEATS = "warm: {type: bool, role: input}, out: {type: bool, role: output}"
GUARD = "llfsm guard a.yaml -p 'G (warm -> !heat)' --fallback heat=false --no-proof -o guarded"
DOUBLED = "".join(f"define p{i + 1}: p{i} && X p{i}\n" for i in range(20))
RING = "llfsm verify ring.yaml --keep-all-bits --max-states 9000"
AUTOMATON = 'automaton never bad: "bad.hoa"\n'
EITHER = """\
HOA: v1
States: 2
Start: 0
AP: 1 "m@ON"
Acceptance: 1 Inf(0)
--BODY--
State: 0
[t] 0
[0] 1
State: 1 {0}
[0] 1
--END--
"""
EVERY_RUN = "HOA: v1\nStates: 1\nStart: 0\nAP: 0\nAcceptance: 0 t\n--BODY--\nState: 0\n[t] 0\n--END--\n"


def _lint(files: dict[str, str]) -> Provoked:
    return Provoked(("llfsm lint a.yaml",), files)


def _theory(rules: str) -> Provoked:
    files = does("out = heat;", HEATS, "knowledge: {heat: {file: Heat.d}}\n")
    return _lint({**files, "Heat.d": f'input {{warm}}.\n{rules}\noutput {{b heat, "heat"}}.\n'})


def _fault(files: dict[str, str]) -> Provoked:
    return Provoked(("llfsm verify a.yaml --engine explicit",), files)


def _rule(text: str, files: Mapping[str, str] = LAMP) -> Provoked:
    return Provoked(("llfsm verify a.yaml p.ltl",), {**files, "p.ltl": f"{text}\n"})


FILE = {"a.yaml": "machines: {m: {file: m.machine.yaml}}\nschedule: [m]\n"}
UNTIMED = {"a.yaml": LAMP["a.yaml"].replace("cycle_ms: 100", "timing: untimed")}
PROCESSES = {
    "a.yaml": f"""\
cycle_ms: 100
whiteboard: {{{GO}}}
machines:
  a: {{inline: {{machine: A, states: [{{name: OFF, transitions: [{{when: go, to: ON}}]}}, {{name: ON}}]}}}}
  b: {{inline: {{machine: B, states: [{{name: B, stays: true}}]}}}}
processes: {{left: [a], right: [b]}}
"""
}
SAVE = "llfsm verify a.yaml -p 'safe: G !m@ON' -q --engine explicit --save-traces ."
REPLAY = "llfsm replay safe.trace.yaml"
CHECKED = "llfsm verify a.yaml -p 'safe: G !m@ON' --engine explicit"
INVARIANTS = "llfsm verify a.yaml -p 'safe: G (m@ON -> !m@OFF)' --engine pdr"

STRICT = """\
from llfsm_verify.testing import ArrangementStateMachine


class Lamp(ArrangementStateMachine):
    arrangement = "a.yaml"
    properties = "{}"
    strict = True


TestLamp = Lamp.TestCase
"""

PROVOKED: dict[str, Provoked] = {
    "E002": Provoked(("llfsm lint a.yaml/b.yaml",), LAMP),
    "E004": Provoked(("llfsm lint a.yaml",), {**FILE, "m.machine.yaml": "# " + "x" * (4 << 20)}),
    "E005": Provoked(("printf 'machine: M # \\377' > m.machine.yaml", "llfsm lint a.yaml"), FILE),
    "E011": Provoked(("llfsm lint a.yaml",), {"a.yaml": ""}),
    "E193": Provoked(
        ("llfsm verify a.yaml",),
        does("n = a * b * a;", "a: {type: int64, role: input}, b: {type: int64, role: input}, n: {type: int}"),
    ),
    "E301": Provoked(("llfsm verify a.yaml lights.ltl",), LAMP),
    "E302": Provoked(("mkdir rules", "llfsm verify a.yaml rules"), LAMP),
    "E303": Provoked(("printf 'x: G p # \\377' > p.ltl", "llfsm verify a.yaml p.ltl"), LAMP),
    "E304": Provoked(("llfsm verify a.yaml p.ltl",), {**LAMP, "p.ltl": "# " + "x" * (4 << 20)}),
    "E305": Provoked(("llfsm verify a.yaml p.ltl",), {**LAMP, "p.ltl": f"define p0: m@ON\n{DOUBLED}x: G p20\n"}),
    "E306": Provoked(("llfsm verify a.yaml p.ltl",), {**LAMP, "p.ltl": f"x: {'(' * 201}m@ON{')' * 201}\n"}),
    "E314": Provoked(("llfsm verify a.yaml p.ltl",), {**LAMP, "p.ltl": "safe:\n"}),
    "E335": Provoked(("llfsm monitor 'G (go -> F[<=2s] on)'",)),
    "E336": _rule("x: G (go -> F[<=2s] m@ON)", UNTIMED),
    "E337": _rule("x: F[<=105000s] m@ON"),
    "E338": Provoked(("llfsm query a.yaml 'F m@ON'",), LAMP),
    "E339": _rule("x: F[110ms:190ms] m@ON"),
    "E342": _rule("forbid x: m@ON*"),
    "E344": _rule("forbid x: [m@ON && m@OFF]"),
    "E345": _rule("x: G (initially m@OFF -> go)"),
    "E352": Provoked(("llfsm property print --to spin 'G (p -> O q)'",)),
    "E353": Provoked(("llfsm property accepts 'G p' 'p;!p'",)),
    "E360": Provoked(("llfsm verify a.yaml p.ltl",), {**LAMP, "p.ltl": AUTOMATON, "bad.hoa": "never { }\n"}),
    "E361": _rule(AUTOMATON.strip(), {**LAMP, "bad.hoa": EVERY_RUN.replace("0 t", "1 Fin(0)")}),
    "E362": _rule(AUTOMATON.strip(), {**LAMP, "bad.hoa": EVERY_RUN.replace("Start: 0", "Start: 0&0")}),
    "E363": Provoked(("llfsm verify a.yaml p.ltl",), {**LAMP, "p.ltl": AUTOMATON, "bad.hoa": 2 * EVERY_RUN}),
    "E364": Provoked(
        ("llfsm monitor p.ltl --arrangement a.yaml",),
        {
            **LAMP,
            "p.ltl": 'automaton good: "good.hoa"\n',
            "good.hoa": EITHER,
        },
    ),
    "E365": _rule('automaton x: ""'),
    "E401": Provoked((SAVE, "sed -i 's/^trace: 1/trace: 7/' safe.trace.yaml", REPLAY), LAMP),
    "E402": Provoked((SAVE, "sed -i 's/^trace: 1/trace: 1\\nloop: soon/' safe.trace.yaml", REPLAY), LAMP),
    "E403": Provoked((SAVE, "sed -i 's/^trace: 1/trace: 1\\nloop: 9/' safe.trace.yaml", REPLAY), LAMP),
    "E404": Provoked((SAVE, "sed -i '/^property:/,/^  text:/d' safe.trace.yaml", REPLAY), LAMP),
    "E405": Provoked((SAVE,), {**LAMP, "safe.trace.yaml": "my notes\n"}),
    "E407": Provoked(("llfsm draw a.yaml --format dot -o a.yaml",), LAMP),
    "E408": Provoked(
        ("llfsm simulate a.yaml --inputs inputs.yaml --steps 5",), {**LAMP, "inputs.yaml": "soon: {go: true}\n"}
    ),
    "E409": Provoked(
        ("llfsm simulate a.yaml --inputs inputs.yaml --steps 5",), {**LAMP, "inputs.yaml": "3: {go: perhaps}\n"}
    ),
    "E410": Provoked(("llfsm verify - -p 'safe: G !m@ON' -q --engine explicit --save-traces . < a.yaml", REPLAY), LAMP),
    "E411": Provoked((SAVE, "sed -i 's/process: main/process: left/' safe.trace.yaml", REPLAY), LAMP),
    "E412": Provoked(("llfsm verify a.yaml -p 'F m@ON' > /dev/full",), LAMP),
    "E413": Provoked(
        (f"{RING} --checkpoint ring.ckpt -q", "truncate -s -20 ring.ckpt", f"{RING} --checkpoint ring.ckpt --resume"),
        {"ring.yaml": ring(4, 3)},
    ),
    "E414": Provoked(
        (
            f"{RING} --checkpoint ring.ckpt -q",
            "llfsm verify ring.yaml --engine explicit --checkpoint ring.ckpt --resume",
        ),
        {"ring.yaml": ring(4, 3)},
    ),
    "E415": Provoked((f"{CHECKED} --checkpoint a.yaml",), LAMP),
    "E422": Provoked(("llfsm kripke a.yaml --format json -o a.yaml",), LAMP),
    "E430": Provoked(("llfsm monitor 'G !m.ran' --arrangement a.yaml --as machine",), LAMP),
    "E431": Provoked(("llfsm monitor 'G (n == 3)' --as machine",)),
    "E432": Provoked(("llfsm monitor 'G F m@ON' --arrangement a.yaml --as machine",), LAMP),
    "E433": Provoked(("llfsm monitor 'G (go -> X[10] m@ON)' --arrangement a.yaml --as machine",), LAMP),
    "E434": Provoked(
        ("llfsm monitor p.ltl --arrangement a.yaml --as machine -o p.ltl",), {**LAMP, "p.ltl": "x: G !m@ON\n"}
    ),
    "E435": Provoked(("llfsm monitor 'G !m@ON' --arrangement a.yaml --as machine --set alarm",), LAMP),
    "E436": Provoked(("llfsm monitor 'F m@ON' --arrangement a.yaml --as machine --suspend m",), LAMP),
    "E437": Provoked(("llfsm guard a.yaml -p 'G F heat' --fallback heat=true --no-proof -o guarded",), HEATER),
    "E438": Provoked((GUARD.replace("--no-proof", "--no-proof --react 'suspend m' --react 'unload m'"),), HEATER),
    "E439": Provoked((GUARD.replace("--no-proof", "--no-proof --react 'suspend pump'"),), HEATER),
    "E440": Provoked((GUARD, "echo mine > guarded/switch.machine.yaml", GUARD), HEATER),
    "E450": Provoked((f"{CHECKED} --certificate no/such/folder/lamp.json",), LAMP),
    "E451": Provoked((f"{CHECKED} --certificate a.yaml",), LAMP),
    "E452": Provoked((f"{INVARIANTS} --save-invariants no/such/folder/lamp.json",), LAMP),
    "E453": Provoked(("llfsm verify a.yaml --check-invariants lamp.json",), {**LAMP, "lamp.json": "proved\n"}),
    "E454": Provoked((f"{INVARIANTS} --save-invariants a.yaml",), LAMP),
    "E463": Provoked(
        (
            SAVE,
            "sed -i 's/^expect: violated/expect: \\&e violated/' safe.trace.yaml",
            "sed -i 's/when: go/when: \"false\"/' a.yaml",
            "python -m pytest -q --llfsm-update safe.trace.yaml",
        ),
        LAMP,
    ),
    "E470": Provoked(("python -m unittest -q test_lamp",), {**LAMP, "test_lamp.py": STRICT.format("served: G F go")}),
    "E471": Provoked(
        ("python -m unittest -q test_lamp",), {**LAMP, "test_lamp.py": STRICT.format("both: G !m@ON && G F go")}
    ),
    "E480": Provoked(("llfsm run a.yaml --rate 0 --for 1s --record no/such/folder/lamp.rec",), LAMP),
    "E481": Provoked(("llfsm check-recording a.yaml -p 'F m@ON'",), LAMP),
    "E482": Provoked(
        (RECORD, "llfsm check-recording lamp.rec -p 'F m@ON' --arrangement other.yaml"),
        {**LAMP, "other.yaml": LAMP["a.yaml"].replace("not go", "go")},
    ),
    "E483": Provoked(("llfsm run a.yaml",), {"a.yaml": LAMP["a.yaml"].replace("cycle_ms: 100\n", "")}),
    "E484": Provoked(
        (
            "llfsm verify a.yaml -p 'safe: G !a@ON' -q --engine explicit --save-traces .",
            "llfsm run a.yaml --inputs safe.trace.yaml",
        ),
        PROCESSES,
    ),
    "E485": Provoked(("llfsm run a.yaml --whiteboard my/lamp",), LAMP),
    "E486": Provoked(("llfsm whiteboard get lamp go",)),
    "E487": Provoked(("llfsm simulate a.yaml --seed 1 --steps 9 --format svg -o no/such/folder/run.svg",), LAMP),
    "E488": Provoked((RECORD, "llfsm trace lamp.rec --to trace --arrangement a.yaml"), LAMP),
    "E490": Provoked(("llfsm report a.yaml -p 'F m@ON' --assurance -o no/such/folder/page.md",), LAMP),
    "E493": Provoked(
        ("llfsm run a.yaml --ports a.ports.yaml",),
        {**LAMP, "a.ports.yaml": "ports: {button: {kind: mtqq, inputs: [go]}}\n"},
    ),
    "E494": Provoked(
        ("llfsm run a.yaml --ports a.ports.yaml",),
        {**LAMP, "a.ports.yaml": "ports: {lamp: {kind: callback, call: 'lamp:show', outputs: {m: x, go: x}}}\n"},
    ),
    "E495": Provoked(
        ("llfsm run a.yaml --ports a.ports.yaml",),
        {**LAMP, "a.ports.yaml": "ports: {lamp: {kind: stream, write: no/such/pipe, outputs: [m]}}\n"},
    ),
    "E526": Provoked(
        ("llfsm run a.yaml --ports a.ports.yaml",),
        {
            **does("ask = true;", "ask: {type: bool}, heard: {type: bool, role: input}"),
            "a.ports.yaml": "ports: {robot: {kind: process, run: robot, requests: "
            "{locate: {kind: service, ask: ask, state: heard}}}}\n",
        },
    ),
    "E527": Provoked(
        ("llfsm run a.yaml --ports a.ports.yaml",),
        {
            **does("go = gain > 1;", "go: {type: bool}, gain: {type: 0..3, role: input, changes: never}"),
            "a.ports.yaml": "ports: {knob: {kind: stream, read: knob, inputs: [gain], on_failure: stale}}\n",
        },
    ),
    "E500": Provoked(("llfsm audit verify no/such/folder/lamp.log",)),
    "E502": Provoked(("ulimit -n 24; llfsm run a.yaml --whiteboard lamp",), LAMP),
    "E501": Provoked(("llfsm audit verify lamp.log",), {"lamp.log": "mine\n"}),
    "E503": Provoked((BUILD,), states("{name: A, stays: true}", "", "profile: clfsm\n")),
    "E520": Provoked((SAVE, "echo >> a.yaml", "llfsm coverage a.yaml safe.trace.yaml"), LAMP),
    "E521": Provoked(
        (SAVE, "sed -i 's/choices: {go: true}/choices: {}/' safe.trace.yaml", "llfsm coverage a.yaml safe.trace.yaml"),
        LAMP,
    ),
    "E522": Provoked(("llfsm coverage a.yaml lamp.json",), LAMP | {"lamp.json": '{"vectors": 1,\n "unit": }\n'}),
    "E523": Provoked(("llfsm coverage a.yaml --vectors a.yaml",), LAMP),
    "E505": Provoked((BUILD.replace("made", "."),), LAMP | {"a.c": "int x;\n"}),
    "E515": Provoked((f"{BUILD} -p 'x: G !env@S'",), model("far = 1;", "far: {type: 0..3, role: input}")),
    "E516": Provoked(
        (f"{BUILD} -p 'x: G (go -> F[0:999] m@ON) && G (m@ON -> F[0:998] !go) && G (!go -> F[0:997] m@OFF)'",), LAMP
    ),
    "F001": _fault(does("if (car) n += 1;", "car: {type: bool, role: input}, n: {type: 0..3}")),
    "F002": _fault(does("share = 100 / n;", "n: {type: 0..9, role: input}, share: {type: 0..100}")),
    "F003": _fault(does("seen[i] = true;", "i: {type: 0..4, role: input}, seen: {type: {array: bool, size: 4}}")),
    "F004": _fault(does("root = floor(sqrt(n));", "n: {type: -9..9, role: input}, root: {type: 0..3}")),
    "F005": _fault(does("mask = mask << k;", "k: {type: 0..9, role: input}, mask: {type: uint8, init: 1}")),
    "F011": _fault(model("far = far + 1;", "far: {type: 0..3, role: input}")),
    "F012": _fault(model("far = 9 / far;", "far: {type: 0..9, role: input}")),
    "F013": _fault(
        model(
            "far = road[k]; k += 1;",
            "far: {type: 0..9, role: input}",
            "road: {type: {array: 0..9, size: 4}}, k: {type: 0..9}",
        )
    ),
    "F014": _fault(model("far = floor(sqrt(far - 1));", "far: {type: 0..9, role: input}")),
    "F015": _fault(model("far = far << far;", "far: {type: uint8, init: 8, role: input}")),
    "L001": _lint(
        states(
            "{name: SLOW, transitions: [{when: v > 5, to: FAST}, {when: v > 7, to: SLOW}]}\n"
            "{name: FAST, transitions: [{when: v < 3, to: SLOW}]}",
            "v: {type: 0..9, role: input}",
        )
    ),
    "L002": _lint(
        states(
            "{name: OFF, transitions: [{when: go, to: ON}]}\n{name: ON, transitions: [{when: not go, to: OFF}]}\n"
            "{name: BROKEN, transitions: [{when: true, to: OFF}]}",
            GO,
        )
    ),
    "L003": _lint(
        states(
            "{name: REST, transitions: [{when: up, to: RISE}, {when: down, to: SINK}]}\n"
            "{name: RISE, transitions: [{when: not up, to: REST}]}\n"
            "{name: SINK, transitions: [{when: not down, to: REST}]}",
            "up: {type: bool, role: input}, down: {type: bool, role: input}",
        )
    ),
    "L004": _lint(
        states(
            "{name: SLOW, transitions: [{when: v > 5 || v < 8, to: FAST}]}\n"
            "{name: FAST, transitions: [{when: v < 3, to: SLOW}]}",
            "v: {type: 0..9, role: input}",
        )
    ),
    "L005": _lint(
        does("if (v > 8 && v < 5) lamp = true;", "v: {type: 0..9, role: input}, lamp: {type: bool, role: output}")
    ),
    "L006": _lint(
        states(
            "{name: A, transitions: [{when: go, to: B}]}\n"
            '{name: B, on_entry: "n = 9; n = n + 1;", transitions: [{when: not go, to: A}]}',
            f"{GO}, n: {{type: 0..9, role: output}}",
        )
    ),
    "L007": _lint(does("if (car) n += 1;", "car: {type: bool, role: input}, n: {type: 0..3, role: output}")),
    "L008": _lint(does("share = 100 / n;", "n: {type: 0..9, role: input}, share: {type: 0..100, role: output}")),
    "L009": _lint(
        does("seen[i] = true;", "i: {type: 0..4, role: input}, seen: {type: {array: bool, size: 4}, role: output}")
    ),
    "L010": _lint(does("n = go ? 1 : 0;", f"{GO}, n: {{type: 0..1}}")),
    "L011": _lint(does("lamp = true; lamp = go;", f"{GO}, lamp: {{type: bool, role: output}}")),
    "L012": _lint(
        states(
            "{name: A, transitions: [{when: go, to: B}]}\n"
            "{name: B, on_entry: n = 5;, transitions: [{when: n > 5, to: A}]}",
            f"{GO}, n: {{type: 0..9}}",
        )
    ),
    "L013": _lint(
        {
            "a.yaml": f"""\
whiteboard: {{{GO}}}
machines:
  pump:
    inline: {{machine: P, suspend: S, states: [{{name: A, stays: true}}, {{name: S}}]}}
  boss:
    inline:
      machine: B
      states:
        - {{name: A, transitions: [{{when: go, to: STOP}}]}}
        - {{name: STOP, on_entry: suspend(pump);, transitions: [{{when: go, to: HALT}}, {{when: not go, to: A}}]}}
        - {{name: HALT, transitions: [{{when: "false", to: ON}}]}}
        - {{name: ON, on_entry: resume(pump);, transitions: [{{when: true, to: A}}]}}
schedule: [boss, pump]
"""
        }
    ),
    "L014": _lint(
        {
            "a.yaml": """\
fairness: none
machines:
  a: {inline: {machine: A, states: [{name: A, stays: true}]}}
  b: {inline: {machine: B, states: [{name: B, stays: true}]}}
processes: {left: [a], right: [b]}
"""
        }
    ),
    "L015": _lint(states("{name: A, internal: lamp = go;}", f"{GO}, lamp: {{type: bool, role: output}}")),
    "L016": _lint(model("n = 1;", GO, "n: {type: 0..3}")),
    "L017": _lint(
        {
            "a.yaml": f"""\
whiteboard: {{{GO}}}
machines:
  part: {{inline: {{machine: P, states: [{{name: A, stays: true}}]}}}}
  owner:
    inline:
      machine: O
      states:
        - {{name: IDLE, transitions: [{{when: go, to: WORK}}]}}
        - {{name: WORK, runs: [part], transitions: [{{when: not go, to: IDLE}}]}}
schedule: [part, owner]
"""
        }
    ),
    "L018": _lint(does("root = floor(sqrt(n));", "n: {type: -9..9, role: input}, root: {type: 0..3, role: output}")),
    "L019": _lint(
        does("mask = mask << k;", "k: {type: 0..9, role: input}, mask: {type: uint8, init: 1, role: output}")
    ),
    "L020": _lint({"a.yaml": f"lint: {{L003: the first one shall win}}\n{LAMP['a.yaml']}"}),
    "L021": _lint(states("{name: A, stays: true}", GO)),
    "L022": _lint({"a.yaml": f"types: {{Phase: [DAY, NIGHT]}}\n{LAMP['a.yaml']}"}),
    "L023": _lint(
        {
            "a.yaml": """\
cycle_ms: 1000
whiteboard: {lamp: {type: bool, role: output}}
machines:
  a:
    inline:
      machine: A
      states:
        - {name: OFF, on_entry: lamp = false;, transitions: [{when: after(2), to: ON}]}
        - {name: ON, on_entry: lamp = true;}
  b: {inline: {machine: B, states: [{name: B, stays: true}]}}
schedule: [a, b]
"""
        }
    ),
    "L024": _lint(
        {
            "a.yaml": f"""\
whiteboard: {{{GO}, wish: {{type: bool}}, lamp: {{type: bool, role: output}}}}
machines:
  a: {{inline: {{machine: Lamp, states: [{{name: A, internal: lamp = wish;, stays: true}}]}}}}
  b: {{inline: {{machine: Wish, states: [{{name: A, internal: wish = go;, stays: true}}]}}}}
schedule: [a, b]
"""
        }
    ),
    "L025": _lint(
        states(
            "{name: A, internal: lamp = go;, transitions: [{when: true, to: A}]}",
            f"{GO}, lamp: {{type: bool, role: output}}",
        )
    ),
    "L026": _lint(states("{name: A, transitions: [{when: go, to: A}, {when: after(9) && !go, to: B}]}\n{name: B}", GO)),
    "W001": _lint(
        {
            "a.yaml": LAMP["a.yaml"]
            .replace("machine: M", "machine: M\n      parameters: {limit: {constant: 0..9}}")
            .replace("schedule", "    parameters: {limit: 3}\nschedule")
        }
    ),
    "W002": _lint(does("if (n < 16) lamp = true;", "n: {type: 0..9, role: input}, lamp: {type: bool, role: output}")),
    "W004": _theory("warm => heat."),
    "W005": _theory("warm -> heat. {} -> ~heat."),
    "W006": _theory("C: {} => ~heat. D: warm => heat. D > C. warm => Heat."),
    "W003": Provoked(("llfsm monitor 'G env@S' --arrangement a.yaml --as table",), model("go = choose(bool);", GO)),
    "W301": Provoked(("llfsm monitor 'G (go -> X[12] m@ON)' --arrangement a.yaml --as machine",), LAMP),
    "W302": _rule("x: go -> F m@ON"),
    "W303": _rule(
        "x: G (n == 3.5 -> lamp)",
        does("lamp = n > 3;", "n: {type: 0..9, role: input}, lamp: {type: bool, role: output}"),
    ),
    "W304": _rule("x: G (go -> F[<=150ms] m@ON)"),
    "W402": Provoked(
        (
            RING,  # what is compiled is kept
            f"ulimit -f 8; {RING} --checkpoint ring.ckpt --checkpoint-every 0.0001",
        ),
        {"ring.yaml": ring(4, 3)},
    ),
}
for _name in OF_OTHERS.ours:
    _folder = OF_OTHERS[_name].place.split(".")[2]
    if (ROOT / "tests" / "extensions" / _folder / "examples.py").exists():
        PROVOKED |= import_module(f"tests.extensions.{_folder}.examples").PROVOKED

ELSEWHERE = {
    "E429": "needs a process to be killed: tests/cli/commands/check/test_jobs.py",
    "E165": "needs a running arrangement: tests/runtime/swapping/test_policies.py",
    "E489": "needs a running arrangement: tests/runtime/deciding/test_frames.py",
    "E406": "needs a package to be missing: tests/report/test_drawing.py",
    "E423": "needs a package to be missing: tests/kripke/export/test_structure.py",
    "E464": "needs a package to be missing: tests/cli/test_missing.py",
    "E560": "needs an editor: tests/extensions/editor/test_editing.py",
    "E561": "needs an editor: tests/extensions/editor/test_broken.py",
    "E562": "needs an editor: tests/extensions/editor/test_editing.py",
    "E580": "needs a program to be missing: tests/extensions/prolog/test_port.py",
    "E582": "needs SWI-Prolog: tests/extensions/prolog/test_port.py",
    "E583": "needs SWI-Prolog: tests/extensions/prolog/test_bridge.py",
    "E584": "needs SWI-Prolog: tests/extensions/prolog/test_bridge.py",
    "E598": "needs a system that starts no process: tests/extensions/sweep/test_command.py",
    "E600": "needs ten seconds: tests/extensions/cluster/test_cluster.py",
    "E601": "needs a scheduler of Dask: tests/extensions/cluster/test_cluster.py",
    "E602": "needs a scheduler of Dask: tests/extensions/cluster/test_cluster.py",
    "E603": "needs a scheduler of Dask: tests/extensions/cluster/test_cluster.py",
    "W401": "needs a trace of very many steps, or a smaller limit: tests/cli/commands/test_replay.py",
}
"""Codes whose example was copied by hand from what the program said, and why no command here provokes them."""


def places() -> dict[str, Path]:
    """Where the examples of each code are: of the core, or in the folder of an extension."""
    found = {code: KEPT for _, codes in SECTIONS for code in codes}
    for name in OF_OTHERS.ours:
        folder = ROOT.joinpath(*OF_OTHERS[name].place.partition(":")[0].split(".")[:-1])
        found |= dict.fromkeys(OF_OTHERS.load(name), folder / "examples.json")
    return found


def of_wrong_texts() -> dict[str, list[str]]:
    """What wrong texts get, by its code: the shortest with a hint first."""
    told: dict[str, set[tuple[bool, int, str]]] = {}
    for found in (found for _, said in wrong() for found in said if found.code not in PROVOKED):
        text = found.render()
        told.setdefault(found.code, set()).add((found.hint is None, len(text), text))
    return {code: [text for *_, text in sorted(texts)] for code, texts in told.items()}


def example(code: str) -> str:
    """The last command, and below it what it says under this code."""
    provoked = PROVOKED[code]
    with TemporaryDirectory() as folder, chdir(folder):
        for name, text in provoked.files.items():
            Path(name).write_text(text, encoding="utf-8")
        for command in provoked.commands:
            printed = _run(command)
        for found in PRINTED.finditer(printed):
            if found[1] == code:
                return "\n".join(line.rstrip() for line in [f"$ {command}", *found[0].split("\n")])
    raise AssertionError(f"`{command}` does not say {code}, but {printed}")


def _run(command: str) -> str:
    name, *arguments = shlex.split(command)
    if name == "llfsm" and not {"<", ">"} & set(arguments):  # no shell is needed
        done = llfsm(*arguments)
        return done.stderr + done.stdout
    scripts = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    shell = subprocess.run(
        command, shell=True, capture_output=True, text=True, check=False, env={**os.environ, "PATH": scripts}
    )
    return shell.stderr + shell.stdout


def keep(texts: Mapping[str, str]) -> None:
    """Write these examples in the place of what their codes had. Of wrong texts an example stays while it is true."""
    homes = places()
    told = of_wrong_texts()
    for file in set(homes.values()):
        kept: dict[str, str] = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
        kept |= {code: said[0] for code, said in told.items() if kept.get(code) not in said}
        kept |= {code: text for code, text in texts.items() if code not in told}
        known = {code: text for code, text in sorted(kept.items()) if homes.get(code) == file}
        file.write_text(json.dumps(known, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def main(codes: Collection[str]) -> None:
    """Write the examples of these codes. SystemExit, with a sentence: no command and no wrong text has one of them."""
    told = of_wrong_texts() if set(codes) - PROVOKED.keys() else {}
    for code in sorted(set(codes) - PROVOKED.keys() - told.keys()):
        why = ELSEWHERE.get(code, "has no command in PROVOKED, and no case in tests/bad_input/ gets it")
        raise SystemExit(f"{code} {why}")
    keep({code: example(code) for code in codes if code in PROVOKED})


if __name__ == "__main__":
    main(sys.argv[1:] or PROVOKED)
