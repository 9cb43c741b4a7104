"""The ports of `llfsm run`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from llfsm_verify.runtime.live.loop import LiveCode
from llfsm_verify.runtime.live.slots import inputs_of, slots_of
from llfsm_verify.runtime.ports.file import read_ports
from llfsm_verify.runtime.ports.line_port import STANDARD_INPUT, STANDARD_OUTPUT
from llfsm_verify.runtime.ports.port import PortSpec
from llfsm_verify.runtime.ports.ports import Ports
from llfsm_verify.runtime.whiteboard.shared import Shared


def declared_ports(path: str | None, code: LiveCode) -> tuple[PortSpec, ...]:
    """The ports in a file, if there is one. DiagnosticError: see `read_ports`."""
    if path is None:
        return ()
    return read_ports(path, inputs_of(code.program), slots_of(code))


def unusable(specs: Sequence[PortSpec], held: Mapping[str, str], arrangement: str) -> str | None:
    """What other options say that does not go with the ports; None: nothing."""
    for spec in specs:
        twice = next((name for name in spec.inputs if name in held), None)
        if twice is not None:
            return f"--set {twice}: port `{spec.name}` feeds it"
        if arrangement == "-" and STANDARD_INPUT in spec.holds:
            return "standard input cannot be both the arrangement and what a port reads"
    return None


def following(ports: Ports) -> Callable[[Shared], None]:
    """What lets ports serve another run."""
    return lambda shared: ports.follow(shared.posts, shared.segment.newest, slots_of(shared.loop.code))


def writes_to_output(specs: Sequence[PortSpec]) -> bool:
    """Whether standard output belongs to a port."""
    return any(STANDARD_OUTPUT in spec.holds for spec in specs)


@contextmanager
def opened(
    specs: Sequence[PortSpec], shared: Shared, stop: Callable[[], object], recording: str | None
) -> Iterator[Ports | None]:
    """The ports of a run, none where none is declared. They are opened when the processes of the run have been forked,
    so that these inherit none of their descriptors.

    DiagnosticError: one cannot be opened (E495); the recording, in which nothing is yet, is removed.
    """
    if not specs:
        yield None
        return
    code = shared.loop.code
    try:
        ports = Ports(
            specs, shared.posts, shared.segment.newest, slots_of(code),
            period=shared.segment.period / 1e9, stop=stop,
            say=lambda what: print(what, file=sys.stderr, flush=True),
        )  # fmt: skip
    except BaseException:
        if recording is not None:
            Path(recording).unlink(missing_ok=True)
        raise
    try:
        yield ports
    finally:
        ports.finish("died")  # where nothing better was said before
