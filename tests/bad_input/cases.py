"""Wrong arrangements: a reason, a text in which ``§`` marks the place the diagnostic must name, and its code.

``GUARD(…)``, ``ACTION(…)`` and ``BOARD(…)`` put their text into a small arrangement that is right otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass

FRAME = """\
name: frame
cycle_ms: 100
types: {Colour: [RED, AMBER, GREEN], Signal: [ON, OFF], Level: [RED, HIGH], Ball: {record: {x: int8, y: int8}}}
whiteboard:
  car: {type: bool, role: input}
  light: {type: Colour}
  sig: {type: Signal}
  n: {type: 0..15}
  u: {type: uint8}
  big: {type: int}
  a: {type: {array: 0..3, size: 4}}
  b: {type: {array: bool, size: 4}}
  ball: {type: Ball}
  ball2: {type: Ball}
BOARD
machines:
  m:
    inline:
      machine: M
      parameters: {limit: {constant: 0..9}}
      states:
        - name: A
          variables: {mine: {type: bool}}
          on_entry: |
            mine = limit > 3;
            ACTION
          transitions:
            - when: |-
                GUARD
              to: B
        - name: B
    parameters: {limit: 5}
  other: {inline: {machine: O, states: [{name: IDLE}]}}
schedule: [m, other]
"""


def FRAMED(guard: str = "true", action: str = "", board: str = "") -> str:  # noqa: N802
    return FRAME.replace("GUARD", guard).replace("ACTION", action).replace("BOARD", board)


def DECIMAL(action: str, init: str = "0.5") -> str:  # noqa: N802
    """With a decimal `x`."""
    return FRAMED(action=action, board=f"  x: {{type: {{decimal: 0.1, range: -1.0..1.0}}, init: {init}}}")


def TABLE(action: str) -> str:  # noqa: N802
    """With a table `t` of two numbers."""
    return "tables: {t: [1, 2]}\n" + FRAMED(action=action)


def RUNS(names: str, action: str = "") -> str:  # noqa: N802
    """State B runs these machines."""
    return FRAMED(action=action).replace("- name: B", f"- {{name: B, runs: [{names}]}}")


def GUARD(text: str) -> str:  # noqa: N802
    return FRAMED(guard=text)


def ACTION(text: str) -> str:  # noqa: N802
    return FRAMED(action=text)


def BOARD(text: str) -> str:  # noqa: N802
    return FRAMED(board="  " + text)


def TOP(text: str) -> str:  # noqa: N802
    """`text` and the rest of a smallest arrangement."""
    return text + "\nmachines: {m: {inline: {machine: M, states: [{name: A}]}}}\nschedule: [m]\n"


def TWO(text: str) -> str:  # noqa: N802
    """`text` and an arrangement of two processes and a machine `c` that is in neither."""
    machines = ", ".join(f"{m}: {{inline: {{machine: M, states: [{{name: A}}]}}}}" for m in "abc")
    return f"{text}\nmachines: {{{machines}}}\nprocesses: {{one: [a], two: [b]}}\n"


def MACHINE(text: str) -> str:  # noqa: N802
    """An arrangement of one machine, `text` being its mapping, in flow style."""
    return f"machines: {{m: {{inline: {text}}}}}\nschedule: [m]\n"


def STATE(text: str) -> str:  # noqa: N802
    """A machine in block style with the state A, `text` being lines of it."""
    lines = "".join(f"          {line}\n" for line in text.split("\n"))
    return (
        "whiteboard: {car: {type: bool}, bus: {type: bool}, n: {type: 0..9}}\n"
        "machines:\n  m:\n    inline:\n      machine: M\n      states:\n        - name: A\n" + lines + "schedule: [m]\n"
    )


def PLANT(text: str) -> str:  # noqa: N802
    """An arrangement with a model of the surroundings, `text` being its action."""
    return (
        "whiteboard: {go: {type: bool, role: input}, n: {type: 0..3, role: input}, "
        "row: {type: {array: bool, size: 2}, role: input}, "
        "fixed: {type: bool, role: input, changes: never}, out: {type: bool, role: output}}\n"
        f"environment: {{inline: {{machine: P, states: [{{name: A, internal: '{text}'}}]}}}}\n"
        "machines: {m: {inline: {machine: M, states: [{name: A}]}}}\nschedule: [m]\n"
    )


def REQUEST(keys: str, timing: str = "cycle_ms: 100") -> str:  # noqa: N802
    """An arrangement with a plant that is there already, `keys` being what it is given."""
    return (
        f"{timing}\ntypes: {{S: [IDLE, WAITING, DONE, FAILED, TIMED_OUT], T: [IDLE, WAITING, DONE]}}\n"
        "whiteboard: {ask: {type: bool, role: output}, many: {type: 0..3}, state: {type: S, role: input}, "
        "short: {type: T, role: input}, n: {type: 0..3, role: input}}\n"
        f"environment: {{locate: {{{keys}}}}}\n"
        "machines: {m: {inline: {machine: M, states: [{name: A}]}}}\nschedule: [m]\n"
    )


def TOLD(inputs: str, output: str = "") -> str:  # noqa: N802
    """The theory of the microwave, and what it is told."""
    return f"models/microwave/MicrowaveCook.d, inputs: {{{inputs}}}" + (f", output: {output}" if output else "")


TOLD_ALL = TOLD("timeLeft: car, doorOpen: n > 0")


def COOK(theory: str = TOLD_ALL, name: str = "cook", action: str = "", guard: str = "true") -> str:  # noqa: N802
    """An arrangement that asks a theory, which is relative to the root of the project."""
    return f"knowledge: {{{name}: {{file: {theory}}}}}\n" + FRAMED(guard, action)


@dataclass(frozen=True, slots=True)
class Case:
    reason: str
    text: str
    code: str


CASES: tuple[Case, ...] = (
    # ---------------------------------------------------------------- YAML
    Case("an unclosed flow list", "schedule: §[m\nmachines: 1\n", "E010"),
    Case("a tab as indentation", "machines:\n§\tm: 1\n", "E010"),
    Case("an unclosed quote", 'name: §"abc\n', "E010"),
    Case("a list where the schedule's mapping ends", "name: a\n§- b\n", "E010"),
    Case("depth 65", "name: " + "[" * 63 + "§[" + "]" * 64 + "\n", "E012"),
    Case("100,000 opening brackets", "name: " + "[" * 63 + "§[" + "[" * 99936, "E012"),
    Case("100,000 opening braces", "name: " + "{" * 63 + "§{" + "{" * 99936, "E012"),
    Case("100,000 nested block lists", "name:\n" + "- " * 63 + "§- " + "- " * 10000 + "\n", "E012"),
    Case(
        "an alias bomb",
        "a: &a [x, x, x, x, x, x, x, x, x, x]\n"
        + "".join(f"{c}: &{c} [{', '.join(['*' + p] * 10)}]\n" for p, c in zip("abc", "bcd", strict=True))
        + "e: &e [*d, *d, *d, *d, *d, *d, *d, §*d, *d, *d]\n",
        "E013",
    ),
    Case("a second document", TOP("name: a") + "§---\nname: b\n", "E014"),
    Case("an alias to nothing", TOP("name: §*nothing"), "E015"),
    Case("an alias inside its own anchor", "machines: &all {m: §*all}\n", "E015"),
    Case("a tag that would run code", TOP('name: §!!python/object/apply:os.system ["true"]'), "E016"),
    Case("a tag that would make an object", TOP("name: §!!python/object/new:object {}"), "E016"),
    Case("a tag for an integer", TOP("cycle_ms: §!!int 3"), "E016"),
    Case("a key twice", TOP("name: a\n§name: b"), "E017"),
    Case(
        "a machine twice",
        "machines:\n  m: {inline: {machine: M, states: [{name: A}]}}\n  §m: {}\nschedule: [m]",
        "E017",
    ),
    Case("a list as a key", TOP("§[a, b]: c"), "E018"),
    # ---------------------------------------------------------------- files of another kind
    Case("properties", "# safety\n\n§safe: G !(a@ON && b@ON)\nlive: G F a@ON\n", "E019"),
    Case("properties that are no YAML", "§assume fair: G F (m.ran && car)\n[] <> x\nlive: G (a -> F: b)\n", "E019"),
    Case("a bare formula", "§G !(a@ON && b@ON)\n", "E019"),
    Case("an until", "§p: !a@ON U b@ON\n", "E019"),
    Case("an enforced expression", "§enforce order: (a@ON b@ON)*\n", "E019"),
    Case("a machine", "§machine: M\nstates:\n  - name: A\n  - name: B\n", "E019"),
    Case("a trace", "§trace: 1\narrangement: a.yaml\nproperty: {name: p, text: G a}\nsteps: []\n", "E019"),
    # ---------------------------------------------------------------- guards and actions that YAML eats
    Case("a guard that starts with !", STATE("transitions:\n  - when: §!car\n    to: A"), "E016"),
    Case("a guard that starts with ! and goes on", STATE("transitions:\n  - when: §!car && !bus\n    to: A"), "E020"),
    Case("a guard in a flow mapping that starts with !", STATE("transitions:\n  - {when: §!car, to: A}"), "E016"),
    Case("a guard that starts with a bracket", STATE("transitions:\n  - when: §[car]\n    to: A"), "E020"),
    Case("a guard that starts with a brace", STATE("transitions:\n  - when: §{car}\n    to: A"), "E020"),
    Case("a guard that starts with *", STATE("transitions:\n  - when: §*car && bus\n    to: A"), "E020"),
    Case("a guard that starts with @", STATE("transitions:\n  - when: §@A\n    to: A"), "E020"),
    Case("a guard that starts with a backtick", STATE("transitions:\n  - when: §`car`\n    to: A"), "E020"),
    Case("a guard that starts with %", STATE("transitions:\n  - when: §% 3 == 1\n    to: A"), "E020"),
    Case("a guard with `: ` in it", STATE("transitions:\n  - when: §car ? bus : car\n    to: A"), "E020"),
    Case("an action with `: ` in it", STATE("on_entry: §n = car ? 1 : 0;"), "E020"),
    Case("a comma in a flow mapping", STATE("transitions:\n  - {when: §max(n, 3) > 3, to: A}"), "E020"),
    Case("an index in a flow mapping", STATE("transitions:\n  - {when: §n[0] == 3, to: A}"), "E020"),
    Case("an action near the start", "name: n\non_entry: §[n] = 1\nschedule: [m]\nprofile: llfsm\n", "E020"),
    Case("text behind a quoted guard", STATE("transitions:\n  - when: §'car' && bus\n    to: A"), "E020"),
    # ---------------------------------------------------------------- shapes and keys
    Case("the file is a list", "§- a\n- b\n", "E030"),
    Case("the file is a word", "§hello\n", "E030"),
    Case("a machine that is a word", "machines: {m: §light}\nschedule: [m]\n", "E030"),
    Case("a whiteboard list", TOP("whiteboard: §[a, b]"), "E030"),
    Case("a schedule that is a word", TOP("").replace("[m]", "§m"), "E031"),
    Case("states as a mapping", MACHINE("{machine: M, states: §{A: {}}}"), "E031"),
    Case("a schedule that is a mapping", TOP("").replace("[m]", "§{main: [m]}"), "E031"),
    Case("a name that is a list", TOP("name: §[a]"), "E032"),
    Case("an empty name", TOP("name:§"), "E032"),
    Case("a misspelt key", TOP("§shedule: [m]"), "E033"),
    Case("a key of a later version", TOP("§clearance: {}"), "E033"),
    Case("clearances without levels", TOP("access: §{}"), "E034"),
    Case("no levels", TOP("access: {levels: §[]}"), "E099"),
    Case("a level twice", TOP("access: {levels: [a, §a]}"), "E099"),
    Case("an unknown level", TOP("access: {levels: [a], machines: {m: §b}}"), "E099"),
    Case("a clearance of no machine", TOP("access: {levels: [a], machines: {§n: a}}"), "E099"),
    Case("a class of an input", FRAMED() + "access: {levels: [a], write: {§car: a}}\n", "E099"),
    Case(
        "a machine that may not write", FRAMED(action="§n = 1;") + "access: {levels: [a, b], write: {n: b}}\n", "E157"
    ),
    Case(
        "a variable that needs a class",
        FRAMED(action="n = 1;").replace("  n: {type", "  §n: {type") + "access: {levels: [a, b], machines: {m: b}}\n",
        "E158",
    ),
    Case(
        "an operator whom nobody allows",
        TOP("access: {levels: [a, b], machines: {m: b}}\noperators: {suspend: [§m]}"),
        "E157",
    ),
    Case("a state that runs no machine", RUNS("§nobody"), "E159"),
    Case("a state that runs its own machine", RUNS("§m"), "E159"),
    Case("a state that runs a machine twice", RUNS("other, §other"), "E159"),
    Case("a question of a machine that no state runs", GUARD("§done(other)"), "E159"),
    Case("unloading a machine inside a state", RUNS("other", "§unload(other);"), "E159"),
    Case("a state that runs a machine of the pool", RUNS("§other").replace("[m, other]", "[m]\npool: [other]"), "E159"),
    Case("an operator without a word", TOP("operators: {§stop: [m]}"), "E033"),
    Case("an operator of no list", TOP("operators: {suspend: §m}"), "E031"),
    Case("an operator of no machine", TOP("operators: {suspend: [§n]}"), "E098"),
    Case("an operator that lets a state enter", TOP("operators: {enter: [§m@A]}"), "E098"),
    Case("an operator that lets one state be entered", TOP("operators: {enter: §{m: A}}"), "E031"),
    Case(
        "an operator without the clearance that a state needs",
        TOP("access: {levels: [a, b], command: {m: b}}\noperators: {enter: [§m]}"),
        "E157",
    ),
    Case("an operator of no variable", TOP("operators: {write: [§n]}"), "E098"),
    Case("an operator named twice", TOP("operators: {suspend: [m, §m]}"), "E098"),
    Case("an operator that writes an input", FRAMED() + "operators: {write: [§car]}\n", "E098"),
    Case("an operator that writes a record", FRAMED() + "operators: {write: [§ball]}\n", "E098"),
    Case("an operator that writes an int", FRAMED() + "operators: {write: [§big]}\n", "E098"),
    Case("a fault with another effect", TOP("").replace("{m: {", "{m: {on_fault: §stop, "), "E035"),
    Case("an empty pool", TOP("pool: §{}"), "E080"),
    Case("a pool that is a word", TOP("pool: §m"), "E031"),
    Case("a pool of another process", TWO("pool: {one: [c], §n: [b]}"), "E089"),
    Case("a pool for two processes", TWO("pool: §[c]"), "E089"),
    Case("a machine of the schedule in the pool", TOP("pool: [§m]"), "E082"),
    Case("an unknown machine in the pool", TOP("pool: [§n]"), "E081"),
    Case("a suspended machine in the pool", TWO("pool: {one: [c]}").replace("c: {", "§c: {suspended: true, "), "E089"),
    Case("surroundings without a machine", TOP("§environment: {}"), "E060"),
    Case("suspended surroundings", PLANT("").replace("inline:", "§suspended: true, inline:", 1), "E033"),
    Case("a suspend state of the surroundings", PLANT("").replace("machine: P", "machine: P, suspend: §A"), "E087"),
    Case("surroundings that are resumed", PLANT("").replace("{name: A", "{name: §A, on_resume: n = 0;", 1), "E087"),
    Case(
        "surroundings of several processes",
        PLANT("")
        .replace("schedule: [m]", "processes: {a: [m], b: [o]}")
        .replace("environment", "§environment")
        .replace("machines: {", "machines: {o: {inline: {machine: O, states: [{name: A}]}}, "),
        "E086",
    ),
    Case(
        "surroundings that write what never changes",
        PLANT("fixed = choose(bool);").replace("fixed:", "§fixed:"),
        "E088",
    ),
    Case(
        "two plants that write one input",
        PLANT("")
        .replace(
            "environment: {inline: ",
            "environment: {one: {inline: {machine: O, states: [{name: A, internal: n = 1;}]}}, two: {inline: ",
        )
        .replace("internal: ''}]}}", "internal: '§n = 2;'}]}}}"),
        "E532",
    ),
    Case("a plant of several without a machine", TOP("environment: {§one: {parameters: {}}}"), "E060"),
    Case(
        "a plant with the name of a machine",
        TOP("environment: {m: {inline: {machine: P, states: [{name: A}]}}}").replace("machines: {m", "machines: {§m"),
        "E118",
    ),
    Case("a plant of another name", REQUEST("use: §servce, ask: ask, state: state"), "E533"),
    Case("a plant without a name", TOP("§environment: {use: service, ask: ask, state: state}"), "E533"),
    Case("a request without its state", REQUEST("use: service, ask: ask").replace("{use", "§{use"), "E034"),
    Case("a request with a key of another", REQUEST("use: service, ask: ask, state: state, §feedback: [n]"), "E033"),
    Case("a request by an input", REQUEST("use: service, ask: §n, state: state"), "E534"),
    Case("a request by a number", REQUEST("use: service, ask: §many, state: state"), "E534"),
    Case("a request whose state is an output", REQUEST("use: service, ask: ask, state: §ask"), "E534"),
    Case("a request whose state is a number", REQUEST("use: service, ask: ask, state: §n"), "E534"),
    Case("a request whose answer is nowhere", REQUEST("use: service, ask: ask, state: state, answers: [§m]"), "E534"),
    Case(
        "a request whose answer is its state",
        REQUEST("use: service, ask: ask, state: §state, answers: [state]"),
        "E534",
    ),
    Case("a request with an answer twice", REQUEST("use: service, ask: ask, state: state, answers: [n, §n]"), "E017"),
    Case(
        "a request that is not idle at first",
        REQUEST("use: service, ask: ask, state: §state").replace(
            "{type: S, role: input", "{type: S, init: DONE, role: input"
        ),
        "E534",
    ),
    Case(
        "a request with the value of no state",
        REQUEST("use: service, ask: ask, state: short, values: {§FIALED: DONE, TIMED_OUT: DONE}"),
        "E534",
    ),
    Case(
        "a request of an input that is wrong",
        REQUEST("use: service, ask: ask, state: state, answers: [n]").replace("n: {type: 0..3", "n: {type: §int"),
        "E056",
    ),
    Case(
        "requests that share a state",
        REQUEST("use: service, ask: ask, state: state}, §two: {use: service, ask: ask, state: state"),
        "E532",
    ),
    Case(
        "a request that feeds the state of another",
        REQUEST(
            "use: service, ask: ask, state: state}, §two: {use: service, ask: ask, state: short, answers: [state]"
        ).replace("short: {type: T", "short: {type: S"),
        "E532",
    ),
    Case(
        "a request whose plant has the name of a machine",
        REQUEST("use: service, ask: ask, state: state")
        .replace("{locate:", "{§ask:")
        .replace("{m:", "{ask_plant:")
        .replace("[m]", "[ask_plant]"),
        "E118",
    ),
    Case(
        "a variable with the name of a state of a request",
        REQUEST("use: service, ask: ask, state: state").replace("whiteboard: {", "whiteboard: {§DONE: {type: bool}, "),
        "E118",
    ),
    Case("a type without states", REQUEST("use: service, ask: ask, state: §short, values: {FAILED: DONE}"), "E534"),
    Case("an action with states of a service", REQUEST("use: action, ask: ask, state: §state"), "E534"),
    Case(
        "an end that stands for none", REQUEST("use: service, ask: ask, state: short, values: {FAILED: §IDLE}"), "E534"
    ),
    Case("a time-out that is no time", REQUEST("use: service, ask: ask, state: state, timeout: §soon"), "E535"),
    Case(
        "a time-out without cycles",
        REQUEST("use: service, ask: ask, state: state, timeout: §2s", "timing: untimed"),
        "E535",
    ),
    Case("surroundings as a name alone", TOP("environment: §railway.yaml"), "E030"),
    Case(
        "surroundings that write what changes with the cycle",
        PLANT("go = true;").replace("go: {type: bool, role: input", "§go: {type: bool, role: input, changes: cycle"),
        "E088",
    ),
    Case("a plant by the name of its kind", TOP("§plant: {}"), "E033"),
    Case("a model that its file calls so", MACHINE("{machine: M, §model: true, states: [{name: A}]}"), "E033"),
    Case("a range among values", PLANT("n = choose(§0..1, 3);"), "E155"),
    Case(
        "a machine that looks at the surroundings",
        PLANT("").replace("states: [{name: A}]", "states: [{name: A, transitions: [{when: §env@A, to: A}]}]"),
        "E111",
    ),
    Case(
        "a machine called env", PLANT("").replace("machines: {m:", "machines: {§env:").replace("[m]", "[env]"), "E118"
    ),
    Case("a variable called env", PLANT("").replace("board: {", "board: {§env: {type: bool}, "), "E118"),
    Case("surroundings that write an output", PLANT("§out = true;"), "E156"),
    Case("surroundings that read an input of others", PLANT("go = §fixed;"), "E156"),
    Case("surroundings that command", PLANT("§suspend(m);"), "E156"),
    Case("surroundings that look at a machine", PLANT("go = §m@A;"), "E156"),
    Case("surroundings that ask for themselves", PLANT("go = is_running(§self);"), "E156"),
    Case(
        "surroundings with a machine as parameter",
        PLANT("")
        .replace("machine: P", "machine: P, parameters: {peer: machine}")
        .replace("}]}}", "}]}, parameters: {peer: §m}}", 1),
        "E156",
    ),
    Case("choosing from nothing", PLANT("go = §choose();"), "E117"),
    Case("choosing from an empty range", PLANT("n = choose(§3..1);"), "E116"),
    Case("choosing what varies", PLANT("n = choose(0, §n);"), "E136"),
    Case("choosing from a range that varies", PLANT("n = choose(0..§n);"), "E136"),
    Case("choosing outside the range", PLANT("n = §choose(0..9);"), "E128"),
    Case("choosing another type", PLANT("n = §choose(bool);"), "E123"),
    Case("choosing any integer", PLANT("n = choose(§int);"), "E155"),
    Case("choosing a whole array", PLANT("row = §choose(bool);"), "E155"),
    Case("choosing inside an expression", PLANT("n = 1 + §choose(0..1);"), "E155"),
    Case("choosing an operand", PLANT("n += §choose(0..1);"), "E155"),
    Case("a range as a value", PLANT("n = §0..1;").replace("n = §0..1;", "n = abs(§0..1);"), "E155"),
    Case("choosing and leaving it", PLANT("§choose(0..1);"), "E141"),
    Case("a machine that chooses", ACTION("n = §choose(0..3);"), "E155"),
    Case("a suppression where none may stand", TOP("").replace("{inline:", "{§lint: {L001: why}, inline:"), "E033"),
    Case("a merge key", TOP("§<<: {}"), "E033"),
    Case("a misspelt key of a state", MACHINE("{machine: M, states: [{name: A, §on_entrance: ''}]}"), "E033"),
    Case(
        "a misspelt key of a transition",
        MACHINE("{machine: M, states: [{name: A, transitions: [{when: true, to: A, §if: ''}]}]}"),
        "E033",
    ),
    Case("no machines", "§name: a\nschedule: []\n", "E034"),
    Case("a state without a name", MACHINE("{machine: M, states: [§{on_entry: ''}]}"), "E034"),
    Case("a transition without a guard", MACHINE("{machine: M, states: [{name: A, transitions: [§{to: A}]}]}"), "E034"),
    Case("a variable without a type", TOP("whiteboard: {a: §{init: 0}}"), "E034"),
    Case("an unknown profile", TOP("profile: §clfms"), "E035"),
    Case("an unknown snapshot", TOP("profile: {base: clfsm, snapshot: §often}"), "E035"),
    Case("an unknown role", TOP("whiteboard: {a: {type: bool, role: §sensor}}"), "E035"),
    Case("an unknown timing", TOP("timing: §none"), "E035"),
    Case(
        "`yes` for true",
        "machines: {m: {inline: {machine: M, states: [{name: A}]}, suspended: §yes}}\nschedule: [m]",
        "E035",
    ),
    Case("a name that is not a valid identifier", TOP("whiteboard: {§2nd: {type: bool}}"), "E036"),
    Case("a state that is no identifier", MACHINE("{machine: M, states: [{name: §A-B}]}"), "E036"),
    Case("a word of the language as a state", MACHINE("{machine: M, states: [{name: §if}]}"), "E119"),
    # ---------------------------------------------------------------- types and initial values
    Case("an unknown type", BOARD("z: {type: §Color}"), "E040"),
    Case("a type that contains itself", TOP("types: {A: {record: {x: §A}}}"), "E041"),
    Case("types that contain each other", TOP("types: {A: {record: {x: B}}, B: {array: §A, size: 2}}"), "E041"),
    Case("an empty range", BOARD("z: {type: §5..3}"), "E042"),
    Case(
        "a state that stays and has transitions", STATE("stays: §true\ntransitions:\n  - when: car\n    to: A"), "E075"
    ),
    Case("an enumeration without a name", BOARD("z: {type: §[X, Y]}"), "E042"),
    Case("a mapping that is no type", BOARD("z: {type: §{int: 3}}"), "E042"),
    Case("a record without fields", BOARD("z: {type: {record: §{}}}"), "E042"),
    Case(
        "a constant parameter that is a record",
        MACHINE("{machine: M, parameters: {p: {constant: §{record: {x: int}}}}, states: [{name: A}]}"),
        "E042",
    ),
    Case("a large array", BOARD("z: {type: §{array: {array: bool, size: 100}, size: 100}}"), "E043"),
    Case("deep arrays", BOARD("z: {type: " + "{size: 1, array: " * 32 + "§bool" + "}" * 32 + "}"), "E043"),
    Case("an empty enumeration", TOP("types: {E: §[]}"), "E044"),
    Case("an enumerator twice", TOP("types: {E: [X, Y, §X]}"), "E044"),
    Case("an array of no elements", BOARD("z: {type: {array: bool, size: §0}}"), "E045"),
    Case("an array of many elements", BOARD("z: {type: {array: bool, size: §99999999999999999999}}"), "E045"),
    Case("a range beyond 64 bits", BOARD("z: {type: §0..99999999999999999999}"), "E129"),
    Case("a list for a number", BOARD("z: {type: int, init: §[1]}"), "E050"),
    Case("a number for an array", BOARD("z: {type: {array: int, size: 2}, init: §1}"), "E050"),
    Case("a list of the wrong length", BOARD("z: {type: {array: int, size: 2}, init: §[1]}"), "E050"),
    Case("a number for a record", BOARD("z: {type: Ball, init: §1}"), "E050"),
    Case("a record without a field", BOARD("z: {type: Ball, init: §{x: 1}}"), "E051"),
    Case("a record with another field", BOARD("z: {type: Ball, init: {x: 1, y: 2, §z: 3}}"), "E115"),
    Case("an initial value out of range", BOARD("z: {type: 0..15, init: §16}"), "E128"),
    Case("a field out of range", BOARD("z: {type: Ball, init: {x: §128, y: 0}}"), "E128"),
    Case("an element out of range", BOARD("z: {type: {array: 0..3, size: 2}, init: [0, §4]}"), "E128"),
    Case("`no` is no bool", BOARD("z: {type: bool, init: §no}"), "E110"),
    Case("a number for a bool", BOARD("z: {type: bool, init: §0}"), "E123"),
    Case("an enumerator that does not exist", BOARD("z: {type: Colour, init: §BLUE}"), "E110"),
    Case("an enumerator of another type", BOARD("z: {type: Colour, init: §ON}"), "E114"),
    Case("1:30 is no number", BOARD("z: {type: int, init: 1§:30}"), "E101"),
    Case("an initial value that is not constant", BOARD("z: {type: 0..15, init: §n}"), "E110"),
    Case("`changes` on an output", BOARD("z: {type: bool, role: output, changes: §never}"), "E055"),
    Case("`safe` on an input", BOARD("z: {type: bool, role: input, safe: §false}"), "E057"),
    Case("an input without a range", BOARD("z: {type: §int, role: input}"), "E056"),
    Case("an input with a part without a range", BOARD("z: {type: §{record: {x: int}}, role: input}"), "E056"),
    # ---------------------------------------------------------------- machines and parameters
    Case("neither file nor inline", "machines: {§m: {}}\nschedule: [m]\n", "E060"),
    Case("a machine file that is not there", "machines: {m: {file: §nowhere.machine.yaml}}\nschedule: [m]\n", "E001"),
    Case("a machine file that is a directory", "machines: {m: {file: §.}}\nschedule: [m]\n", "E003"),
    Case(
        "a parameter without a value",
        FRAMED().replace("  m:\n", "  §m:\n").replace("    parameters: {limit: 5}\n", ""),
        "E061",
    ),
    Case("a value without a parameter", FRAMED().replace("{limit: 5}", "{limit: 5, §limmit: 6}"), "E062"),
    Case(
        "a whiteboard variable that does not exist",
        PARAMETER := TOP("whiteboard: {car: {type: bool}}")
        .replace("{machine: M,", "{machine: M, parameters: {p: {whiteboard: bool}},")
        .replace("}}}\nsch", "}, parameters: {p: §cat}}}\nsch"),
        "E063",
    ),
    Case("a machine that does not exist", PARAMETER.replace("{p: {whiteboard: bool}}", "{p: machine}"), "E063"),
    Case(
        "a whiteboard variable of another type",
        PARAMETER.replace("{p: {whiteboard: bool}}", "{p: {whiteboard: int}}").replace("cat", "car"),
        "E064",
    ),
    Case("a constant out of range", FRAMED().replace("{limit: 5}", "{limit: §10}"), "E128"),
    Case("a constant of the wrong kind", FRAMED().replace("{limit: 5}", "{limit: §car}"), "E123"),
    Case("a parameter of no kind", MACHINE("{machine: M, parameters: {p: §integer}, states: [{name: A}]}"), "E065"),
    Case(
        "a parameter of two kinds",
        MACHINE("{machine: M, parameters: {p: §{whiteboard: int, constant: int}}, states: [{name: A}]}"),
        "E065",
    ),
    Case(
        "a parameter that hides a whiteboard variable",
        FRAMED().replace("{limit: {", "{§n: {").replace("limit: 5", "n: 5").replace("limit > 3", "true"),
        "E118",
    ),
    Case(
        "a parameter called like an enumerator",
        FRAMED().replace("{limit: {", "{§GREEN: {").replace("limit: 5", "GREEN: 5").replace("limit > 3", "true"),
        "E118",
    ),
    Case(
        "a machine variable that hides a whiteboard variable",
        FRAMED().replace(
            "      states:\n        - name: A", "      variables: {§n: {type: int}}\n      states:\n        - name: A"
        ),
        "E118",
    ),
    Case(
        "a state variable that hides a parameter",
        FRAMED().replace("{mine: {type: bool}}", "{mine: {type: bool}, §limit: {type: int}}"),
        "E118",
    ),
    Case("a variable called like an enumerator", BOARD("§GREEN: {type: bool}"), "E118"),
    Case("a machine called like a variable", BOARD("§other: {type: bool}"), "E118"),
    Case("a variable called like a word of properties", BOARD("§cycle: {type: bool}"), "E119"),
    Case(
        "a machine variable called like a state with variables",
        MACHINE("{machine: M, variables: {§A: {type: bool}}, states: [{name: A, variables: {k: {type: bool}}}]}"),
        "E118",
    ),
    Case("two states of one name", MACHINE("{machine: M, states: [{name: A}, {name: B}, {name: §A}]}"), "E070"),
    Case(
        "a transition to nowhere",
        MACHINE("{machine: M, states: [{name: RED, transitions: [{when: true, to: §RAD}]}]}"),
        "E071",
    ),
    Case("an unknown initial state", MACHINE("{machine: M, initial: §B, states: [{name: A}]}"), "E072"),
    Case("an unknown suspend state", MACHINE("{machine: M, suspend: §B, states: [{name: A}]}"), "E073"),
    Case("no states", MACHINE("{machine: M, states: §[]}"), "E074"),
    # ---------------------------------------------------------------- schedule and time
    Case("an empty schedule", TOP("").replace("[m]", "§[]"), "E080"),
    Case("no processes", TOP("").replace("schedule: [m]", "processes: §{}"), "E080"),
    Case("an unknown machine in the schedule", TOP("").replace("[m]", "[m, §n]"), "E081"),
    Case("a machine with two places", TOP("").replace("[m]", "[m, §m]"), "E082"),
    Case("a machine in two processes", TOP("").replace("schedule: [m]", "processes: {a: [m], b: [§m]}"), "E082"),
    Case("a machine without a place", FRAMED().replace("[m, other]", "[m]").replace("  other:", "  §other:"), "E083"),
    Case("no schedule", "§machines: {m: {inline: {machine: M, states: [{name: A}]}}}\n", "E084"),
    Case("schedule and processes", TOP("").replace("schedule: [m]", "schedule: [m]\nprocesses: §{a: [m]}"), "E084"),
    Case(
        "cycles of several processes",
        FRAMED().replace("schedule: [m, other]", "processes: {a: [m], b: [other]}\nobserve: §cycle"),
        "E085",
    ),
    Case("after without a cycle", GUARD("§after(3)").replace("cycle_ms: 100\n", ""), "E090"),
    Case("untimed with cycle_ms", TOP("timing: untimed\ncycle_ms: §10"), "E091"),
    Case("untimed with a bound that varies", GUARD("§after(n)").replace("cycle_ms: 100", "timing: untimed"), "E092"),
    Case("a bound above 2^20 ticks", GUARD("§after(104858)"), "E093"),
    Case("a bound without a bound", GUARD("car && §after_ms(big)"), "E093"),
    Case("a cycle of no time", TOP("cycle_ms: §0"), "E094"),
    Case("a suppression of a finding that there is none of", TOP("lint: {§L999: known}"), "E095"),
    Case("a later format", TOP("format: §2"), "E097"),
    Case("a format that is not a number", TOP("format: §one"), "E097"),
    Case("a later format of a machine", TOP("").replace("{inline: {", "{inline: {format: §3, "), "E097"),
    Case("a suppression without a reason", TOP("lint: {§L001: ''}"), "E096"),
    Case("a cycle that is no number", TOP("cycle_ms: §fast"), "E094"),
    # ---------------------------------------------------------------- syntax of guards and actions
    Case("a guard that ends too early", GUARD("car &§&"), "E101"),
    Case("an operand is missing", GUARD("car && §|| car"), "E101"),
    Case("a bracket too many", GUARD("(car)§)"), "E101"),
    Case("a bracket too few", GUARD("§(car"), "E101"),
    Case("a shift of a range", GUARD("§n << 1 == 2"), "E161"),
    Case("bits of two widths", FRAMED(action="u = u & §v;", board="  v: {type: int8}"), "E161"),
    Case("bits of constants", ACTION("n = §1 << n;"), "E161"),
    Case("bits of two widths in the other order", FRAMED(action="u = v & §u;", board="  v: {type: int8}"), "E161"),
    Case("a number in a conditional that is too wide", ACTION("u = (car ? u : §300) & 7;"), "E128"),
    Case("bits of a wider variable stored in place", FRAMED(action="u |= §v;", board="  v: {type: uint16}"), "E161"),
    Case(
        "bits of a decimal", FRAMED(action="u = u | §x;", board="  x: {type: {decimal: 0.1, range: 0.0..1.0}}"), "E161"
    ),
    Case("bits of a sum", ACTION("u = §(u + 1) & u;"), "E161"),
    Case("a mask that is too wide", ACTION("u = u | §0x100;"), "E128"),
    Case("a shift by the width", ACTION("u = u << §8;"), "E131"),
    Case("a mask that is compared without brackets", GUARD("u & §3 == 1"), "E105"),
    Case("a bit operation that stores in a range", ACTION("§n &= 1;"), "E150"),
    Case("a bit operation that stores in a bool", ACTION("§mine |= car;"), "E150"),
    Case("a bit as a condition", GUARD("§u & 1"), "E120"),
    Case("a bit that a conditional chooses as a condition", GUARD("§car ? u : 1"), "E120"),
    Case("a shift without a sign", ACTION("u = u §>>> 1;"), "E101"),
    Case("an exclusive or of conditions", GUARD("car §^^ car"), "E101"),
    Case("a comparison as a statement", ACTION("n §== 2;"), "E101"),
    Case("a name as a statement", ACTION("car§;"), "E101"),
    Case("a name at the end", STATE("on_entry: c§x"), "E101"),
    Case("a power", ACTION("n = n §** 2;"), "E101"),
    Case("a cast", ACTION("n = §(int) u;"), "E101"),
    Case("an arrow", GUARD("car -§> car"), "E101"),
    Case("an unclosed comment", GUARD("car §/* never closed"), "E101"),
    Case("an else without if", ACTION("§else n = 1;"), "E101"),
    Case("the error is in the second line of a folded guard", GUARD("car &&\n                car && §&& car"), "E101"),
    Case("an error in a single-quoted guard", STATE("transitions:\n  - when: '  car && §&& car'\n    to: A"), "E101"),
    Case("an error behind an escape", STATE('transitions:\n  - when: "\\u0063ar \\x26& §&& car"\n    to: A'), "E101"),
    Case(
        "an error in a plain guard of two lines",
        STATE("transitions:\n  - when: car &&\n      car && §&& car\n    to: A"),
        "E101",
    ),
    Case("an error in a folded block", STATE("on_entry: >\n  n = 1;\n\n  n = 2 §3;"), "E101"),
    Case("a text", GUARD("light == §'red'"), "E102"),
    Case("a double-quoted name", GUARD('§"car"'), "E102"),
    Case("a backslash", GUARD("car §\\ car"), "E102"),
    Case("a letter of another script", GUARD("c§\N{CYRILLIC SMALL LETTER A}r"), "E102"),
    Case("a missing semicolon", ACTION("n = §1\n            u = 2;"), "E103"),
    Case("a missing last semicolon", ACTION("u = 2; n = §1"), "E103"),
    Case("a missing semicolon before a brace", ACTION("if (car) { n = §1 }"), "E103"),
    Case("an assignment as a guard", GUARD("n §= 1"), "E104"),
    Case("an increment as a guard", GUARD("n§++ > 1"), "E104"),
    Case("a single ampersand", GUARD("§car & car"), "E105"),
    Case("a single bar", GUARD("§car | car"), "E105"),
    Case("a chained comparison", GUARD("§0 < n < 5"), "E106"),
    Case("a chained equality", GUARD("§n == u == n"), "E106"),
    Case("201 brackets", GUARD("(" * 200 + "§(" + "car" + ")" * 201), "E107"),
    Case("10,000 brackets", GUARD("(" * 200 + "§(" + "(" * 9799 + "car"), "E107"),
    Case("201 negations", GUARD("!" * 200 + "§!" + "car"), "E107"),
    Case("201 ifs", ACTION("if (car) if (car) §" + "if (car) " * 199 + "n = 1;"), "E107"),
    Case("a tower of conditions", GUARD("car ? car : §" + "car ? car : " * 200 + "car"), "E107"),
    Case("many divisions", GUARD("§n" + " / 1" * 70 + " == 0"), "E107"),
    Case("100,000 brackets", GUARD("§" + "(" * 100_000), "E108"),
    Case("200,000 negations", GUARD("§" + "!" * 200_000 + "car"), "E108"),
    Case("a guard of 1 MiB", GUARD("§car" + " && car" * 150_000), "E108"),
    Case("a missing guard", STATE("transitions:\n  - when: '§'\n    to: A"), "E109"),
    Case("a missing guard in a flow mapping", STATE("transitions:\n  - {when: §, to: A}"), "E109"),
    # ---------------------------------------------------------------- names
    Case("an unknown variable", GUARD("§cat"), "E110"),
    Case("an unknown target", ACTION("§nn = 1;"), "E110"),
    Case("a local outside its block", ACTION("{ int k = 1; n = k; } n = §k;"), "E110"),
    Case(
        "a state variable of another state",
        FRAMED().replace("- name: B", "- name: B\n          on_entry: §mine = true;"),
        "E110",
    ),
    Case("an unknown machine", GUARD("§othr@IDLE"), "E111"),
    Case("a command to an unknown machine", ACTION("suspend(§nobody);"), "E111"),
    Case("a command to an expression", ACTION("suspend(§1 + 2);"), "E111"),
    Case("an unknown state", GUARD("other@§IDEL"), "E112"),
    Case("an unknown function", GUARD("§cube(4) == 2"), "E113"),
    Case("an unknown command", ACTION("§print(n);"), "E113"),
    Case("a value of another enumeration", GUARD("light == §ON"), "E114"),
    Case("a value of two enumerations", GUARD("§RED == RED"), "E114"),
    Case("a qualified value that does not exist", GUARD("light == Colour.§BLUE"), "E114"),
    Case("an unknown field", GUARD("ball.§z == 0"), "E115"),
    Case("an unknown local type", ACTION("§string k = 1;"), "E116"),
    Case("an empty local range", ACTION("§5..3 k = 4;"), "E116"),
    Case("a local range beyond 64 bits", ACTION("§0..9223372036854775808 k = 4;"), "E129"),
    Case("abs of two", GUARD("§abs(n, 1) == 1"), "E117"),
    Case("min of one", GUARD("§min(n) == 1"), "E117"),
    Case("suspend_all with an argument", ACTION("§suspend_all(other);"), "E117"),
    Case("a local that hides a whiteboard variable", ACTION("int §n = 1;"), "E118"),
    Case("a local that hides a local", ACTION("int k = 1; if (car) { int §k = 2; n = k; }"), "E118"),
    Case("a word of the language as a local", ACTION("int §self = 1;"), "E119"),
    # ---------------------------------------------------------------- types
    Case("an integer guard", GUARD("§n"), "E120"),
    Case("an integer beside &&", GUARD("car && §n"), "E120"),
    Case("an enumeration as a guard", GUARD("§light"), "E120"),
    Case("not binds tighter than ==", GUARD("!§n == 3"), "E120"),
    Case("a bool in arithmetic", GUARD("§car + 1 > 1"), "E121"),
    Case("an enumeration in arithmetic", ACTION("n = §light + 1;"), "E121"),
    Case("a bool as an index", GUARD("a[§car] == 1"), "E121"),
    Case("a bool compared with a number", GUARD("§car == 1"), "E122"),
    Case("a record compared with an array", GUARD("§ball == a"), "E122"),
    Case("two types behind ?", GUARD("§(car ? 1 : true) == 1"), "E122"),
    Case("a number stored in a bool", ACTION("sig = ON; mine = §1;"), "E123"),
    Case("a bool stored in a number", ACTION("n = §car;"), "E123"),
    Case("an array stored in a record", ACTION("ball = §a;"), "E123"),
    Case("an array stored in an array of another type", ACTION("a = §b;"), "E123"),
    Case("an index behind a number", GUARD("n§[0] == 1"), "E124"),
    Case("a field of a number", GUARD("n§.x == 1"), "E125"),
    Case("writing an input", ACTION("§car = true;"), "E126"),
    Case("writing a constant", ACTION("§limit = 3;"), "E127"),
    Case("writing a loop's counter", ACTION("for (i in 0..3) §i = 2;"), "E127"),
    Case("a constant out of range", ACTION("n = §16;"), "E128"),
    Case("a local's value out of range", ACTION("0..3 k = §2 + 2;"), "E128"),
    Case("a number beyond 128 bits", GUARD("big < §340282366920938463463374607431768211456"), "E129"),
    Case("a number beyond an int", ACTION("big = §9223372036854775808;"), "E128"),
    Case("a very long number", GUARD("big < §" + "9" * 5000), "E129"),
    Case("a division by zero", GUARD("n / §0 == 1"), "E130"),
    Case("a remainder of a constant zero", ACTION("n %= §limit - 5;"), "E130"),
    Case("an index outside its array", GUARD("a[§4] == 1"), "E131"),
    Case("a negative index", ACTION("a[§-1] = 1;"), "E131"),
    Case("a negative time", GUARD("after(§-1)"), "E132"),
    Case("a negative decimal time", GUARD("after(§-0.5)"), "E132"),
    Case("a decimal that is no multiple", DECIMAL("x = §0.25;"), "E160"),
    Case("an initial decimal that is no multiple", DECIMAL("", init="§0.25"), "E160"),
    Case("a decimal outside its range", DECIMAL("x = §0.5 * 3;"), "E128"),
    Case("a decimal in an integer", DECIMAL("n = §x;"), "E123"),
    Case("a remainder of decimals", DECIMAL("x = §x % 0.3;"), "E121"),
    Case("a decimal number in an integer", DECIMAL("n = §0.5;"), "E123"),
    Case("a decimal number as an index", DECIMAL("n = a[§1.0];"), "E121"),
    Case("a decimal in a bool", DECIMAL("mine = §x;"), "E123"),
    Case("a bool in a decimal", DECIMAL("x = §car;"), "E123"),
    Case("bits stored in a decimal", DECIMAL("§x |= 1;"), "E150"),
    Case("a time that is a decimal variable", DECIMAL("if (after(§x)) n = 1;"), "E121"),
    Case("a number without a digit before the point", DECIMAL("x = §.5;"), "E134"),
    Case("a number without a digit behind the point", DECIMAL("x = §1.;"), "E134"),
    Case("a decimal with a comma", DECIMAL("x = §0,5;"), "E134"),
    Case("a decimal with an exponent", DECIMAL("x = §5e-1;"), "E134"),
    Case("a function of another language", DECIMAL("x = §sin(x);"), "E113"),
    Case("a root of two numbers", DECIMAL("x = §sqrt(1, 2);"), "E117"),
    Case("rounding to digits", DECIMAL("n = §round(x, 1);"), "E117"),
    Case("a local variable of type float", DECIMAL("§float y = 0.5;"), "E116"),
    Case("a variable of type float", BOARD("x: {type: §float}"), "E040"),
    Case("a range of decimals without a step", BOARD("x: {type: §0.0..1.0}"), "E040"),
    Case("a decimal index", DECIMAL("n = a[§x];"), "E121"),
    Case("a decimal as a condition", DECIMAL("if (§x) n = 1;"), "E120"),
    Case("a decimal beyond 128 bits", DECIMAL("x = §34028236692093846346337460743176821145.6;"), "E129"),
    Case("a negative decimal beyond 128 bits", DECIMAL("x = -§34028236692093846346337460743176821145.5;"), "E129"),
    Case("too many digits", DECIMAL("x = §0.1234567890123456789;"), "E129"),
    Case("a product of too many digits", DECIMAL("x = §0.1234567890 * 0.1234567890;"), "E129"),
    Case("a remainder stored in a decimal", DECIMAL("§x %= 2;"), "E150"),
    Case("the root of a number without bounds", ACTION("n = sqrt(§big + 1);"), "E163"),
    Case("a table without numbers", TOP("tables: {t: §[]}"), "E047"),
    Case("a table of names", TOP("tables: {t: [1, §RED]}"), "E047"),
    Case("a table that is one number", TOP("tables: {t: §1}"), "E031"),
    Case("a table of too large a number", TOP("tables: {t: §[9223372036854775808]}"), "E129"),
    Case("a table with the name of a value", TOP("types: {Colour: [RED]}\ntables: {§RED: [1]}"), "E118"),
    Case("a table as a whole", TABLE("n = §t;"), "E162"),
    Case("a table that is written", TABLE("§t[0] = 1;"), "E127"),
    Case("a place that a table does not have", TABLE("n = t[§2];"), "E131"),
    Case("a place in a number of a table", TABLE("n = t[1]§[0];"), "E124"),
    Case("the root of a negative number", DECIMAL("x = sqrt(§-1.0);"), "E130"),
    Case("a step that is no power of ten", BOARD("x: {type: {decimal: §0.05, range: 0.0..1.0}}"), "E046"),
    Case("a decimal without a range", BOARD("x: {type: {decimal: 0.1, range: §1.0}}"), "E046"),
    Case("a bound that is no multiple", BOARD("x: {type: {decimal: 0.1, range: §0.0..1.05}}"), "E046"),
    Case("an empty range of decimals", BOARD("x: {type: {decimal: 0.1, range: §1.0..0.5}}"), "E042"),
    Case("a range of too many steps", BOARD("x: {type: {decimal: 0.000000001, range: §0..99999999999}}"), "E129"),
    Case("a number with a suffix", GUARD("n > §10u"), "E134"),
    Case("a number with a suffix at the beginning", GUARD("§10u > n"), "E134"),
    Case("a decimal number with a suffix", GUARD("n > §1.5u"), "E134"),
    Case("an octal number", GUARD("n > §010"), "E134"),
    # ---------------------------------------------------------------- theories
    Case("a theory that is nowhere", COOK("§nowhere.d"), "E001"),
    Case("a theory that is something else", COOK("§pyproject.toml"), "E019"),
    Case("an entry without a theory", TOP("knowledge: {cook: §{inputs: {}}}"), "E034"),
    Case("an entry that is a file", TOP("knowledge: {cook: §MicrowaveCook.d}"), "E030"),
    Case("an input that the theory does not have", COOK(TOLD("timeLeft: car, §doorOpn: car, doorOpen: n > 0")), "E166"),
    Case("an input that is misspelt", COOK(TOLD("timeLeft: car, §doorOpn: n > 0")), "E166"),
    Case("an unknown key beside a theory", COOK(TOLD("timeLeft: car").replace("inputs:", "§input:")), "E033"),
    Case("an output that the theory does not have", COOK(TOLD("timeLeft: car, doorOpen: n > 0", "§cok")), "E166"),
    Case("an input that is told nothing", COOK(TOLD("timeLeft: car"), "§cook"), "E167"),
    Case("an input that is an integer", COOK(TOLD("timeLeft: §n, doorOpen: n > 0")), "E120"),
    Case("an input of an unknown variable", COOK(TOLD("timeLeft: §cat, doorOpen: n > 0")), "E110"),
    Case("an input that asks for the time", COOK(TOLD("timeLeft: §after(3), doorOpen: n > 0")), "E168"),
    Case("an input that asks for itself", COOK(TOLD("timeLeft: §cook, doorOpen: n > 0")), "E110"),
    Case("an input that asks for its own state", COOK(TOLD("timeLeft: §self@A, doorOpen: n > 0")), "E111"),
    Case("an entry with the name of a variable", COOK(TOLD("timeLeft: car, doorOpen: n > 0"), "§car"), "E118"),
    Case("an entry with the name of a machine", COOK(TOLD("timeLeft: car, doorOpen: n > 0"), "§m"), "E118"),
    Case("an entry with the name of a word", COOK(TOLD("timeLeft: car, doorOpen: n > 0"), "§cycle"), "E119"),
    Case("a local variable with the name of an entry", COOK(action="bool §cook = true;"), "E118"),
    Case("what a theory says, written", COOK(action="§cook = true;"), "E127"),
    Case("a part of what a theory says", COOK(guard="cook§.x"), "E125"),
    Case("an entry that is spelt wrong", COOK(guard="§cok"), "E110"),
    # ---------------------------------------------------------------- statements
    Case("a loop downwards", ACTION("for (int i = 3; §i >= 0; i--) n = i;"), "E135"),
    Case("a loop by two", ACTION("for (int i = 0; i < 4; §i += 2) n = i;"), "E135"),
    Case("a loop over an outer variable", ACTION("for (§u = 0; u < 4; u++) n = 1;"), "E135"),
    Case("a bool counter", ACTION("for (§bool i = 0; i < 4; i++) n = 1;"), "E135"),
    Case("a loop to a variable", ACTION("for (i in 0..§n) u = i;"), "E136"),
    Case("a long loop", ACTION("§for (i in 0..10000) u = i;"), "E137"),
    Case("long nested loops", ACTION("for (i in 0..99) §for (k in 0..99) u = i + k;"), "E137"),
    Case("a loop that is long when written out", ACTION("§for (i in 0..9000) { " + "u = i; " * 5 + "}"), "E137"),
    Case("a loop of 2^62 turns", ACTION("§for (i in 0..4611686018427387904) u = 1;"), "E137"),
    Case("a local without a value", ACTION("§int k;"), "E138"),
    Case("a local in a range without a value", ACTION("§0..3 k;"), "E138"),
    Case("a loop as in Promela", ACTION("for (i §: 0..3) u = i;"), "E101"),
    Case("a loop with commas", ACTION("for (int i = 0§, i < 3, i++) u = i;"), "E101"),
    Case("a loop without a step", ACTION("for (int i = 0; i < 3§) u = i;"), "E101"),
    Case("a local record", ACTION("§Ball k = ball;"), "E139"),
    Case("a command as a guard", GUARD("§suspend(other)"), "E140"),
    Case("a query as a statement", ACTION("§is_running(other);"), "E141"),
    Case("a load as a guard", GUARD("§load(other)"), "E140"),
    Case("a load of no machine", ACTION("load(§nobody);"), "E111"),
    Case("a choice in a guard", GUARD("§choose(bool)"), "E155"),
    Case("what only a property asks", GUARD("§refused(other)"), "E145"),
    Case("another machine's variable", GUARD("§other.n == 1"), "E148"),
    Case("adding to a bool", ACTION("§mine += 1;"), "E150"),
    Case("ordering colours", GUARD("§light < GREEN"), "E152"),
    Case("choosing between records", ACTION("ball = §car ? ball : ball2;"), "E153"),
)
