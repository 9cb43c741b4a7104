"""The context: what machine code works with beside the record.

It is an array of 64-bit words in which a caller and the loops keep what is not part of a configuration: the samples of
a step, the values choices have by default, events, and where to resume.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from llfsm_verify.backends.native.layout import WORD_BYTES, Layout
from llfsm_verify.backends.native.paths import heaviest_step, most_samples
from llfsm_verify.program.program import Emit, EventKind, Program, Stmt

ENDED = -3
"""Status of a run in which no process is left."""
EDGE_HEADER = 16
"""Bytes before an edge's record: u32 source, i32 process, i32 status, u32 number of samples, little endian."""

# The words of a context before its tables.
RANDOM = 0  # state of the generator; 0: choices that nothing prescribes have their default
STEP = 1  # number of the step, to tell this step's samples from older ones
SAMPLES = 2  # how many choices the step has read
PREFIX = 3  # how many of them are prescribed by the sample table
EVENTS = 4  # words used in the event table
SOURCE = 5  # expand: index of the record
PROCESS = 6  # expand: the process whose steps are due; run: the one whose turn is next
STEPPED = 7  # expand: some process of this source could step
STATUS = 8  # run: of the last step; expand: BROKEN when an edge was
READ = 9  # how many choices the step had read before its letter
DRAWN = 10  # run: address of the table by which choices are drawn before each step, or 0 (`loops`, draw)
HEADER_WORDS = 11


@dataclass(frozen=True, slots=True)
class ContextLayout:
    """Where the tables of a context begin, in words."""

    samples: int
    """Pairs of a choice's index and its value, in the order of first reading."""
    defaults: int
    stamps: int
    values: int
    events: int
    """Kind, machine, number of arguments, arguments; one event after the other."""
    saved: int
    words: int

    def edge_bytes(self, layout: Layout) -> int:
        """The size of an edge: header, record, as many samples as a step can read."""
        return EDGE_HEADER + layout.record_bytes + WORD_BYTES * (self.defaults - self.samples)

    @staticmethod
    def of(program: Program, layout: Layout, events: Collection[EventKind]) -> ContextLayout:
        def size(statement: Stmt) -> int:
            return 3 + len(statement.args) if isinstance(statement, Emit) and statement.kind in events else 0

        choices = len(program.choices)
        defaults = HEADER_WORDS + 2 * most_samples(program)
        event_table = defaults + 3 * choices
        saved = event_table + (heaviest_step(program, size) if events else 0)
        return ContextLayout(
            HEADER_WORDS, defaults, defaults + choices, defaults + 2 * choices, event_table, saved,
            saved + layout.record_bytes // WORD_BYTES,
        )  # fmt: skip
