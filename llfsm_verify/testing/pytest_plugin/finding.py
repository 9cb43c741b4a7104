"""Which arrangement a test is about."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from llfsm_verify.testing.pytest_plugin.session import failure
from llfsm_verify.testing.pytest_plugin.texts import MARKER

if TYPE_CHECKING:
    import pytest

FILE = "arrangement.yaml"


def arrangement_of(node: pytest.Item, config: pytest.Config) -> Path:
    """The path that the closest marker names, or the ini key, or the only arrangement.yaml near the test file.

    Near: in its folder or in a folder of that; else the same in the folder above, and so on up to pytest's root folder.
    Fails the test where there is none, or more than one.
    """
    marker = node.get_closest_marker(MARKER)
    if marker is not None:
        if len(marker.args) != 1 or marker.kwargs or not isinstance(marker.args[0], str | Path):
            raise failure([f"the marker {MARKER} takes one path: @pytest.mark.{MARKER}('lights.yaml')"], config)
        return node.path.parent / Path(marker.args[0])
    named = str(config.getini(MARKER))
    if named:
        return (config.inipath.parent if config.inipath is not None else config.rootpath) / named
    hint = f"hint: name one with @pytest.mark.{MARKER}('PATH'), or with `{MARKER} = PATH` in pytest's ini file"
    looked = []
    for folder in _upwards(node.path.parent, config.rootpath):
        found = [folder / FILE] if (folder / FILE).is_file() else sorted(folder.glob(f"*/{FILE}"))
        if len(found) == 1:
            return found[0]
        if found:
            raise failure([f"more than one {FILE} is near this test:", *(f"  {path}" for path in found), hint], config)
        looked.append(f"  {folder}")
    raise failure(
        [f"there is no {FILE} near this test; looked in these folders and one level below:", *looked, hint], config
    )


def _upwards(folder: Path, root: Path) -> Iterator[Path]:
    yield folder
    for parent in folder.parents:
        if not parent.is_relative_to(root):
            return
        yield parent
