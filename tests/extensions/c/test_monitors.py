"""Monitors in C: verdicts and their steps, what is promised, and that mistakes in them are seen."""

from __future__ import annotations

import ctypes
import json
import re
import subprocess
from collections import Counter
from pathlib import Path
from random import Random

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement import build_arrangement, load_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.extensions.c.image import MARK
from llfsm_verify.extensions.c.monitors import operations
from llfsm_verify.logic.formula import atoms
from llfsm_verify.logic.progression import progress
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.logic.reading import read_source
from llfsm_verify.logic.rewriting.normal_form import nnf
from llfsm_verify.monitoring.states import MonitorVerdict
from llfsm_verify.semantics.operators import OPERATOR
from llfsm_verify.testing.arrangements import Document, arrangements
from llfsm_verify.testing.properties import state_formulas
from tests.cli.running import llfsm
from tests.extensions.c.compiled import compile_strictly, needs_avr, needs_gcc
from tests.extensions.c.drawn import adapted
from tests.extensions.c.watching import VERDICTS, Board, Letters, asked, guarded
from tests.extensions.c.ways import SEED, WAYS, Chance
from tests.outside import demand
from tests.quick import each, examples, many, spread

UNDEFINED = ("-O1", "-fsanitize=undefined", "-fno-sanitize-recover=all")
SHAPES = (
    "G !({0} && {1})", "F {0}", "{0} W {1}", "G ({0} -> X X {1})", "G ({0} -> O[0:3] {1})", "X X X {0} || G {1}",
    "G ({0} -> F[<=40ms] {1})", "G ({0} -> ({1} S {2}))", "{0} U ({1} && X {2})", "G[0:4] !{0} && F {1}", "X {0}",
)  # fmt: skip
LINES = ("enforce {n}: [{0}]* [{1}] true*", "forbid {n}: [{0}] [!({1})] [{2}]", "assume {n}: G ({0} || {1} || {2})")
KINDS = (
    "violated",
    "satisfied",
    "undecided",
    "at first",
    "later",
    "a fault",
    "cycles",
    "ringlets",
    "regular",
    "assume",
)


def questions(arrangement: Arrangement, random: Random) -> str:
    """Properties over some of all that can be asked."""
    found = state_formulas(arrangement)
    lines = []
    for number in range(6):
        atoms = [f"({random.choice(found)})" for _ in range(3)]
        kind = random.random()
        shape = random.choice(LINES) if kind < 0.2 else f"{{n}}: {random.choice(SHAPES)}"
        lines.append(shape.format(*atoms, n=f"p{number}"))
    return "\n".join(lines) + "\n"


def compared(given: Arrangement, text: str, random: Random, tally: Counter[str], steps: int = 60) -> None:
    """A random run, by ringlets and cycles, in C and by the executor with monitors of Python."""
    board, letters = Board(guarded(given, text), *UNDEFINED), Letters(given, asked(text))
    board.start()
    letters.start()
    assert board.told() == letters.told()
    tally["at first"] += any(verdict is not MonitorVerdict.NOT_YET for verdict, _ in board.told()[1])
    sources = {c.source: c for c in letters.program.choices}
    for _ in range(steps):
        if letters.ended:
            assert board.go({c.name: c.type.low for c in board.image.program.choices}) == -1
            break
        held = {
            name: random.choice((c.type.low, c.type.high, random.randint(c.type.low, c.type.high)))
            if not name.startswith(OPERATOR) or random.random() < 0.2 else c.type.low for name, c in sources.items()
        }  # fmt: skip
        own = {c.name: held[c.source] for c in board.image.program.choices}
        if random.random() < 0.3:
            status = board.go(own, cycle=True)
            ours = letters.go(held)
            while ours == 0 and not letters.cycle_is_over:
                ours = letters.go(held)
        else:
            status, ours = board.go(own), letters.go(held)
        assert (status > 0) == (ours > 0), (status, ours)
        assert board.told() == letters.told()
        if ours:
            tally["a fault"] += 1
            break
    step, found = board.told()
    tally["later"] += any(place for _, place in found)
    tally["cycles" if letters.program.observe == "cycle" else "ringlets"] += step > 0
    for verdict, _ in found:
        tally[{MonitorVerdict.TRUE: "satisfied", MonitorVerdict.FALSE: "violated"}.get(verdict, "undecided")] += 1


