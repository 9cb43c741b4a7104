"""Arrangements so small that their answers can be checked by hand: every kind of property, fault and timing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties


@dataclass(frozen=True, slots=True)
class Known:
    """An arrangement, properties of it, and what is true of them."""

    name: str
    about: str
    """What it looks at, in a sentence without its full stop."""
    arrangement: str
    properties: str
    holds: Mapping[str, bool]
    """Whether each property holds, by its name."""
    faults: frozenset[str] = frozenset()
    """The codes of the faults in which runs end."""
    open: frozenset[str] = frozenset()
    """Names of properties (`faults`: of those) that an engine may leave unknown, although it claims to decide them."""
    contradictory: bool = False
    """No run satisfies the assumptions: what holds is to be said with a note."""
    files: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    """Files beside the property file, by their names."""

    def problem(self) -> Problem:
        """A new one, with nothing lowered."""
        arrangement = load_arrangement_text(self.arrangement, f"{self.name}.yaml")
        with TemporaryDirectory() as folder:
            for name, text in self.files.items():
                Path(folder, name).write_text(text, encoding="utf-8")
            return bind(arrangement, parse_properties([Source(str(Path(folder, "known.ltl")), self.properties)]))


def _answers(text: str) -> dict[str, bool]:
    """`a+ b-`: a holds, b does not."""
    return {word[:-1]: word.endswith("+") for word in text.split()}


TOGGLE = """
name: toggle
whiteboard: {go: {type: bool, role: input}}
machines:
  m:
    inline:
      machine: Toggle
      states:
        - {name: A, transitions: [{when: go, to: B}]}
        - {name: B, transitions: [{when: not go, to: A}]}
schedule: [m]
"""
BUTTON = TOGGLE.replace("not go", "go").replace("toggle", "button")
"""Each press leads to the other state."""
UNREAD = """
name: unread
whiteboard:
  seen: {type: bool, role: input}
  other: {type: bool, role: input}
machines:
  m: {inline: {machine: M, states: [{name: A, transitions: [{when: seen, to: A}]}]}}
schedule: [m]
"""
PLANT = """
name: plant
whiteboard: {level: {type: 0..5, role: input}, seen: {type: 0..5}}
environment:
  inline:
    machine: P
    variables: {to: {type: 0..5}}
    states: [{name: S, internal: "to = choose(1, 3, 5); level = level == 5 ? level + to : to;"}]
machines:
  v: {inline: {machine: V, states: [{name: A, stays: true}]}}
  w: {inline: {machine: W, states: [{name: A, stays: true, internal: seen = level;}]}}
schedule: [v, w]
"""
ENDING = """
name: ending
whiteboard: {late: {type: bool, role: input}}
machines:
  m: {inline: {machine: M, states: [{name: A, transitions: [{when: "true", to: B}]}, {name: B}]}}
schedule: [m]
"""
COUNTER = """
name: counter
whiteboard: {{n: {{type: {type}, init: 0}}, up: {{type: bool, role: input}}}}
machines:
  m:
    inline:
      machine: Counter
      states:
        - {{name: A, internal: "{action}", transitions: [{{when: "false", to: A}}]}}
schedule: [m]
"""
DEEP = COUNTER.format(type="0..12", action="if (n < 12) { n++; }")
"""`n` grows to 12, whatever the input is, and stays there."""
LAP = COUNTER.format(type="0..4", action="n = n == 4 ? 2 : n + 1;")
CYCLES = """
name: cycles
observe: cycle
whiteboard:
  go: {type: bool, role: input}
  n: {type: 0..2, init: 0}
machines:
  a: {inline: {machine: A, states: [{name: S, internal: n = 2;, transitions: [{when: "false", to: S}]}]}}
  b: {inline: {machine: B, states: [{name: S, internal: "n = go ? 1 : 0;", transitions: [{when: "false", to: S}]}]}}
