"""When a long search is saved, and going on from what was saved."""

from __future__ import annotations

import time
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.binding import Bound
from llfsm_verify.checking.search import Walk
from llfsm_verify.checking.searching import Search
from llfsm_verify.checking.verdict import Checkpointing
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.kripke.checkpoint import Json, Unusable, header_of, load, save
from llfsm_verify.kripke.explore import LimitReached
from llfsm_verify.kripke.graph import Letters
from llfsm_verify.kripke.memory import Region

SHARE = 0.1
"""At most this share of the time goes into saving, once a save has been timed."""
PATIENCE = 1.0
"""Seconds in which an exploration must come to a place where it can be saved."""
CODES = {
    "E413": "A checkpoint cannot be read or written.",
    "E414": "A checkpoint belongs to another arrangement, other properties, options or another version.",
}


class Checkpoints:
    """Saves one check now and then. `note`: what to tell the user, once the search has begun.

    Raises DiagnosticError (E413, E414) when the file cannot be written, or is not one of this check.
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
        self._header = self._read() if wanted.resume else None
        self._last, self._took = time.monotonic(), 0.0
        if self._header is None and not wanted.path.parent.is_dir():
            raise _problem("E413", f"there is no folder {wanted.path.parent}", wanted.path)

    @property
    def search(self) -> str | None:
        """Which search was saved; None: there is nothing to go on from."""
        return None if self._header is None else str(self._header["search"])

    # -------------------------------------------------- reading

    def _read(self) -> dict[str, Json] | None:
        path = self._wanted.path
        try:
            header = header_of(path)
        except FileNotFoundError:
            self.note = f"there is no checkpoint {path} yet: the search begins at the beginning"
            return None
        except OSError as error:
            raise _problem("E413", f"the checkpoint cannot be read: {error.strerror or error}", path) from None
        except Unusable as error:
            raise _problem("E413", f"the checkpoint cannot be used: {error}", path) from None
        for key, value in self._about.items():
            if header.get(key) != value:
                what = {"version": "another version of llfsm-verify"}.get(key, f"other {key}")
                what = "another arrangement" if key == "arrangement" else what
                raise _problem("E414", f"the checkpoint belongs to {what}", path, "leave out --resume to begin anew")
        return header

    def restore(self, search: Search) -> None:
        """Bring a search that has not begun to where it was saved."""
        header, path = self._header, self._wanted.path
        assert header is not None
        try:
            if header["program"] != _program(search):
                raise _problem("E414", "the checkpoint belongs to another version of llfsm-verify", path)
            numbers, walks, target = header["numbers"], header["violations"], header["target"]
            assert isinstance(numbers, list)
            assert isinstance(walks, list)
            assert isinstance(target, int)

            def read(regions: Sequence[Region]) -> None:
                load(path, regions)

            search.explorer.restore([n for n in numbers if isinstance(n, int)], read)
            search.target = target
            for task, walk in zip(search.tasks, walks, strict=True):
                task.violation = _walk(walk)
        except OSError as error:
            raise _problem("E413", f"the checkpoint cannot be read: {error.strerror or error}", path) from None
        except (Unusable, KeyError, ValueError, AssertionError) as error:
            why = str(error) if isinstance(error, Unusable) else "it is damaged"
            raise _problem("E413", f"the checkpoint cannot be used: {why}", path) from None
        self.note = f"going on from {path} with {search.graph.configurations:,} configurations"

    # -------------------------------------------------- writing

    def maybe(self, search: Search, name: str) -> None:
        """Save when it is time to. Raises LimitReached, and DiagnosticError when the file cannot be written."""
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
                save(self._wanted.path, header, sections)
            except OSError as error:
                why = f"the checkpoint cannot be written: {error.strerror or error}"
                raise _problem("E413", why, self._wanted.path) from None
        self._last = time.monotonic()
        self._took = self._last - began


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
    assert isinstance(data, list)
    nodes, letters, loop = data
    assert isinstance(nodes, list)
    assert isinstance(letters, list)
    assert loop is None or isinstance(loop, int)
    return Walk(tuple(n for n in nodes if isinstance(n, int)), tuple(map(_letters, letters)), loop)


def _letters(data: Json) -> Letters:
    assert data is None or isinstance(data, int | list)
    return tuple(x for x in data if isinstance(x, int)) if isinstance(data, list) else data


def _problem(code: str, message: str, path: Path, hint: str | None = None) -> DiagnosticError:
    return DiagnosticError(Diagnostic(code, message, file=str(path), hint=hint))
