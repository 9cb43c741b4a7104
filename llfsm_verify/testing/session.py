"""What the tests of one session share: loaded arrangements, compiled steps and results."""

from __future__ import annotations

import os
from pathlib import Path

from llfsm_verify.arrangement import Arrangement, load_arrangement
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.checking.verdict import Options, Result
from llfsm_verify.diagnostics import Span
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.runtime.stepping.simulation import Simulation
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.verification.verify import verify

Signature = tuple[tuple[str, int, int], ...]


class Session:
    """Loads, compiles and searches once what several tests ask for."""

    def __init__(self) -> None:
        self._arrangements: dict[str, tuple[Signature, Arrangement]] = {}
        self._programs: dict[tuple[str, str], NativeProgram] = {}
        self._results: dict[tuple[object, ...], Result] = {}

    def arrangement(self, path: str | Path, *, named_at: Span | None = None) -> Arrangement:
        """The arrangement at `path`, loaded again when one of its files has changed. Raises DiagnosticError.

        `named_at` is the place in a file where the path stands (`load_arrangement`).
        """
        name = os.path.abspath(path)  # noqa: PTH100 - `..` goes, symbolic links stay as the user wrote them
        known = self._arrangements.get(name)
        if known is not None and known[0] == _signature(known[1]):
            return known[1]
        loaded = load_arrangement(name, named_at=named_at)
        self._arrangements[name] = (_signature(loaded), loaded)
        return loaded

    def simulation(self, arrangement: Arrangement) -> Simulation:
        """A simulation at its beginning."""
        key = (arrangement.path, arrangement.digest)
        if key not in self._programs:
            self._programs[key] = NativeProgram(lower(arrangement), events=True)
        return Simulation(self._programs[key])

    def result(self, arrangement: Arrangement, properties: PropertySet, options: Options, engine: str) -> Result:
        """Verdicts, searched for once. What has no limit in seconds or bytes is the same each time; all is kept."""
        asked = tuple((p.name, p.kind, p.text, p.syntax, p.span.source.name) for p in properties)
        automata = tuple(_stamp(Path(p.span.source.name).parent / p.file) for p in properties if p.file is not None)
        key = (arrangement.path, arrangement.digest, asked, automata, options, engine)
        if key not in self._results:
            result = verify(arrangement, properties, options, engine)
            if result.interrupted:
                raise KeyboardInterrupt  # the user means pytest, not this search
            self._results[key] = result
        return self._results[key]


def _signature(arrangement: Arrangement) -> Signature:
    """The files that the arrangement was read from, as they are now."""
    files = {arrangement.path, *(state.span.source.name for m in arrangement.texts for state in m.states)}
    return tuple(_stamp(name) for name in sorted(files))


def _stamp(path: str | Path) -> tuple[str, int, int]:
    try:
        status = Path(path).stat()
    except OSError:
        return str(path), 0, -1
    return str(path), status.st_mtime_ns, status.st_size
