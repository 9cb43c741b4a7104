"""When a long search is saved, and going on from what was saved."""

from __future__ import annotations

import time
import warnings
import weakref
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.binding import Bound
from llfsm_verify.checking.search import Walk
from llfsm_verify.checking.searching import Search
from llfsm_verify.checking.verdict import Checkpointing
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.kripke.checkpoint import Json, Unusable, header_of, load
from llfsm_verify.kripke.explore import LimitReached
from llfsm_verify.kripke.graph import Letters
from llfsm_verify.kripke.memory import Region
from llfsm_verify.kripke.reservation import NotReplaceable, Reservation, Taken

SHARE = 0.1
"""At most this share of the time goes into saving, once a save has been timed."""
PATIENCE = 1.0
"""Seconds in which an exploration must come to a place where it can be saved."""
CODES = {
    "E413": "A checkpoint cannot be read or written.",
    "E414": "A checkpoint belongs to another arrangement, other properties, options or another version.",
    "E415": "A checkpoint would replace something that is no checkpoint.",
    "W402": "A checkpoint could not be saved; the search goes on, and saving is tried again.",
}


class CheckpointWarning(UserWarning):
    """Issued, once for failures in a row, when a checkpoint could not be saved; the message is a rendered diagnostic
    (W402)."""


class Checkpoints:
    """Saves one check now and then. `note`: what to tell the user, once the search has begun.

    Raises DiagnosticError when the file cannot be written or another search saves there (E413), is not one of this
    check (E414), or is no checkpoint (E415). A save that fails later is a CheckpointWarning.
    """

    def __init__(self, wanted: Checkpointing, arrangement: Arrangement, bound: Bound, options: dict[str, Json]) -> None:
        from importlib.metadata import version

        self._wanted = wanted
        self._about: dict[str, Json] = {
            "version": version("llfsm-verify"),
            "arrangement": arrangement.digest,
            "properties": [
                [p.kind, p.name, p.text, _digest(str(bound.automata.get(p.name, "")))]
                for p in (*bound.properties, *bound.assumptions)
            ],
            "options": options,
        }
        self.note: str | None = None
        self._last, self._took = time.monotonic(), 0.0
        self._failed = self._saved = False
        self._place = _reserved(wanted.path)
        self._finalizer = weakref.finalize(self, self._place.release)
        try:
            self._header = self._read() if wanted.resume else None
        except BaseException:
            self._finalizer()
            raise

    @property
    def search(self) -> str | None:
        """Which search was saved; None: there is nothing to go on from."""
        return None if self._header is None else str(self._header["search"])

    # -------------------------------------------------- reading

    def _read(self) -> dict[str, Json] | None:
        path = self._wanted.path
        try:
            header = header_of(path)
        except OSError as error:
            raise _problem("E413", f"the checkpoint cannot be read: {error.strerror or error}", path) from None
        except Unusable as error:
            raise _problem("E413", f"the checkpoint cannot be used: {error}", path) from None
        if header is None:
            self.note = f"there is no checkpoint {path} yet: the search begins at the beginning"
            return None
        for key, value in self._about.items():
            if header.get(key) != value:
                what = {"version": "another version of llfsm-verify"}.get(key, f"other {key}")
                what = "another arrangement" if key == "arrangement" else what
                raise _problem("E414", f"the checkpoint belongs to {what}", path, "leave out --resume to begin anew")
        if not isinstance(header.get("search"), str):
            raise _problem("E413", "the checkpoint cannot be used: it is damaged", path)
        return header

    def restore(self, search: Search) -> None:
        """Bring a search that has not begun to where it was saved. When there is no memory for that, it is stopped."""
        header, path = self._header, self._wanted.path
        if header is None:
            raise ValueError("there is nothing to go on from")
        try:
            if header["program"] != _program(search):
                raise _problem("E414", "the checkpoint belongs to another version of llfsm-verify", path)
            numbers, walks = _numbers(header["numbers"]), _list(header["violations"])
            violations, target = [_walk(walk) for walk in walks], _number(header["target"])
            if len(violations) != len(search.tasks):
                raise Unusable("it is damaged")

            def read(regions: Sequence[Region]) -> None:
                load(path, regions)

            search.explorer.restore(numbers, read)
        except OSError as error:
            raise _problem("E413", f"the checkpoint cannot be read: {error.strerror or error}", path) from None
        except LimitReached as limit:
            search.graph.stopped = str(limit)
            self.note = f"{path} could not be gone on from: {limit}"
            return
        except (Unusable, KeyError, ValueError) as error:
            why = str(error) if isinstance(error, Unusable) else "it is damaged"
            raise _problem("E413", f"the checkpoint cannot be used: {why}", path) from None
        search.target = target
        for task, violation in zip(search.tasks, violations, strict=True):
            task.violation = violation
        self._saved = True
        self.note = f"going on from {path} with {search.graph.configurations:,} configurations"

    # -------------------------------------------------- writing

    def maybe(self, search: Search, name: str) -> None:
        """Save when it is time to."""
        pause = max(self._wanted.every, self._took / SHARE)
        if time.monotonic() - self._last >= pause and not search.graph.exhausted:
            self.now(search, name)

    def now(self, search: Search, name: str) -> None:
        """Save, unless the exploration is in the middle of something."""
        began = time.monotonic()
        try:
            settled = search.explorer.settle(PATIENCE)
        except LimitReached:
            settled = False
        if settled:
            numbers, sections = search.explorer.saved()
            header: dict[str, Json] = {
                **self._about,
                "search": name,
                "program": _program(search),
                "numbers": list(numbers),
                "target": search.target,
                "violations": [_plain(t.violation) for t in search.tasks],
            }
            try:
                self._place.save(header, sections)
                self._saved, self._failed = True, False
            except OSError as error:
                self._warn(error.strerror or str(error))
        self._last = time.monotonic()
        self._took = self._last - began

    def _warn(self, why: str) -> None:
        """Say that a save has failed, unless the one before it has failed, too."""
        if not self._failed:
            self._failed = True
            left = "the one saved before is still there" if self._saved else "nothing has been saved so far"
            message = f"the checkpoint cannot be written: {why}; {left}"
            text = Diagnostic("W402", message, file=str(self._wanted.path)).render()
            warnings.warn(text, CheckpointWarning, stacklevel=2)


