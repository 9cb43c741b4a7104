"""Arrangements: the validated model, and the loader that makes it from files (imported when first asked for)."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from llfsm_verify.arrangement.loader import build_arrangement, load_arrangement, load_arrangement_text
    from llfsm_verify.arrangement.model import Arrangement

__all__ = ["Arrangement", "build_arrangement", "load_arrangement", "load_arrangement_text"]


def __getattr__(name: str) -> object:
    if name in ("build_arrangement", "load_arrangement", "load_arrangement_text"):
        from llfsm_verify.arrangement import loader

        return getattr(loader, name)
    if name == "Arrangement":
        from llfsm_verify.arrangement.model import Arrangement

        return Arrangement
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
