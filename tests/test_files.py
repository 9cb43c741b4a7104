"""Files that we name: they appear whole, also where the file system has no links."""

from __future__ import annotations

import errno
import os
import socket
import stat
from pathlib import Path

import pytest

from llfsm_verify.files import publish, read_regular, replacing, special_kind, unfinished


@pytest.mark.parametrize("refused", [None, errno.EPERM, errno.EOPNOTSUPP])
@pytest.mark.parametrize("taken", [False, True])
def test_a_new_file_takes_no_name_from_another(refused, taken, tmp_path, monkeypatch):
    def link(*_: object) -> None:
        raise OSError(refused, "no links here")

    if refused is not None:
        monkeypatch.setattr(os, "link", link)
    path = tmp_path / "run.yaml"
    if taken:
        path.write_text("old")
    with unfinished(path) as (file, name):
        file.write(b"new")
        file.close()
        assert publish(name, path) is not taken
    assert path.read_text() == ("old" if taken else "new") and [p.name for p in tmp_path.iterdir()] == ["run.yaml"]


def test_a_disk_that_is_full_is_not_a_file_system_without_links(tmp_path, monkeypatch):
    def link(*_: object) -> None:
        raise OSError(errno.ENOSPC, "no space")

    monkeypatch.setattr(os, "link", link)
    with unfinished(tmp_path / "run.yaml") as (_, name), pytest.raises(OSError, match="no space"):
        publish(name, tmp_path / "run.yaml")
    assert list(tmp_path.iterdir()) == []


def test_a_regular_file_is_read_up_to_the_most(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"12345")
    (tmp_path / "link").symlink_to(path)
    assert [read_regular(path, most) for most in (0, 4, 5, 6)] == [b"", b"1234", b"12345", b"12345"]
    assert read_regular(str(tmp_path / "link"), 9) == b"12345"
    with pytest.raises(FileNotFoundError):
        read_regular(tmp_path / "b", 9)
    if Path("/proc/self/status").exists():
        assert read_regular("/proc/self/status", 9) == b""  # its size is said to be 0


def test_what_is_no_regular_file_is_refused_by_its_kind(tmp_path: Path) -> None:
    pipe, bound = tmp_path / "pipe", tmp_path / "socket"
    os.mkfifo(pipe)
    with socket.socket(socket.AF_UNIX) as made:
        made.bind(str(bound))
        kinds = {tmp_path: "a directory", pipe: "a pipe", bound: "a socket", Path("/dev/null"): "a device"}
        for path, kind in kinds.items():
            assert special_kind(path.stat().st_mode) == kind
            error = IsADirectoryError if path is tmp_path else OSError
            with pytest.raises(error) as refused:
                read_regular(path, 9)
            assert type(refused.value) is error
            assert (refused.value.errno, refused.value.strerror) == (
                errno.EINVAL,
                f"it is {kind}, and a file is expected",
            )
    assert special_kind(stat.S_IFLNK) == "a link" and special_kind(stat.S_IFBLK) == "a device"
    assert special_kind(stat.S_IFREG) is None


def test_a_pipe_that_takes_the_place_of_a_file_is_not_waited_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pipe, before = tmp_path / "pipe", tmp_path / "file"
    before.write_text("x")
    os.mkfifo(pipe)
    status = before.stat()
    with monkeypatch.context() as first:
        first.setattr(Path, "stat", lambda *_, **__: status)
        with pytest.raises(OSError, match="it is a pipe, and a file is expected"):
            read_regular(pipe, 9)


def test_a_folder_in_the_way_is_named(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.mkdir()
    with pytest.raises(IsADirectoryError) as caught, replacing(path) as file:
        file.write(b"text")
    assert (caught.value.filename, caught.value.filename2) == (str(path), None)
    assert [p.name for p in tmp_path.iterdir()] == ["a"]


def test_a_file_is_replaced_whole_with_its_permissions(tmp_path: Path) -> None:
    path = tmp_path / "a"
    with replacing(path) as file:
        file.write(b"new")
        assert not path.exists()
    assert path.read_bytes() == b"new"
    path.chmod(0o640)
    with replacing(path) as file:
        file.write(b"newer")
        assert path.read_bytes() == b"new"
    assert path.read_bytes() == b"newer" and stat.S_IMODE(path.stat().st_mode) == 0o640
    with pytest.raises(TypeError), replacing(path) as file:
        file.write("no bytes")
    assert path.read_bytes() == b"newer" and [p.name for p in tmp_path.iterdir()] == ["a"]


def test_only_what_is_written_to_the_end_takes_the_place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[bytes] = []
    rename = Path.replace

    def replace(name: Path, path: Path) -> Path:
        seen.append(name.read_bytes())
        return rename(name, path)

    monkeypatch.setattr(Path, "replace", replace)
    with replacing(tmp_path / "a") as file:
        file.write(b"whole")
    assert seen == [b"whole"]


def test_a_file_left_behind_is_in_nobodys_way(tmp_path: Path) -> None:
    path = tmp_path / "a"
    for left in ("", "-2", "-3"):
        with unfinished(path) as (_, name):
            assert name == tmp_path / f".a.{os.getpid()}{left}"
        name.write_text("left behind")


@pytest.mark.parametrize("refused", [errno.EPERM, errno.EOPNOTSUPP, errno.ENOSYS, errno.EMLINK])
def test_a_name_is_given_back_when_the_file_cannot_take_it(
    refused: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def link(*_: object) -> None:
        raise OSError(refused, "no links here")

    def replace(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "link", link)
    with unfinished(tmp_path / "a") as (_, name):
        with monkeypatch.context() as interrupted:
            interrupted.setattr(Path, "replace", replace)
            with pytest.raises(KeyboardInterrupt):
                publish(name, tmp_path / "a")
        assert not (tmp_path / "a").exists()
        assert publish(name, tmp_path / "a") is True
        name.write_text("")
        assert publish(name, tmp_path / "a") is False
