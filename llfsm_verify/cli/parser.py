"""What commands are made of: an entry in their table, a parser (a mistake is one line, and each help ends with exit
codes and an example), and wrong usage that only the command knows."""

from __future__ import annotations

import sys
from argparse import Action, ArgumentError, ArgumentParser, HelpFormatter, Namespace
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, NoReturn, cast

from llfsm_verify.registry import Choices, Entry, Registry, at, meant

EXIT_CODES = (
    "exit codes: 0 everything holds, 1 violated or a fault, 2 wrong usage, 3 input files wrong or unreadable, "
    "4 unknown, 5 a check of a result failed, 70 internal error, 130 interrupted"
)

EXAMPLE = "example: "
INPUTS = ("arrangement", "properties", "monitor")
"""Options and arguments that name files to read; `-` is standard input there."""


GROUPS = {
    "check": "to check arrangements, formulas and recordings",
    "run": "to run an arrangement, and go through its runs",
    "build": "to start a project, and build monitors, guards and programs",
    "exchange": "to draw, and write models for other tools",
    "look": "to look things up",
}
"""What commands are for, in the order in which help shows them, with its headings."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandEntry(Entry):
    """A command: `about` is its line in the help of `llfsm`, and at its place is what adds its arguments."""

    group: str
    """One of GROUPS."""
    runs: str
    """The place of what runs it, as `module:attribute`."""

    def run(self, options: Namespace) -> int:
        """Returns the exit code. It may raise UsageError and DiagnosticError, which are told to the user."""
        return cast(Callable[[Namespace], int], at(self.runs))(options)


class UsageError(Exception):
    """The command line is wrong in a way that only the command knows; the message says how. The exit code is 2."""

    def said(self, of: str = "") -> str:
        """What the user is told; `of`: about which file, where there are several."""
        from llfsm_verify.diagnostics import without_controls

        return f"error: {without_controls(f'{of}: {self}' if of else str(self))}"


@contextmanager
def wrong_usage(kind: type[Exception], option: str = "") -> Iterator[None]:
    """An error of this `kind` is one of the command line: UsageError says it, after the `option` that it is about."""
    try:
        yield
    except kind as wrong:
        raise UsageError(f"{option}{wrong}") from None


class Paragraphs(HelpFormatter):
    """Help whose texts may have several paragraphs, with an empty line between two. Examples are not wrapped."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        fill = super()._fill_text
        return "\n\n".join(
            paragraph if paragraph.startswith(EXAMPLE) else fill(paragraph, width, indent)
            for paragraph in text.split("\n\n")
        )

    def _iter_indented_subactions(self, action: Action) -> Generator[Action, None, None]:
        """The commands of a parser, below the headings that it has for them."""
        headings: dict[str, str] = getattr(action, "headings", {})
        before = None
        for command in super()._iter_indented_subactions(action):
            heading = headings.get(command.dest)
            if heading != before:
                yield Action((), "", metavar=f"{heading}:")
            before = heading
            if heading is not None:
                self._indent()
            yield command
            if heading is not None:
                self._dedent()


class Parser(ArgumentParser):
    """A parser that says what is wrong in one line, as all commands do, and what was probably meant."""

    def __init__(self, prog: str | None = None, **options: Any) -> None:
        super().__init__(prog, formatter_class=Paragraphs, **options)
        self.before: Callable[[Sequence[str]], None] | None = None
        """What looks at the words before they are parsed, such as to add options that they ask for."""
        self.unusable: Sequence[str] = ()
        """Sentences about commands of other packages that cannot be used, for those who ask for one that is missing."""

    def about(self, description: str, example: str, codes: str = EXIT_CODES) -> None:
        """What the help says before and after the options; `example`: a whole command, or several, one a line."""
        self.description = description
        examples = "\n\n".join(f"{EXAMPLE}{line}" for line in example.splitlines())
        self.epilog = f"{codes}\n\n{examples}"

    def parse_known_args(  # type: ignore[override]  # the types of argparse are overloads of this
        self, args: Sequence[str] | None = None, namespace: Namespace | None = None
    ) -> tuple[Namespace, list[str]]:
        """As argparse does, but options may stand between the last positional arguments, and an option that there is
        not is told here, where those that there are can be looked through."""
        if self.before is not None:
            self.before(sys.argv[1:] if args is None else args)
        options, left = super().parse_known_args(args, namespace)
        try:
            left = self._given_last(options, left)
        except ArgumentError as error:
            self.error(str(error))
        if left:
            wrong, _, value = next((word for word in left if word.startswith("-")), "").partition("=")
            advice = meant(wrong, self._option_string_actions)
            if wrong in ("-o", "--output"):
                advice = self._to_file(value or left[-1])
            if not wrong and "--properties" in self._option_string_actions:
                advice = f"; write `--properties {left[0][:100]}` for a property file"
            self.error(f"unrecognized arguments: {' '.join(left)[:200]}{advice}")
        given = [getattr(options, name, None) for name in INPUTS]
        if sum(each.count("-") if isinstance(each, list) else each == "-" for each in given) > 1:
            self.error("standard input can be read only once")
        return options, left

    def _to_file(self, path: str) -> str:
        """What to write in place of `-o FILE` where a command has no such option."""
        formats = self._option_string_actions.get("--format")
        ending = path.rpartition(".")[2]
        named = formats is not None and ending in (formats.choices or ())
        shape = "" if formats is None else f"--format {ending if named else 'json'} "
        return f"; write `{shape}> {'FILE' if path.startswith('-') else path[:100]}` for a file"

    def _given_last(self, options: Namespace, left: list[str]) -> list[str]:
        """Give words after an option to the last positional argument, which argparse took for complete when the option
        came; what is left then. ArgumentError: a word is not one for it."""
        last = next(reversed(self._get_positional_actions()), None)
        if not left or last is None or any(word.startswith("-") for word in left):
            return left
        given = getattr(options, last.dest)
        if last.nargs in ("*", "+"):
            before = [] if given is last.default else given
            setattr(options, last.dest, [*before, *self._get_values(last, left)])
            return []
        if last.nargs == "?" and given is last.default:
            setattr(options, last.dest, self._get_values(last, left[:1]))
            return left[1:]
        return left

    def error(self, message: str) -> NoReturn:
        """Ends the process with exit code 2; where a command is missing, its help says what there is."""
        from llfsm_verify.diagnostics import without_controls

        missing = message.startswith("the following arguments are required")
        if missing and self._subparsers is not None:
            self.print_help()
            self.exit(2)
        advice = f" (`{self.prog} --help` says more)" if missing else ""
        self.exit(2, f"error: {without_controls(message.removeprefix('argument '))}{advice}\n")

    def _check_value(self, action: Action, value: Any) -> None:
        """Where none of our names fits, other packages are searched."""
        choices = action.choices
        if choices is None or value in choices:
            return
        broken = choices.find_others() if isinstance(choices, Registry | Choices) else []
        if value not in choices:
            names = [str(choice) for choice in choices]
            text = str(value)[:100]
            there = meant(text, names) or f"; there are: {', '.join(names)}"
            raise ArgumentError(action, "; ".join([f"there is no `{text}`{there}", *broken, *self.unusable]))


class Version(Action):
    """Prints the version of the installed package, which is looked up only now, and ends."""

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
