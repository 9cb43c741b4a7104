"""docs/architecture.md names rooms and files that are there, in the order that import-linter checks."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

PACKAGE = Path("llfsm_verify")
TEXT = Path("docs/architecture.md").read_text(encoding="utf-8")
QUOTED = re.findall(r"`([^`\s]+)`", TEXT)
PATHS = sorted({q for q in QUOTED if re.fullmatch(r"[\w/]+(\.py|/)", q)})


def rows(heading: str) -> list[list[str]]:
    """The cells of the table of rooms below a heading."""
    table = re.search(rf"^#+ {heading}\n.*?\n\|---[-|]*\n(.*?)\n\n", TEXT, re.MULTILINE | re.DOTALL)
    assert table
    return [line.strip("| ").split(" | ") for line in table[1].splitlines()]


def rooms(cell: str) -> list[str]:
    return [name.removesuffix(".py").strip("/") for name in re.findall(r"`([^`]+)`", cell)]


def layers(container: str) -> list[set[str]]:
    """What the contract of a package says, from the ground up."""
    contracts = tomllib.loads(Path("pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]["contracts"]
    (layered,) = [c for c in contracts if c.get("containers") == [container] and c["type"] == "layers"]
    return [set(layer.split(" | ")) for layer in reversed(layered["layers"])]


@pytest.mark.parametrize(
    ("heading", "container"), [("The rooms", "llfsm_verify"), ("The rooms of a run", "llfsm_verify.runtime")]
)
def test_the_tables_have_all_rooms_in_their_order(heading: str, container: str) -> None:
    listed = [name for row in rows(heading) for name in rooms(row[0]) if name != "certificate"]
    height = {name: number for number, layer in enumerate(layers(container)) for name in layer}
    assert sorted(listed) == sorted(height)
    assert [height[name] for name in listed] == sorted(height.values())


@pytest.mark.parametrize(("heading", "folder"), [("The rooms", PACKAGE), ("The rooms of a run", PACKAGE / "runtime")])
def test_the_files_to_begin_with_are_in_their_rooms(heading: str, folder: Path) -> None:
    for room, _, *begin in rows(heading):
        for name in re.findall(r"`([^`]+)`", begin[0]) if begin else ():
            assert any((folder / place / name).is_file() for place in (".", *rooms(room))), (room, name)


@pytest.mark.parametrize("path", PATHS)
def test_a_file_or_folder_that_is_named_is_there(path: str) -> None:
    found = [*PACKAGE.glob(path), *Path().glob(path), *PACKAGE.rglob(path)]
    assert found, path


def test_there_are_names() -> None:
    assert len(PATHS) >= 80 and len(rows("The rooms")) >= 20
