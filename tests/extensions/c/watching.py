"""Images with monitors, built by a compiler of this machine, and what Python says of the same letters."""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.diagnostics import Source
from llfsm_verify.extensions.c.image import MARK, Image
from llfsm_verify.extensions.c.numbers import stored_as
from llfsm_verify.extensions.c.target import image_for
from llfsm_verify.kripke.observing import initial_atoms
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.monitoring.properties import Timing, monitor_properties
from llfsm_verify.monitoring.states import Monitor, MonitorVerdict
from llfsm_verify.targets.images import image_of
from llfsm_verify.targets.monitors import watched
from tests.extensions.c.compiled import compile_strictly

VERDICTS = (MonitorVerdict.NOT_YET, MonitorVerdict.TRUE, MonitorVerdict.FALSE)
Change = Callable[[str], str]
"""Of the source of monitors."""


def asked(text: str) -> PropertySet:
    """The properties of a text."""
    return parse_properties([Source("p.ltl", text)])


def guarded(given: Arrangement, properties: str | PropertySet, optimize: str = "speed") -> Image:
    """The image of an arrangement with monitors."""
    lines = asked(properties) if isinstance(properties, str) else properties
    image = image_of(given)
    return image_for(image, (), watched(given, image, lines, optimize))


def _driver(image: Image) -> str:
    """C that takes inputs, and tells of monitors, as words."""
    p, inputs = image.prefix, image.names.inputs
    sizes = [f"size_t {n}_size(void);\nsize_t {n}_size(void) {{ return sizeof({p}_{n}); }}" for n in
             ("state", "inputs", "monitors")]  # fmt: skip
    taken = [f"i->{inputs[c.name]} = ({stored_as(c.type)})words[{k}];" for k, c in enumerate(image.program.choices)]
    free = [
        f"s->{f.path}{'' if f.var.length is None else f'[{k}]'} = ({f.type})*words++;"
        for f in image.names.fields.values() if f.var.free for k in range(f.var.length or 1)
    ]  # fmt: skip
    verdict = f"{p}_monitors_verdict(m, ({p}_property)i)"
    return "\n".join(
        [
            f'#include "{p}_monitors.h"', *sizes,
            f"void take(const uint64_t *words, {p}_inputs *i);",
            f"void take(const uint64_t *words, {p}_inputs *i) {{ (void)words; (void)i; {' '.join(taken)} }}",
            f"void free_values(const uint64_t *words, {p}_state *s);",
            f"void free_values(const uint64_t *words, {p}_state *s) {{ (void)words; (void)s; {' '.join(free)} }}",
            f"void told(const {p}_monitors *m, uint32_t *words);",
            f"void told(const {p}_monitors *m, uint32_t *words)\n{{\n    uint32_t i;\n    words[0] = m->step;",
            f"    for (i = 0; i < {p}_PROPERTIES; i++) {{\n        words[1 + 2 * i] = {verdict};",
            "        words[2 + 2 * i] = m->decided[i];\n    }\n}\n",
        ]
    )  # fmt: skip


