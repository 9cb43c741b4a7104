"""Messages as lines of JSON: an object a line, in pieces as they come and go."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import cast

from llfsm_verify.jsonvalue import Json
from llfsm_verify.values import Shown, text

MOST_BYTES = 1 << 16
"""Of a line, without its end."""


class Malformed(Exception):
    """A line is no message; the message says why."""


class LineReader:
    """Puts lines together. What is longer than MOST_BYTES is passed over, and told once, where it becomes too long."""

    def __init__(self) -> None:
        self._rest = b""
        self._passing = False

    def lines(self, data: bytes) -> Iterator[bytes | None]:
        """The lines that end in `data`, without their ends; None stands for one that is too long."""
        *whole, last = data.split(b"\n")
        for piece in whole:
            line, passing = self._rest + piece, self._passing
            self._rest, self._passing = b"", False
            if not passing:
                yield line if len(line) <= MOST_BYTES else None
        self._rest += last
        if self._passing or len(self._rest) > MOST_BYTES:
            if not self._passing:
                yield None
            self._rest, self._passing = b"", True

    def restart(self) -> bool:
        """Begin with another sender; whether the one before left a line without an end."""
        begun = bool(self._rest.strip()) or self._passing
        self._rest, self._passing = b"", False
        return begun


def decode(line: bytes) -> dict[str, Json]:
    """The object in a line; decimals stay as they are written, as texts. Malformed."""
    try:
        found = json.loads(line.decode("utf-8"), parse_float=str, parse_constant=_constant)
    except UnicodeDecodeError:
        raise Malformed("a line is not UTF-8") from None
    except (ValueError, RecursionError):
        raise Malformed("a line is not JSON") from None
    if not isinstance(found, dict):
        raise Malformed('a line is not an object such as {"car": true}')
    return cast(dict[str, Json], found)


def _constant(name: str) -> None:
    raise ValueError(name)


def encode(values: Mapping[str, Shown]) -> bytes:
    """An object in a line with its end; decimals are written exactly."""
    shown = (f"{json.dumps(name)}: {json.dumps(v) if isinstance(v, str) else text(v)}" for name, v in values.items())
    return f"{{{', '.join(shown)}}}\n".encode()
