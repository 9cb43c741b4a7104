"""The readers of files and texts: for each, how a case with a mutated file is made."""

from __future__ import annotations

import hashlib
import json
import struct
from collections.abc import Callable
from dataclasses import replace
from functools import cache, cached_property
from random import Random

import yaml

from tests.fuzzing import grammar
from tests.fuzzing.case import Case
from tests.fuzzing.corpus import ATOMS, CORPUS, MAIN, Folder, trees
from tests.fuzzing.mutating import NUMBERS, Words, mutate_bytes, mutate_gently, mutate_leaf, mutate_text, mutate_tree
from tests.fuzzing.running import run_case
from tests.knowledge.theories import random_theory

LIMITS = ("--max-states", "200", "--timeout", "5")
EXPLICIT = ("--engine", "explicit", *LIMITS)
FORMATS = ("text", "json", "junit", "sarif")
STRUCTURES = ("json", "dot", "graphml", "aut", "smv", "promela")
NAMES = (
    "car",
    "n",
    "u",
    "big",
    "light",
    "RED",
    "GREEN",
    "a[1]",
    "b[0]",
    "ball.x",
    "ball2",
    "ball",
    "mine",
    "limit",
    "sig",
    "A",
)

Reader = Callable[[Random], Case]


ATTEMPTS = 8


def make(name: str, seed: int, number: int) -> Case:
    """The case of this number: it depends on nothing else.

    Most mutations make a file wrong at once; so half of the cases are the first of some whose files are read without
    complaint, and reach what comes after.
    """
    random = Random(f"{seed} {name} {number}")
    case = READERS[name](random)
    for _ in range(ATTEMPTS if random.random() < 0.6 else 0):
        probe = _probe(case)
        if probe is None:
            break
        outcome = run_case(probe)
        if outcome.found is not None:
            return probe
        if outcome.code != WRONG_FILES:
            break
        case = READERS[name](random)
    return case


WRONG_FILES = 3


def _probe(case: Case) -> Case | None:
    """A short command that reads the same files; None for those that are not worth it."""
    given = [argument for argument in case.arguments if argument.endswith(".ltl")]
    at = case.arguments.index("--syntax") if "--syntax" in case.arguments else len(case.arguments)
    syntax = case.arguments[at : at + 2]
    match case.arguments[0]:
        case "property":
            return replace(case, arguments=("property", "print", *given, *syntax)) if given else None
        case "draw" | "lint" | "verify" | "simulate" | "kripke" if MAIN in dict(case.files):
            if given:
                limits = ("--engine", "explicit", "--max-states", "1", "--timeout", "3")
                return replace(case, arguments=("verify", MAIN, *given, *syntax, *limits))
            return replace(case, arguments=("draw", MAIN, "--format", "dot"))
        case _:
            return None


def _words(random: Random) -> Words:
    return Words(
        CORPUS.words,
        (random.choice(CORPUS.properties), random.choice(CORPUS.snippets), random.choice(CORPUS.folders).files[MAIN]),
    )


@cache
def _yaml_trees() -> list[object]:
    return trees(tuple(text for folder in (*CORPUS.folders[:60], *CORPUS.random) for text in folder.files.values()))


def _folder(random: Random) -> Folder:
    origin = random.choice((CORPUS.folders, CORPUS.models, CORPUS.random, CORPUS.random))
    return random.choice(origin)


def _mutated_yaml(random: Random, text: str) -> bytes:
    words, kind = _words(random), random.random()
    if kind < 0.4:
        return mutate_gently(random, text).encode("utf-8", "surrogatepass")
    if kind < 0.7:
        try:
            tree = yaml.load(text, Loader=yaml.BaseLoader)
            gently = random.random() < 0.4
            tree = mutate_leaf(random, tree) if gently else mutate_tree(random, tree, words, _yaml_trees())
            if random.random() < 0.3:
                return json.dumps(tree, ensure_ascii=False).encode("utf-8", "surrogateescape")
            style = random.choice((None, False, True))
            dumped = yaml.dump(
                tree, Dumper=yaml.SafeDumper, sort_keys=False, allow_unicode=True, default_flow_style=style
            )
            return dumped.encode("utf-8", "surrogateescape")
        except (yaml.YAMLError, UnicodeEncodeError, RecursionError):
            pass
    return _encoded(random, mutate_text(random, text, words))


