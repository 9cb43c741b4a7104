"""The words of letters that edges of a graph of chains show, kept as a trie: a word is a shorter one and a letter."""

from __future__ import annotations

from array import array
from collections.abc import Sequence

from llfsm_verify.kripke.memory import Region

WORD_BYTES = 8
NO_PREFIX = 0xFFFFFFFF
"""The prefix of a word of one letter."""


class Sequences:
    """Words by number. Number i lies in 64 bits of `trie`: the number of its prefix (high half; NO_PREFIX: none) and
    that of its last letter in `alphabet`. A prefix has a smaller number than the words that go on from it."""

    def __init__(self, alphabet: Sequence[int], trie: Region) -> None:
        self._alphabet = alphabet
        self._trie = trie
        self.count = 0

    def __len__(self) -> int:
        return self.count

    def __getitem__(self, word: int) -> tuple[int, ...]:
        """The letters of a word, as masks."""
        letters = []
        while word != NO_PREFIX:
            pair = int.from_bytes(self._trie.read(WORD_BYTES * word, WORD_BYTES), "little")
            letters.append(self._alphabet[pair & NO_PREFIX])
            word = pair >> 32
        return tuple(reversed(letters))

    def pairs(self) -> array[int]:
        """Prefix and last letter of each word, as they lie in memory."""
        return array("Q", self._trie.read(0, WORD_BYTES * self.count))
