"""The formats in which other tools write automata."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from llfsm_verify.automata.automaton import Automaton
from llfsm_verify.diagnostics import Source, Span
from llfsm_verify.registry import Registry


@dataclass(frozen=True, slots=True)
class FileAutomaton:
    """An automaton with its name, and the place of each of its atoms' names in the file."""

    name: str | None
    automaton: Automaton
    places: Mapping[str, Span]


class AutomataFormat(Protocol):
    """A reader and a writer. DiagnosticError: E360 wrong, E361 another acceptance than generalised Büchi, E362
    alternation and the like, E363 (of `read_one`) not one automaton."""

    def read(self, source: Source) -> tuple[FileAutomaton, ...]: ...
    def read_one(self, source: Source) -> FileAutomaton: ...
    def is_recognised(self, source: Source) -> bool: ...
    def write(self, automaton: Automaton, name: str | None = None) -> str: ...


AUTOMATA: Registry[AutomataFormat] = Registry("format of automata", (), "llfsm_verify.automata")
HOA = "hoa"
"""The format of property files."""