class Board:
    """An image with monitors as a shared library. `change`: of the source of the monitors, to plant mistakes."""

    def __init__(self, image: Image, *flags: str, change: Change = str, compiler: str = "gcc") -> None:
        assert image.monitors is not None
        self.image, p = image, image.prefix
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            texts = {f"{p}.c": image.source(), f"{p}.h": image.header(), **image.monitors.files(MARK)}
            texts[f"{p}_monitors.c"] = change(texts[f"{p}_monitors.c"])
            texts["driver.c"] = _driver(image)
            for name, text in texts.items():
                (folder / name).write_text(text)
            sources = [name for name in texts if name.endswith(".c")]
            for source in sources:
                compile_strictly(compiler, folder / source, folder / f"{source}.o", "-fPIC", *flags)
            command = [compiler, "-shared", *flags, *(f"{source}.o" for source in sources), "-o", "lib.so"]
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
            assert done.returncode == 0, done.stderr
            self.library = ctypes.CDLL(str(folder / "lib.so"))
        self.sizes = {n: self.library[f"{n}_size"]() for n in ("state", "inputs", "monitors")}
        self._state, self._inputs, self._monitors = (ctypes.create_string_buffer(n) for n in self.sizes.values())

    def _call(self, what: str, *given: object) -> int:
        call = getattr(self.library, f"{self.image.prefix}_{what}")
        call.restype = ctypes.c_int16
        return int(call(*given))

    def start(self, free: Sequence[int] = ()) -> None:
        """The beginning, with these values of inputs that never change."""
        self._call("init", self._state)
        if free:
            self.library.free_values((ctypes.c_uint64 * len(free))(*(v & (1 << 64) - 1 for v in free)), self._state)
        self._call("monitors_init", self._monitors, self._state)

    def go(self, choices: Mapping[str, int], *, cycle: bool = False) -> int:
        """A ringlet or a cycle with these inputs, and its status."""
        words = [choices[c.name] & (1 << 64) - 1 for c in self.image.program.choices]
        self.library.take((ctypes.c_uint64 * max(1, len(words)))(*words), self._inputs)
        if cycle:
            return self._call("monitored_cycle", self._monitors, self._state, self._inputs)
        status = self._call("step", self._state, self._inputs)
        if status == 0:
            self._call("monitors_step", self._monitors, self._state)
        return status

    def told(self) -> tuple[int, list[tuple[MonitorVerdict, int]]]:
        """The steps so far, and of each property its verdict and its step."""
        assert self.image.monitors is not None
        count = len(self.image.monitors.walks)
        words = (ctypes.c_uint32 * (1 + 2 * count))()
        self.library.told(self._monitors, words)
        return words[0], [(VERDICTS[words[1 + 2 * i]], words[2 + 2 * i]) for i in range(count)]


class Letters:
    """The letters of the same run by the executor, with a program of its own, and monitors that read them."""

    def __init__(self, given: Arrangement, properties: PropertySet) -> None:
        self.problem: Problem = bind(image_of(given), properties)
        self.program = self.problem.program(keep_all_bits=True)
        self._native = NativeProgram(self.program, effort="quick")
        self.monitors: list[Monitor] = [
            monitor_properties(line, self.problem.assumptions, Timing(self.problem.clock)).monitor
            for line in self.problem.properties
        ]
        self.record = b""
        self.step = 0
        self.read: list[frozenset[str]] = []

    def start(self, free: Mapping[str, int] | None = None) -> None:
        """The beginning."""
        self.record, self.step, self.read = self._native.layout.first(free or {}), 0, []
        letter = initial_atoms(self.program, self._native.layout, self.record)
        self.read.append(frozenset(name for name, true in letter.items() if true))
        self.states = [m.step(0, m.letter(self.read[0])) for m in self.monitors]
        self.decided = [0] * len(self.states)

    @property
    def ended(self) -> bool:
        return not self._native.enabled(self.record)

    def go(self, choices: Mapping[str, int]) -> int:
        """A ringlet; `choices` by what users call them."""
        own = {c.name: choices[c.source] for c in self.program.choices}
        result = self._native.step(self.record, 0, own)
        if result.status == 0:
            self.record = result.record
            values = self._native.layout.decode_record(self.record)
            if self.program.observe == "ringlet" or values[self.program.cycle]:
                self.step += 1
                self.read.append(frozenset(a.name for a in self.program.atoms if values[a.output]))
                for i, m in enumerate(self.monitors):
                    before, self.states[i] = self.states[i], m.step(self.states[i], m.letter(self.read[-1]))
                    if m.verdicts[before] is not m.verdicts[self.states[i]]:
                        self.decided[i] = self.step
        return result.status

    @property
    def cycle_is_over(self) -> bool:
        return bool(self._native.layout.decode_record(self.record)[self.program.cycle])

    def told(self) -> tuple[int, list[tuple[MonitorVerdict, int]]]:
        """As `Board.told`."""
        verdicts = [m.verdicts[q] for m, q in zip(self.monitors, self.states, strict=True)]
        return self.step, list(zip(verdicts, self.decided, strict=True))