def _encoded(random: Random, text: str) -> bytes:
    """Usually UTF-8; what is not Unicode becomes single bytes, or the bytes that a careless program writes."""
    try:
        data = text.encode("utf-8", random.choice(("surrogateescape", "surrogatepass")))
    except UnicodeEncodeError:
        data = text.encode("utf-8", "surrogatepass")
    if random.random() < 0.01:
        data = text.encode(random.choice(("utf-16", "utf-32")), "surrogatepass")
    return mutate_bytes(random, data) if random.random() < 0.05 else data


def _files(folder: Folder, **others: bytes) -> tuple[tuple[str, bytes], ...]:
    files = {name: text.encode("utf-8", "surrogateescape") for name, text in folder.files.items()}
    return tuple({**files, **{name.replace("_", "."): data for name, data in others.items()}}.items())


def _replaced(folder: Folder, name: str, data: bytes) -> tuple[tuple[str, bytes], ...]:
    return tuple((file, data if file == name else old) for file, old in _files(folder))


# ---------------------------------------------------------------- arrangements


def _command(random: Random, folder: Folder) -> tuple[str, ...]:
    """A command that reads an arrangement."""
    atom = random.choice(folder.atoms)
    asked = random.choice(((), ("-p", f"G ({atom})"), ("-p", f"a: G F {atom}", "-p", f"forbid x: [{atom}]")))
    match random.randrange(12):
        case 0 | 1 | 2 | 3:
            more = random.choice(
                ((), (), ("--vacuity",), ("--all", "2"), ("--cone", "on"), ("--chains", "on"), ("--strict",))
            )
            return ("verify", MAIN, *asked, *EXPLICIT, "--format", random.choice(FORMATS), *more)
        case 4:
            engine = random.choice(("bmc", "induction", "pdr"))
            return ("verify", MAIN, *asked, "--engine", engine, "--depth", "3", "--timeout", "4")
        case 5 | 6:
            kind = random.choice(((*LIMITS,), ("--local", "--timeout", "5"), (*LIMITS, "--traces", "--silenced")))
            return ("lint", MAIN, "--format", random.choice(("text", "json", "sarif")), *kind)
        case 7:
            return (
                "draw",
                MAIN,
                "--format",
                random.choice(("dot", "mermaid")),
                *random.choice(((), ("--machine", "m"))),
            )
        case 8 | 9:
            wanted = random.choice(STRUCTURES)
            limits = () if wanted in ("smv", "promela") else LIMITS
            return ("kripke", MAIN, *asked, "--format", wanted, *limits)
        case 10:
            return ("query", MAIN, atom, *EXPLICIT)
        case _:
            return ("simulate", MAIN, "--seed", "1", "--steps", "30")


def _arrangement(random: Random) -> Case:
    folder = _folder(random)
    command = _command(random, folder)
    return Case(command, _replaced(folder, MAIN, _mutated_yaml(random, folder.files[MAIN])))


def _machine(random: Random) -> Case:
    folder = random.choice([f for f in CORPUS.folders if len(f.files) > 1])
    name = random.choice([name for name in folder.files if name != MAIN])
    return Case(_command(random, folder), _replaced(folder, name, _mutated_yaml(random, folder.files[name])))


def _language(random: Random) -> Case:
    """Guards and actions that the grammar allows, or nearly."""
    words, kind = _words(random), random.random()
    if kind < 0.3:
        guard, action = grammar.expression(random, NAMES), grammar.actions(random, NAMES)
    else:
        guard, action = (
            grammar.condition(random),
            " ".join(grammar.assignment(random) for _ in range(random.choice((1, 3)))),
        )
    if kind > 0.7:
        guard, action = mutate_gently(random, guard), mutate_gently(random, action)
    if 0.2 < kind < 0.5:
        guard, action = random.choice(
            ((mutate_text(random, guard, words), action), (guard, mutate_text(random, action, words)))
        )
    document = yaml.load(CORPUS.folders[-1].files[MAIN], Loader=yaml.BaseLoader)
    state = document["machines"]["m"]["inline"]["states"][0]
    state["transitions"][0]["when"] = guard
    state[random.choice(("on_entry", "internal", "on_exit", "on_suspend"))] = action
    text = json.dumps(document)
    return Case(_command(random, CORPUS.folders[-1]), ((MAIN, text.encode()),))


