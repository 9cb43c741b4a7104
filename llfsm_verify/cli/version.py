"""`--version`: the version is looked up only when somebody asks."""

from __future__ import annotations

from argparse import Action, ArgumentParser, Namespace
from collections.abc import Sequence


class Version(Action):
    """Prints the version of the installed package and ends."""

    def __init__(self, option_strings: Sequence[str], dest: str) -> None:
        super().__init__(option_strings, dest, nargs=0, help="show the version and end")

    def __call__(
        self, parser: ArgumentParser, _namespace: Namespace, _values: object, _option: str | None = None
    ) -> None:
        from importlib.metadata import version

        from llfsm_verify.cli.io.output import drop_output

        try:
            print(f"{parser.prog} {version('llfsm-verify')}", flush=True)
        except OSError as error:
            drop_output()
            parser.error(f"the version cannot be written: {error.strerror}")
        parser.exit()
