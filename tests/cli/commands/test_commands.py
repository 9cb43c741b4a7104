"""The table of commands: groups in the help, and commands of other packages."""

from __future__ import annotations

import re
from argparse import Namespace, _HelpAction, _SubParsersAction
from pathlib import Path

import pytest

from llfsm_verify import plug
from llfsm_verify.cli import commands
from llfsm_verify.cli.commands import COMMANDS, Commands, llfsm_parser
from llfsm_verify.cli.parser import GROUPS, CommandEntry, Parser
from tests.cli.running import llfsm
from tests.test_registry import Found

GROUP = "llfsm_verify.commands"
GREET = CommandEntry("greet", f"{__name__}:greet_arguments", "say hello", group="look", runs=f"{__name__}:greet")


def greet_arguments(parser: plug.CommandParser) -> None:
    parser.about("Say hello.", "llfsm greet you")
    parser.add_argument("name")


def greet(options: Namespace) -> int:
    if options.name == "?":
        raise plug.UsageError("this is no name")
    plug.Output().plain(f"hello {options.name}\n")
    return 4


@pytest.fixture
def others(monkeypatch: pytest.MonkeyPatch) -> Commands:
    """The commands, where other packages have some."""
    points = [
        Found("greet", GREET), Found("broken", ImportError("no module named x")), Found("number", 3),
        Found("cook", CommandEntry("cook", "os:sep", group="kitchen", runs="os:sep")),
    ]  # fmt: skip
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: points if group == GROUP else [])
    monkeypatch.setattr("llfsm_verify.registry.extensions", dict)  # what they have is among those
    found = Commands("command", map(COMMANDS.entry, COMMANDS), GROUP)
    monkeypatch.setattr(commands, "COMMANDS", found)
    return found


def test_help_shows_every_command_once_below_its_group() -> None:
    text = llfsm_parser([]).format_help()
    assert re.findall(r"^    (to .*):$", text, re.MULTILINE) == list(GROUPS.values())
    for group, part in zip(GROUPS, re.split(r"^    to .*:\n", text, flags=re.MULTILINE)[1:], strict=True):
        names = re.findall(r"^      ([\w-]+)", part.partition("\n\n")[0], re.MULTILINE)
        assert names == [name for name in COMMANDS if COMMANDS.entry(name).group == group]


def test_the_page_has_the_groups_and_the_order_of_the_help() -> None:
    page = Path("docs/command-line.md").read_text(encoding="utf-8")
    table = page.partition("| to | use |\n|---|---|\n")[2].partition("\n\n")[0]
    shown = {}
    for row in table.splitlines():
        purpose, used = re.sub(r"\]\([^)]*\)", "]", row).strip("| ").split(" | ")
        shown["to " + purpose.replace("[", "").replace("]", "")] = re.findall(r"\[`([\w-]+)`\]", used)
    ours = [name for name in COMMANDS if name in COMMANDS.ours]
    assert list(shown) == list(GROUPS.values())
    assert [*shown.values()] == [[name for name in ours if COMMANDS.entry(name).group == group] for group in GROUPS]
    assert re.findall(r"^## `llfsm ([\w-]+)`$", page, re.MULTILINE) == ours


@pytest.mark.parametrize("name", COMMANDS.ours)
def test_the_page_names_every_option_of_a_command(name: str) -> None:
    """In the section of the command, or among what all commands share."""
    sections = re.split(r"^## ", Path("docs/command-line.md").read_text(encoding="utf-8"), flags=re.MULTILINE)
    texts = [text for text in sections if text.startswith(("What all commands share\n", f"`llfsm {name}`\n"))]
    assert len(texts) == 2
    named = set(re.findall(r"(?<![\w-])--?[a-z][\w-]*", "".join(texts)))
    parser = Parser(name)
    COMMANDS.load(name)(parser)
    wanting = [parser]
    while wanting:
        for action in wanting.pop()._actions:
            if isinstance(action, _SubParsersAction):
                wanting += action.choices.values()
            elif not isinstance(action, _HelpAction):
                flags = action.option_strings
                assert not flags or named.intersection(flags), flags


@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_is_a_module_or_a_folder(name: str) -> None:
    entry = COMMANDS.entry(name)
    assert entry.about and callable(COMMANDS.load(name))
    place = Path(*entry.place.partition(":")[0].split(".")).with_suffix(".py")
    if place.name == "arguments.py":
        assert (place.with_name("run.py")).exists() and entry.runs.endswith(".run:run")
    else:
        assert len(place.read_text(encoding="utf-8").splitlines()) <= 120 and entry.runs == f"{entry.place[:-9]}run"


@pytest.mark.parametrize("name", COMMANDS.ours)
def test_a_command_has_a_section_of_the_page(name: str) -> None:
    page = Path("docs/command-line.md").read_text(encoding="utf-8")
    assert f"\n## `llfsm {name}`\n" in page


def test_a_command_of_another_package_is_found_when_it_is_asked_for(others: Commands) -> None:
    assert "greet" not in llfsm("--help").stdout
    assert (llfsm("greet", "you").returncode, llfsm("greet", "you").stdout) == (4, "hello you\n")
    assert "say hello" in llfsm("--help").stdout
    done = llfsm("greet", "?")
    assert (done.returncode, done.stderr) == (2, "error: this is no name\n")
    assert list(others)[-1] == "greet"


def test_a_command_of_an_extension_is_in_the_help(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("llfsm_verify.registry.extensions", lambda: {GROUP: (GREET,)})
    monkeypatch.setattr(commands, "COMMANDS", Commands("command", map(COMMANDS.entry, COMMANDS), GROUP))
    assert "      greet  " in llfsm("--help").stdout
    assert llfsm("greet", "you").stdout == "hello you\n"


@pytest.mark.usefixtures("others")
def test_who_asks_for_none_is_told_of_those_that_cannot_be_used() -> None:
    done = llfsm("gret")
    assert done.returncode == 2
    assert done.stderr == (
        "error: COMMAND: there is no `gret`; did you mean `greet`?; "
        "the command `broken` cannot be used (ImportError: no module named x); "
        "the command `cook` cannot be used (ValueError: the group of a command is one of check, run, build, exchange, "
        "look, and not `kitchen`); "
        "the command `number` cannot be used (TypeError: somewhere:number is not an Entry)\n"
    )
