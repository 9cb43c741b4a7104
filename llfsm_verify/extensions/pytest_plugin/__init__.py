"""The plugin of pytest, which pytest finds by its own entry point: trace files as tests, and fixtures."""

from __future__ import annotations

from collections.abc import Mapping

from llfsm_verify.plug import Entry

ENTRIES: Mapping[str, tuple[Entry, ...]] = {}
