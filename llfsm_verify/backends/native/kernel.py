"""The LLVM module of a step program: its blocks, put together to steps."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from llfsm_verify.backends.native.code import BROKEN, DECLARATIONS, FunctionText
from llfsm_verify.backends.native.context import EDGE_HEADER, ENDED, READ, SAMPLES, WORDS, ContextLayout, statements
from llfsm_verify.backends.native.layout import WORD_BYTES, Layout
from llfsm_verify.backends.native.loops import RUN, emit_function, fill, llvm_source
from llfsm_verify.limits import tick
from llfsm_verify.program.program import INT64_MAX, Block, Emit, EventKind, Process, Program, Slot

INLINED_LINES = 4000
"""A module with more lines of text keeps its blocks as functions, so that compiling stays linear."""


def _file(name: str) -> str:
    return llvm_source("llfsm_verify.backends.native", f"{name}.ll")


class ModuleText:
    """Writes the module of one program: `text`. It exports `step`, `expand` and `run`."""

    def __init__(self, program: Program, layout: Layout, context: ContextLayout, events: Collection[EventKind]) -> None:
        self._program = program
        self._layout = layout
        self._context = context
        self._events = events
        self._choices = {c.name: i for i, c in enumerate(program.choices)}
        self._functions: list[str] = []
        self._known: dict[str, str] = {}
        self._fallible: set[str] = set()
        self._arities: set[int] = set()
        self._divides_wide = False
        blocks = self._blocks()
        lines = sum(f.count("\n") for f in self._functions)
        drivers = [*self._drivers(blocks), *self._loops()]
        inlining = "" if lines <= INLINED_LINES else "noinline "
        self.text = "\n".join(
            [
                DECLARATIONS,
                *([_file("quotient")] if self._divides_wide else []),
                *self._helpers(),
                *self._functions,
                *drivers,
                f"attributes #0 = {{ {inlining}nounwind willreturn norecurse }}",
                "attributes #1 = { nounwind }",
            ]
        )

    # ------------------------------------------------------------ functions of blocks

    def _writer(self) -> FunctionText:
        return FunctionText(self._layout, self._choices, self._events)

    def _define(self, writer: FunctionText, prefix: str, *, fallible: bool = False) -> str:
        """The name of the function with this body; equal bodies are one function."""
        body = writer.text()
        known = self._known.get(body)
        if known is None:
            known = self._known[body] = f"@{prefix}{len(self._functions)}"
            self._functions.append(f"define internal i32 {known}(ptr noalias %r, ptr noalias %c) #0 {body}")
            self._arities |= writer.emitted_arities
            self._divides_wide = self._divides_wide or writer.divides_wide
            if fallible or writer.can_fail:
                self._fallible.add(known)
        return known

    def _function(self, block: Block) -> str | None:
        """The function of a block, None when it does nothing."""
        if all(isinstance(s, Emit) and s.kind not in self._events for s in statements(block)):
            return None
        tick()
        writer = self._writer()
        writer.block(block)
        writer.line("ret i32 0")
        return self._define(writer, "block")

    def _blocks(self) -> dict[int, str | None]:
        """The functions of all blocks, by the identity of the block."""
        program = self._program
        blocks: list[Block] = [program.letter, program.letter_stutter, *(p.epilogue for p in program.processes)]
        for slot in program.slots:
            blocks += [slot.prologue, *slot.blocks, slot.epilogue, slot.canonical]
        functions: dict[int, str | None] = {}
        for block in blocks:
            if id(block) not in functions:
                functions[id(block)] = self._function(block)
        return functions

    # ------------------------------------------------------------ from blocks to steps

    def _call(self, writer: FunctionText, function: str | None) -> None:
        """Call a function; return its status when that is not 0."""
        if function is None:
            return
        status = writer.name(f"call i32 {function}(ptr %r, ptr %c)")
        if function in self._fallible:
            failed, after = writer.new_label(), writer.new_label()
            good = writer.name(f"icmp eq i32 {status}, 0")
            writer.line(f"br i1 {good}, label %{after}, label %{failed}")
            writer.start_label(failed)
            writer.line(f"ret i32 {status}")
            writer.start_label(after)

    def _dispatch(self, writer: FunctionText, variable: str, functions: list[str | None]) -> None:
        """Call the function whose index is the variable's value."""
        value = writer.load(variable).text
        labels, join = [writer.new_label() for _ in functions], writer.new_label()
        table = " ".join(f"i64 {i}, label %{label}" for i, label in enumerate(labels))
        otherwise = writer.new_label()
        writer.line(f"switch i64 {value}, label %{otherwise} [{table}]")
        writer.start_label(otherwise)
        writer.line(f"ret i32 {BROKEN}")
        for label, function in zip(labels, functions, strict=True):
            writer.start_label(label)
            self._call(writer, function)
            writer.line(f"br label %{join}")
        writer.start_label(join)

    def _drivers(self, blocks: dict[int, str | None]) -> list[str]:
        program = self._program
        processes = [self._process(p, blocks) for p in program.processes]
        writer = self._writer()
        if program.observe == "cycle":
            due, kept = writer.new_label(), writer.new_label()
            closing = writer.truth(writer.load(program.cycle))
            stutter = writer.name(f"icmp uge i64 %p, {len(processes)}")
            writer.line(f"br i1 {writer.name(f'or i1 {closing}, {stutter}')}, label %{due}, label %{kept}")
            writer.start_label(due)
            self._reset_outputs(writer)
            writer.line(f"br label %{kept}")
            writer.start_label(kept)
        else:
            self._reset_outputs(writer)
        labels, rest = [writer.new_label() for _ in processes], writer.new_label()
        table = " ".join(f"i64 {i}, label %{label}" for i, label in enumerate(labels))
        writer.line(f"switch i64 %p, label %{rest} [{table}]")
        for label, function in zip(labels, processes, strict=True):
            writer.start_label(label)
            self._call(writer, function)
            writer.line("ret i32 0")
        writer.start_label(rest)
        self._call(writer, blocks[id(program.letter_stutter)])
        writer.line("ret i32 0")
        return [f"define internal i32 @ringlet(ptr noalias %r, ptr noalias %c, i64 %p) #1 {writer.text()}"]

    def _process(self, process: Process, blocks: dict[int, str | None]) -> str:
        writer = self._writer()
        slots: list[str | None] = [self._slot(self._program.slots[i], process, blocks) for i in process.slots]
        self._dispatch(writer, process.turn, slots)
        writer.line("ret i32 0")
        return self._define(writer, "process", fallible=True)

    def _slot(self, slot: Slot, process: Process, blocks: dict[int, str | None]) -> str:
        writer = self._writer()
        called = [blocks[id(slot.prologue)]]
        self._call(writer, called[0])
        states = [blocks[id(b)] for b in slot.blocks]
        self._dispatch(writer, slot.state, states)
        for block in (slot.epilogue, process.epilogue, slot.canonical):
            self._call(writer, blocks[id(block)])
        self._count_read(writer)
        self._call(writer, blocks[id(self._program.letter)])
        writer.line("ret i32 0")
        return self._define(writer, "slot", fallible=True)

    def _count_read(self, writer: FunctionText) -> None:
        """Keep how many choices the ringlet has read: the letter after it shows more."""
        places = [writer.name(f"getelementptr i64, ptr %c, i64 {word}") for word in (SAMPLES, READ)]
        writer.line(f"store i64 {writer.name(f'load i64, ptr {places[0]}')}, ptr {places[1]}")

    def _reset_outputs(self, writer: FunctionText) -> None:
        inits = {v.name: v.init for v in self._program.vars if v.output}
        data = self._layout.encode_outputs(inits)
        for i in range(self._layout.output_words):
            word = int.from_bytes(data[i * WORD_BYTES : (i + 1) * WORD_BYTES], "little", signed=True)
            pointer = writer.name(f"getelementptr i64, ptr %r, i64 {self._layout.words + i}")
            writer.line(f"store i64 {word}, ptr {pointer}")

    # ------------------------------------------------------------ helpers

    def _helpers(self) -> list[str]:
        choices = self._program.choices
        context = self._context

        def table(name: str, values: Iterable[int]) -> str:
            numbers = [f"i64 {v if v <= INT64_MAX else v - (1 << 64)}" for v in values] or ["i64 0"]
            return f"@{name} = internal constant [{len(numbers)} x i64] [{', '.join(numbers)}]"

        sizes = ((c.type.high - c.type.low + 1) & (1 << 64) - 1 for c in choices)
        places = {
            "SAMPLES": context.samples, "DEFAULTS": context.defaults, "STAMPS": context.stamps,
            "VALUES": context.values, "EVENTS": context.events, "CHOICES": len(choices),
        }  # fmt: skip
        emits = [emit_function(n, context.events) for n in sorted(self._arities)]
        return [
            table("lows", (c.type.low for c in choices)),
            table("highs", (c.type.high for c in choices)),
            table("sizes", sizes),
            fill(_file("choices"), WORDS | places),
            *emits,
        ]

    def _loops(self) -> list[str]:
        program, layout, context = self._program, self._layout, self._context
        cycle = self._writer()
        cycle.line(f"ret i1 {cycle.truth(cycle.load(program.cycle))}")
        record = layout.record_bytes
        numbers = {
            "RECORD": record, "EDGE": context.edge_bytes(layout), "PROCESSES": len(program.processes),
            "BODY": EDGE_HEADER, "TAIL": EDGE_HEADER + record, "SAMPLES": context.samples, "SAVED": context.saved,
            "BROKEN": BROKEN, "ENDED": ENDED,
        }  # fmt: skip
        return [
            self._enabled(),
            f"define internal i1 @cycle(ptr noalias %r) #1 {cycle.text()}",
            fill(_file("steps"), WORDS | numbers),
            fill(RUN, numbers),
        ]

    def _enabled(self) -> str:
        """Whether a process may step."""
        writer = self._writer()
        labels, rest = [writer.new_label() for _ in self._program.processes], writer.new_label()
        table = " ".join(f"i64 {i}, label %{label}" for i, label in enumerate(labels))
        writer.line(f"switch i64 %p, label %{rest} [{table}]")
        for label, process in zip(labels, self._program.processes, strict=True):
            writer.start_label(label)
            if process.ended is None:
                writer.line("ret i1 true")
            else:
                writer.line(f"ret i1 {writer.name(f'xor i1 {writer.truth(writer.load(process.ended))}, true')}")
        writer.start_label(rest)
        writer.line("ret i1 false")
        return f"define internal i1 @enabled(ptr noalias %r, i64 %p) #1 {writer.text()}"
