"""What the server finds in files, by two ways: its own look at texts and drafts, and the readers of the package."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from lsprotocol.types import PositionEncodingKind

from llfsm_verify.arrangement.keys import VOCABULARY
from llfsm_verify.arrangement.loader import load_arrangement
from llfsm_verify.diagnostics import Source
from llfsm_verify.extensions.editor.findings import Asked, Findings, find_all
from llfsm_verify.extensions.editor.fixes import fixes_of, mends
from llfsm_verify.extensions.editor.names import Place, resolve_word
from llfsm_verify.extensions.editor.positions import Lines, moved
from llfsm_verify.extensions.editor.yamlpath import spot_at
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import Read
from llfsm_verify.yaml.compose import compose
from llfsm_verify.yaml.nodes import Mapping, Node, Scalar, Sequence
from tests.bad_input.cases import CASES
from tests.bad_input.property_cases import BOARD_OF_PROPERTIES, PROPERTY_CASES

MODELS = Path(__file__).resolve().parents[3] / "models"
ARRANGEMENTS = sorted(p for p in MODELS.glob("*/arrangement.yaml"))


def scalars(node: Node, keys: tuple[str, ...] = ()) -> Iterator[tuple[Scalar, tuple[str, ...], bool]]:
    """Each single value and key, with the keys that lead to it."""
    if isinstance(node, Scalar):
        yield node, keys, False
    elif isinstance(node, Sequence):
        for item in node.items:
            yield from scalars(item, (*keys, "-"))
    elif isinstance(node, Mapping):
        for key, value in node.items:
            yield key, keys, True
            yield from scalars(value, (*keys, key.text))


@pytest.mark.slow
def test_places_in_yaml_are_those_of_the_reader() -> None:
    count = 0
    for path in sorted(MODELS.glob("*/*.yaml")):
        text, seen = path.read_text(), set[int]()
        for scalar, keys, is_key in scalars(compose(Source(str(path), text), [], VOCABULARY)):
            if scalar.text and scalar.span.start not in seen:  # else an alias repeats it
                seen.add(scalar.span.start)
                spot = spot_at(text, scalar.fragment.offsets[len(scalar.text) // 2])
                assert (spot.keys, spot.is_key) == (keys, is_key), (path.name, scalar.span)
                count += 1
    assert count > 5_000


@pytest.mark.slow
@pytest.mark.parametrize("path", ARRANGEMENTS, ids=lambda p: p.parent.name)
def test_names_are_those_of_the_language(path: Path) -> None:
    """Every read of a variable in the typed texts is a use of the name that is declared at its place."""
    arrangement = load_arrangement(path)
    (findings,) = find_all(Asked(str(path), (), ((str(path), ()),)))
    uses = dict(findings.index.uses)
    count = 0
    for machine in arrangement.texts:
        texts = (machine.actions, tuple(t.guard for s in machine.states for t in s.transitions))
        for read in of_kind(texts, Read):
            file = str(Path(read.span.source.name).resolve())
            word = read.span.text.split("[")[0].split(".")[0].strip()
            if not word.isidentifier() or read.variable.name.startswith("__") or file.endswith(".d"):
                continue  # an input of a theory is told the variable of its name
            name = uses.get(Place(file, read.span.start, read.span.start + len(word)))
            assert name is not None, (word, read.span)
            if name.kind == "variable":
                assert (name.place.start, name.word) == (read.variable.span.start, word)
                assert str(Path(read.variable.span.source.name).resolve()) == name.place.file
            count += 1
    assert count > 0


def test_a_guard_knows_what_a_theory_says() -> None:
    (findings,) = find_all(Asked("models/microwave/arrangement.yaml", (), (("models/microwave/arrangement.yaml", ()),)))
    file = str(Path("models/microwave/cooking.machine.yaml").resolve())
    text = Path(file).read_text()
    named = [(place.start, name) for place, name in findings.index.uses if name.word == "cook"]
    assert sorted(at for at, _ in named) == [
        text.index("cook:"),
        text.index("cook,"),
        text.index("cook,", text.index("not")),
    ]
    assert {name.about for _, name in named} == {"`cook`: what MicrowaveCook.d says"}


def test_positions_are_those_of_python_s_codecs() -> None:
    text = "a: \U0001f600 b\r\n\u00e9\u2028x\rlast\n"
    for encoding, codec, size in (("utf-8", "utf-8", 1), ("utf-16", "utf-16-le", 2), ("utf-32", "utf-32-le", 4)):
        for bom in ("", "\ufeff"):
            lines = Lines(bom + text, PositionEncodingKind(encoding))
            for offset in range(len(text) + 1):
                if text[offset - 1 : offset + 1] == "\r\n":
                    continue  # no place is between the two
                position = lines.position(offset)
                done = text[:offset].replace("\r\n", "\n").replace("\r", "\n")
                last = done.rsplit("\n", 1)[-1] if "\n" in done else bom + done
                assert (position.line, position.character) == (done.count("\n"), len(last.encode(codec)) // size)
                assert lines.offset(position) == offset


def test_an_offset_moves_with_the_text_around_it() -> None:
    old = "one two three"
    assert [moved(old.index(word), old, "one 2 2 three") for word in ("one", "two", "three")] == [0, 4, 8]
    draw = random.Random(7)
    for _ in range(300):
        a, b = ("".join(draw.choices("ab", k=draw.randrange(12))) for _ in "12")
        for offset in range(len(a) + 1):
            assert 0 <= moved(offset, a, b) <= len(b)


def found(folder: Path, texts: dict[str, str], name: str) -> Findings:
    for file, text in texts.items():
        (folder / file).write_text(text)
    return find_all(Asked(str(folder / name), ()))[0]


@pytest.mark.long
def test_fixes_make_their_diagnostic_go_away(tmp_path: Path) -> None:
    """All wrong files: an edit that passes its trial mends what it says, and what is left out is few."""
    mended, left = Counter[str](), Counter[str]()
    cases = [({"arrangement.yaml": case.text.replace("§", "")}, "arrangement.yaml") for case in CASES]
    cases += [
        (
            {"arrangement.yaml": BOARD_OF_PROPERTIES, "arrangement.ltl": f"p: G ({case.text.replace('§', '')})\n"},
            "arrangement.ltl",
        )
        for case in PROPERTY_CASES
    ]
    for texts, name in cases:
        (tmp_path / "arrangement.ltl").unlink(missing_ok=True)
        before = found(tmp_path, texts, name)
        file = str((tmp_path / name).resolve())
        for said in (one for one in before.said if one.file == file):
            for fix in fixes_of(said, texts[name]):
                new = fix.applied(texts[name])
                after = found(tmp_path, {**texts, name: new}, name)
                if mends(fix, said, [before], [after]):
                    mended[said.code] += 1
                    assert (said.code, said.start) not in {(one.code, one.start) for one in after.said}
                else:
                    left[said.code] += 1
    assert sum(mended.values()) >= 35
    assert sum(left.values()) <= 20
    assert {"E020", "E031", "E033", "E040", "E071", "E103", "E106", "E110", "E111", "E112", "E120"} <= set(mended)


def test_words_after_a_machine_are_its_own() -> None:
    path = MODELS / "traffic_lights" / "arrangement.yaml"
    (findings,) = find_all(Asked(str(path), (), ((str(path), ()),)))
    region = findings.index.region(str(path.resolve()), 0)
    assert region is not None
    text = "ns@RED && ns@{GREEN, AMBER} && ns.fired(RED, 0) && RED"
    kinds = [
        found.kind if (found := resolve_word(text, at, at + len(word), region)) else None
        for word, at in (("RED", 3), ("GREEN", 14), ("AMBER", 21), ("RED", 40), ("RED", len(text) - 3))
    ]
    assert kinds == ["state", "state", "state", "state", "value"]
