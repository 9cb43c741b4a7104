"""The session of a pytest run, which arrangement a test is about, and how failures look."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

from llfsm_verify import DiagnosticError
from llfsm_verify.extensions.pytest_plugin.texts import MARKER
from llfsm_verify.plug import PIPE_WIDTH
from llfsm_verify.testing.session import Session

_SESSION = pytest.StashKey[Session]()


def session_of(config: pytest.Config) -> Session:
    """The one session of a pytest run (of a worker, under xdist)."""
    return config.stash.setdefault(_SESSION, Session())


def width(config: pytest.Config) -> int:
    """Terminal cells of a line in what we show: of the terminal, or COLUMNS where a user has set it."""
    if os.environ.get("COLUMNS", "").isdigit() and "PYTEST_XDIST_WORKER" not in os.environ:
        return max(1, int(os.environ["COLUMNS"]))
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    if getattr(reporter, "isatty", False):
        return config.get_terminal_writer().fullwidth
    return PIPE_WIDTH


def shortened(text: str, config: pytest.Config) -> str:
    """Paths below the folder that pytest was called in are shown relative to it."""
    return text.replace(f"{config.invocation_params.dir}{os.sep}", "")


def failure(lines: Sequence[str], config: pytest.Config) -> BaseException:
    """What ends a test with these lines, and without a traceback."""
    return pytest.fail.Exception(shortened("\n".join(lines), config), pytrace=False)


@contextmanager
def without_traceback(config: pytest.Config) -> Iterator[None]:
    """Mistakes in the user's files fail the test with what the command line says about them."""
    __tracebackhide__ = True
    try:
        yield
    except DiagnosticError as error:
        raise failure([d.render() for d in error.diagnostics], config) from None


FILE = "arrangement.yaml"


def arrangement_of(node: pytest.Item, config: pytest.Config) -> Path:
    """The path that the closest marker names, or the ini key, or the only arrangement.yaml near the test file.

    Near: in its folder or in a folder of that; else the same in the folder above, and so on up to pytest's root folder.
    Fails the test unless there is exactly one.
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
