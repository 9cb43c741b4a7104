"""When a long search is saved, and going on from what was saved."""

from __future__ import annotations

import json
import time
import warnings
import weakref
from collections.abc import Callable, Sequence
from hashlib import sha256
from pathlib import Path

from llfsm_verify.backends.broken import BrokenProgramError
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.reach import FIRST_LOOK
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Disagreement, counted
from llfsm_verify.engines.explicit.options import Checkpointing, CheckpointWarning
from llfsm_verify.engines.explicit.search import Search
from llfsm_verify.jsonvalue import Json
from llfsm_verify.kripke.checkpoint import (
    NotReplaceable,
    OtherVersion,
    Reservation,
    Section,
    Taken,
    Unusable,
    header_of,
    load,
    whole,
)
from llfsm_verify.kripke.graph import MAX_NODES, Graph, Letters
from llfsm_verify.kripke.product_search import Walk
from llfsm_verify.kripke.witnesses import NoWitness
from llfsm_verify.limits import Budget, LimitReached

Tell = Callable[[str], None]

SHARE = 0.1
"""At most this share of the time goes into saving, once a save has been timed."""
MOST_TARGET = 4 * MAX_NODES
"""Nodes at which the properties are looked at next, at most: there are never so many."""
LONGEST_WALKS = 1 << 20
"""Characters of the violations found so far; where they take more, they are not saved, and are found again."""
CONTRADICTED = (Disagreement, BrokenProgramError, NoWitness)
"""What a search raises that goes on from what the arrangement does not do."""
PATIENCE = 1.0
"""Seconds in which an exploration must come to a place where it can be saved."""
CODES = {
    "E413": "A checkpoint cannot be read, used or written: it is damaged, or the arrangement does not do what it says.",
    "E414": "A checkpoint belongs to another arrangement, other properties, options or another version.",
    "E415": "A checkpoint would replace something that is not a checkpoint.",
    "W402": "A checkpoint could not be saved; the search goes on, and saving is tried again.",
}


