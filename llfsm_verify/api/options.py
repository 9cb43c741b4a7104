"""The options of a check, a query and a lint: keyword arguments with the names of the command line's options."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from decimal import Decimal
from pathlib import Path
from typing import TypedDict, TypeVar, cast, get_args

from llfsm_verify.checking.verdict import EarlyVerdict, Options, Progress
from llfsm_verify.engines.explicit.options import Checkpointing, ExplicitOptions, When
from llfsm_verify.engines.unrolled.options import UnrolledOptions
from llfsm_verify.limits import Limits, parse_size
from llfsm_verify.registry import meant
from llfsm_verify.values import Shown, text
from llfsm_verify.verification.engines import ENGINES, WRITTEN

T = TypeVar("T")
Draw = Mapping[str, float | Mapping[Shown, float]]
"""By input: the probability that it is true, or those of its values."""

COMMON = ("strict", "allow_contradiction", "witnesses", "traces", "keep_all_bits", "progress", "decided", "tell")
"""Those that every engine takes, by the same names."""

USUAL: Mapping[str, tuple[object, ...]] = {
    "cone": ("auto", "off"), "compression": ("auto", "off"), "labels": (True,), "traces": (1,), "vacuity": (False,),
    "witnesses": (False,),
}  # fmt: skip
"""Values that ask nothing of an engine, of the options that only some take."""


class LimitOptions(TypedDict, total=False):
    """Where to end a search whose answer is then *unknown*. An option that is None counts as not given."""

    timeout: float | None
    """Seconds."""
    memory: int | str | None
    """Bytes of the whole process, or a text such as ``"500M"`` or ``"2G"``."""
    max_states: int | None
    """Configurations."""


class QueryOptions(LimitOptions, total=False):
    """The options of `Model.query`."""

    depth: int | None
    """Steps up to which engines look at runs that do not explore all configurations."""


class CheckOptions(QueryOptions, total=False):
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
    cone: When | None
    """Leave out what no property depends on."""
    compression: When | None
    """Do not store configurations with one step only."""
    labels: bool | None
    """Split wide inputs into classes of values."""
    keep_all_bits: bool | None
    """Keep entered flags that cannot matter any more."""
    checkpoint: str | Path | None
    """The file in which a long search is saved now and then."""
    checkpoint_every: float | None
    """Seconds between two such saves."""
    resume: bool | None
    """Go on from the checkpoint."""
    progress: Callable[[Progress], None] | None
    """Called now and then with how far the search is."""
    decided: Callable[[EarlyVerdict], None] | None
    """Called with each verdict as soon as it is known, such as to stop waiting for the others."""
    tell: Callable[[str], None] | None
    """Called with sentences that the user should see, such as that the search kernels are compiled first."""


Given = Mapping[str, object]


def is_count(value: object) -> bool:
    """Whether it is a whole number from 1."""
    return isinstance(value, int) and not isinstance(value, bool) and value >= 1


def _is_seconds(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0 < value < 1e9


def _is_size(value: object) -> bool:
    return is_count(value) or isinstance(value, str)


def _is_when(value: object) -> bool:
    return isinstance(value, str) and value in get_args(When)


def _is_flag(value: object) -> bool:
    return isinstance(value, bool)


def _are_names(value: object) -> bool:
    return isinstance(value, Collection) and not isinstance(value, str) and all(isinstance(v, str) for v in value)


def _is_path(value: object) -> bool:
    return isinstance(value, Path) or (isinstance(value, str) and value != "")


_COUNT = ("a whole number from 1", is_count)
_SECONDS = ("a positive number of seconds", _is_seconds)
_WHEN = ("one of " + ", ".join(get_args(When)), _is_when)
_FLAG = ("True or False", _is_flag)
_CALL = ("something to call", callable)

WANTED: Mapping[str, tuple[str, Callable[[object], bool]]] = {
    "timeout": _SECONDS,
    "memory": ('a number of bytes, or a text such as "500M" or "2G"', _is_size),
    "max_states": _COUNT,
    "depth": _COUNT,
    "strict": _FLAG,
    "vacuity": _FLAG,
    "accept_vacuity": ("names of properties", _are_names),
    "allow_contradiction": _FLAG,
    "witnesses": _FLAG,
    "traces": _COUNT,
    "cone": _WHEN,
    "compression": _WHEN,
    "labels": _FLAG,
    "keep_all_bits": _FLAG,
    "checkpoint": ("the name of a file", _is_path),
    "checkpoint_every": _SECONDS,
    "resume": _FLAG,
    "progress": _CALL,
    "decided": _CALL,
    "tell": _CALL,
}
"""What each option wants, in words and as a test."""


def checked(what: str, given: Given, known: type) -> Given:
    """The options that were given, without those that are None. `known`: the TypedDict that has them.

    TypeError: `what` has no such option; ValueError: an option wants another value. Both say what there is.
    """
    names = tuple(known.__annotations__)
    for name in given:
        if name not in names:
            raise TypeError(f"{what} has no option `{name}`, only {', '.join(names)}{meant(name, names)}")
    found = {name: value for name, value in given.items() if value is not None}
    for name, value in found.items():
        words, fits = WANTED[name]
        if not fits(value):
            raise ValueError(f"the option `{name}` needs {words}, not {value!r}")
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
    return Options(limits_of(given), own=_own(given))


def check_options(given: Given, engine: str) -> Options:
    """The options of a check. ValueError: two of them, or one and the engine, do not go together."""
    _check_engine(given, engine)
    mistake = _checkpoint_mistake(given)
    if mistake is not None:
        raise ValueError(mistake)
    changed = {name: given[name] for name in COMMON if name in given}
    if given.get("vacuity") or given.get("strict"):
        changed["vacuity"] = "all"
    if "accept_vacuity" in given:
        changed["accepted"] = frozenset(cast("Collection[str]", given["accept_vacuity"]))
    return Options(limits_of(given), own=_own(given), **changed)  # type: ignore[arg-type]  # `checked` has seen them


def _own(given: Given) -> tuple[object, ...]:
    """What single engines are told."""
    explicit = {name: given[name] for name in ("cone", "compression", "labels") if name in given}
    if "checkpoint" in given:
        saved = Checkpointing(Path(cast("str | Path", given["checkpoint"])), resume=bool(given.get("resume")))
        every = cast("float | None", given.get("checkpoint_every"))
        explicit["checkpoint"] = saved if every is None else replace(saved, every=every)
    own = ExplicitOptions(**explicit), UnrolledOptions(cast("int | None", given.get("depth")))  # type: ignore[arg-type]
    return tuple(each for each in own if each != type(each)())


def _checkpoint_mistake(given: Given) -> str | None:
    if "checkpoint" in given:
        return None
    alone = [name for name in ("resume", "checkpoint_every") if given.get(name)]
    return f"the option `{alone[0]}` is about the file that the option `checkpoint` names" if alone else None


def _check_engine(given: Given, engine: str) -> None:
    """ValueError: an option is for other engines."""
    asked = [name for name, value in given.items() if name in WRITTEN and value not in USUAL.get(name, ())]
    wrong = ENGINES.misplaced(engine, asked)
    if wrong is not None:
        raise ValueError(f"the option `{wrong}` is for {ENGINES.takers(wrong)}, not for `{engine}`")


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
