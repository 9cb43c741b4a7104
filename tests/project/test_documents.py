"""The documents run: each `console` block shows what its commands print today."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.forked import Forks, forks

LONG = (
    "docs/command-line.md", "docs/guarding.md", "docs/modelling.md", "docs/properties.md", "docs/tutorial.md",
    "models/batman/README.md",
)  # fmt: skip
"""Pages whose commands take many seconds together."""
PAGES = sorted(str(page) for page in (*Path().glob("*.md"), *Path("docs").rglob("*.md"), *Path("models").rglob("*.md")))

LLFSM = {"llfsm": [], "llfsm-verify": ["verify"]}
"""What follows `llfsm` in commands of ours; the others have processes of their own."""
COMMANDS = {
    "llfsm-check-certificate": [sys.executable, "-m", "llfsm_verify.certificate"],
    "pytest": [sys.executable, "-m", "pytest"],
    "sed": ["sed"],
}
PLUGIN = {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTEST_PLUGINS": "llfsm_verify.testing.pytest_plugin"}
"""Our plugin, and no other that happens to be installed."""

BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"# ([\w./-]+\.(?:yaml|ltl|py))\n")
"""The first line of a block that is a file."""
EARLY = re.compile(r"^(?:\S+: )?after \d+ s: .*\n", re.MULTILINE)
"""A verdict that is said before the report, where a check takes longer than usual."""
SECONDS = re.compile(r"\d+\.\d+ ?s\b")
LINK = re.compile(r"\]\((?!https?:|mailto:)([^)#]*)(?:#([^)]+))?\)")
CODE = re.compile(r"^ *```.*?^ *```$|<!-- written by .*?<!-- end of", re.MULTILINE | re.DOTALL)
"""What is not prose: blocks, and what benchmarks write into a page."""
SPAN = re.compile(r"`[^`]*`")
MOST_WORDS = 65_000
"""Of the pages of `docs/` together: a new page takes its words from another."""


def transcripts(page: str) -> list[tuple[str, str]]:
    """Each command with the output shown below it; and each file, `# NAME`, with its text."""
    parts = []
    for kind, block in BLOCK.findall(Path(page).read_text(encoding="utf-8")):
        if FILE.match(block):
            parts.append((f"# {FILE.match(block)[1]}", block))
        for piece in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:] if kind == "console" else ():
            command, _, output = piece.partition("\n")
            parts.append((command, output))
    return parts


def test_the_examples_are_there():
    assert len(transcripts("README.md")) >= 3


def test_the_tutorial_has_ten_steps_and_each_runs():
    steps = re.split(r"^## (\d+)\. ", Path("docs/tutorial.md").read_text(encoding="utf-8"), flags=re.MULTILINE)
    assert steps[1::2] == [str(number) for number in range(1, 11)]
    assert all("```console\n" in step for step in steps[2::2])


@pytest.mark.slow
@pytest.mark.parametrize(
    "page",
    [pytest.param(p, marks=pytest.mark.long) if p in LONG else p for p in PAGES if transcripts(p)],
)
def test_what_a_page_shows_is_what_happens(page, tmp_path, forked):
    """All commands of a page in order, in a folder that holds the models, the properties and the files of the page."""
    for name in ("models", "properties"):
        (tmp_path / name).symlink_to(Path(name).resolve())
    for command, output in transcripts(page):
        if command.startswith("# "):
            (tmp_path / command[2:]).write_text(output, encoding="utf-8")
            continue
        printed = EARLY.sub("", run(command, tmp_path, forked))
        printed = SECONDS.sub("… s", printed).rstrip("\n")
        shown = SECONDS.sub("… s", output).rstrip("\n")
        if "\n[…]\n" in shown:
            # A page may leave out the middle of a long output.
            first, last = shown.split("\n[…]\n")
            assert printed.startswith(first + "\n") and printed.endswith("\n" + last)
        else:
            assert printed == shown
    if page == "README.md":  # a newcomer runs these here
        made = {path.name for path in tmp_path.iterdir()} - {"models", "properties"}
        ignored = {line.strip("/") for line in Path(".gitignore").read_text(encoding="utf-8").splitlines()}
        assert made and made <= ignored


@pytest.fixture(scope="module")
def forked() -> Iterator[Forks]:
    with forks() as found:
        yield found


def run(command: str, folder: Path, forked: Forks) -> str:
    """What a command, of LLFSM or COMMANDS, prints, and its exit code where the page asks for it (`; echo $?`)."""
    command, _, echo = command.partition(";")
    words = shlex.split(command)
    assert words[0] in (*LLFSM, *COMMANDS) and echo.strip() in ("", "echo $?"), command
    if words[0] in LLFSM:
        code, printed = forked.llfsm([*LLFSM[words[0]], *words[1:]], folder)
        return printed + (f"{code}\n" if echo else "")
    done = subprocess.run(
        [*COMMANDS[words[0]], *words[1:]],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        encoding="utf-8",
        check=False,
        env={**os.environ, "PYTHONPATH": str(Path.cwd()), **PLUGIN},
    )
    return done.stdout + (f"{done.returncode}\n" if echo else "")


@pytest.mark.parametrize("page", PAGES)
def test_links_lead_somewhere(page):
    """To a file, and where they name a heading, to one that it has."""
    for target, heading in LINK.findall(Path(page).read_text(encoding="utf-8")):
        file = Path(page).parent.joinpath(target) if target else Path(page)
        assert file.exists(), f"{page}: {target}"
        if heading and file.suffix == ".md":
            assert heading in anchors(file.read_text(encoding="utf-8")), f"{page}: {target}#{heading}"


def anchors(text: str) -> set[str]:
    """What a link to this page can name: its headings, as code hosts write them, and its own marks."""
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    made = {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}
    return made | set(re.findall(r'<a id="([^"]+)">', text))


@pytest.mark.parametrize("page", [page for page in PAGES if not page.startswith("CHANGELOG")])
def test_prose_has_one_width(page):
    """120 columns at most, except tables, blocks and a word that is longer."""
    prose = CODE.sub("", Path(page).read_text(encoding="utf-8")).splitlines()
    wide = [
        line for line in prose if len(line) > 120 and not line.startswith("|") and " " in SPAN.sub("", line).strip()
    ]
    assert not wide, f"{page}: {wide}"


def test_the_pages_are_no_longer_than_someone_reads():
    words = {str(page): len(page.read_text(encoding="utf-8").split()) for page in Path("docs").glob("*.md")}
    assert sum(words.values()) <= MOST_WORDS, sorted(words.items(), key=lambda item: -item[1])
