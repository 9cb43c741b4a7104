"""Monitors in machine code that read many letters at once."""

from __future__ import annotations

import ctypes
from collections.abc import Iterable, Mapping, Sequence

from llfsm_verify.backends.native.layout import WORD_BITS, WORD_BYTES
from llfsm_verify.backends.native.machine_code import MachineCode
from llfsm_verify.monitoring.code import atom_places, by_word, letters_text, monitor_text
from llfsm_verify.monitoring.lookup import Stepping, walk_table

PORTION = 1 << 17
"""Letters in one native call, so that Ctrl-C is served soon."""


class CompiledMonitors:
    """Several monitors that read the same letters, compiled for this computer.

    A letter is as many 64-bit words as `atoms` need, little endian: bit i of the first word is atom i. A monitor is
    *settled* in a state that is never left: it has its verdict, or can have none any more.
    """

    def __init__(self, monitors: Mapping[str, Stepping], atoms: Sequence[str] | None = None) -> None:
        """`atoms` are what letters show (by default what the monitors read, in their order). ValueError: one that a
        monitor reads is missing; MonitorTooLarge: a monitor's tables would have too many entries."""
        own = dict.fromkeys(key for monitor in monitors.values() for key in monitor.atoms)
        self.names = tuple(monitors)
        self.atoms = tuple(own if atoms is None else atoms)
        self.letter_words = max(1, -(-len(self.atoms) // WORD_BITS))
        self._tables = [walk_table(monitor) for monitor in monitors.values()]
        places = by_word(self.atoms)
        text = monitor_text(self._tables, [atom_places(m.atoms, places) for m in monitors.values()])
        text = "\n".join([text, letters_text(self._tables, self.letter_words)])
        self._code = MachineCode(lambda: text, "thorough")
        i64, pointer = ctypes.c_int64, ctypes.c_void_p
        self._letters = ctypes.CFUNCTYPE(i64, pointer, i64, pointer)(self._code.address("letters"))
        self._states = (ctypes.c_int64 * max(1, len(self._tables)))()
        self._back = [table.states for table in self._tables]
        self.read = 0
        """Letters read so far."""
        self.settled: dict[str, int] = {}
        """The monitors that are settled, each with the number of letters read until then."""
        self.reset()

    def reset(self) -> None:
        """Begin anew, before the first letter."""
        self.read = 0
        for k, table in enumerate(self._tables):
            self._states[k] = table.numbers[0]
        self.settled = {}
        self._note()

    @property
    def states(self) -> dict[str, int]:
        """The state of each monitor, by its own numbers."""
        return {name: self._back[k][self._states[k]] for k, name in enumerate(self.names)}

    def pack(self, letters: Iterable[int]) -> bytes:
        """Letters given as masks over `atoms`, as `feed` reads them."""
        return b"".join(letter.to_bytes(self.letter_words * WORD_BYTES, "little") for letter in letters)

    def feed(self, letters: bytes | bytearray | memoryview, *, stop: bool = False) -> int:
        """Read letters that lie one after the other; `stop` as soon as a monitor becomes settled.

        Returns how many were read. ValueError: no whole number of letters.
        """
        view = memoryview(letters).cast("B")
        size = self.letter_words * WORD_BYTES
        if len(view) % size:
            raise ValueError(f"a letter takes {size} bytes, and there are {len(view)}")
        count, done = len(view) // size, 0
        data = bytes(view)
        base = ctypes.cast(ctypes.c_char_p(data), ctypes.c_void_p).value or 0
        while done < count:
            ran = self._letters(base + done * size, min(PORTION, count - done), self._states)
            done += ran
            self.read += ran
            if self._note() and stop:
                break
        return done

    def _note(self) -> bool:
        """Write down which monitors are newly settled; whether there are some."""
        new = False
        for k, (name, table) in enumerate(zip(self.names, self._tables, strict=True)):
            if name not in self.settled and self._states[k] >= table.settled:
                self.settled[name] = self.read
                new = True
        return new
