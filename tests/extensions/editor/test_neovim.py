"""The page for Neovim: a real one does what its configurations say, and prints what it was told."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from llfsm_verify.plug import REPORTS
from tests import outside

pytestmark = [outside.needs("nvim"), pytest.mark.long]

PAGE = Path("editors/neovim/README.md")
TYPO, RIGHT = "both: G !(ns@GREN && ew@GREEN)", "both: G !(ns@GREEN && ew@GREEN)"
PROPERTIES = f"# Rules.\n{TYPO}\nnever: G !(car && ew@GREEN)\n"
PATIENCE = 60_000
"""Milliseconds that an answer may take on a busy computer."""
DRIVER = """\
local seen = {}
local function ready(what, test)
  if not vim.wait(PATIENCE, test, 20) then error("there is not " .. what) end
end
local function save()
  local file = io.open("seen.json", "w")
  file:write(vim.fn.json_encode(seen))
  file:close()
  vim.cmd("qall!")
end
local function count(code)
  return #vim.tbl_filter(function(one) return one.code == code end, vim.diagnostic.get(0))
end
vim.ui.select = function(items, _, choose) choose(items[1]) end
local fine, problem = pcall(function()
  vim.cmd("edit arrangement.yaml")
  vim.cmd("edit rules.ltl")
  seen.filetype = vim.bo.filetype
  ready("a diagnostic", function() return #vim.diagnostic.get(0) > 0 end)
  seen.said = vim.diagnostic.get(0)
  vim.api.nvim_buf_set_lines(0, 1, 2, false, { RIGHT })
  ready("no diagnostic", function() return #vim.diagnostic.get(0) == 0 end)
  local function lens(words)
    vim.lsp.codelens.refresh()
    for _, one in ipairs(vim.lsp.codelens.get(vim.api.nvim_get_current_buf())) do
      if one.range.start.line == 2 and one.command and one.command.title:find(words) then return true end
    end
    return false
  end
  vim.api.nvim_win_set_cursor(0, { 3, 0 })
  ready("a lens", function() return lens("[Cc]heck") end)
  vim.lsp.codelens.run()
  ready("a verdict", function() return lens("violated") end)
  for _, one in ipairs(vim.lsp.codelens.get(vim.api.nvim_get_current_buf())) do
    if one.range.start.line == 2 and not seen.lens then seen.lens = one.command.title end
  end
  vim.lsp.codelens.run()
  if PAGES then
    ready("a page", function() return vim.fn.filereadable("opened") == 1 end)
  end
end)
if not fine then seen.problem = problem end
save()
"""


def blocks() -> list[str]:
    """The configurations of the page: for lenses, since 0.11, and before."""
    return re.findall(r"```lua\n(.*?)```", PAGE.read_text(), re.DOTALL)


def test_the_page_is_short() -> None:
    assert len(PAGE.read_text().split()) <= 250 and len(blocks()) == 3


def test_neovim_shows_a_typo_and_checks_a_property(tmp_path: Path) -> None:
    nvim = outside.program("nvim")
    version = re.search(r"NVIM v(\d+)\.(\d+)", subprocess.check_output([nvim, "--version"], text=True))
    assert version is not None
    shutil.copytree("models/traffic_lights", tmp_path / "work")
    work = tmp_path / "work"
    (work / "rules.ltl").write_text(PROPERTIES)
    programs = tmp_path / "bin"
    programs.mkdir()
    write(programs / "llfsm", f'#!/bin/sh\nexec {sys.executable} -m llfsm_verify "$@"\n')
    write(programs / "xdg-open", f'#!/bin/sh\ncp "$1" {work}/page; mv {work}/page {work}/opened\n')
    lenses, since, before = blocks()
    modern = (int(version[1]), int(version[2])) >= (0, 11)
    config = tmp_path / "config" / "nvim" / "plugin"
    config.mkdir(parents=True)
    (config / "llfsm.lua").write_text(lenses + (since if modern else before))
    pages = "html" in REPORTS.result
    known = {"PATIENCE": PATIENCE, "RIGHT": RIGHT, "PAGES": pages}
    driver = re.sub("|".join(known), lambda word: json.dumps(known[word[0]]), DRIVER)
    (tmp_path / "driver.lua").write_text(driver)
    environment = os.environ | {
        "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(Path.cwd()),
        **{f"XDG_{kind}_HOME": str(tmp_path / kind.lower()) for kind in ("CONFIG", "DATA", "STATE", "CACHE")},
    }
    command = [nvim, "--headless", "-n", "-i", "NONE", "-c", f"luafile {tmp_path}/driver.lua"]
    done = subprocess.run(
        command, cwd=work, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False
    )
    assert (work / "seen.json").exists(), done.stderr
    seen = json.loads((work / "seen.json").read_text())
    assert "problem" not in seen, (seen, done.stderr)
    assert seen["filetype"] == "llfsm-ltl"
    (said,) = seen["said"]
    assert (said["lnum"], said["col"], said["end_col"]) == (1, TYPO.index("GREN"), TYPO.index("GREN") + 4)
    assert "GREN" in said["message"]
    assert "violated" in seen["lens"]
    assert not pages or "<title>" in (work / "opened").read_text()


def write(program: Path, text: str) -> None:
    program.write_text(text)
    program.chmod(0o755)
