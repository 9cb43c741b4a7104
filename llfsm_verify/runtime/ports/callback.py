"""The kind `callback`: a function in Python that gets outputs and returns inputs."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Mapping
from decimal import Decimal

from llfsm_verify.jsonvalue import Json
from llfsm_verify.runtime.ports import UNKNOWN
from llfsm_verify.runtime.ports.port import Kind, Link, Opener, Port, Started, Unopened
from llfsm_verify.values import Shown
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Node, mark
from llfsm_verify.yaml.tables import Field, Single, Table

Function = Callable[[Mapping[str, Shown]], Mapping[str, Json | Decimal] | None]
"""Gets the outputs by field, and returns values of some of its inputs by field, or None."""


class CallbackPort(Port):
    """Calls a function for each frame that is seen, on the thread that serves ports."""

    every_frame = True

    def __init__(self, link: Link, function: Callable[[Mapping[str, Shown]], object]) -> None:
        self._link = link
        self._function = function

    def send(self, values: Mapping[str, Shown]) -> None:
        """See `Port`."""
        try:
            given = self._function(values)
        except Exception as error:  # noqa: BLE001 - whatever a function of others raises, the run goes on
            self._link.unsent("the function has raised an exception")
            self._link.lost(f"the function has raised {type(error).__name__}: {error}")
            return
        self._link.sent()
        if given is None:
            return
        if isinstance(given, Mapping):
            self._link.take({name: str(v) if isinstance(v, Decimal) else v for name, v in given.items()})
        else:
            self._link.malformed(f"the function has returned neither a mapping nor None, but {type(given).__name__}")


def callback(function: Function) -> Opener:
    """What starts a port of a function."""

    def start(link: Link) -> Port:
        return CallbackPort(link, function)

    return start


class Callback(Kind):
    """`call: module:function`; the module may stand beside the file of ports."""

    table = Table(
        "a function in Python",
        (Field("call", "the function, as `module:function`", Single(("string",), "^[^:]+:[^:]+$"), required=True),),
    )
    keys, required = table.keys, table.required

    def settings(self, report: Report, found: Mapping[str, Node], what: str, folder: str) -> Started | None:
        """See `Kind`."""
        scalar = report.scalar(found["call"], "`call`")
        if scalar is None:
            return None
        module, colon, attribute = scalar.text.partition(":")
        if not (
            colon and attribute and all(part.isidentifier() for part in (*module.split("."), *attribute.split(".")))
        ):
            message = f"{what} cannot call `{scalar.text[:60]}`"
            report.error(UNKNOWN, message, mark(scalar), "write `module:function`")
            return None

        def start(link: Link) -> Port:
            return CallbackPort(link, _function(module, attribute, folder))

        return Started(start)


def _function(module: str, attribute: str, folder: str) -> Function:
    if folder not in sys.path:
        sys.path.insert(0, folder)
    hint = "write `module:function`, with a module beside the file of ports or one that is installed"
    try:
        found: object = importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name and (module == error.name or module.startswith(f"{error.name}.")):
            raise Unopened(f"there is no module `{module}`, neither in {folder} nor installed", hint) from None
        raise Unopened(f"`{module}` cannot be imported: {error}", "install what the module needs") from None
    except Exception as error:  # noqa: BLE001 - a module of others may raise anything
        why = f"`{module}` cannot be imported: {type(error).__name__}: {error}"
        raise Unopened(why, "correct the module") from None
    for part in attribute.split("."):
        if not hasattr(found, part):
            raise Unopened(f"`{module}` has no `{attribute}`", hint)
        found = getattr(found, part)
    if not callable(found):
        raise Unopened(f"`{module}:{attribute}` is not a function", hint)
    return found


KIND = Callback()
