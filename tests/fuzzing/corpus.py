"""Valid (and nearly valid) files to start from: those of the project, and those that its commands write."""

from __future__ import annotations

import json
import os
import re
import tempfile
from collections.abc import Iterator
from contextlib import chdir
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import hypothesis
import yaml
from hypothesis import HealthCheck, Phase, settings

from llfsm_verify.arrangement.keys import schema
from llfsm_verify.testing.arrangements import arrangements
from tests.bad_input.cases import CASES, FRAMED
from tests.bad_input.property_cases import BOARD_OF_PROPERTIES, PROPERTY_CASES
from tests.cli.running import llfsm

ROOT = Path(__file__).parents[2]
MAIN = "a.yaml"
"""The name of the arrangement in each case."""
RANDOM_ARRANGEMENTS = 40
ATOMS = ("p", "q", "r")

SMALL = """\
name: small
cycle_ms: 100
whiteboard:
  k: {type: 0..3, role: input}
  n: {type: 0..9}
machines:
  m:
    inline:
      machine: M
      states:
        - name: A
          on_entry: n = (n + 1) % 10;
          transitions: [{when: k > 1, to: B}]
        - name: B
          transitions: [{when: "true", to: A}]
schedule: [m]
"""
LANGUAGE = """
true false not and or int bool uint8 int8 uint16 min max abs after after_ms suspend resume restart is_running
is_suspended refused if else for in ran fired finished suspended loaded cycle G F X U W R M S T O H Y Z enforce
forbid initially assume automaton never syntax : :: := == != <= >= < > + - * / % ++ -- += -= && || -> <-> ! ( )
[ ] { } , . ; @ # " ' ? .. ... | ^ ~ <> [] [* [+] [= [-> |-> []-> <>-> ## xor V always eventually until release
next LTLSPEC NAME ltl HOA: v1 --BODY-- --END-- --ABORT-- State: Start: AP: acc-name: Acceptance: Inf(0) Fin(0)
Buchi generalized-Buchi t f Alias: @a States: tool: properties: cycle{ 1 0 // /* */ ns ew timer RED GREEN AMBER
car a b n m k light
""".split()  # noqa: SIM905 - a list of 150 quoted words is no better


@dataclass(frozen=True, slots=True)
class Folder:
    """The files of an arrangement, `MAIN` among them, and texts that fit them."""

    files: dict[str, str]
    atoms: tuple[str, ...]

    def inputs(self) -> dict[str, str]:
        """The types of the inputs, by name."""
        board = yaml.load(self.files[MAIN], Loader=yaml.BaseLoader)["whiteboard"]
        return {name: str(declared["type"]) for name, declared in board.items() if declared.get("role") == "input"}


class Corpus:
    """All that mutations start from; each part is made when it is first asked for, and is the same in every run."""

    @cached_property
    def models(self) -> tuple[Folder, ...]:
        """Arrangements without mistakes."""
        return tuple(_models())

    @cached_property
    def folders(self) -> tuple[Folder, ...]:
        """The same, and arrangements with one mistake each."""
        return (*self.models, *_nearly_right())

    @cached_property
    def random(self) -> tuple[Folder, ...]:
        """Drawn by the strategies for random arrangements: they use all of the language."""
        return tuple(_random_folders())

    @cached_property
    def lights(self) -> Folder:
        """The traffic lights."""
        return next(folder for folder in self.models if folder.files[MAIN].startswith("# Traffic lights"))

    @cached_property
    def small(self) -> Folder:
        """An arrangement of ten lines."""
        return Folder({MAIN: SMALL}, _atoms(SMALL))

    @cached_property
    def properties(self) -> tuple[str, ...]:
        """Property files, right ones and wrong ones."""
        return (
            *(path.read_text("utf-8") for path in sorted((ROOT / "properties").glob("*.ltl"))),
            *(path.read_text("utf-8") for path in sorted((ROOT / "tests/bad_properties").glob("*.ltl"))),
            *(case.text.replace("§", "") for case in PROPERTY_CASES),
        )

    @cached_property
    def automata(self) -> tuple[str, ...]:
        """Files in the format HOA."""
        return tuple(_automata())

    @cached_property
    def traces(self) -> tuple[tuple[Folder, str], ...]:
        """Saved traces."""
        return tuple(_traces([self.lights, self.small, *self.random[:12]]))

    @cached_property
    def certificates(self) -> tuple[tuple[Folder, str, str], ...]:
        """Certificates, with the property that each is about."""
        return tuple(_certificates([self.lights, self.small, *self.random[:6]]))

    @cached_property
    def invariants(self) -> tuple[tuple[Folder, str, str], ...]:
        """Files of invariants, with the property."""
        return tuple(_invariants([self.small]))

    @cached_property
    def checkpoints(self) -> tuple[tuple[Folder, str, bytes], ...]:
        """Checkpoints, with the property."""
        return tuple(_checkpoints([self.lights, self.small]))

    @cached_property
    def words(self) -> tuple[str, ...]:
        """Words of the languages."""
        return _words(self.folders)

    @cached_property
    def snippets(self) -> tuple[str, ...]:
        """What stands between fences in the documentation."""
        return tuple(_snippets())


