"""`llfsm lsp`: a language server at standard input and output."""

from __future__ import annotations

from argparse import Namespace

from llfsm_verify.plug import CommandParser


def arguments(parser: CommandParser) -> None:
    """Add the arguments of `llfsm lsp`."""
    parser.about(
        "Serve an editor by the Language Server Protocol, at standard input and output. Editors start it themselves.",
        "llfsm lsp",
        "exit codes: 0 the editor has ended it, 2 wrong usage, 3 a package is missing",
    )
    parser.add_argument("--stdio", action="store_true", help="what editors add; there is nothing else")


def run(options: Namespace) -> int:  # noqa: ARG001 - there are none
    """Serve until the editor ends it. Returns the exit code."""
    import pygls  # noqa: F401 - where it is missing, the command line says which extra brings it

    from llfsm_verify.extensions.editor.features import run as serve

    return serve()
