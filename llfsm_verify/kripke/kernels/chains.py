"""Chains: exploration that steps on while a configuration has one step only.

A chain ends at a configuration with several steps (or one that fails), at a milestone (a configuration that its hash
value marks, so that chains which meet end together), where it returns to its source, and in a loop without any of these
at the configuration with the least hash value there. Loops are noticed by R. Brent's method (An improved Monte Carlo
factorization algorithm, BIT 20, 1980); milestones are the distinguished points of P. van Oorschot and M. Wiener
(Parallel collision search with cryptanalytic applications, J. Cryptology 12, 1999).
"""

from __future__ import annotations

from llfsm_verify.kripke.kernels import blocks as b
from llfsm_verify.kripke.kernels import chain_blocks as c
from llfsm_verify.kripke.kernels.exploration import exploration, label_of
from llfsm_verify.kripke.kernels.sets import equal, hashed, insert
from llfsm_verify.kripke.kernels.words import expand, helper, kernel, load32, load64, store64


@helper
def copy(source: int, target: int, words: int) -> None:
    for i in range(words):
        store64(target, i, load64(source, i))


@helper
def only_step(block: int, chain: int) -> bool:
    """Take the step from CURRENT to STEPS; whether it is the only one, and does not fail."""
    context = load64(chain, c.CONTEXT)
    store64(context, load64(block, b.CONTEXT_SOURCE), 0)
    store64(context, load64(chain, c.CONTEXT_PROCESS), 0)
    store64(context, load64(chain, c.CONTEXT_STEPPED), 0)
    store64(context, load64(chain, c.CONTEXT_PREFIX), 0)
    steps = load64(chain, c.STEPS)
    count = expand(load64(block, b.EXPAND), load64(chain, c.CURRENT), 1, steps, 2, context)
    return count == 1 and load32(steps, b.EDGE_STATUS) == 0


@helper
def word_of(chain: int, length: int) -> int:
    """The number of the word of the first letters of the chain; NO_ROOM when there is none for all its prefixes."""
    words, letters, pair = load64(chain, c.WORDS), load64(chain, c.LETTERS), load64(chain, c.PAIR)
    if load64(words, b.SET_COUNT) + length > load64(words, b.SET_LIMIT):
        return c.NO_ROOM
    word = c.NO_PREFIX
    for i in range(length):
        store64(pair, 0, word << 32 | load64(letters, i))
        word = insert(words, pair, hashed(pair, 1), 1)
    return word


@helper
def follow(block: int, words: int, edge: int, body: int, label: int) -> int:
    """Put the end of the chain that begins with an edge into its body; the label of the whole chain, or NO_ROOM.

    `label` is the letter of the first step. Nothing has changed when there was no room.
    """
    chain, with_edges, with_letters = (
        load64(block, b.CHAINS), load64(block, b.WITH_EDGES) != 0, load64(block, b.WITH_LETTERS) != 0
    )  # fmt: skip
    current, saved, least = load64(chain, c.CURRENT), load64(chain, c.SAVED), load64(chain, c.LEAST)
    steps, letters = load64(chain, c.STEPS), load64(chain, c.LETTERS)
    source = load64(block, b.BATCH) + load32(edge, b.EDGE_SOURCE) * load64(block, b.RECORD) * 8
    successor = steps + load64(block, b.EDGE_BODY)
    outputs = successor + load64(block, b.CONFIGURATION) * 8
    copy(body, current, words)
    store64(letters, 0, label)
    length, saved_at, least_at, least_hash, patience = 1, 0, 0, 0, 0
    while length < c.MAX_CHAIN:
        h = hashed(current, words)
        if h & c.MILESTONE_MASK == 0 or equal(current, source, words):
            break
        if saved_at > 0 and equal(current, saved, words):
            copy(least, current, words)
            length = least_at
            break
        if length - saved_at >= patience:
            copy(current, saved, words)
            saved_at = length
            patience = 2 * length
            copy(current, least, words)
            least_at, least_hash = length, h
        elif h < least_hash:
            copy(current, least, words)
            least_at, least_hash = length, h
        if not only_step(block, chain):
            break
        if with_letters:
            letter = label_of(block, outputs, edge)
            if letter < 0:
                return c.NO_ROOM
            store64(letters, length, letter)
        copy(successor, current, words)
        length += 1
    store64(block, b.SEEN_EDGES, load64(block, b.SEEN_EDGES) + length)
    if with_edges:
        label = word_of(chain, length)
    if label >= 0:
        copy(current, body, words)
    return label


kernel("chains_1")(exploration(1, False, follow))
kernel("chains_2")(exploration(2, False, follow))
kernel("chains_any")(exploration(0, False, follow))
