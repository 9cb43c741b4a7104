"""A model checker for arrangements of logic-labelled finite-state machines.

`import llfsm_verify as lv` is the front door (docs/api.md). What it gives is imported when it is first asked for, from
the room `api/` and from the values below that `api/` hands out; `__init__.pyi` lists it.

This file has no assertions for pytest to rewrite (PYTEST_DONT_REWRITE): else pytest, which loads our plugin, would warn
where a program imports us before it runs pytest.
"""

from __future__ import annotations


def __getattr__(name: str) -> object:
    from llfsm_verify.lazily import imported

    return imported(__name__, name)


def __dir__() -> list[str]:
    from llfsm_verify.lazily import places

    return sorted({*globals(), *places(__name__)})