# ---------------------------------------------------------------- properties


def _properties(syntax: str) -> Reader:
    def reader(random: Random) -> Case:
        free = random.random() < 0.5
        folder = random.choice((CORPUS.folders[-1], CORPUS.folders[-2], CORPUS.small, _folder(random)))
        atoms = ATOMS if free else folder.atoms
        lines = [grammar.line(random, syntax, atoms) for _ in range(random.choice((1, 1, 3)))]
        text = "\n".join([*([f"# syntax: {syntax}"] if random.random() < 0.2 else []), *lines, ""])
        if random.random() < 0.15:
            text = random.choice(CORPUS.properties)
        if random.random() < 0.4:
            text = mutate_text(random, text, _words(random))
        elif random.random() < 0.3:
            text = mutate_gently(random, text)
        if free:
            return _free(random, syntax, text)
        command = ("verify", MAIN, "p.ltl", "--syntax", syntax, *EXPLICIT, "--format", random.choice(FORMATS))
        if random.random() < 0.2:
            wanted = random.choice(("smv", "promela", "json"))
            command = (
                "kripke",
                MAIN,
                "p.ltl",
                "--syntax",
                syntax,
                "--format",
                wanted,
                *(LIMITS if wanted == "json" else ()),
            )
        return Case(command, _files(folder, p_ltl=_encoded(random, text)))

    return reader


def _free(random: Random, syntax: str, text: str) -> Case:
    """A question about formulas without an arrangement."""
    question = random.choice(("classify", "translate", "simplify", "print", "example", "draw"))
    more: tuple[str, ...] = ()
    if question in ("simplify", "print") and random.random() < 0.6:
        more = ("--to", random.choice(grammar.SYNTAXES))
    if question == "translate":
        more = random.choice(((), ("--buchi",), ("--stats",)))
    stripped = "\n".join(line.split(": ", 1)[-1] for line in text.split("\n")) if random.random() < 0.8 else text
    return Case(("property", question, "p.ltl", "--syntax", syntax, *more), (("p.ltl", _encoded(random, stripped)),))


def _pairs(random: Random) -> Case:
    syntax = random.choice(grammar.SYNTAXES)
    left, right = (grammar.formula(random, syntax, ATOMS, 3) for _ in range(2))
    text = mutate_text(random, f"{left}\t{right}", _words(random)) if random.random() < 0.5 else f"{left}\t{right}"
    question = random.choice(("equivalent", "implies"))
    return Case(("property", question, "p.tsv", "--syntax", syntax), (("p.tsv", _encoded(random, text)),))


def _word(random: Random) -> Case:
    syntax = random.choice(grammar.SYNTAXES)
    atoms = (*ATOMS, '"x == 1"', "m@A", "m.fired(S, 0)", "a[1] > 2")
    word = grammar.word(random, atoms)
    if random.random() < 0.6:
        word = mutate_text(
            random, word, Words(("cycle{", "}", ";", "&", "!", "1", "0", "p", '"', "(", "true"), CORPUS.words)
        )
    asked = grammar.formula(random, syntax, ATOMS, 3)
    return Case(
        ("property", "accepts", "w.tsv", "--syntax", syntax), (("w.tsv", _encoded(random, f"{asked}\t{word}")),)
    )


def _monitor(random: Random) -> Case:
    text = "\n".join(grammar.line(random, "llfsm", ATOMS) for _ in range(random.choice((1, 1, 2))))
    if random.random() < 0.35:
        text = mutate_text(random, text, _words(random))
    shape = random.choice(("text", "machine", "table", "dot"))
    more: tuple[str, ...] = ()
    if shape == "machine" and random.random() < 0.5:
        more = random.choice((("--set", "alarm"), ("--suspend", "m"), ("--set", "n"), ("--arrangement", MAIN)))
    return Case(("monitor", "p.ltl", "--as", shape, *more), _files(CORPUS.small, p_ltl=_encoded(random, text)))


