"""`llfsm completion`: what makes a shell ask us how a command goes on, by argcomplete."""

from __future__ import annotations

from argparse import Namespace

from llfsm_verify.cli.io.output import Output


def run(options: Namespace) -> int:
    """Prints the text for the shell `options.shell`; returns 0."""
    from argcomplete.shell_integration import shellcode

    Output().plain(shellcode(["llfsm", "llfsm-verify"], shell=options.shell).strip("\n") + "\n")
    return 0
