"""Files that we name: they appear whole, also where the file system has no links."""

from __future__ import annotations

import errno
import os

import pytest

from llfsm_verify.files import publish, unfinished


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
        assert publish(name, path) != taken
    assert path.read_text() == ("old" if taken else "new") and [p.name for p in tmp_path.iterdir()] == ["run.yaml"]


def test_a_disk_that_is_full_is_not_a_file_system_without_links(tmp_path, monkeypatch):
    def link(*_: object) -> None:
        raise OSError(errno.ENOSPC, "no space")

    monkeypatch.setattr(os, "link", link)
    with unfinished(tmp_path / "run.yaml") as (_, name), pytest.raises(OSError, match="no space"):
        publish(name, tmp_path / "run.yaml")
    assert list(tmp_path.iterdir()) == []