def _query(random: Random) -> Case:
    folder = random.choice((CORPUS.folders[-1], CORPUS.folders[-2], CORPUS.small, _folder(random)))
    text = " && ".join(random.choice((*folder.atoms, *folder.atoms, grammar.condition(random, 2))) for _ in range(2))
    if random.random() < 0.4:
        text = mutate_text(random, text, _words(random))
    return Case(
        ("query", MAIN, _argument(text), *EXPLICIT, "--format", random.choice(("text", "json"))), _files(folder)
    )


def _argument(text: str) -> str:
    """What can be given to a process: no NUL, and what is no UTF-8 as the surrogates that Python makes of it."""
    return "".join(c for c in text if c != "\0" and not ("\ud800" <= c <= "\udfff" and not "\udc80" <= c <= "\udcff"))


def _automaton(random: Random) -> Case:
    text = random.choice(CORPUS.automata)
    if random.random() < 0.5:
        text = mutate_gently(random, text)
    elif random.random() < 0.9:
        text = mutate_text(random, text, Words(CORPUS.words, CORPUS.automata))
    files = _files(CORPUS.small, x_hoa=_encoded(random, text))
    kind = random.choice(("automaton", "automaton never"))
    files = (*files, ("p.ltl", f"{kind} bad: x.hoa\n".encode()))
    # The atoms of the file are those of the arrangement, half of the time.
    if random.random() < 0.5:
        data = dict(files)["x.hoa"].replace(b'"p"', b'"m@A"').replace(b'"q"', b'"n == 1"').replace(b'"r"', b'"k > 1"')
        files = tuple((name, data if name == "x.hoa" else old) for name, old in files)
        return Case(("verify", MAIN, "p.ltl", *EXPLICIT, "--format", random.choice(FORMATS)), files)
    return Case(("property", "draw", "x.hoa", "--format", random.choice(("dot", "mermaid"))), files)


# ---------------------------------------------------------------- what our commands write


def _trace(random: Random) -> Case:
    folder, text = random.choice(CORPUS.traces)
    data = _mutated_yaml(random, text)
    files = (*_files(folder), ("d/t.trace.yaml", data))
    if random.random() < 0.3:
        return Case(("update-trace", "d/t.trace.yaml"), files)
    given = ("--arrangement", MAIN) if random.random() < 0.3 else ()
    return Case(("replay", "d/t.trace.yaml", *given), files)


def _inputs(random: Random) -> Case:
    folder = random.choice((CORPUS.small, CORPUS.lights, CORPUS.models[0], random.choice(CORPUS.models)))
    name, kind = random.choice([*folder.inputs().items()] or [("k", "0..3")])
    value = random.choice(("true", "false") if kind == "bool" else ("0", "1", "2", "RED", *kind.split("..")))
    if random.random() < 0.5:
        text = f"1: {{{name}: {value}}}\n5: {{{name}: {random.choice((value, value, *NUMBERS))}}}\n"
        data = _mutated_yaml(random, text)
        return Case(("simulate", MAIN, "--seed", "2", "--inputs", "i.yaml"), _files(folder, i_yaml=data))
    given = f"{name}={value}"
    given = mutate_gently(random, given) if random.random() < 0.5 else mutate_text(random, given, _words(random))
    return Case(("simulate", MAIN, "--seed", "2", "--set=" + _argument(given)), _files(folder))


def _json(random: Random, text: str, words: Words) -> str:
    if random.random() < 0.2:
        return mutate_text(random, text, words)
    document = json.loads(text)
    gently = random.random() < 0.5
    changed = mutate_leaf(random, document) if gently else mutate_tree(random, document, words, [document])
    return json.dumps(changed, indent=random.choice((None, 2)))


SMT = """
true false (and (or (not (=> (= (<= (< (>= (> (+ (- (* (div (mod (ite (xor (let (forall ((x Int)) (exists ( ) x
n k (declare-const x Int) (assert (check-sat) 0 1 9 10 -1 1.5 #b1 #xff "s" |n| |k'| ! _ ; (_ bv1 8) (distinct
(abs (to_real Int Bool Real Array (select (store (as const) :named (define-fun f () Int 1) (push) (exit)
(get-model) (set-logic QF_BV)
""".split()  # noqa: SIM905 - a list of 80 quoted words is no better


