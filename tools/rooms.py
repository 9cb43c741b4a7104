"""Where a room of the package is, and where its tests are: `make check ROOM=runtime/live` asks it.

python -m tools.rooms runtime/live            the files: llfsm_verify/runtime/live tests/runtime/live
python -m tools.rooms --tests runtime/live    only the tests
"""

from __future__ import annotations

import sys
from difflib import get_close_matches
from pathlib import Path

SOURCE, TESTS = Path("llfsm_verify"), Path("tests")
ELSEWHERE = {
    "language": ("bad_input", "fuzzing"),
    "arrangement": ("bad_input", "fuzzing"),
    "certificate": ("analysis/certificates",),
}
"""Folders of tests/ that test a room and do not have its name."""


class NoRoom(ValueError):
    """There is no such room; says which there are."""


def rooms(of: str = "") -> list[str]:
    """The rooms in the package, or in a room."""
    found = {path.relative_to(SOURCE).with_suffix("").as_posix() for path in SOURCE.joinpath(of).iterdir() if _is(path)}
    return sorted(found | {path.relative_to(TESTS).as_posix() for path in TESTS.joinpath(of).glob("*/") if _is(path)})


def _is(path: Path) -> bool:
    """Whether it has Python in it, and is not a file such as `__init__.py`."""
    return not path.name.startswith("_") and (path.suffix == ".py" or (path.is_dir() and any(path.rglob("*.py"))))


def places_of_tests(room: str) -> list[Path]:
    """Where the tests of a room are: its own, else those of the room around it, and those that are elsewhere.

    A file of the ground without any, such as `jsonvalue`, has those of all such files.
    """
    place, own = Path(room), list[Path]()
    while place.parts and not own:
        mirrored = place if (SOURCE / place).is_dir() else place.with_name(f"test_{place.name}.py")
        own, place = [path for path in (TESTS / place, TESTS / mirrored) if path.exists()][:1], place.parent
    also = [TESTS / name for name in ELSEWHERE.get(room.partition("/")[0], ())]
    return own + also or sorted(TESTS.glob("test_*.py"))


def source_of(room: str) -> list[Path]:
    """Where its source is. A folder that only tests/ has, such as `project`, has none."""
    return [path for path in (SOURCE / room, SOURCE / f"{room}.py") if path.exists()]


def checked(room: str) -> str:
    """The name of a room, as from `llfsm_verify/runtime/` or `runtime`. NoRoom."""
    name = room.strip("/").removeprefix(f"{SOURCE}/").removeprefix(f"{TESTS}/").removesuffix(".py")
    parent, _, last = name.rpartition("/")
    around = parent if _is(SOURCE / parent) else ""
    known = rooms(around)
    if name in known:
        return name
    near = get_close_matches(name, known, 1) or [one for one in known if one.endswith(f"/{last}")]
    meant = f"; did you mean {near[0]}?" if near else ""
    raise NoRoom(f"there is no room {room}{meant}\n{around or 'the rooms'}: {' '.join(known)}")


def main(arguments: list[str]) -> None:
    try:
        room = checked(arguments[-1])
    except NoRoom as wrong:
        sys.exit(f"make: {wrong}")
    print(*([] if "--tests" in arguments else source_of(room)), *places_of_tests(room))


if __name__ == "__main__":
    main(sys.argv[1:])
