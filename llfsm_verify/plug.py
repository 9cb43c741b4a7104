"""What an extension, or another package, may know of us besides the front door: the protocols of what can be added.

An engine, a kind of port, a reader and a writer of arrangements, a format of Kripke structures, a model for another
checker, a report, a reader of logs, a format of timelines, a drawing, a target, a world of C, a command and a front end
of the debugger each have a registry, an entry and a protocol here (docs/plugs.md). As in the front door, each name is
imported when it is first asked for; `plug.pyi` lists them. Lint rules have no registry. The functions beside these
(`find_accepting_lasso`, `mask`, `moves_of` and others), which the examples use, may change, and so may what walks step
programs and formulas (`fold`, `op`, `mapped` and others).
"""

from __future__ import annotations

from llfsm_verify.lazily import imported, places


def __getattr__(name: str) -> object:
    return imported(__name__, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *places(__name__)})
