"""The context: what machine code works with beside the record.

It is an array of 64-bit words in which a caller and the loops keep what is not part of a configuration: the samples of
a step, the values choices have by default, events, and where to resume. How large it has to be follows from what a path
through a block can do at most, found without running it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass

from llfsm_verify.backends.native.layout import WORD_BYTES, Layout
from llfsm_verify.program.program import Block, Emit, EventKind, If, Program, Sample, Stmt, Switch


def statements(block: Block) -> Iterator[Stmt]:
    """Every statement of a block, nested ones included, in textual order."""
    todo: list[Stmt] = list(reversed(block))
    while todo:
        statement = todo.pop()
        yield statement
        for inner in reversed(branches(statement)):
            todo.extend(reversed(inner))


def branches(statement: Stmt) -> tuple[Block, ...]:
    """The blocks of which a statement runs one."""
    match statement:
        case If(_, then, otherwise):
            return then, otherwise
        case Switch(_, cases, default):
            return (*(block for _, block in cases), default)
        case _:
            return ()


def heaviest(block: Block, weight: Callable[[Stmt], int]) -> int:
    """The largest total `weight` of the statements on a path through a block."""
    # Each frame: what is left of the block, the total so far, the largest total of its finished sibling blocks.
    frames: list[tuple[Iterator[Stmt], list[int], list[Block]]] = [(iter(block), [0, 0], [])]
    while True:
        left, totals, siblings = frames[-1]
        statement = next(left, None)
        if statement is not None:
            totals[0] += weight(statement)
            inner = [b for b in branches(statement) if b]
            if inner:
                frames.append((iter(inner.pop()), [0, 0], inner))
            continue
        totals[1] = max(totals[1], totals[0])
        if siblings:
            frames[-1] = (iter(siblings.pop()), [0, totals[1]], siblings)
            continue
        frames.pop()
        if not frames:
            return totals[1]
        frames[-1][1][0] += totals[1]


def heaviest_step(program: Program, weight: Callable[[Stmt], int]) -> int:
    """A bound of the total `weight` of the statements of one step."""

    def total(block: Block) -> int:
        return heaviest(block, weight)

    letter = total(program.letter)
    bound = total(program.letter_stutter)
    for process in program.processes:
        fixed = total(process.epilogue) + letter
        for slot in (program.slots[i] for i in process.slots):
            block = max((total(b) for b in slot.blocks), default=0)
            bound = max(bound, fixed + total(slot.prologue) + block + total(slot.epilogue) + total(slot.canonical))
    return bound


def most_samples(program: Program) -> int:
    """A bound of the number of different choices that one step reads."""
    return min(len(program.choices), heaviest_step(program, lambda s: int(isinstance(s, Sample))))


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
WORDS = {
    "C.STEP": STEP, "C.SAMPLES": SAMPLES, "C.PREFIX": PREFIX, "C.EVENTS": EVENTS, "C.SOURCE": SOURCE,
    "C.PROCESS": PROCESS, "C.STEPPED": STEPPED, "C.STATUS": STATUS, "C.DRAWN": DRAWN,
}  # fmt: skip
"""As they are called in files of LLVM text."""


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