def agree(count: int, until: tuple[str, ...]) -> None:
    """Random arrangements and properties."""
    tally = Counter[str]()

    def one(document: Document, seed: int) -> None:
        random = Random(seed)
        given = build_arrangement(adapted(document, unloads=seed % 2 == 0))
        text = questions(given, random)
        lines = []
        for line in text.splitlines():  # those that can be monitored, each tried alone
            try:
                guarded(given, f"{line}\n" + "x: true\n" * line.startswith("assume"))
            except DiagnosticError:
                continue
            lines.append(line)
        if not any(not line.startswith("assume") for line in lines):
            return
        try:
            guarded(given, "\n".join(lines))
        except DiagnosticError:  # what is assumed may leave nothing to decide
            lines = [line for line in lines if not line.startswith("assume")]
        tally["assume"] += any(line.startswith("assume") for line in lines)
        tally["regular"] += any(line.startswith(("enforce", "forbid")) for line in lines)
        compared(given, "\n".join(lines), random, tally)

    checks = list(HealthCheck)
    amount = settings(max_examples=count, deadline=None, database=None, suppress_health_check=checks)
    spread(one, amount, arrangements(), st.integers(0, 1 << 16), size=10, until=each(tally, until))


@needs_gcc
@pytest.mark.slow
def test_verdicts_and_their_steps_are_those_of_python():
    agree(examples(6), ())


@needs_gcc
@pytest.mark.long
def test_verdicts_and_their_steps_are_those_of_python_on_many_arrangements():
    agree(many(60), KINDS)


SMALL = {
    "name": "small", "cycle_ms": "10",
    "whiteboard": {
        "a": {"type": "bool", "role": "input"}, "b": {"type": "bool", "role": "input"},
        "far": {"type": "-3..3", "role": "input"}, "n": {"type": "-3..3"}, "safe": {"type": "0..9", "role": "output"},
    },
    "machines": {"m": {"inline": {"machine": "M", "states": [
        {"name": "S", "transitions": [{"when": "a", "to": "T"}]},
        {"name": "T", "internal": "n = far;", "transitions": [{"when": "b", "to": "S"}]},
    ]}}},
    "schedule": ["m"],
}  # fmt: skip


def small(**changes: object) -> Arrangement:
    return build_arrangement(SMALL | changes)


def draw(letters: Letters, random: Random) -> dict[str, int]:
    """Values of all inputs, extremes often."""
    return {
        c.source: random.choice((c.type.low, c.type.high, random.randint(c.type.low, c.type.high)))
        for c in letters.program.choices
    }


def agrees(board: Board, letters: Letters, random: Random, steps: int = 5000) -> bool:
    """Whether both say the same of random ringlets, from the beginning again where all is decided."""
    for number in range(steps):
        if number % 40 == 0 or all(verdict is not MonitorVerdict.NOT_YET for verdict, _ in letters.told()[1]):
            board.start()
            letters.start()
        if board.told() != letters.told():
            return False
        held = draw(letters, random)
        if board.go(held, cycle=number % 2 == 0) != letters.go(held):  # a cycle is one ringlet
            return False
    return board.told() == letters.told()


@needs_gcc
@pytest.mark.slow
def test_verdicts_are_those_of_the_definition():
    """By what progression leaves of a formula, which is unsatisfiable, valid, or neither."""
    random = Random(5)
    found = ("a", "b", "n > 2", "m@S", "a && !b", "far <= n", "m.ran")
    texts = ("G !({0} && {1})", "F {0}", "{0} W {1}", "G ({0} -> X X {1})", "X X {0} || G {1}", "{0} U ({1} && X {2})",
             "X (F ({0} && X {1}) -> {2})")  # fmt: skip
    lines = "".join(
        f"p{i}: {text.format(*(f'({a})' for a in random.sample(found, 3)))}\n" for i, text in enumerate(texts)
    )
    given, properties = small(), asked(lines)
    board, letters = Board(guarded(given, properties)), Letters(given, properties)
    tally = Counter[MonitorVerdict]()
    for _ in range(12):
        board.start()
        letters.start()
        rests = [nnf(line.formula) for line in properties.goals if line.formula is not None]
        for step in range(9):
            rests = [progress(rest, letters.read[-1]) for rest in rests]
            for rest, (verdict, _) in zip(rests, board.told()[1], strict=True):
                keys = atoms(rest)
                bad, good = (translate(rest, keys, negate=negate).is_empty for negate in (False, True))
                known = MonitorVerdict.FALSE if bad else MonitorVerdict.TRUE if good else MonitorVerdict.NOT_YET
                assert verdict is known, step
                tally[verdict] += 1
            held = draw(letters, random)
            board.go(held)
            letters.go(held)
    assert len(tally) == 3


