"""`llfsm completion`: what makes a shell ask us how a command goes on, by argcomplete."""

from __future__ import annotations

from argparse import Namespace

from llfsm_verify.cli.io.output import Output
from llfsm_verify.cli.parser import Parser

SHELLS = ("bash", "zsh", "fish")


def arguments(parser: Parser) -> None:
    """Add the arguments of `llfsm completion`."""
    parser.about(
        "Print what makes a shell complete commands, options and files of `llfsm` and `llfsm-verify`.",
        "llfsm completion bash >> ~/.bashrc\nllfsm completion fish > ~/.config/fish/completions/llfsm.fish",
        "exit codes: 0 printed, 2 wrong usage",
    )
    parser.add_argument("shell", metavar="SHELL", choices=SHELLS, help=", ".join(SHELLS))


def run(options: Namespace) -> int:
    """Prints the text for the shell `options.shell`; returns 0."""
    from argcomplete.shell_integration import shellcode

    Output().plain(shellcode(["llfsm", "llfsm-verify"], shell=options.shell).strip("\n") + "\n")
    return 0