schedule: [a, b]
"""
PROCESSES = """
name: two
fairness: {fairness}
machines:
  a:
    inline:
      machine: A
      states:
        - {{name: X, transitions: [{{when: "true", to: Y}}]}}
        - {{name: Y, transitions: [{{when: "true", to: X}}]}}
  b: {{inline: {{machine: B, states: [{{name: X, transitions: [{{when: "true", to: Y}}]}}, {{name: Y}}]}}}}
processes: {{left: [a], right: [b]}}
"""
TIMED = """
name: timed
cycle_ms: 100
machines:
  m:
    inline:
      machine: M
      states:
        - {name: A, transitions: [{when: after(0.2), to: B}]}
        - {name: B, transitions: [{when: after_ms(0), to: A}]}
schedule: [m]
"""
UNTIMED = """
name: untimed
timing: untimed
machines:
  m:
    inline:
      machine: M
      states:
        - name: A
          transitions: [{when: after(1), to: B}, {when: after_ms(500), to: C}]
        - {name: B, transitions: [{when: "false", to: B}]}
        - {name: C, transitions: [{when: "true", to: A}]}
schedule: [m]
"""
CLOCK = """
name: clock
cycle_ms: 100
whiteboard: {n: {type: 0..4, init: 0}}
machines:
  idle: {inline: {machine: I, states: [{name: A, transitions: [{when: "false", to: A}]}]}}
  m:
    inline:
      machine: M
      states:
        - {name: A, internal: "n = n == 4 ? 0 : n + 1;", transitions: [{when: "false", to: A}]}
schedule: [idle, m]
"""
"""`n` counts cycles, each of two letters: in the cycle of time 0 it is 0, then 1; in the next one 1, then 2."""
LIGHT = """
name: light
whiteboard: {go: {type: bool, role: input}}
machines:
  m:
    inline:
      machine: Light
      states:
        - {name: RED, transitions: [{when: go, to: GREEN}]}
        - {name: GREEN, transitions: [{when: go, to: AMBER}]}
        - {name: AMBER, transitions: [{when: go, to: RED}]}
schedule: [m]
"""
COMMANDS = """
name: commands
whiteboard: {stop: {type: bool, role: input}}
machines:
  c:
    inline:
      machine: C
      parameters: {m: machine}
      states:
        - {name: C0, transitions: [{when: stop, to: C1}]}
        - {name: C1, on_entry: suspend(m);, transitions: [{when: not stop, to: C2}]}
        - {name: C2, on_entry: resume(m);, transitions: [{when: "false", to: C2}]}
    parameters: {m: m}
  m:
    inline:
      machine: M
      states:
        - {name: X, transitions: [{when: "true", to: Y}]}
        - {name: Y, transitions: [{when: "true", to: X}]}
schedule: [c, m]
"""
NEVER = """
name: never
whiteboard: {jumper: {type: bool, role: input, changes: never}, n: {type: 0..1, init: 0}}
machines:
  m: {inline: {machine: M, states: [{name: A, internal: "n = jumper ? 1 : 0;", transitions: [{when: "false", to: A}]}]}}
schedule: [m]
"""
HELD = """
name: held
whiteboard:
  lever: {type: bool, role: input, changes: cycle}
  first: {type: bool}
  same: {type: bool, init: true}
machines:
  a: {inline: {machine: A, states: [{name: S, internal: first = lever;, transitions: [{when: "false", to: S}]}]}}
  b:
    inline:
      machine: B
      states: [{name: S, internal: same = first == lever;, transitions: [{when: "false", to: S}]}]
schedule: [a, b]
"""
DIVISION = """
name: division
whiteboard: {{d: {{type: 0..3, role: input}}, q: {{type: int32, init: 0}}}}
machines:
  m:
    inline:
      machine: M
      states:
        - name: A
          internal: "q = d != 0 && 6 / d > {limit} ? 6 % d : 10 / (d - 2);"