def swapped(text: str, table: str, at: int) -> str:
    """The source with an entry of a table in the place of the next one."""
    begin = text.index(f"{table}[]")
    body = re.compile(r"\{([^}]*)\}").search(text, begin)
    assert body is not None
    numbers = body[1].split(",")
    numbers[at], numbers[at + 1] = numbers[at + 1], numbers[at]
    return text[: body.start(1)] + ",".join(numbers) + text[body.end(1) :]


PLANTED = (
    ("n <= 1;", "n < 1;"), ("monitors->step++;", ";"), ("== 2 ? small_VIOLATED", "== 1 ? small_VIOLATED"),
    ("<< 1)", "<< 0)"), (" < 4)", " < 3)"), ("] = monitors->step;", "] = monitors->step + 1;"),
    ("monitors->at.p0 = 0;", "monitors->at.p0 = 1;"),
    ("(void)small_monitors_step(monitors, state);", "(void)monitors;"),
)  # fmt: skip
"""Mistakes: what stands there, and what in its place."""


@needs_gcc
@pytest.mark.slow
def test_mistakes_in_the_source_are_seen():
    lines = "p0: G (a -> X (b || X a))\np1: G ((b && a) -> X (n <= 1 || far > 2))\n"
    given = small()
    image, letters = guarded(given, lines), Letters(given, asked(lines))
    assert image.monitors is not None
    assert agrees(Board(image), letters, Random(1))
    for walk in image.monitors.walks:
        for name, stage in zip(walk.tables, walk.of.table.stages, strict=True):
            places = [i for i in range(len(stage) - 1) if stage[i] != stage[i + 1]]
            for at in places[::3]:
                mistaken = Board(image, change=lambda text, name=name, at=at: swapped(text, name, at))
                assert not agrees(mistaken, letters, Random(1)), (name, at)
    source = image.monitors.files(MARK)["small_monitors.c"]
    for old, new in PLANTED:
        assert old in source, old
        mistaken = Board(image, change=lambda text, old=old, new=new: text.replace(old, new))
        assert not agrees(mistaken, letters, Random(1)), old


@needs_gcc
@pytest.mark.slow
def test_inputs_that_never_change_are_in_the_first_letter():
    """Their values are stored after the beginning, and an input that machines never read is one all the same."""
    board = {
        "size": {"type": "0..9", "role": "input", "changes": "never"}, "unread": {"type": "bool", "role": "input"},
        **SMALL["whiteboard"],
    }  # fmt: skip
    text = "a: size > 4\nb: X (size <= 4 && unread)\nc: G (size != 7 || n < 2)\nd: F (unread && !a)\n"
    given = small(whiteboard=board)
    made, letters, random = Board(guarded(given, text), *UNDEFINED), Letters(given, asked(text)), Random(2)
    for size in range(10):
        made.start([size])
        letters.start({"size": size})
        for _ in range(30):
            assert made.told() == letters.told(), size
            held = draw(letters, random)
            assert made.go(held) == letters.go(held)


@needs_gcc
@pytest.mark.slow
@pytest.mark.parametrize("snapshot", ["ringlet", "cycle"])
@pytest.mark.parametrize("observe", ["ringlet", "cycle"])
def test_letters_are_those_of_cycles_or_ringlets(snapshot, observe):
    """With single samples a letter shows the last one of its cycle."""
    machines = dict.fromkeys(("m", "k"), SMALL["machines"]["m"])
    given = small(
        machines=machines, schedule=["m", "k"], observe=observe, profile={"base": "llfsm", "snapshot": snapshot}
    )
    text = "p0: G (a -> X (b || X a))\np1: G (rose(n > 0) -> X (b || m@T))\np2: m.ran R !(far > 2 && k.sampled(a))\n"
    compared(given, text, Random(7), Counter(), steps=400)