class Checkpoints:
    """Saves one check now and then. `note`: what to tell the user, once the search has begun.

    Raises DiagnosticError when the file cannot be written or another search saves there (E413), is not one of this
    check (E414), or is not a checkpoint (E415). A failure to save later is told, or warned of.
    """

    def __init__(self, wanted: Checkpointing, problem: Problem, options: dict[str, Json], tell: Tell | None) -> None:
        """`tell` takes sentences for the user."""
        from importlib.metadata import version

        self._wanted = wanted
        self._tell = tell
        self._about: dict[str, Json] = {
            "version": version("llfsm-verify"),
            "arrangement": problem.arrangement.digest,
            "properties": _digest(
                json.dumps(
                    [
                        [p.kind, p.name, p.text, _digest(str(problem.automata.get(p.name, "")))]
                        for p in (*problem.properties, *problem.assumptions)
                    ]
                )
            ),
            "options": options,
        }
        self.note: str | None = None
        self._resumed: Search | None = None
        """The search that goes on from what the file says."""
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
        except OtherVersion:
            raise _other("another version of llfsm-verify", path) from None
        except Unusable as error:
            raise _unusable(str(error), path) from None
        if header is None:
            self.note = f"there is no checkpoint {path} yet: the search begins at the beginning"
            return None
        for key, value in self._about.items():
            if header.get(key) != value:
                what = {"version": "another version of llfsm-verify"}.get(key, f"other {key}")
                what = "another arrangement" if key == "arrangement" else what
                raise _other(what, path)
        if not isinstance(header.get("search"), str):
            raise _unusable("it is damaged", path)
        return header

    def restore(self, search: Search, name: str) -> None:
        """Bring a search of this name that has not begun to where it was saved. When there is no memory for that, it is
        stopped."""
        header, path = self._header, self._wanted.path
        if header is None:
            raise ValueError("there is nothing to go on from")
        if header.get("program") != _program(search):
            raise _other("another version of llfsm-verify", path)

        def read(sections: Sequence[Section], budget: Budget) -> None:
            load(path, sections, budget)

        try:
            if name != self.search:
                raise Unusable("it is damaged")
            target = whole(header.get("target"), FIRST_LOOK, MOST_TARGET)
            search.explorer.restore(header.get("numbers"), read)
            walks = _list(header.get("violations"), len(search.tasks))
            violations = [_walk(walk, search.graph, len(search.explorer.observed)) for walk in walks]
        except OSError as error:
            raise _problem("E413", f"the checkpoint cannot be read: {error.strerror or error}", path) from None
        except LimitReached as limit:
            search.graph.stopped = str(limit)
            self.note = f"{path} could not be continued from: {limit}"
            return
        except Unusable as error:
            raise _unusable(str(error), path) from None
        search.target = target
        for task, violation in zip(search.tasks, violations, strict=True):
            task.violation = violation
        self._saved, self._resumed = True, search
        self.note = f"going on from {path} with {counted(search.graph.configurations, 'configuration')}"

    @property
    def resumed(self) -> bool:
        """A search went on from what the file says."""
        return self._resumed is not None

    def source(self, search: Search) -> str | None:
        """The file, when this search went on from it."""
        return str(self._wanted.path) if search is self._resumed else None

    def contradicted(self, error: Exception) -> DiagnosticError | None:
        """What to say of one of CONTRADICTED in a search that goes on from the file; None: it is not that."""
        if not (self.resumed and isinstance(error, CONTRADICTED)):
            return None
        text = " ".join(str(error.args[0] if error.args else error).split())
        why = f"what it says of the search is not what the arrangement does ({text})"
        return _unusable(why, self._wanted.path)

    # -------------------------------------------------- writing

    def maybe(self, search: Search, name: str) -> None:
        """Save when it is time to."""
        pause = max(self._wanted.every, self._took / SHARE)
        if time.monotonic() - self._last >= pause and not search.graph.exhausted:
            self.now(search, name)

    def now(self, search: Search, name: str) -> None:
        """Save, or warn when that is not possible."""
        began = time.monotonic()
        try:
            finished = search.explorer.finish_batch(PATIENCE)
        except LimitReached:
            finished = False
        if finished:
            numbers, sections = search.explorer.saved()
            walks: list[Json] = [_plain(t.violation) for t in search.tasks]
            if len(json.dumps(walks)) > LONGEST_WALKS:
                walks = [None] * len(walks)
            header: dict[str, Json] = {
                **self._about,
                "search": name,
                "program": _program(search),
                "numbers": numbers.header(),
                "target": min(search.target, MOST_TARGET),
                "violations": walks,
            }
            try:
                self._place.save(header, sections)
                self._saved, self._failed = True, False
            except OSError as error:
                self._warn(error.strerror or str(error))
        else:
            self._warn("the search was in the middle of a change")
        self._last = time.monotonic()
        self._took = self._last - began

    def _warn(self, why: str) -> None:
        """Say that a save has failed, unless the one before it failed as well."""
        if not self._failed:
            self._failed = True
            left = "the one saved before is still there" if self._saved else "nothing has been saved so far"
            message = f"the checkpoint cannot be written: {why}; {left}"
            text = Diagnostic("W402", message, file=str(self._wanted.path)).render()
            if self._tell is None:
                warnings.warn(text, CheckpointWarning, stacklevel=2)
            else:
                self._tell(text)


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


def _walk(data: Json, graph: Graph, bits: int) -> Walk | None:
    """A walk that `_plain` gave, through nodes of a graph whose letters have so many bits. Raises Unusable."""
    if data is None:
        return None
    nodes, letters, loop = _list(data, 3)
    path = tuple(whole(node, 0, len(graph) - 1) for node in _list(nodes))
    shown = tuple(_letters(each, graph, (1 << bits) - 1) for each in _list(letters, len(path) - 1))
    whole(path[0], 0, graph.roots - 1)
    if loop is not None and path[whole(loop, 0, len(path) - 2)] != path[-1]:
        raise Unusable("it is damaged")
    return Walk(path, shown, loop if isinstance(loop, int) else None)


def _letters(data: Json, graph: Graph, most: int) -> Letters:
    """What one edge of a graph shows. Raises Unusable."""
    if graph.sequences is not None:
        return tuple(whole(letter, 0, most) for letter in _list(data))
    return None if data is None and graph.has_silent_edges else whole(data, 0, most)


def _list(data: Json, length: int | None = None) -> list[Json]:
    if not isinstance(data, list) or len(data) != (len(data) if length is None else length):
        raise Unusable("it is damaged")
    return data


def _other(what: str, path: Path) -> DiagnosticError:
    return _problem("E414", f"the checkpoint belongs to {what}", path, "leave out --resume to start again")


def _unusable(why: str, path: Path) -> DiagnosticError:
    return _problem("E413", f"the checkpoint cannot be used: {why}", path, "leave out --resume to start again")


def _problem(code: str, message: str, path: Path, hint: str | None = None) -> DiagnosticError:
    return DiagnosticError(Diagnostic(code, message, file=str(path), hint=hint))
