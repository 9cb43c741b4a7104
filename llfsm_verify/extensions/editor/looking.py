"""What is at a place of a file: the name or word under the cursor, and what may be written there.

All of it works on the text as it is now and on the index of the last text that could be read: a place is looked up
where it was in that.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from llfsm_verify.extensions.editor import keys, words
from llfsm_verify.extensions.editor.findings import Findings, Sort
from llfsm_verify.extensions.editor.names import WORD, Index, Name, Place, Region, resolve_word
from llfsm_verify.extensions.editor.positions import moved
from llfsm_verify.extensions.editor.yamlpath import Spot, spot_at

TEXTS = ("when", *words.ACTIONS)
_COMPARED = re.compile(r"([\w.]+)\s*(?:==|!=|(?<![<>=!])=)\s*\w*$")
_CALLED = re.compile(r"(\w+)\s*\(\s*\w*$")


@dataclass(frozen=True, slots=True)
class Offer:
    """Something that may be written: `order` says which come first."""

    word: str
    kind: str
    about: str = ""
    order: int = 1
    insert: str | None = None


@dataclass(frozen=True, slots=True)
class Look:
    """A place in a file, with the index of the newest text that could be read, and that text."""

    file: str
    sort: Sort | None
    text: str
    offset: int
    index: Index
    old: str

    @property
    def is_yaml(self) -> bool:
        return self.sort not in ("properties", "automaton", None)

    def region(self) -> Region:
        """The names here."""
        at = moved(self.offset, self.text, self.old)
        return self.index.region(self.file, at) or Region(self.file, 0, {})

    def word(self) -> tuple[int, int] | None:
        """Where the word under the cursor begins and ends."""
        begin = self.text.rfind("\n", 0, self.offset) + 1
        end = self.text.find("\n", self.offset)
        line = self.text[begin : end if end >= 0 else len(self.text)]
        at = self.offset - begin
        found = next((w for w in WORD.finditer(line) if w.start() <= at <= w.end()), None)
        return None if found is None else (begin + found.start(), begin + found.end())

    def spot(self) -> Spot | None:
        """The place in YAML."""
        return spot_at(self.text, self.offset) if self.is_yaml else None


def look(findings: Findings, file: str, text: str, offset: int) -> Look:
    """What is known of a place in a file."""
    return Look(file, findings.sorts.get(file), text, offset, findings.index, findings.texts.get(file, text))


# ---------------------------------------------------------------- what is there


def name_at(here: Look) -> Name | None:
    """The name under the cursor."""
    word = here.word()
    if word is None:
        return None
    region, (start, end) = here.region(), word
    spot = here.spot()
    if spot is not None:
        last = _last_key(spot)
        if spot.is_key:
            at = moved(start, here.text, here.old)
            return next((n for p, n in here.index.uses if p.file == here.file and p.start == at), None) or (
                region.names.get(here.text[start:end]) if _names_keys(spot) else None
            )
        if last in ("to", "initial", "suspend", "name") and region.machine is not None:
            return region.machine.of("state").get(here.text[start:end])
    return resolve_word(here.text, start, end, region)


def describe(here: Look) -> tuple[str, int, int] | None:
    """What is said of what is under the cursor, in Markdown, and where that begins and ends."""
    word = here.word()
    if word is None:
        return None
    start, end = word
    name, spot = name_at(here), here.spot()
    if name is not None:
        return name.about, start, end
    if spot is None:
        said = words.explained(here.text[start:end], properties=True) if here.sort == "properties" else None
    elif spot.is_key:
        key = re.match(r"[\w.-]+", here.text[spot.start :])
        said = keys.about(str(here.sort), (*spot.keys, key[0] if key else ""))
        start, end = (spot.start, spot.start + len(key[0])) if key else (start, end)
    elif _last_key(spot) in TEXTS:
        said = words.explained(here.text[start:end], properties=False)
    else:
        said = keys.about(str(here.sort), spot.keys)
    return None if said is None else (said, start, end)


def declaration(here: Look) -> Place | None:
    """Where what is under the cursor is declared: also the file that a key `file` names."""
    spot = here.spot()
    if spot is not None and not spot.is_key and _last_key(spot) == "file":
        value = re.match(r"""\s*["']?([^\s"'{}\[\],#]+)""", here.text[spot.start :])
        path = (Path(here.file).parent / value[1]).resolve() if value else None
        return Place(str(path), 0, 0) if path is not None and path.is_file() else None
    name = name_at(here)
    return None if name is None else name.place


def _last_key(spot: Spot) -> str:
    return next((key for key in reversed(spot.keys) if key != "-"), "")


def _names_keys(spot: Spot) -> bool:
    """Whether keys are names of variables and machines there."""
    return any(key in ("access", "inputs", "outputs", "safe", "events") for key in spot.keys)


# ---------------------------------------------------------------- what may be there


def offers(here: Look) -> list[Offer]:
    """What may be written at a place, the best first."""
    spot = here.spot()
    if spot is None:
        found = list(_in_formula(here)) if here.sort == "properties" else []
    elif _in_comment(here):
        found = []
    elif spot.is_key:
        found = list(_as_key(here, spot)) or list(_as_value(here, spot))
    elif _last_key(spot) in TEXTS:
        found = list(_in_text(here))
    else:
        found = list(_as_value(here, spot))
    return sorted({offer.word: offer for offer in reversed(found)}.values(), key=lambda o: (o.order, o.word))


def _in_comment(here: Look) -> bool:
    line = here.text[here.text.rfind("\n", 0, here.offset) + 1 : here.offset]
    return re.search(r"(?:^|\s)#", line) is not None


def _as_key(here: Look, spot: Spot) -> Iterator[Offer]:
    for key, said in keys.fields(str(here.sort), spot.keys).items():
        yield Offer(key, "key", said, insert=f"{key}: ")
    last, region = _last_key(spot), here.region()
    kinds: dict[str, tuple[str, ...]] = {
        "inputs": ("variable",), "outputs": ("variable",), "safe": ("variable",), "events": ("variable",),
        "write": ("variable",), "machines": ("machine",), "command": ("machine",),
    }  # fmt: skip
    if last in kinds and (here.sort in ("ports", "policy") or "access" in spot.keys):
        yield from (_offer(n, insert=f"{n.word}: ") for n in region.names.values() if n.kind in kinds[last])


def _as_value(here: Look, spot: Spot) -> Iterator[Offer]:
    last, region, sort = _last_key(spot), here.region(), str(here.sort)
    names = region.names.values()
    for word in keys.options(sort, spot.keys):
        yield Offer(word, "word", order=0)
    if last in ("to", "initial", "suspend") and region.machine is not None and "operators" not in spot.keys:
        yield from map(_offer, region.machine.of("state").values())
        return
    if keys.is_shape(sort, spot.keys, "type"):
        yield from (_offer(name) for name in names if name.kind == "type")
        yield from (Offer(word, "type", order=2) for word in ("bool", "int8", "int16", "int32", "uint8", "uint16"))
    elif last in ("init", "safe") and len(spot.keys) > 1:
        variable = region.names.get(spot.keys[-2])
        yield from (Offer(word, "value") for word in (variable.values if variable else ()))
    elif last == "file":
        yield from _files(here)
    elif last in ("schedule", "pool", "runs") or {"processes", "operators"} & set(spot.keys):
        wanted = "variable" if last == "write" else "machine"
        yield from (_offer(name) for name in names if name.kind == wanted)
    elif "parameters" in spot.keys:
        yield from (_offer(name) for name in names if name.kind in ("variable", "machine", "value"))
    elif sort == "ports" and last in ("inputs", "outputs", "when", "ask", "state", "sends", "answers", "feedback"):
        yield from (_offer(name) for name in names if name.kind == "variable")


def _files(here: Look) -> Iterator[Offer]:
    own = Path(here.file)
    try:
        beside = sorted(own.parent.iterdir())[:500]
    except OSError:
        return
    yield from (Offer(p.name, "file") for p in beside if p.suffix in (".yaml", ".yml") and p != own)


def _in_text(here: Look) -> Iterator[Offer]:
    """In a guard or an action."""
    region, before = here.region(), _before(here)
    special = list(_after_sign(region, before, properties=False))
    if special:
        yield from special
        if _COMPARED.search(before) is None:
            return
    for name in region.names.values():
        if name.kind in ("variable", "parameter", "value", "definition", "table"):
            yield _offer(name)
        elif name.kind == "machine":
            yield _offer(name, order=2, insert=f"{name.word}@")
    for word, said in words.IN_TEXTS.items():
        yield Offer(word, "function" if word in words.FUNCTIONS else "word", said, order=3)


def _in_formula(here: Look) -> Iterator[Offer]:
    line = here.text[here.text.rfind("\n", 0, here.offset) + 1 : here.offset]
    if "#" in line:
        return
    region, before = here.region(), _before(here)
    special = list(_after_sign(region, before, properties=True))
    if special:
        yield from special
        if _COMPARED.search(before) is None:
            return
    for name in region.names.values():
        if name.kind in ("variable", "value", "definition", "table"):
            yield _offer(name)
        elif name.kind in ("machine", "plant"):
            yield _offer(name, order=2)
    at_start = re.fullmatch(r"\s*\w*", line) is not None
    for word, said in words.IN_PROPERTIES.items():
        if at_start or word not in words.KINDS:
            yield Offer(word, "operator" if word in words.TEMPORAL else "word", said, order=3)


def _after_sign(region: Region, before: str, *, properties: bool) -> Iterator[Offer]:
    """What `m@`, `m.`, `x ==` and a call ask for."""
    state = re.search(r"(\w+)\s*@\s*(?:\{[\w\s,]*)?\w*$|(\w+)\s*\.\s*(?:fired|entered)\s*\(\s*\w*$", before)
    if state:
        machine = region.names.get(state[1] or state[2])
        yield from map(_offer, (machine.of("state") if machine else {}).values())
        return
    path = re.search(r"((?:\w+\s*\.\s*)+)\w*$", before)
    if path:
        names: Mapping[str, Name] = region.names
        for step in re.findall(r"\w+", path[1]):
            names = names[step].inside if step in names else {}
        yield from (_offer(name) for name in names.values() if properties or name.kind == "variable")
        if properties and path[1].count(".") == 1:
            yield from (Offer(word, "word", said, order=2) for word, said in words.OBSERVATIONS.items())
        return
    called = _CALLED.search(before)
    if called and called[1] in words.OF_MACHINES:
        yield from (
            _offer(name) for name in region.names.values() if name.kind in ("machine", "parameter") and name.inside
        )
        return
    compared = _COMPARED.search(before)
    if compared:
        words_before = compared[1].split(".")
        at = before.rfind(compared[1])
        start = at + len(compared[1]) - len(words_before[-1])
        name = resolve_word(before, start, start + len(words_before[-1]), region)
        yield from (Offer(value, "value", order=0) for value in (name.values if name else ()))


def _before(here: Look) -> str:
    return here.text[max(0, here.offset - 300) : here.offset]


def _offer(name: Name, *, order: int = 1, insert: str | None = None) -> Offer:
    return Offer(name.word, name.kind, name.about, order, insert)
