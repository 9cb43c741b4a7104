"""The documents run: each `console` block shows what its commands print today."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from llfsm_verify.runtime.whiteboard.places import names
from tests.forked import Forks, forks

LONG = (
    "docs/command-line.md", "docs/guarding.md", "docs/modelling.md", "docs/properties.md", "docs/tutorial.md",
    "models/batman/README.md", "models/reasoned_lights/README.md",
)  # fmt: skip
"""Pages whose commands take many seconds together."""
BESIDE_ROS = "docs/robots.md"
"""Its commands need a master of ROS: `tests/extensions/ros/test_robots_page.py` runs them."""
PAGES = sorted(str(page) for page in (*Path().glob("*.md"), *Path("docs").rglob("*.md"), *Path("models").rglob("*.md")))
BESIDE = sorted(str(page) for page in (Path("tests/README.md"), *Path("examples").rglob("*.md")))
NOTES = sorted({*BESIDE, *(str(page) for folder in ("llfsm_verify", "tests") for page in Path(folder).rglob("*.md"))})
"""Those beside the source, the tests and the examples."""

LLFSM = {"llfsm": [], "llfsm-verify": ["verify"]}
"""What follows `llfsm` in commands of ours; the others have processes of their own."""
COMMANDS = {
    "llfsm-check-certificate": [sys.executable, "-m", "llfsm_verify.certificate"],
    "pytest": [sys.executable, "-m", "pytest"],
    "python": [sys.executable],
    "sed": ["sed"],
}
BACKGROUND = re.compile(r"llfsm (run .*--whiteboard (\S+).*) > (\S+) 2>&1 &")
"""A run that goes on while the next commands are given, until `ENDED`."""
BEGINNING = "sleep 2"
"""What a reader's run needs until it has a whiteboard; ours are waited for."""
ENDED = "kill %1; wait"
ASKED = ("llfsm whiteboard list", "llfsm whiteboard get")
MOST = 120
"""Seconds that a run may take to begin, to read what is posted, and to end."""
PLUGIN = {"PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTEST_PLUGINS": "llfsm_verify.extensions.pytest_plugin.plugin"}
"""Our plugin, and no other that happens to be installed."""

BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"[#%] ([\w./-]+\.(?:yaml|ltl|py|d))\n")
"""The first line of a block that is a file."""
EARLY = re.compile(r"^(?:\S+: )?after \d+ s: .*\n", re.MULTILINE)
"""A verdict that is said before the report, where a check takes longer than usual."""
SECONDS = re.compile(r"\d+\.\d+ ?s\b")
NUMBERS = re.compile(r"\d[\d,.]*")
"""What is said of a run in real time: how far it was when it was asked."""
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
    [pytest.param(p, marks=pytest.mark.long) if p in LONG else p for p in PAGES if transcripts(p) and p != BESIDE_ROS],
)
def test_what_a_page_shows_is_what_happens(page, tmp_path, forked):
    """All commands of a page in order, in a folder that holds the models, the properties and the files of the page."""
    for name in ("models", "properties"):
        (tmp_path / name).symlink_to(Path(name).resolve())
    with ExitStack() as left:
        background = Background(tmp_path, left)
        for command, output in transcripts(page):
            if command.startswith("# "):
                (tmp_path / command[2:]).write_text(output, encoding="utf-8")
            elif BACKGROUND.fullmatch(command):
                background.start(command)
            elif command == BEGINNING:
                assert background.run is not None
            elif command == ENDED:
                background.end()
            else:
                compare(command, output, tmp_path, forked, background)
        assert background.run is None
    if page == "README.md":  # a newcomer runs these here
        made = {path.name for path in tmp_path.iterdir()} - {"models", "properties"}
        ignored = {line.strip("/") for line in Path(".gitignore").read_text(encoding="utf-8").splitlines()}
        assert made and made <= ignored


def compare(command: str, output: str, folder: Path, forked: Forks, background: Background) -> None:
    """A command prints what is shown; it is asked again where it looks at a run that may not have come so far."""
    changing = NUMBERS if background.concerns(command) else SECONDS
    shown = changing.sub("… s", output).rstrip("\n")
    last_try = time.monotonic() + (MOST if command.startswith(ASKED) else 0)
    while True:
        printed = changing.sub("… s", EARLY.sub("", run(command, folder, forked))).rstrip("\n")
        if printed == shown or time.monotonic() >= last_try:
            break
    if "\n[…]\n" in shown:
        # A page may leave out the middle of a long output.
        first, last = shown.split("\n[…]\n")
        assert printed.startswith(first + "\n") and printed.endswith("\n" + last)
    else:
        assert printed == shown


class Background:
    """The run of a page that goes on in the background, if there is one, and the files that such runs wrote."""

    def __init__(self, folder: Path, left: ExitStack) -> None:
        self.folder = folder
        self.left = left
        self.run: subprocess.Popen[bytes] | None = None
        self.files: set[str] = set()

    def start(self, command: str) -> None:
        """Begin a run, and wait until it can be asked: a reader is slower than that."""
        matched = BACKGROUND.fullmatch(command)
        assert matched and self.run is None
        words = shlex.split(matched[1])
        self.files |= {matched[3], *(after for word, after in pairwise(words) if word == "--record")}
        said = self.left.enter_context((self.folder / matched[3]).open("wb"))
        environment = {**os.environ, "PYTHONPATH": str(Path.cwd())}
        self.run = self.left.enter_context(
            subprocess.Popen(
                [sys.executable, "-m", "llfsm_verify", *words],
                cwd=self.folder, stdout=said, stderr=said, env=environment,
            )
        )  # fmt: skip
        self.left.callback(self.run.kill)
        until = time.monotonic() + MOST
        while matched[2] not in names():
            assert self.run.poll() is None and time.monotonic() < until, (self.folder / matched[3]).read_text()
            time.sleep(0.01)

    def end(self) -> None:
        assert self.run is not None
        self.run.terminate()
        self.run.wait(MOST)
        self.run = None

    def concerns(self, command: str) -> bool:
        """Whether what a command prints depends on how far a run was."""
        return self.run is not None or any(word.startswith(tuple(self.files)) for word in shlex.split(command))


@pytest.fixture(scope="module")
def forked() -> Iterator[Forks]:
    """With a folder for whiteboards that no other test has."""
    with TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patched:
        patched.setenv("LLFSM_WHITEBOARDS", folder)
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


@pytest.mark.parametrize("page", [*PAGES, *BESIDE])
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


@pytest.mark.parametrize("page", [*PAGES, *NOTES])
def test_prose_has_one_width(page):
    """120 columns at most, except tables, blocks and a word that is longer: `python -m tools.reflow PAGE` wraps it."""
    prose = CODE.sub("", Path(page).read_text(encoding="utf-8")).splitlines()
    wide = [
        line for line in prose if len(line) > 120 and not line.startswith("|") and " " in SPAN.sub("", line).strip()
    ]
    assert not wide, f"{page}: {wide}"


def test_the_pages_are_no_longer_than_someone_reads():
    words = {str(page): len(page.read_text(encoding="utf-8").split()) for page in Path("docs").glob("*.md")}
    assert sum(words.values()) <= MOST_WORDS, sorted(words.items(), key=lambda item: -item[1])
