"""Help, slips, completion: what the command line says before any command runs."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys

import pytest

from llfsm_verify.cli.commands import llfsm_parser, verify_parser
from llfsm_verify.cli.parser import Parser
from tests.cli.running import LIGHTS, PROPERTIES, llfsm


def parsers(parser: Parser, name: str = "llfsm") -> dict[str, Parser]:
    """All parsers by the words that lead to them."""
    found = {name: parser}
    if parser._subparsers is not None:
        for action in parser._subparsers._group_actions:
            for word, below in action.choices.items():
                found |= parsers(below, f"{name} {word}")
    return found


ALL = parsers(llfsm_parser())


@pytest.mark.parametrize("name", [name for name in ALL if name != "llfsm"])
def test_each_help_has_exit_codes_and_examples_that_can_be_typed(name):
    epilog = ALL[name].epilog
    assert epilog is not None and "exit codes: 0" in epilog, name
    examples = re.findall(r"^example: (.*)$", epilog, re.MULTILINE)
    assert examples
    for example in examples:
        words = shlex.split(re.split(r" >>? ~", example)[0])
        assert " ".join(words).startswith(name)
        options = llfsm_parser().parse_args(words[1:])
        assert options.command == words[1]


def test_the_options_of_verify_are_in_groups():
    titles = [group.title for group in verify_parser()._action_groups if group._group_actions]
    assert titles == [
        "options",
        "what to check",
        "what a pass is worth",
        "how to search",
        "limits; what is not decided within them is unknown",
        "what to print",
        "files to write and to read",
    ]
    loose = verify_parser()._action_groups[1]._group_actions
    assert [action.dest for action in loose] == ["help", "version"]


@pytest.mark.parametrize("words", [(), ("property",), ("whiteboard",)])
def test_without_a_command_there_is_help(words):
    done = llfsm(*words)
    assert done.returncode == 2 and done.stderr == ""
    assert done.stdout == ALL[" ".join(("llfsm", *words))].format_help()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("verfiy",), "COMMAND: there is no `verfiy`; did you mean `verify`?"),
        (("property", "clasify", "a"), "QUESTION: there is no `clasify`; did you mean `classify`?"),
        (("verify", LIGHTS, "--timout=3"), "unrecognized arguments: --timout=3; did you mean `--timeout`?"),
        (
            ("verify", LIGHTS, "-o", "x.json"),
            "unrecognized arguments: -o x.json; write `--format json > x.json` for a file",
        ),
        (
            ("verify", LIGHTS, "-o", "x.html"),
            "unrecognized arguments: -o x.html; write `--format html > x.html` for a file",
        ),
        (("check", "--output=x"), "unrecognized arguments: --output=x; write `> x` for a file"),
        (("run", LIGHTS, "-o"), "unrecognized arguments: -o; write `> FILE` for a file"),
        (
            ("guard", LIGHTS, PROPERTIES),
            f"unrecognized arguments: {PROPERTIES}; write `--properties {PROPERTIES}` for a property file",
        ),
        (("verify", LIGHTS, "--format", "jsn"), "--format: there is no `jsn`; did you mean `json`?"),
        (("completion", "tcsh"), "SHELL: there is no `tcsh`; there are: bash, zsh, fish"),
        (
            ("verify", LIGHTS, PROPERTIES, "--only", "ns_lmaps"),
            "--only: there is no property `ns_lmaps`; did you mean `ns_lamps`?",
        ),
        (("verify", LIGHTS, "--only", "x"), "--only: there is no property `x`, and there are no others"),
        (
            ("verify", LIGHTS, "-p", "a: G true", "-p", "b: G true", "--only", "x"),
            "--only: there is no property `x`; there are: a, b",
        ),
    ],
)
def test_slips_are_told_with_what_was_probably_meant(words, told):
    done = llfsm(*words)
    assert (done.returncode, done.stdout, done.stderr) == (2, "", f"error: {told}\n")


@pytest.mark.parametrize(
    ("words", "dest", "given"),
    [
        ("send x replace ns --unchecked f.yaml", "value", "f.yaml"),
        ("send x --unchecked replace ns f.yaml", "value", "f.yaml"),
        ("verify a.yaml -p X p.ltl", "properties", ["p.ltl"]),
        ("verify a.yaml p.ltl -q q.ltl r.ltl", "properties", ["p.ltl", "q.ltl", "r.ltl"]),
        ("check-recording r --allow-undecided p.ltl", "properties", ["p.ltl"]),
        ("replay a -q b", "traces", ["a", "b"]),
        ("check a -q b", "paths", ["a", "b"]),
        ("check -q", "paths", ["."]),
        ("property classify a --timeout 3 b", "input", ["a", "b"]),
        ("whiteboard watch x --every 3 a b", "slots", ["a", "b"]),
        ("send x suspend ns", "value", None),
    ],
)
def test_options_may_stand_between_the_last_arguments(words, dest, given):
    assert getattr(llfsm_parser().parse_args(words.split()), dest) == given


@pytest.mark.parametrize("words", ["send x replace ns --unchecked a b", "verify a.yaml b.ltl -q c.ltl --nonsense d"])
def test_what_is_too_much_is_told(words, capsys):
    with pytest.raises(SystemExit):
        llfsm_parser().parse_args(words.split())
    assert "unrecognized arguments: " in capsys.readouterr().err


def test_only_the_properties_that_are_named_are_checked_under_all_assumptions():
    texts = ["assume a: G F sampled(car)", "one: F ew@GREEN", "two: F G ew@GREEN", "three: G F ns@GREEN"]
    lines = [word for text in texts for word in ("-p", text)]
    done = llfsm("verify", LIGHTS, *lines, "--only", "three", "--only", "one", "-q")
    assert done.returncode == 0
    assert [line.split()[1] for line in done.stdout.splitlines() if line.startswith("holds")] == [
        "one",
        "three",
        "faults",
    ]
    assert "two" not in done.stdout


def completed(line: str) -> list[str]:
    """What a shell is offered after `line`."""
    asking = os.environ | {
        "_ARGCOMPLETE": "1",
        "_ARGCOMPLETE_IFS": "\n",
        "_ARGCOMPLETE_SUPPRESS_SPACE": "1",
        "COMP_LINE": line,
        "COMP_POINT": str(len(line)),
        "COMP_TYPE": "9",
    }
    read, write = os.pipe()
    command = (
        f"import os; os.dup2({write}, 8); os.dup2(2, 9); import sys; from llfsm_verify.cli import main; "
        "sys.exit(main())"
    )
    with subprocess.Popen([sys.executable, "-c", command], env=asking, pass_fds=[write]) as process:
        os.close(write)
        with os.fdopen(read) as answers:
            text = answers.read()
        assert process.wait() == 0
    return text.split("\n")


@pytest.mark.slow
def test_shells_complete_commands_options_and_values():
    assert completed("llfsm ver") == ["verify"]
    assert {"bash", "fish", "zsh"} <= set(completed("llfsm completion "))
    assert completed("llfsm verify --onl") == ["--only"]
    assert completed("llfsm verify --engine p") == ["pdr"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_what_a_shell_reads_names_both_commands(shell):
    done = llfsm("completion", shell)
    assert done.returncode == 0 and done.stderr == ""
    assert "llfsm-verify" in done.stdout and "_ARGCOMPLETE" in done.stdout


def test_the_shell_takes_it():
    text = llfsm("completion", "bash").stdout
    done = subprocess.run(["bash", "-n"], input=text, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("command", [name for name in ALL if name.count(" ") == 1])
def test_a_command_alone_is_as_among_all(command: str) -> None:
    """The parser that `llfsm` makes for one command line has all arguments of the command that stands in it."""
    alone = parsers(llfsm_parser([command.removeprefix("llfsm "), "--help"]))
    for name, parser in ALL.items():
        if f"{name} ".startswith(f"{command} ") or name == "llfsm":
            assert alone[name].format_help() == parser.format_help()
    other = "llfsm lint" if command != "llfsm lint" else "llfsm verify"
    assert alone[other].format_help() != ALL[other].format_help()