def _invariants(random: Random) -> Case:
    folder, asked, text = random.choice(CORPUS.invariants)
    words = Words((*SMT, *SMT, *CORPUS.words), CORPUS.properties)
    if random.random() < 0.6:
        document = json.loads(text)
        for row in document["proved"]:
            for proof in row["proofs"]:
                term = " ".join(random.choice(SMT) for _ in range(random.choice((1, 3, 6))))
                whole = random.choice((proof["smt"], f"(and {proof['smt']} {term} {')' * term.count('(')}", term))
                proof["smt"] = mutate_text(random, whole, words) if random.random() < 0.7 else whole
                if random.random() < 0.2:
                    proof["k"] = random.choice((0, 1, 2, 3, 100, 65535))
        changed = json.dumps(document)
    else:
        changed = _json(random, text, words)
    command = ("verify", MAIN, "-p", asked, "--check-invariants", "i.json", "--timeout", "5")
    return Case(command, _files(folder, i_json=_encoded(random, changed)))


def _canonical(value: object) -> str:
    return json.dumps(value, sort_keys=True, separators=(",", ":"))


def _certificate(random: Random) -> Case:
    folder, asked, text = random.choice(CORPUS.certificates)
    words = Words(CORPUS.words, CORPUS.properties)
    if random.random() < 0.15:
        changed = mutate_text(random, text, words)
    else:
        document = json.loads(text)
        del document["digests"]
        if random.random() < 0.6:
            found = mutate_leaf(random, document)
        else:
            found = mutate_tree(random, document, words, [document, json.loads(random.choice(CORPUS.certificates)[2])])
        if isinstance(found, dict):
            found.pop("digests", None)
            digests = {k: hashlib.sha256(_canonical(v).encode()).hexdigest() for k, v in found.items()}
            found = {**found, "digests": digests}
        changed = _canonical(found) + "\n"
    files = _files(folder, c_json=_encoded(random, changed))
    if random.random() < 0.6:
        return Case(("check-certificate", "c.json"), files)
    return Case(("verify", MAIN, "-p", asked, *EXPLICIT, "--check-certificate", "c.json"), files)


def _checkpoint(random: Random) -> Case:
    """A checkpoint with a valid checksum over mutated content."""
    folder, asked, data = random.choice(CORPUS.checkpoints)
    first = data.index(b"\n") + 1
    second = data.index(b"\n", first) + 1
    header, sections = json.loads(data[first:second]), data[second:]
    if random.random() < 0.5:
        changed = mutate_tree(random, header, Words(CORPUS.words, CORPUS.words), [header])
        data = data[:first] + json.dumps(changed).encode() + b"\n" + sections
    else:
        body = bytearray(sections)
        for _ in range(random.choice((1, 2, 8))):
            at = random.randrange(max(1, len(body) - 36))
            body[at : at + 4] = struct.pack("<i", random.choice((-1, 0, 1, 255, 1 << 20, (1 << 31) - 1)))
        data = data[:second] + bytes(body)
    if random.random() < 0.9:
        data = data[:-32] + hashlib.sha256(data[:-32]).digest()
    command = ("verify", MAIN, "-p", asked, "--engine", "explicit", "--timeout", "5", "--checkpoint", "c", "--resume")
    return Case(command, _files(folder, c=data))


def _theory(random: Random) -> Case:
    """A random theory of plausible logic, with words of another one."""
    text, other = (random_theory(random).text(random) for _ in range(2))
    if random.random() < 0.4:
        text = mutate_gently(random, text)
    else:
        text = mutate_text(random, text, Words(tuple(other.split()), (other,)))
    asked = random.choice((("table", "a.d"), ("explain", "a.d", "a=true"), ("equivalent", "a.d", "b.d")))
    more = random.choice(((), (), ("--format", "json"), ("--output", "p0")))
    return Case(("knowledge", *asked, *more), (("a.d", _encoded(random, text)), ("b.d", other.encode())))


# ---------------------------------------------------------------- whole folders, and options


def _check(random: Random) -> Case:
    folder = _folder(random)
    name = random.choice(list(folder.files))
    files = _replaced(folder, name, _mutated_yaml(random, folder.files[name]))
    text = grammar.line(random, "llfsm", folder.atoms)
    if random.random() < 0.4:
        text = mutate_text(random, text, _words(random))
    files = (*files, ("a.ltl", _encoded(random, text)))
    return Case(("check", random.choice((".", MAIN, "a.ltl", name))), files)