schedule: [m]
finished: keep
"""
"""6 / d is evaluated only where d is not 0; d = 2 comes to 10 / (d - 2) only where 6 / 2 is not above the limit.
Proofs are not demanded where numbers divide each other."""
PLACES = """
name: places
types: {Cell: {record: {x: 0..3, f: bool}}, Row: {array: Cell, size: 3}}
whiteboard:
  a: {type: {array: Row, size: 2}}
  i: {type: 0..3, role: input}
machines:
  m: {inline: {machine: M, states: [{name: S, internal: "if (a[1][2].x < 3) { a[1][i].x = 3; }", transitions: [{when: "false", to: S}]}]}}
schedule: [m]
"""  # noqa: E501
THREE = """
name: three
whiteboard:
  way: {type: 0..3, role: input}
  n: {type: 0..1, init: 0}
  row: {type: {array: bool, size: 2}}
machines:
  m:
    inline:
      machine: M
      states:
        - name: A
          internal: |
            if (way == 1) { n = way + 1; }
            if (way == 2) { n = 1 / (way - 2); }
            if (way == 3) { row[way] = true; }
          transitions: [{when: "false", to: A}]
schedule: [m]
"""
WIDE = """
name: wide
whiteboard: {level: {type: uint8, role: input}, high: {type: bool}}
machines:
  m:
    inline:
      machine: M
      states: [{name: S, internal: high = level > 200;, transitions: [{when: "false", to: S}]}]
schedule: [m]
"""
EVEN = """HOA: v1
States: 2
Start: 0
AP: 1 "m@B"
acc-name: Buchi
Acceptance: 1 Inf(0)
--BODY--
State: 0
[!0] 0
[0] 1 {0}
State: 1
[!0] 0
[0] 1 {0}
--END--
"""
"""`m@B` again and again, deterministic."""
STUCK = """HOA: v1
States: 2
Start: 0
AP: 1 "m@B"
acc-name: Buchi
Acceptance: 1 Inf(0)
--BODY--
State: 0
[t] 0
[0] 1
State: 1
[0] 1 {0}
--END--
"""
"""`m@B` forever from some time on, which no deterministic automaton of this kind can say."""

POOL = """
whiteboard: {n: {type: 0..9, init: 4}, zero: {type: 0..1, role: input}, safe: {type: bool}}
machines:
  a:
    inline: {machine: A, states: [{name: S, internal: n = 1; n = 4 / zero;, stays: true}]}
    on_fault: unload
  c: {inline: {machine: C, states: [{name: S, internal: if (is_running(a)) unload(b); else load(b);, stays: true}]}}
  b: {inline: {machine: B, states: [{name: S, internal: safe = true;, stays: true}]}}