@needs_gcc
@pytest.mark.slow
def test_the_microwave_and_the_lift_on_board():
    for name, drop in (("microwave", ""), ("lift", "env|answered|for i")):
        lines = Path(f"properties/{name}.ltl").read_text().splitlines()
        text = "".join(f"{line}\n" for line in lines if not drop or not re.search(drop, line))
        compared(load_arrangement(f"models/{name}/arrangement.yaml"), text, Random(3), Counter(), steps=2000)


PROPERTIES = "never: G n <= 2\nonce: F (a && rose(b))\nfirst: m@S\nopen: G !(a && !a)\nlate: F n < 0\n"
LINES_IN = '{"a": true}\n{"far": 3}\n{"far": 0}\n{"a": true, "b": true}\n'


@needs_gcc
@pytest.mark.slow
@pytest.mark.parametrize(("observe", "steps"), [("ringlet", (3, 7)), ("cycle", (4, 8))])
def test_a_program_for_posix_tells_verdicts_as_its_recording_does(observe, steps, tmp_path):
    """With `--strict` a violation ends it, with safe values. A step is a ringlet, of which a cycle has two here."""
    idle = {"machine": "K", "states": [{"name": "S", "transitions": [{"when": "false", "to": "S"}]}]}
    two = {"machines": SMALL["machines"] | {"k": {"inline": idle}}, "schedule": ["m", "k"], "observe": observe}
    board = SMALL["whiteboard"] | {"safe": {"type": "0..9", "role": "output", "safe": 7}}
    (tmp_path / "a.yaml").write_text(json.dumps(SMALL | two | {"whiteboard": board}))
    (tmp_path / "p.ltl").write_text(PROPERTIES)
    files = ("build", str(tmp_path / "a.yaml"), "--monitor", str(tmp_path / "p.ltl"), "-o", str(tmp_path / "made"))
    assert llfsm(*files, "--target", "c", "--for", "posix").returncode == 0
    subprocess.run(["make", "CFLAGS=-O1 -Werror"], cwd=tmp_path / "made", capture_output=True, check=True)

    def said(*words: str) -> tuple[int, list[dict[str, object]]]:
        command = [str(tmp_path / "made" / "small"), "--lines", *words]
        done = subprocess.run(command, input=LINES_IN, capture_output=True, text=True, check=False)
        return done.returncode, [json.loads(line) for line in done.stdout.splitlines()]

    first = {"cycle": 1, "property": "first", "verdict": "satisfied", "step": 0}
    bad = {"cycle": 2, "property": "never", "verdict": "violated", "step": steps[0]}
    good = {"cycle": 4, "property": "once", "verdict": "satisfied", "step": steps[1]}
    shown = [{"cycle": i, "safe": 0} for i in range(1, 5)]
    end = {"cycle": 4, "safe": 7, "end": "stopped"}
    decided = [{"cycle": 1, "property": "open", "verdict": "satisfied", "step": 0}]
    recording = tmp_path / "record"
    assert said("--record", str(recording)) == (
        1, [first, *decided, shown[0], bad, shown[1], shown[2], good, shown[3], end],
    )  # fmt: skip
    assert said("--strict") == (
        1, [first, *decided, shown[0], bad, {"cycle": 2, "safe": 7, "end": "violated"}],
    )  # fmt: skip
    assert "the same bit for bit, and then stopped" in llfsm("replay", str(recording)).stdout
    assert said("--strict", "--record", str(tmp_path / "short"))[0] == 1
    assert "4 frames, the same bit for bit, and then violated" in llfsm("replay", str(tmp_path / "short")).stdout
    told = llfsm("check-recording", str(recording), str(tmp_path / "p.ltl")).stdout
    found = re.findall(r"^(\w+) +(\w+) .*\n +(at step \d+|before the first step|[a-z ]+)", told, re.MULTILINE)
    assert found == [
        ("violated", "never", f"at step {steps[0]}"), ("satisfied", "once", f"at step {steps[1]}"),
        ("satisfied", "first", "before the first step"), ("satisfied", "open", "before the first step"),
        ("undecided", "late", "because the recording ended before a verdict"),
    ]  # fmt: skip