OPTIONS = {
    "--max-states": ("1", "3", "1000"), "--memory": ("2G", "500M", "1T"), "--timeout": ("1", "0.001", "1e3"),
    "--depth": ("1", "3"), "--all": ("1", "3"), "--engine": ("auto", "explicit", "bmc", "pdr", "induction"),
    "--format": FORMATS, "--cone": ("on", "off", "auto"), "--chains": ("on", "off", "auto"), "--labels": ("on", "off"),
    "--syntax": grammar.SYNTAXES, "--color": ("never", "always"), "--accept-vacuity": ("a", "faults"),
    "--checkpoint": ("c",), "--checkpoint-every": ("1",), "-p": ("G n < 9", "a: F m@A", "forbid x: [m@A] [m@B]"),
    "--save-traces": ("d",), "--certificate": ("c.json",), "--save-invariants": ("i.json",), "--steps": ("1", "9"),
    "--cycles": ("2",), "--seed": ("0", "7"), "--set": ("k=1",), "-o": ("o.dot", "o.json", "o"),
}  # fmt: skip
VALUES = (
    "0", "-1", "nan", "inf", "always", "a", "", " ", "1 G", "x" * 300, "\udcff", "1" * 40, "²", "a.yaml", ".", "..",
    "c/d", "-", "--", "=", "\n",
)  # fmt: skip
FLAGS = {
    "verify": ("--strict", "--vacuity", "--witness", "-q", "--all-steps", "--keep-all-bits", "--resume"),
    "lint": ("--local", "--traces", "--silenced"),
    "query": ("--all-steps",),
    "kripke": ("--keep-all-bits", "--partial", "--large"),
}
EXPLORING = ("--max-states", "--memory", "--timeout")
TAKEN = {
    "verify": (
        *EXPLORING, "--depth", "--all", "--engine", "--format", "--cone", "--chains", "--labels", "--syntax", "--color",
        "--accept-vacuity", "--checkpoint", "--save-traces", "--certificate", "--save-invariants", "-p", "-p",
    ),
    "query": (*EXPLORING, "--depth", "--engine", "--format", "--syntax"),
    "lint": (*EXPLORING, "--format", "--syntax", "-p"),
    "kripke": (*EXPLORING, "--format", "--syntax", "-p", "-o"),
    "simulate": ("--steps", "--cycles", "--seed", "--set", "--color"),
    "draw": ("--format", "-o"),
}  # fmt: skip
"""The options of each command that a case may have."""


def _options(random: Random) -> Case:
    """Options with values that fit, or do not."""
    command = random.choice(("verify", "verify", "verify", *TAKEN))
    more: list[str] = []
    for name in random.sample(TAKEN[command], random.randint(1, min(4, len(TAKEN[command])))):
        fits = random.random() < 0.9
        name = name if random.random() < 0.97 else random.choice(list(OPTIONS))
        more += [name, random.choice(OPTIONS[name] if fits else VALUES)]
    flags = random.sample(FLAGS[command], random.choice((0, 0, 0, 1))) if command in FLAGS else []
    asked = ("n == 3",) if command == "query" else ()
    return Case((command, MAIN, *asked, *more, *flags), _files(CORPUS.small))


READERS: dict[str, Reader] = {
    "arrangement": _arrangement,
    "machine": _machine,
    "guards": _language,
    "properties": _properties("llfsm"),
    "spot": _properties("spot"),
    "spin": _properties("spin"),
    "nusmv": _properties("nusmv"),
    "pairs": _pairs,
    "words": _word,
    "monitors": _monitor,
    "query": _query,
    "automata": _automaton,
    "traces": _trace,
    "inputs": _inputs,
    "invariants": _invariants,
    "certificates": _certificate,
    "checkpoints": _checkpoint,
    "theories": _theory,
    "folders": _check,
    "options": _options,
}
"""By what they read; the last ones read more than one kind of file."""


def make_corpus() -> None:
    """Make all that mutations start from, now and not in each child."""
    for name, part in vars(type(CORPUS)).items():
        if isinstance(part, cached_property):
            getattr(CORPUS, name)
    _yaml_trees()
