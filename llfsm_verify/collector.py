"""Python's garbage collector, paused: while trees that live on are built, it would look through them again and again;
while another thread works with Z3, it would free terms of that thread.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def paused_collector() -> Iterator[None]:
    """Collect no cycles inside; what is no longer referred to is freed as ever. Also for whole functions."""
    collects = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collects:
            gc.enable()