CORPUS = Corpus()


# ---------------------------------------------------------------- arrangements


def _models() -> Iterator[Folder]:
    for path in sorted((ROOT / "models").glob("*/*.yaml")):
        text = path.read_text("utf-8")
        if path.name.endswith(".machine.yaml"):
            continue
        named = {name for name in re.findall(r"file: *([\w./-]+)", text) if (path.parent / name).is_file()}
        if all("/" not in name for name in named):
            files = {name: (path.parent / name).read_text("utf-8") for name in sorted(named)}
            yield Folder({MAIN: text, **files}, _atoms(text))


def _nearly_right() -> Iterator[Folder]:
    for case in CASES:
        yield Folder({MAIN: case.text.replace("§", "")[:20_000]}, ("car", "n == 1"))
    yield Folder(
        {MAIN: BOARD_OF_PROPERTIES}, ("car", "ns@RED", "counter == 3", "ns.ran", "a[1] == 2", "ns.fired(RED, 0)")
    )
    yield Folder({MAIN: FRAMED()}, ("car", "n == 3", "m@A", "m.mine", "b[2]", "ball.x > 1"))


def _random_folders() -> Iterator[Folder]:
    found: list[dict[str, object]] = []

    @settings(
        derandomize=True, database=None, max_examples=RANDOM_ARRANGEMENTS, deadline=None, phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    @hypothesis.given(arrangements())
    def collect(document: dict[str, object]) -> None:
        found.append(document)

    collect()
    for document in found:
        text = yaml.safe_dump(_strings(document), sort_keys=False, width=200)
        yield Folder({MAIN: text}, _atoms(text))


def _strings(value: object) -> object:
    """The document with the scalars as a person writes them."""
    if isinstance(value, dict):
        return {str(k): _strings(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_strings(v) for v in value]
    return "" if value is None else value


def _atoms(text: str) -> tuple[str, ...]:
    """State formulas about an arrangement, as far as a glance at its text tells."""
    try:
        document = yaml.load(text, Loader=yaml.BaseLoader)
        machines = list(document["machines"])
        board = [(name, declared["type"]) for name, declared in document.get("whiteboard", {}).items()]
    except (yaml.YAMLError, KeyError, TypeError):
        return ("n == 1",)
    found = [f"{name}.ran" for name in machines[:3]]
    for name, kind in board:
        found.append(name if kind == "bool" else f"{name} == 1" if ".." in str(kind) or "int" in str(kind) else name)
    for name in machines:
        inline = document["machines"][name]
        states = re.findall(r"'name': '(\w+)'", str(inline)) or ["RED", "GREEN"]
        found += [f"{name}@{state}" for state in states[:3]]
    return tuple(found) or ("true",)


def _words(folders: tuple[Folder, ...]) -> tuple[str, ...]:
    """Words of the languages: those of the schemas, those of the project's files, and a list by hand."""
    found = set(LANGUAGE)
    found |= set(re.findall(r'"([a-z_]+)"', json.dumps(schema("arrangement"))))
    for folder in folders:
        for text in folder.files.values():
            found |= set(re.findall(r"\w+", text)) if len(text) < 3_000 else set()
    return tuple(sorted(word for word in found if len(word) < 40))


def _snippets() -> Iterator[str]:
    """What stands between fences in the documentation."""
    for path in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]:
        yield from re.findall(r"^```\w*\n(.*?)^```", path.read_text("utf-8"), re.MULTILINE | re.DOTALL)


# ---------------------------------------------------------------- what commands write


def _written(folder: Folder, *arguments: str) -> dict[str, bytes]:
    """The files that a command writes in a folder of its own."""
    with tempfile.TemporaryDirectory() as name, chdir(name):
        for file, text in folder.files.items():
            Path(file).write_text(text, encoding="utf-8", newline="")
        llfsm(*arguments)
        paths = [Path(top, file) for top, _, files in os.walk(".") for file in files]
        return {path.as_posix(): path.read_bytes() for path in sorted(paths) if path.as_posix() not in folder.files}


def _automata() -> Iterator[str]:
    for text in (
        "G (p -> F q)",
        "p U q",
        "G F p && G F q",
        "F G p",
        "true",
        "false",
        "X X (p | q)",
        "G (p -> X (q R r))",
    ):
        yield llfsm("property", "translate", text).stdout
        yield llfsm("property", "translate", text, "--buchi").stdout


def _asked(folder: Folder) -> tuple[str, ...]:
    return tuple(f"G ({atom}) && G F ({atom})" for atom in folder.atoms[:4])


def _traces(folders: list[Folder]) -> Iterator[tuple[Folder, str]]:
    for folder in folders:
        asked = [part for text in _asked(folder) for part in ("-p", text)]
        written = _written(
            folder, "verify", MAIN, *asked, "--max-states", "2000", "--save-traces", "d", "--engine", "explicit"
        )
        for name, data in written.items():
            if name.endswith(".trace.yaml") and len(data) < 20_000:
                yield folder, data.decode()


def _certificates(folders: list[Folder]) -> Iterator[tuple[Folder, str, str]]:
    for folder in folders:
        for text in ("p0: " + folder.atoms[0], f"p0: G F ({folder.atoms[-1]})", f"assume q: G F ({folder.atoms[0]})"):
            for data in _written(
                folder,
                "verify",
                MAIN,
                "-p",
                text,
                "--max-states",
                "500",
                "--certificate",
                "c.json",
                "--engine",
                "explicit",
            ).values():
                if len(data) < 30_000:
                    yield folder, text, data.decode()


def _invariants(folders: list[Folder]) -> Iterator[tuple[Folder, str, str]]:
    for folder in folders:
        for engine, text in (("pdr", "p0: G n < 10"), ("pdr", "p0: G F m@A"), ("induction", "p0: G !(n == 11)")):
            for data in _written(
                folder, "verify", MAIN, "-p", text, "--engine", engine, "--save-invariants", "i"
            ).values():
                yield folder, text, data.decode()


def _checkpoints(folders: list[Folder]) -> Iterator[tuple[Folder, str, bytes]]:
    for folder in folders:
        text = "p0: G !(" + folder.atoms[0] + ")"
        for data in _written(
            folder, "verify", MAIN, "-p", text, "--max-states", "3", "--checkpoint", "c", "--engine", "explicit"
        ).values():
            yield folder, text, data


def trees(texts: tuple[str, ...]) -> list[object]:
    """Those of the texts that are YAML, as trees of strings."""
    found: list[object] = []
    for text in texts:
        try:
            tree = yaml.load(text, Loader=yaml.BaseLoader)
            json.dumps(tree)
        except (yaml.YAMLError, TypeError, ValueError, RecursionError):
            continue
        found.append(tree)
    return found
