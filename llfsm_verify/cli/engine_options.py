"""The options that engines have as their own, on the command line: arguments, values, and what does not go together."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from llfsm_verify.checking.engine_option import EngineFeature, EngineOption
from llfsm_verify.cli.parser import Parser, UsageError
from llfsm_verify.verification.engines import ENGINES, FEATURES

if TYPE_CHECKING:
    from argparse import _ActionsContainer


def engine_options(parser: Parser, to: _ActionsContainer, options: Sequence[EngineOption]) -> None:
    """Add the arguments of options, and those of the engine of another package when the words name it."""

    def add_others(words: Sequence[str]) -> None:
        name = _engine_named(words)
        if name is None or name in ENGINES.ours:
            return
        ENGINES.find_others()
        own = ENGINES.options([name] if name in ENGINES else [])
        more = [option for option in own if option not in options]
        taken = {*parser._option_string_actions, *(action.dest for action in parser._actions)}
        wrong = next((o for o in more if {*o.flags, o.attribute} & taken), None)
        if wrong is not None:
            parser.error(f"the engine `{name}` cannot be asked: `{wrong.flag}` already is an option of `{parser.prog}`")
        for option in more:
            option.add_to(to)

    for option in options:
        option.add_to(to)
    parser.before = add_others


def _engine_named(words: Sequence[str]) -> str | None:
    """The last one, as argparse reads it: options may be cut short."""
    found = None
    for each, after in zip(words, (*words[1:], None), strict=False):
        flag, equals, value = each.partition("=")
        if len(flag) > 2 and "--engine".startswith(flag):
            found = value if equals else after
    return found


def _options(options: Namespace) -> Iterable[EngineOption]:
    """Those that the command line can have: of ours, and of the engine that is asked."""
    return ENGINES.options(dict.fromkeys([*ENGINES.ours, options.engine]))


def given_options(options: Namespace) -> dict[str, object]:
    """What the command line says of options that only some engines take, by their names in Python."""
    found = {each.name: getattr(options, each.attribute, None) for each in FEATURES}
    for option in _options(options):
        value = getattr(options, option.attribute, None)
        found[option.name] = option.kind.choices.get(value, value) if isinstance(value, str) else value
    return {name: value for name, value in found.items() if value is not None}


def refuse_misplaced(options: Namespace) -> None:
    """UsageError: an option of an engine does not fit its place."""
    given = given_options(options)
    for option in _options(options):
        if option.name in given and not option.kind.fits(given[option.name]):
            raise UsageError(f"{option.flag} needs {option.kind.wants}")
    partial = ENGINES.partial(given)
    if partial is not None:
        option, whole = partial
        raise UsageError(f"{option.flag} {option.alone.format(f'{whole.flag} {whole.kind.metavar}')}")
    wrong = ENGINES.misplaced(options.engine, given)
    if wrong is not None:
        raise UsageError(f"{_written(wrong, options)} is for --engine {ENGINES.takers(wrong.name)}")


def _written(asked: EngineFeature, options: Namespace) -> str:
    """With its value, where that is a word to choose."""
    chosen = isinstance(asked, EngineOption) and asked.kind.choices
    return f"{asked.flag} {getattr(options, asked.attribute)}" if chosen else asked.flag