ELSEWHERE = """#include "small_monitors.h"
#include "walk.h"

void walk_all(void)
{
    static small_state s;
    static small_inputs in;
    static small_monitors m;
    uint64_t seed = UINT64_C(SEED);
    int16_t number;
    for (number = 0; number < STEPS; number++) {
        size_t i;
        if (number % 20 == 0) {
            small_init(&s);
            small_monitors_init(&m, &s);
        }
        in.a = pick(&seed, 0, 2) != 0;
        in.b = pick(&seed, 0, 2) != 0;
        in.far = (int8_t)((int16_t)pick(&seed, 0, 7) - 3);
        (void)small_monitored_cycle(&m, &s, &in);
        for (i = 0; i < small_PROPERTIES; i++) {
            put_word(small_monitors_verdict(&m, (small_property)i));
            put(' ');
            put_word(m.decided[i]);
            put(' ');
        }
        put('\\n');
    }
}
"""
ELSEWHERE_STEPS = 400


@pytest.mark.slow
@pytest.mark.parametrize("way", ["gcc -O2", "arm -O2", "riscv64 -O2", "wasm", "avr"])
def test_machines_of_8_to_64_bits_say_the_same(way, tmp_path):
    demand(*WAYS[way].needs)
    text = "p0: G (a -> X (b || X a))\np1: F (b && n <= 1)\np2: n * 10000 > -15000 W m@T\np3: G[0:9] !(a && far > 2)\n"
    text += "p4: X[17] (a -> b)\n"
    given = small()
    image, letters, chance = guarded(given, text, "size"), Letters(given, asked(text)), Chance(SEED)
    assert image.monitors is not None
    files = {"small.c": image.source(), "small.h": image.header(), **image.monitors.files(MARK)}
    files["all.c"] = ELSEWHERE.replace("SEED", str(SEED)).replace("STEPS", str(ELSEWHERE_STEPS))
    files |= {name: Path(__file__).with_name(name).read_text() for name in ("walk.c", "walk.h")}
    for name, content in files.items():
        (tmp_path / name).write_text(content)
    wanted = []
    for number in range(ELSEWHERE_STEPS):
        if number % 20 == 0:
            letters.start()
        letters.go({"a": chance.pick(0, 2), "b": chance.pick(0, 2), "far": chance.pick(0, 7) - 3})
        wanted.append("".join(f"{VERDICTS.index(v):x} {step:x} " for v, step in letters.told()[1]))
    assert {verdict for line in wanted for verdict in line.split()[::2]} == {"0", "1", "2"}
    WAYS[way].build(tmp_path)
    assert WAYS[way].run(tmp_path) == wanted


# ---------------------------------------------------------------- what is promised


def counting(text: str, prefix: str) -> str:
    """The source with a counter of the operators that a step meets, line by line."""
    begin = text.index(f"bool {prefix}_monitors_step(")
    end = text.index("\n}", begin)
    joined = re.sub(r"\n {8,}(?=[|&(])", " ", text[begin:end])
    lines = []
    for line in joined.split("\n"):
        plain = re.sub(r"/\*.*?\*/|\((?:u?int\d+_t|unsigned)\)", "", line)
        tokens = re.findall(r"->|<<|[=!<>]=|\+\+|&&|\|\||\w+|\S", plain.replace("(&table", "(table"))
        met = sum(not re.fullmatch(r"\w+|[(){};:.,\]=]", token) for token in tokens) + 3 * ("decide(" in line)
        lines += [f"ops += {met};"] * (met > 0 and not line.startswith("bool ")) + [line]
    head = "extern unsigned long ops;\nunsigned long ops = 0;\n"
    return text[:begin] + head + "\n".join(lines) + text[end:]


