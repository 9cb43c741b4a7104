"""Arguments that several commands have, with one wording each, and how the values of arguments are written."""

from __future__ import annotations

from argparse import ArgumentTypeError
from collections.abc import Collection, Iterable
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from llfsm_verify.checking.engine_option import read_count, read_seconds, word
from llfsm_verify.cli.parser import UsageError
from llfsm_verify.limits import parse_size
from llfsm_verify.logic.syntax_names import SYNTAXES
from llfsm_verify.registry import Unregistered
from llfsm_verify.verification.engines import DEFAULT_ENGINE, ENGINES
from llfsm_verify.yaml.duration import duration_ms, excess

if TYPE_CHECKING:
    from argparse import _ActionsContainer

ARRANGEMENT = "the arrangement's file; - reads standard input"
DRAWN = "INPUT=P"
"""How `--draw` is written."""

LEAST_WIDTH = 20


def assignments(
    option: str, items: Iterable[str], form: str = "INPUT=VALUE", instead: str = "leave one out"
) -> dict[str, str]:
    """Inputs with the texts of their values, written in this `form`. UsageError: one is not written so, or is given
    again (`instead`: what to do then)."""
    found: dict[str, str] = {}
    for item in items:
        name, equals, text = item.partition("=")
        if not equals:
            raise UsageError(f"{option} needs {form}, not `{item}`")
        if name.strip() in found:
            raise UsageError(f"{option} gives `{name.strip()}` twice: {instead}")
        found[name.strip()] = text.strip()
    return found


def property_text(text: str) -> str:
    """One or more lines of a property file, of which one is more than a comment."""
    if all(not line.strip() or line.lstrip().startswith("#") for line in text.splitlines()):
        raise ArgumentTypeError("there is no property in this text")
    return text


positive, seconds, size = word(read_count), word(read_seconds), word(parse_size)


def width(text: str) -> int:
    """The width of a table, in columns."""
    number = positive(text)
    if number < LEAST_WIDTH:
        raise ArgumentTypeError(f"a table needs {LEAST_WIDTH} columns at least")
    return number


def milliseconds(text: str) -> Fraction:
    """A positive time in milliseconds; a number without a unit is one of them."""
    value = duration_ms(text)
    if value is None:
        raise ArgumentTypeError(excess(text) or f"{text[:40]!r} is not a positive time such as 500ms, 90s, 5min or 2h")
    return value


# ---------------------------------------------------------------- arguments


def repeatable(to: _ActionsContainer, *flags: str, text: str, **more: Any) -> None:
    """An option whose values are a list; `more`: what `add_argument` takes besides."""
    to.add_argument(*flags, action="append", default=[], help=f"{text}; may be repeated", **more)


def choice(to: _ActionsContainer, flag: str, names: Collection[str], text: str, **more: Any) -> None:
    """An option whose value is one of these names, the first one where it is left out."""
    to.add_argument(flag, choices=names, default=next(iter(names)), help=f"{text} (default: %(default)s)", **more)


def held_inputs(to: _ActionsContainer) -> None:
    """Inputs that keep a value."""
    repeatable(to, "--set", metavar="INPUT=VALUE", text="hold an input at a value")


def drawn_inputs(to: _ActionsContainer) -> None:
    """How a simulation draws inputs."""
    to.add_argument(
        "--hold", metavar="TIME",
        help="for how long random inputs keep their values on average: 5s, 20cycles, or `none` (default: the longest "
        "timer, at most 60 s, and at least 5 cycles)",
    )  # fmt: skip
    repeatable(
        to, "--draw", metavar=DRAWN, text="the probability that an input is true, or speed=3:0.1,4:0.2 of values"
    )


def arrangement(to: _ActionsContainer) -> None:
    """The file of the arrangement."""
    to.add_argument("arrangement", metavar="ARRANGEMENT", help=ARRANGEMENT)


def property_files(to: _ActionsContainer, text: str = "property files; - reads standard input") -> None:
    """Files of properties, after the arrangement."""
    to.add_argument("properties", metavar="PROPERTIES", nargs="*", default=[], help=text)


def property_lines(to: _ActionsContainer, text: str = "one line of a property file") -> None:
    """Properties in the command itself, and the syntax of all properties."""
    repeatable(to, "-p", "--property", metavar="TEXT", text=text, type=property_text)
    syntax(to)


def only(to: _ActionsContainer) -> None:
    """The names of the properties that are meant."""
    repeatable(to, "--only", metavar="NAME", text="only the property of this name, with all assumptions")


def syntax(to: _ActionsContainer, text: str = "how formulas are written, where the file does not say it") -> None:
    """How formulas are written."""
    choice(to, "--syntax", SYNTAXES, text)


def max_states(to: _ActionsContainer, text: str = "end the search after N configurations") -> None:
    """A limit of configurations."""
    to.add_argument("--max-states", metavar="N", type=positive, help=text)


def memory_and_timeout(to: _ActionsContainer, end: str = "end the search") -> None:
    """Limits of memory and time."""
    to.add_argument("--memory", metavar="SIZE", type=size, help=f"{end} when it needs more memory, such as 500M or 2G")
    to.add_argument("--timeout", metavar="SECONDS", type=seconds, help=f"{end} after this many seconds")


def other_arrangement(to: _ActionsContainer, named_by: str) -> None:
    """Another arrangement than the one that a file names."""
    text = f"use this arrangement instead of the one that {named_by}"
    to.add_argument("--arrangement", metavar="FILE", help=text)


def output(to: _ActionsContainer) -> None:
    """The file that is written."""
    to.add_argument("-o", "--output", metavar="FILE", help="the file to write (default: standard output)")


def colour(to: _ActionsContainer) -> None:
    """How output for people looks."""
    text = "colours: always, never, or on a terminal (default: %(default)s)"
    to.add_argument("--color", choices=("auto", "always", "never"), default="auto", help=text)
    to.add_argument("--width", metavar="N", type=width, help="make tables N columns wide (default: as the terminal)")


def all_steps(to: _ActionsContainer) -> None:
    """The option that unfolds tables; it had another name before."""
    to.add_argument(
        "--all-steps",
        "--full-traces",
        action="store_true",
        help="do not fold stretches in which nothing relevant happens",
    )


def engine(to: _ActionsContainer) -> None:
    """The option that names an engine: one of ours, or of another package, which is looked for only then."""
    to.add_argument(
        "--engine",
        type=_engine,
        default=DEFAULT_ENGINE,
        metavar=f"{{{','.join(ENGINES)}}}",
        help="the engine (default: %(default)s)",
    ).completer = lambda **_: tuple(ENGINES)  # type: ignore[attr-defined]  # argcomplete looks for it here


def _engine(text: str) -> str:
    try:
        ENGINES.entry(text)
    except Unregistered as error:
        raise ArgumentTypeError(str(error)) from None
    return text