schedule: [a, c]
pool: [b]
operators: {load: [a]}
access: {levels: [low, high], machines: {c: high}, write: {safe: high}, on_violation: refuse}
"""
"""A machine whose fault unloads it, one that is loaded meanwhile, and an operator."""

KNOWN = (
    Known(
        "safety", "inputs are free, and a letter shows those that its step has read", TOGGLE,
        "both: G (m@A || m@B)\nstays: G m@A\nread: G (m.fired(A, 0) -> go)\nshown: G (m@B -> go)\nfirst: !go",
        _answers("both+ stays- read+ shown+ first+"),
    ),
    Known(
        "first letter", "a property can be lost before any step", TOGGLE, "no: false\nyes: true\nb: m@B\na: m@A",
        _answers("no- yes+ b- a+"),
    ),
    Known(
        "last step", "a violation at the end of all runs is found, and is not found sooner", DEEP,
        "end: G n != 12\nmost: G n <= 12\ncomes: F n == 12\nstays: F G n == 12", _answers("end- most+ comes+ stays+"),
        open=frozenset({"comes", "stays"}),
    ),
    Known(
        "liveness", "what never comes is a run that goes round", TOGGLE,
        "again: G F m@B\never: F m@B\nsettles: F G m@A || F G m@B || G F m@A", _answers("again- ever- settles+"),
    ),
    Known(
        "loop", "the loop of a run begins where it does, after a beginning of its own", BUTTON,
        "back: G (m@B -> F m@A)\nleaves: m@A W m@B", _answers("back- leaves+"),
    ),
    Known(
        "lap", "a loop that does not go back to the beginning", LAP,
        "again: G F n == 1\nsoon: F n == 1\nround: G F n == 4\nonce: G (n == 1 -> X G n != 1)",
        _answers("again- soon+ round+ once+"),
    ),
    Known(
        "unread inputs", "an input that no step reads is free in every letter", UNREAD,
        "never: G !other\never: F other\neither: G F (other || !other)", _answers("never- ever- either+"),
    ),
    Known(
        "operators", "until, weak until, release, strong release and next mean what they should", LIGHT,
        "u: m@RED U m@GREEN\nw: m@RED W m@GREEN\nr: m@GREEN R (m@RED || m@GREEN)\n"
        "m: m@GREEN M (m@RED || m@GREEN)\nx: G (m@RED -> X !m@AMBER)\nxx: G (m@RED -> X X !m@AMBER)",
        _answers("u- w+ r+ m- x+ xx-"),
    ),
    Known(
        "past and steps", "operators of the past, and bounds in steps", LIGHT,
        "once: G (m@AMBER -> O m@GREEN)\nbefore: G (m@AMBER -> Y m@GREEN)\nsince: G (m@AMBER -> !m@RED S m@GREEN)\n"
        "soon: G (m@GREEN -> F[0:2] m@AMBER)\nnext: G (m@RED -> G[0:1] !m@AMBER)",
        _answers("once+ before- since+ soon- next+"),
    ),
    Known(
        "assumption for liveness", "an assumption rules runs out, and leaves others", TOGGLE,
        "assume presses: G F (m.ran && go)\never: F m@B\nback: G F m@A", _answers("ever+ back-"),
    ),
    Known(
        "assumption for safety", "a bad beginning counts only where it can go on as the assumptions want", TOGGLE,
        "assume calm: G (m@B -> X G m@A)\nnever: G !m@B\nonce: G (m@B -> X G !m@B)", _answers("never- once+"),
    ),
    Known(
        "assumption that forbids", "what only forbidden runs do is not done", TOGGLE,
        "assume still: G !go\nnever: G !m@B\nstays: G m@A", _answers("never+ stays+"),
    ),
    Known(
        "contradictory assumptions", "where assumptions contradict each other, nothing is claimed without a note",
        TOGGLE,
        "assume a: G F go\nassume b: F G !go\nx: G m@A\ny: F m@B", _answers("x+ y+"), contradictory=True,
    ),
    Known(
        "impossible assumptions", "where the arrangement makes an assumption impossible, likewise", TOGGLE,
        "assume both: F (m@A && m@B)\nx: G m@A", _answers("x+"), open=frozenset({"x"}), contradictory=True,
    ),
    Known(
        "the end", "after the end the last configuration repeats, and inputs stay free", ENDING,
        "ends: F G m@B\nquiet: F G !m.ran\ndone: F m.finished\nlate: G F late\ngoes: G F m.ran",
        _answers("ends+ quiet+ done+ late- goes-"),
    ),
    Known(
        "fair processes", "each process that has not ended goes on", PROCESSES.format(fairness="processes"),
        "b: F b@Y\na: G F a@Y\nends: F b.finished\nboth: G !(a@Y && b@Y)", _answers("b+ a+ ends+ both-"),
    ),
    Known(
        "unfair processes", "with `fairness: none` a process may be passed over forever",
        PROCESSES.format(fairness="none"),
        "b: F b@Y\na: G F a@Y\nends: F b.finished\nboth: G !(a@Y && b@Y)", _answers("b- a+ ends- both-"),
        open=frozenset({"a"}),
    ),
    Known(
        "observed cycles", "with `observe: cycle` nothing is seen inside a cycle", CYCLES,
        "inside: G n != 2\nlast: X G (n == 1 <-> go)\nall: X G (a.ran && b.ran && cycle)\nnext: X n == 1",
        _answers("inside+ last+ all+ next-"),
    ),
    Known(
        "observed ringlets", "without it everything is", CYCLES.replace("observe: cycle\n", ""),
        "inside: G n != 2\nall: G !(a.ran && b.ran)\nturns: X (a.ran && X b.ran)", _answers("inside- all+ turns+"),
    ),
    Known(
        "logical time", "`after` counts cycles, and is strict", TIMED,
        "three: X X X m@A\nfour: X X X X m@B\nback: G (m@B -> F m@A)\nnot: G m@A", _answers("three+ four+ back+ not-"),
    ),
    Known(
        "untimed", "every timing is possible, and time passes", UNTIMED,
        "leaves: F (m@B || m@C)\nb: F m@B\nc: G !m@C\nshort: G (m@C -> X !m@C)", _answers("leaves+ b- c- short+"),
    ),
    Known(
        "bounds in time", "a deadline is met at its last moment, and not later", CLOCK,
        "now: F[<=0ms] n == 1\nlate: F[<=99ms] n == 2\nmet: F[<=100ms] n == 2\nkept: G[<=99ms] n <= 1\n"
        "lost: G[<=100ms] n <= 1\nwait: G (n == 4 -> F[<=100ms] n == 0)\nuntil: n < 3 U[<=199ms] n == 3",
        _answers("now+ late- met+ kept+ lost- wait+ until-"),
    ),
    Known(
        "bounds in time from below", "what comes too early does not count", CLOCK,
        "met: F[100ms:199ms] n == 2\nearly: F[200ms:300ms] n == 1\nkept: G[100ms:200ms] n >= 1\n"
        "from: G[>=100ms] n >= 1\nuntil: n < 2 U[200ms:300ms] n == 3\nreleased: n == 3 R[200ms:1s] n != 2",
        _answers("met+ early- kept+ from- until- released-"),
    ),
    Known(
        "regular", "`enforce`, `forbid` and `forbid initially`, with equal neighbours merged", LIGHT,
        "enforce order: (m@RED m@GREEN m@AMBER)*\nenforce wrong: (m@RED m@GREEN)*\nforbid back: m@GREEN m@RED\n"
        "forbid on: m@GREEN m@AMBER\nforbid initially late: m@GREEN\nforbid initially soon: m@RED m@GREEN",
        _answers("order+ wrong- back+ on- late+ soon-"),
    ),
    Known(
        "automata", "every run is accepted, or none is", TOGGLE,
        "automaton again: again.hoa\nautomaton never forever: forever.hoa\nboth: G F m@B || F G m@A",
        _answers("again- forever- both+"), files=MappingProxyType({"again.hoa": EVEN, "forever.hoa": STUCK}),
    ),
    Known(
        "automata that hold", "the same under assumptions with which they hold", TOGGLE,
        "assume on: G F (m.ran && go)\nassume off: G F (m.ran && !go)\nautomaton again: again.hoa\n"
        "automaton never forever: forever.hoa",
        _answers("again+ forever+"), files=MappingProxyType({"again.hoa": EVEN, "forever.hoa": STUCK}),
    ),
    Known(
        "commands", "machines suspend and resume each other", COMMANDS,
        "never: G !m.suspended\nwakes: G (c@C2 -> F !m.suspended)\nseen: G (m.suspended -> O stop)\nx: G F m@X",
        _answers("never- wakes+ seen+ x-"),
    ),
    Known(
        "free values", "an input that never changes has any value, but one", NEVER,
        "one: G !jumper || G jumper\nzero: G n == 0\nkeeps: G (n == 1 -> G (m.ran -> n == 1))",
        _answers("one+ zero- keeps+"),
    ),
    Known(
        "held inputs", "an input that changes with the cycle is the same for all machines in it", HELD,
        "same: G same\nfirst: G !first", _answers("same+ first-"),
    ),
    Known(
        "a plant", "a model of the surroundings begins every cycle and chooses; its faults are faults", PLANT,
        "same: G (w.ran -> seen == level)\nfour: G level != 4\nkeeps: G (changed(level) -> v.ran)\n"
        "again: G F level == 0\nentered: G (v.ran -> env.entered)",
        _answers("same+ four+ keeps+ again- entered+"), faults=frozenset({"F011"}),
    ),
    Known(
        "a pool", "a fault unloads a machine, another is loaded instead, and what it may not write is refused", POOL,
        "loaded: G !b.loaded\nthere: G (b.ran -> b.loaded && refused(b))\nsafe: G !safe\neffect: G n == 4\n"
        "fault: G !faulted(a)\ngone: G (faulted(a) -> X G !a.ran)\nturns: G F c.ran",
        _answers("loaded- there+ safe+ effect+ fault- gone- turns+"), open=frozenset({"effect"}),
    ),
    Known(
        "wide input", "an input of 256 values, of which two classes matter", WIDE,
        "high: G !high\nexact: G (high -> level > 200)\nlow: G (m.ran && level <= 200 -> !high)",
        _answers("high- exact+ low+"),
    ),
    Known(
        "records and arrays", "elements of nested arrays are told apart, and an index outside is a fault", PLACES,
        "two: G a[1][2].x == 0\nother: G a[0][1].x == 0\nflag: G !a[1][1].f", _answers("two- other+ flag+"),
        faults=frozenset({"F003"}),
    ),
    Known(
        "a range that is left", "a store outside its range is a fault, and no step",
        COUNTER.format(type="0..3", action="if (up) { n++; } else { n = 0; }"),
        "most: G n <= 3\nless: G n < 3\nagain: G F n == 0", _answers("most+ less- again+"),
        faults=frozenset({"F001"}),
    ),
    Known(
        "an unavoidable fault", "a bad beginning before a fault counts", COUNTER.format(type="0..3", action="n++;"),
        "two: G n < 2\nall: G n <= 3\nfour: F n == 4", _answers("two- all+ four+"), faults=frozenset({"F001"}),
    ),
    Known(
        "no infinite run", "with an assumption only infinite runs count, of which there are none",
        COUNTER.format(type="0..3", action="n++;"), "assume any: G n >= 0\ntwo: G n < 2\nfour: F n == 4",
        _answers("two+ four+"), faults=frozenset({"F001"}), open=frozenset({"two", "four"}), contradictory=True,
    ),
    Known(
        "a division that is safe", "short circuits and choices keep a division from happening",
        DIVISION.format(limit=2),
        "q: G q <= 10\none: G q != 1\nten: G q != 10", _answers("q+ one+ ten-"), open=frozenset({"q", "one", "faults"}),
    ),
    Known(
        "a division by zero", "it is a fault where it happens", DIVISION.format(limit=3),
        "q: G q <= 10\nfive: G q != -5", _answers("q+ five-"), faults=frozenset({"F002"}),
        open=frozenset({"q"}),
    ),
    Known(
        "three kinds of faults", "each has a code of its own", THREE, "row: G !row[1]\nstays: G m@A",
        _answers("row+ stays+"),
        faults=frozenset({"F001", "F002", "F003"}), open=frozenset({"row"}),
    ),
    Known(
        "64 bits", "what leaves 64 bits is never shown, and found before",
        COUNTER.format(type="int", action="if (up) { n = n * 3 + 1; }"), "n: G n != 13\ngrows: G n >= 0",
        _answers("n- grows+"), open=frozenset({"grows", "faults"}),
    ),
)  # fmt: skip
"""Every kind of property, with both answers."""

ENDLESS = Known(
    "endless", "more configurations than can be looked at", COUNTER.format(type="int", action="n = n + 1;"),
    f"far: G n < {10**15}", _answers("far-"), open=frozenset({"far", "faults"}),
)  # fmt: skip
"""No engine can show a run of so many steps, and one that says that the property holds is wrong."""