@needs_gcc
@pytest.mark.slow
def test_no_step_takes_more_operations_than_are_promised():
    """Each operator of the lines that a step meets, counted in another way; all verdicts in one step are the most."""
    cases = [
        ("p0: G (a -> X (b || X a))\np1: F (b && n <= 1)\nend: X X X X X (a || !a)\n", True),
        ("a: X (a && n > 1)\nb: X !(n > 1 || b)\nc: X X true && X m@S\n", True),
        ("a: X n > 1\nb: X X n > 1\n", False),  # which are not decided in one step
    ]
    for text, attained in cases:
        given = small()
        image, letters = guarded(given, text), Letters(given, asked(text))
        assert image.monitors is not None
        board, most, random = Board(image, change=lambda t: counting(t, "small")), 0, Random(3)
        ops = ctypes.c_ulong.in_dll(board.library, "ops")
        letters.start()
        for number in range(500):
            if number % 9 == 0:
                board.start()
            before = ops.value
            board.go(draw(letters, random))
            most = max(most, ops.value - before)
            assert ops.value - before <= image.monitors.operations
        assert (most == image.monitors.operations) == attained, (text, most)
        assert f"at most {image.monitors.operations} operations a step" in image.monitors.cost


@pytest.mark.parametrize(
    ("line", "count"),
    [
        ("const bool atom = state->outputs.motor; /* a && b */", 1), ("monitors->at.p = (uint8_t)x;", 1),
        ("if (monitors->step < UINT32_MAX) {", 2), ("monitors->step++;", 2), ("bool news = false;", 0),
        ("a = x_READ8(&table_0[((unsigned)monitors->at.p << 2) | (unsigned)atom]);", 4),
        ("const bool atom = div_16(state->a.x, 3) > 1;", 3), ("x = wide_div(a, b, true);", 5_323),
    ],
)  # fmt: skip
def test_operations_are_counted_as_the_page_says(line, count):
    assert operations([line]) == count


@needs_gcc
@pytest.mark.slow
@pytest.mark.parametrize("optimize", ["size", "speed"])
def test_memory_is_what_is_promised(optimize, tmp_path):
    properties = parse_properties([read_source("properties/microwave.ltl")])
    given = load_arrangement("models/microwave/arrangement.yaml")
    image = guarded(given, properties, optimize)
    monitors = image.monitors
    assert monitors is not None
    assert Board(image).sizes["monitors"] == monitors.memory
    found = {name: text for name, text in monitors.files(MARK).items() if name.endswith(".c")}
    (source,) = found.values()
    tables = re.findall(r"uint(\d+)_t table_\w+\[\] \w+ = \{([^}]*)\}", source)
    assert sum(int(bits) // 8 * len(body.split(",")) for bits, body in tables) == monitors.table_bytes
    assert (
        monitors.cost
        == {
            "size": "23 monitors: 750 bytes of tables, 120 bytes of RAM, at most 406 operations a step",
            "speed": "23 monitors: 962 bytes of tables, 120 bytes of RAM, at most 403 operations a step",
        }[optimize]
    )


@needs_avr
@pytest.mark.slow
def test_an_atmega_takes_them(tmp_path):
    """The promise about RAM is checked by its compiler, and tables stay in flash."""
    properties = parse_properties([read_source("properties/microwave.ltl")])
    image = guarded(load_arrangement("models/microwave/arrangement.yaml"), properties, "size")
    assert image.monitors is not None
    for name, text in {"microwave.h": image.header(), **image.monitors.files(MARK)}.items():
        (tmp_path / name).write_text(text)
    check = f"typedef char fits[sizeof(microwave_monitors) <= {image.monitors.memory} ? 1 : -1];\n"
    with (tmp_path / "microwave_monitors.c").open("a") as file:
        file.write(check)
    result = tmp_path / "monitors.o"
    compile_strictly("avr-gcc", tmp_path / "microwave_monitors.c", result, "-mmcu=atmega328p", "-Os")
    sizes = subprocess.run(["avr-size", "-A", str(result)], capture_output=True, text=True, check=True).stdout
    parts = {line.split()[0]: int(line.split()[1]) for line in sizes.splitlines() if line.startswith(".")}
    assert parts[".progmem.data"] == image.monitors.table_bytes
    assert parts[".data"] == parts[".bss"] == 0
