"""Compiled kernels are found again, damaged or stale ones are not used, and a run needs no folder to write in."""

from __future__ import annotations

import ast
import ctypes
import os
import random
import shutil
import subprocess
import sys
from importlib import resources
from pathlib import Path

import pytest

from llfsm_verify import kept
from llfsm_verify.diagnostics import telling
from llfsm_verify.kripke import compiled
from llfsm_verify.kripke.kernels.entries import MODULES, SHARED
from llfsm_verify.kripke.texts import PACKAGE, shipped


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "cache"
    monkeypatch.setenv(kept.FOLDER, str(folder))
    return folder


def rebuild_works(kernels: compiled.Kernels) -> bool:
    """The smallest kernel that does something: an empty range."""
    block = (ctypes.c_int64 * 9)()
    return kernels.run("rebuild", ctypes.addressof(block)) == 0


def notes_of_a_rebuild() -> list[str]:
    """What the user is told besides when kernels that are not loaded yet work."""
    said: list[str] = []
    with telling(said.append):
        assert rebuild_works(compiled.Kernels())
    return [text for text in said if not text.startswith("compiling")]


@pytest.mark.slow
@pytest.mark.parametrize("has_text", [True, False])
def test_a_kernel_is_compiled_once(cache: Path, monkeypatch: pytest.MonkeyPatch, has_text: bool) -> None:
    if not has_text:
        monkeypatch.setattr(compiled, "shipped", lambda *_: None)
    elif shipped("rebuild", "sets") is None:
        pytest.skip("the texts of kernels are for another LLVM or machine")
    said: list[str] = []
    first = compiled.Kernels()
    with telling(said.append):
        assert rebuild_works(first)
    assert len(said) == (0 if has_text else 1)
    (file,) = cache.iterdir()
    monkeypatch.setattr(compiled, "_object_file", lambda *_: pytest.fail("compiled again"))
    assert rebuild_works(compiled.Kernels())
    assert file.name.startswith("rebuild-")


@pytest.mark.slow
def test_a_damaged_object_file_is_compiled_again(cache: Path) -> None:
    assert rebuild_works(compiled.Kernels())
    (file,) = cache.iterdir()
    whole = file.read_bytes()
    for data in (b"", whole[:-1], whole[:40] + bytes([whole[40] ^ 255]) + whole[41:]):
        file.write_bytes(data)
        assert kept.kept(file) is None
        assert rebuild_works(compiled.Kernels())
        assert kept.kept(file) is not None


@pytest.mark.slow
def test_what_cannot_be_written_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv(kept.FOLDER, str(tmp_path / "file" / "below"))
    (note,) = notes_of_a_rebuild()
    assert kept.FOLDER in note