def _reserved(path: Path) -> Reservation:
    """The place of the file. Raises DiagnosticError."""
    if not path.parent.is_dir():
        raise _problem("E413", f"there is no folder {path.parent}", path)
    try:
        return Reservation(path)
    except NotReplaceable as found:
        hint = "name a file that is not there yet, or one that --checkpoint has written"
        raise _problem("E415", f"{found}, and a checkpoint would replace it", path, hint) from None
    except Taken:
        hint = "wait for it to end, or name another file"
        raise _problem("E413", "another search is saving its checkpoints there", path, hint) from None
    except OSError as error:
        raise _problem("E413", f"the checkpoint cannot be written: {error.strerror or error}", path) from None


def _program(search: Search) -> str:
    """A name for the step program and for how its configurations lie in memory."""
    return _digest(search.explorer.text)


def _digest(text: str) -> str:
    return sha256(text.encode()).hexdigest()


def _plain(walk: Walk | None) -> Json:
    if walk is None:
        return None
    return [list(walk.nodes), [list(x) if isinstance(x, tuple) else x for x in walk.letters], walk.loop]


def _walk(data: Json) -> Walk | None:
    if data is None:
        return None
    nodes, letters, loop = _list(data)
    return Walk(tuple(_numbers(nodes)), tuple(map(_letters, _list(letters))), None if loop is None else _number(loop))


def _letters(data: Json) -> Letters:
    if data is None:
        return None
    return tuple(_numbers(data)) if isinstance(data, list) else _number(data)


def _numbers(data: Json) -> list[int]:
    return [_number(item) for item in _list(data)]


def _list(data: Json) -> list[Json]:
    if not isinstance(data, list):
        raise Unusable("it is damaged")
    return data


def _number(data: Json) -> int:
    if not isinstance(data, int):
        raise Unusable("it is damaged")
    return data


def _problem(code: str, message: str, path: Path, hint: str | None = None) -> DiagnosticError:
    return DiagnosticError(Diagnostic(code, message, file=str(path), hint=hint))
