"""The options of a check, a query and a lint: keyword arguments with the names of the command line's options."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from decimal import Decimal
from typing import TypedDict, TypeVar, cast

from llfsm_verify.checking.engine_option import COUNT, FLAG, SECONDS, Kind, is_count
from llfsm_verify.checking.verdict import EarlyVerdict, Options, Progress
from llfsm_verify.engines.explicit.options import ExplicitKeywords, JobsKeyword
from llfsm_verify.engines.unrolled.options import UnrolledKeywords
from llfsm_verify.limits import Limits, parse_size
from llfsm_verify.registry import meant
from llfsm_verify.values import Shown, text
from llfsm_verify.verification.engines import DEFAULT_ENGINE, ENGINES

T = TypeVar("T")
Draw = Mapping[str, float | Mapping[Shown, float]]
"""By input: the probability that it is true, or those of its values."""

COMMON = ("strict", "allow_contradiction", "witnesses", "traces", "keep_all_bits", "progress", "decided", "tell")
"""Those that every engine takes, by the same names."""


class LimitOptions(TypedDict, total=False):
    """Where to end a search whose answer is then *unknown*. An option that is None counts as not given."""

    timeout: float | None
    """Seconds."""
    memory: int | str | None
    """Bytes of the whole process, or a text such as ``"500M"`` or ``"2G"``."""
    max_states: int | None
    """Configurations."""


class ExploreOptions(LimitOptions, JobsKeyword, total=False):
    """The options of `Model.explore`."""


class QueryOptions(ExploreOptions, UnrolledKeywords, total=False):
    """The options of `Model.query`."""


class CheckOptions(QueryOptions, ExplicitKeywords, total=False):
    """The options of `Model.check`."""

    strict: bool | None
    """A property that holds only because nothing happens fails the check."""
    vacuity: bool | None
    """Look at every subformula of properties that hold."""
    accept_vacuity: Collection[str] | None
    """Names of properties that may hold vacuously."""
    allow_contradiction: bool | None
    """A property holds where no run satisfies the assumptions; otherwise it is unknown."""
    witnesses: bool | None
    """Show for each property that holds a run in which something happens."""
    traces: int | None
    """Different counterexamples wanted of each violated property (``--all``)."""
    keep_all_bits: bool | None
    """Keep dead values, which nothing reads any more."""
    progress: Callable[[Progress], None] | None
    """Called now and then with how far the search is."""
    decided: Callable[[EarlyVerdict], None] | None
    """Called with each verdict as soon as it is known, such as to stop waiting for the others."""
    tell: Callable[[str], None] | None
    """Called with sentences that the user should see, such as that the search kernels are compiled first."""


Given = Mapping[str, object]


def _is_size(value: object) -> bool:
    return is_count(value) or isinstance(value, str)


def _are_names(value: object) -> bool:
    return isinstance(value, Collection) and not isinstance(value, str) and all(isinstance(v, str) for v in value)


_CALL = Kind("something to call", callable)

WANTED: Mapping[str, Kind] = {
    "timeout": SECONDS,
    "memory": Kind('a number of bytes, or a text such as "500M" or "2G"', _is_size),
    "max_states": COUNT,
    "strict": FLAG,
    "vacuity": FLAG,
    "accept_vacuity": Kind("names of properties", _are_names),
    "allow_contradiction": FLAG,
    "witnesses": FLAG,
    "traces": COUNT,
    "keep_all_bits": FLAG,
    "progress": _CALL,
    "decided": _CALL,
    "tell": _CALL,
    **{option.name: option.kind for option in ENGINES.options(ENGINES.ours)},
}
"""What each option wants."""


def checked(what: str, given: Given, known: type, engine: str = DEFAULT_ENGINE) -> Given:
    """The options that were given, without those that are None. `known`: the TypedDict that has them, beside those of
    an `engine` of another package.

    TypeError: `what` has no such option; ValueError: an option wants another value. Both say what there is.
    """
    others = _of_others(engine)
    names = (*known.__annotations__, *others)
    wants = {**others, **WANTED}
    for name in given:
        if name not in names:
            raise TypeError(f"{what} has no option `{name}`, only {', '.join(names)}{meant(name, names)}")
    found = {name: value for name, value in given.items() if value is not None}
    for name, value in found.items():
        if not wants[name].fits(value):
            raise ValueError(f"the option `{name}` needs {wants[name].wants}, not {value!r}")
    return found


def _of_others(engine: str) -> Mapping[str, Kind]:
    """What the options of an engine of another package want. ValueError: every check has one of the name."""
    if engine in ENGINES.ours or not isinstance(engine, str):
        return {}
    ENGINES.find_others()
    own, ours = ENGINES.options([engine] if engine in ENGINES else []), ENGINES.options(ENGINES.ours)
    found = {option.name: option.kind for option in own if option not in ours}
    if wrong := found.keys() & WANTED.keys():
        raise ValueError(f"the engine `{engine}` cannot be asked: `{min(wrong)}` already is an option of a check")
    return found


def limits_of(given: Given) -> Limits:
    """The limits among checked options. ValueError: the memory is not a size."""
    memory = given.get("memory")
    if isinstance(memory, str):
        memory = parse_size(memory)
    return Limits(
        cast("int | None", given.get("max_states")),
        cast("int | None", memory),
        cast("float | None", given.get("timeout")),
    )


def query_options(given: Given, engine: str) -> Options:
    """The options of a query. ValueError: the engine does not take one of them."""
    _check_engine(given, engine)
    return Options(limits_of(given), own=ENGINES.own(given))


def check_options(given: Given, engine: str) -> Options:
    """The options of a check. ValueError: two of them, or one and the engine, do not go together."""
    _check_engine(given, engine)
    changed = {name: given[name] for name in COMMON if name in given}
    if given.get("vacuity") or given.get("strict"):
        changed["vacuity"] = "all"
    if "accept_vacuity" in given:
        changed["accepted"] = frozenset(cast("Collection[str]", given["accept_vacuity"]))
    return Options(limits_of(given), own=ENGINES.own(given), **changed)  # type: ignore[arg-type]  # `checked` has seen them


def _check_engine(given: Given, engine: str) -> None:
    """ValueError: an option is for other engines, or is part of one that is not there."""
    wrong = ENGINES.misplaced(engine, given)
    if wrong is not None:
        raise ValueError(f"the option `{wrong.name}` is for {ENGINES.takers(wrong.name)}, not for `{engine}`")
    partial = ENGINES.partial(given)
    if partial is not None:
        option, whole = partial
        raise ValueError(f"the option `{option.name}` {option.alone.format(f'the option `{whole.name}`')}")


def laws_of(draw: Draw | None) -> dict[str, str]:
    """What `draw` says, as users write it. TypeError: it says nothing of the kind."""
    return {
        name: ",".join(f"{value_text(value)}:{p}" for value, p in law.items()) if isinstance(law, Mapping) else str(law)
        for name, law in by_input("draw", draw).items()
    }


def by_input(what: str, given: Mapping[str, T] | None) -> Mapping[str, T]:
    """What an argument says of inputs. TypeError: it is no mapping, or one from something else than names."""
    found = {} if given is None else given
    if not isinstance(found, Mapping) or not all(isinstance(name, str) for name in found):
        raise TypeError(f"`{what}` is a mapping from the names of inputs, not {found!r:.80}")
    return found


def value_text(value: Shown) -> str:
    """A value as users write it in files."""
    return text(Decimal(str(value)) if isinstance(value, float) else value)