def test_the_folder_for_kernels(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", "/somebody")
    monkeypatch.setenv(kept.FOLDER, "~/x")
    assert kept.cache_folder() == Path("/somebody/x")
    monkeypatch.setenv(kept.FOLDER, "~nobody-of-this-name/x")
    assert kept.cache_folder() is None
    monkeypatch.delenv(kept.FOLDER)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    assert kept.cache_folder() == Path("/somebody/.cache/llfsm-verify")


@pytest.mark.slow
def test_without_a_home_kernels_are_compiled_for_this_run(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(path: Path) -> Path:
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.setattr(Path, "expanduser", unknown)
    monkeypatch.delenv(kept.FOLDER, raising=False)
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    (note,) = notes_of_a_rebuild()
    assert "no home directory" in note
    assert kept.FOLDER in note


def test_object_files_are_named_after_all_that_decides_them(monkeypatch: pytest.MonkeyPatch) -> None:
    names = {module: compiled._fingerprint.__wrapped__(module) for module in set(MODULES.values())}
    assert len(set(names.values())) == len(names)
    import llvmlite

    monkeypatch.setattr(llvmlite, "__version__", "0.0")
    assert not {compiled._fingerprint.__wrapped__(module) for module in names} & set(names.values())


def test_kernels_import_only_what_their_name_depends_on() -> None:
    folder = resources.files(PACKAGE)
    reach: dict[str, set[str]] = {}
    for module in {*MODULES.values(), *SHARED}:
        tree = ast.parse(folder.joinpath(f"{module}.py").read_text("utf-8"))
        found = set()
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(PACKAGE):
                found |= {alias.name for alias in node.names} if node.module == PACKAGE else set()
                found |= {str(node.module).removeprefix(PACKAGE + ".")} - {PACKAGE}
            elif isinstance(node, ast.ImportFrom):
                assert not (node.module or "").startswith("llfsm_verify"), node.module
        reach[module] = found
    for module, found in reach.items():
        assert found <= {*SHARED, module}, module


@pytest.mark.slow
def test_numba_is_not_imported_when_kernels_are_there() -> None:
    arrangement = "models/traffic_lights/arrangement.yaml"
    program = (
        "import sys; from llfsm_verify.cli import main; "
        f"code = main(['verify', {arrangement!r}, 'properties/traffic_lights.ltl', '-q']); "
        "print([m for m in ('numba', 'numpy', 'networkx') if m in sys.modules], code)"
    )
    for _ in range(2):  # the first run may compile
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.endswith("[] 0\n")


@pytest.mark.long
def test_without_a_cache_folder_a_whole_run_works(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv(kept.FOLDER, str(tmp_path / "file"))
    command = [sys.executable, "-m", "llfsm_verify", "verify", "models/traffic_lights/arrangement.yaml", "-q"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert kept.FOLDER in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.slow
def test_a_file_under_the_name_of_another_is_compiled_again(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its kernel is not in there: calling it would end the process."""
    known = compiled.Kernels()
    assert rebuild_works(known)
    known._load("cycle_pairs")
    rebuild, other = sorted(cache.iterdir(), key=lambda path: path.name, reverse=True)
    shutil.copy(other, rebuild)
    assert kept.kept(rebuild) is None
    assert rebuild_works(compiled.Kernels())
    assert kept.kept(rebuild) is not None


@pytest.mark.slow
def test_no_damage_is_taken_for_a_kernel(cache: Path) -> None:
    assert rebuild_works(compiled.Kernels())
    (file,) = cache.iterdir()
    whole = file.read_bytes()
    generator = random.Random(4)
    for _ in range(300):
        data, at = bytearray(whole), generator.randrange(len(whole))
        if generator.random() < 0.3:
            del data[at:]
        elif generator.random() < 0.2:
            data += generator.randbytes(generator.randrange(1, 9))
        else:
            data[at] ^= 1 << generator.randrange(8)
        file.write_bytes(data)
        assert kept.kept(file) is None
    file.write_bytes(whole)
    assert kept.kept(file) is not None


@pytest.mark.slow
@pytest.mark.parametrize("what", ["folder", "pipe", "device", "link to itself", "huge file"])
def test_something_else_in_the_place_of_a_kernel_is_not_waited_for(cache: Path, what: str) -> None:
    assert rebuild_works(compiled.Kernels())
    (file,) = cache.iterdir()
    file.unlink()
    if what == "folder":
        file.mkdir()
    elif what == "pipe":
        os.mkfifo(file)
    elif what == "device":
        file.symlink_to("/dev/zero")
    elif what == "link to itself":
        file.symlink_to(file)
    else:
        with file.open("wb") as large:
            large.truncate(1 << 40)  # a hole: nothing of it is on the disk
    notes = notes_of_a_rebuild()
    if what == "folder":
        assert len(notes) == 1 and kept.FOLDER in notes[0]
    else:
        assert not notes and kept.kept(file) is not None and not file.is_symlink()
    assert not list(cache.glob("*.tmp"))


@pytest.mark.long
def test_first_runs_at_the_same_time(cache: Path) -> None:
    """Each of several processes finds an empty cache, and one more comes later; none sees half a file."""
    command = [sys.executable, "-m", "llfsm_verify", "verify", "models/traffic_lights/arrangement.yaml", "-q"]
    runs = [subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) for _ in range(3)]
    said = [run.communicate() for run in runs]
    assert [run.returncode for run in runs] == [0] * 3, said
    assert {(out, errors) for out, errors in said} == {("holds     faults  no run ends in a fault\n", "")}
    files = list(cache.iterdir())
    assert {file.suffix for file in files} == {".o", ".tables"}
    assert all(kept.kept(file) is not None for file in files)
    before = {file: file.stat().st_mtime_ns for file in files}
    assert subprocess.run(command, capture_output=True, check=False).returncode == 0
    assert {file: file.stat().st_mtime_ns for file in cache.iterdir()} == before
