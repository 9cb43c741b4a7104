"""The options that engines have as their own, on the command line: arguments, values, and what does not go together."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from llfsm_verify.checking.engine_option import EngineFeature, EngineOption
from llfsm_verify.cli.argument_types import word
from llfsm_verify.verification.engines import ENGINES, FEATURES

if TYPE_CHECKING:
    from argparse import _ActionsContainer


def engine_options(to: _ActionsContainer, options: Iterable[EngineOption]) -> None:
    """Add the arguments of options."""
    for option in options:
        kind, more = option.kind, dict[str, Any](metavar=option.kind.metavar)
        if kind.choices:
            more["choices"] = tuple(kind.choices)
        elif kind.read is None:
            more = {"action": "store_true"}
        else:
            more["type"] = word(kind.read)
        text = option.help
        if option.default is not None:
            text += " (default: %(default)s)"
            more["default"] = next(w for w, value in kind.choices.items() if value == option.default)
        to.add_argument(option.flag, *option.old, help=text, **more)


def given_options(options: Namespace) -> dict[str, object]:
    """What the command line says of options that only some engines take, by their names in Python."""
    found = {each.name: getattr(options, each.attribute, None) for each in FEATURES}
    for option in ENGINES.options():
        value = getattr(options, option.attribute, None)
        found[option.name] = option.kind.choices.get(value, value) if isinstance(value, str) else value
    return {name: value for name, value in found.items() if value is not None}


def engine_mistake(options: Namespace) -> str | None:
    """What is wrong with the options of engines."""
    given = given_options(options)
    for option in ENGINES.options():
        if option.name in given and not option.kind.fits(given[option.name]):
            return f"{option.flag} needs {option.kind.wants}"
    partial = ENGINES.partial(given)
    if partial is not None:
        option, whole = partial
        return f"{option.flag} {option.alone.format(f'{whole.flag} {whole.kind.metavar}')}"
    wrong = ENGINES.misplaced(options.engine, given)
    return None if wrong is None else f"{_written(wrong, options)} is for --engine {ENGINES.takers(wrong.name)}"


def _written(asked: EngineFeature, options: Namespace) -> str:
    """With its value, where that is a word to choose."""
    chosen = isinstance(asked, EngineOption) and asked.kind.choices
    return f"{asked.flag} {getattr(options, asked.attribute)}" if chosen else asked.flag
