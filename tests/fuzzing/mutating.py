"""Mutations of texts and of documents: what people and programs get wrong, and what nobody would write."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from random import Random

TOKEN = re.compile(r"\w+|\s+|[^\w\s]")
NUMBERS = (
    "0", "1", "2", "-1", "007", "0x10", "0b1", "1e9", "1.5", "64", "65", "255", "256", "1000", "1001", "65535", "65536",
    "100000", "2147483648", "4294967296", "9223372036854775807", "9223372036854775808", "18446744073709551616",
    "9" * 40, "9" * 5000, "1_000", "²", "٣", "½",
)  # fmt: skip
ODD = (
    "\0", "\x01", "\x07", "\x1b[31m", "\x7f", "\x80", "\x85", "\xa0", "\xad", "\u200b", "\u200e", "\u202e", "\u2028",
    "\u2029", "\u2066", "\ufeff", "\ufffd", "\uffff", "\U0001f600", "\U000e0001", "e\u0301", "ß", "İ", "ﬁ", "Ⅷ",
    "\udcff", "\udc80", "\udced\udca0\udc80", "\v", "\f", "\x1c", "\r",
)  # fmt: skip
YAML_WORDS = (
    "&a ", "*a", "&a &b ", "!!str ", "!!int ", "!x ", "!<x> ", "!!python/object/apply:os.system ", "? ", "- ", ": ",
    "<<: *a", "|\n", ">-\n", "|9\n", "---\n", "...\n", "%YAML 1.1\n", "%TAG ! x\n", "{", "}", "[", "]", "'", '"', "~",
    "null", "# ", "=", '"\\x00"', '"\\uD800"', '"\\e[31m"', "{a: *a}", "&a [*a]",
)  # fmt: skip
BRACKETS = (("(", ")"), ("[", "]"), ("{", "}"), ("", "}"), ("!", ""), ("-", ""), ("not ", ""), ("X ", ""), ("- ", ""))
DEPTHS = (2, 10, 63, 64, 65, 199, 200, 201, 500, 1000, 3000, 20000)
LARGEST = 1 << 20
SIGNS = ("+", "-", "*", "/", "%", "<", ">", "==", "!=", "&&", "||", "<=", ">=")
GENTLE = re.compile(r"\w+|\s+|==|!=|&&|\|\||<=|>=|->|[^\w\s]")
Tree = object
"""Mappings, lists and strings (and numbers, in JSON)."""


@dataclass(frozen=True, slots=True)
class Words:
    """What mutations put in: `words` of the language, and `others`, texts to splice with."""

    words: Sequence[str]
    others: Sequence[str]


Mutation = Callable[[Random, str, Words], str]


def mutate_text(random: Random, text: str, words: Words) -> str:
    """`text` after one to six mutations."""
    for _ in range(random.choice((1, 1, 1, 2, 2, 3, 6))):
        mutation = random.choices(MUTATIONS, WEIGHTS)[0]
        text = mutation(random, text, words)[:LARGEST]
    return text


def mutate_gently(random: Random, text: str) -> str:
    """`text` with one to three numbers, signs or words replaced by others of their kind that stand in it."""
    tokens = GENTLE.findall(text)
    kinds: dict[str, list[int]] = {"number": [], "sign": [], "word": []}
    for i, token in enumerate(tokens):
        kind = "number" if token.isdigit() else "sign" if token in SIGNS else "word" if token.isidentifier() else ""
        if kind:
            kinds[kind].append(i)
    for _ in range(random.choice((1, 1, 2, 3))):
        kind = random.choice(("number", "number", "sign", "word"))
        if not kinds[kind]:
            continue
        at, other = random.choice(kinds[kind]), tokens[random.choice(kinds[kind])]
        near = {"number": (other, "0", "1", "2", "3", "7", "16", "255"), "sign": SIGNS, "word": (other,)}
        tokens[at] = random.choice(near[kind])
    return "".join(tokens)


def mutate_leaf(random: Random, tree: Tree) -> Tree:
    """A document with one to three numbers, texts or constants replaced by others of it, or by what is next to them."""
    leaves = [path for path in places(tree) if not isinstance(at(tree, path), dict | list)]
    for _ in range(random.choice((1, 1, 2, 3)) if leaves else 0):
        path, other = random.choice(leaves), at(tree, random.choice(leaves))
        node = at(tree, path)
        if isinstance(node, int) and random.random() < 0.6:
            tree = _put(tree, path, node + random.choice((1, -1)))
        elif isinstance(node, str) and random.random() < 0.6:
            tree = _put(tree, path, mutate_gently(random, node))
        else:
            tree = _put(tree, path, other)
    return tree


def mutate_bytes(random: Random, data: bytes) -> bytes:
    """`data` after one to four mutations that know nothing of text."""
    found = bytearray(data)
    for _ in range(random.choice((1, 1, 2, 4))):
        at = random.randrange(len(found) + 1)
        match random.randrange(4):
            case 0 if at < len(found):
                found[at] ^= 1 << random.randrange(8)
            case 1:
                found[at : at + random.choice((1, 4, 50))] = b""
            case 2:
                found[at:at] = random.randbytes(random.choice((1, 2, 8)))
            case _:
                start = random.randrange(len(found) + 1)
                found[at:at] = found[start : start + random.choice((1, 16, 300))]
    return bytes(found)


# ---------------------------------------------------------------- texts


def _span(random: Random, text: str, longest: int = 40) -> tuple[int, int]:
    start = random.randrange(len(text) + 1)
    return start, min(len(text), start + random.randint(0, longest))


def _cut(random: Random, text: str, _: Words) -> str:
    start, end = _span(random, text)
    return text[:start] + text[end:]


def _truncate(random: Random, text: str, _: Words) -> str:
    return text[: random.randrange(len(text) + 1)]


def _flip(random: Random, text: str, _: Words) -> str:
    if not text:
        return text
    at = random.randrange(len(text))
    return text[:at] + chr(ord(text[at]) % 0xD000 ^ 1 << random.randrange(8)) + text[at + 1 :]


def _lines(random: Random, text: str, _: Words) -> str:
    lines = text.split("\n")
    at, to = random.randrange(len(lines)), random.randrange(len(lines))
    match random.randrange(5):
        case 0:
            lines.insert(to, lines[at])
        case 1:
            del lines[at]
        case 2:
            lines[at], lines[to] = lines[to], lines[at]
        case 3:
            lines[at] = " " * random.choice((1, 2, 3, 4)) + lines[at]
        case _:
            lines[at] = lines[at][random.choice((1, 2, 4)) :]
    return "\n".join(lines)


def _tokens(random: Random, text: str, words: Words) -> str:
    tokens = TOKEN.findall(text)
    solid = [i for i, token in enumerate(tokens) if not token.isspace()]
    if not solid:
        return text + random.choice(words.words)
    at, to = random.choice(solid), random.choice(solid)
    match random.randrange(6):
        case 0 | 1:
            tokens[at] = random.choice(words.words)
        case 2:
            tokens[at] = tokens[to]
        case 3:
            tokens[at], tokens[to] = tokens[to], tokens[at]
        case 4:
            tokens.insert(at, random.choice((random.choice(words.words), tokens[to])) + " ")
        case _:
            del tokens[at]
    return "".join(tokens)


def _number(random: Random, text: str, _: Words) -> str:
    places = [m.span() for m in re.finditer(r"\d+", text)] or [_span(random, text, 1)]
    start, end = random.choice(places)
    return text[:start] + random.choice(NUMBERS) + text[end:]


def _odd(random: Random, text: str, _: Words) -> str:
    at = random.randrange(len(text) + 1)
    return text[:at] + random.choice(ODD) + text[at:]


def _yaml_word(random: Random, text: str, _: Words) -> str:
    tokens = TOKEN.findall(text)
    tokens.insert(random.randrange(len(tokens) + 1), random.choice(YAML_WORDS))
    return "".join(tokens)


def _nest(random: Random, text: str, _: Words) -> str:
    start, end = _span(random, text, 12)
    before, after = random.choice(BRACKETS)
    depth = random.choice(DEPTHS)
    return text[:start] + before * depth + text[start:end] + after * depth + text[end:]


def _repeat(random: Random, text: str, _: Words) -> str:
    start, end = _span(random, text)
    times = random.choice((2, 3, 20, 300, 3000))
    return text[:start] + (text[start:end] * times)[:100_000] + text[end:]


def _splice(random: Random, text: str, words: Words) -> str:
    other = random.choice(words.others)
    start, end = _span(random, other, 400)
    if random.random() < 0.5:
        return text[: random.randrange(len(text) + 1)] + other[start:]
    at = random.randrange(len(text) + 1)
    return text[:at] + other[start:end] + text[at:]


def _ends(random: Random, text: str, _: Words) -> str:
    match random.randrange(5):
        case 0:
            return text.replace("\n", "\r\n")
        case 1:
            return text.replace("\n", "\r")
        case 2:
            return text.replace("  ", "\t", random.choice((1, -1)))
        case 3:
            return "\ufeff" + text
        case _:
            return text.replace(" ", random.choice(("\t", "\xa0", "", "\u2003")), random.choice((1, 3)))


MUTATIONS: tuple[Mutation, ...] = (
    _tokens, _lines, _number, _cut, _odd, _splice, _yaml_word, _nest, _repeat, _ends, _flip, _truncate,
)  # fmt: skip
WEIGHTS = (30, 12, 10, 6, 6, 6, 5, 5, 4, 3, 3, 3)


# ---------------------------------------------------------------- documents


def mutate_tree(random: Random, tree: Tree, words: Words, others: Sequence[Tree]) -> Tree:
    """The document after one to four mutations that keep it a document."""
    for _ in range(random.choice((1, 1, 2, 4))):
        tree = _change(random, tree, words, others)
    return tree


def places(tree: Tree) -> list[tuple[object, ...]]:
    """The path of every value."""
    found: list[tuple[object, ...]] = []
    waiting: list[tuple[tuple[object, ...], Tree]] = [((), tree)]
    while waiting:
        path, node = waiting.pop()
        found.append(path)
        if isinstance(node, dict):
            waiting += [((*path, key), value) for key, value in node.items()]
        elif isinstance(node, list):
            waiting += [((*path, i), value) for i, value in enumerate(node)]
    return found


def at(tree: Tree, path: tuple[object, ...]) -> Tree:
    """The value at a path."""
    for step in path:
        tree = tree[step]  # type: ignore[index]
    return tree


def _put(tree: Tree, path: tuple[object, ...], value: Tree) -> Tree:
    """A copy of the tree with another value at a path; what the copy does not share with the tree is on the path."""
    if not path:
        return value
    copy = tree.copy()  # type: ignore[attr-defined]
    copy[path[0]] = _put(copy[path[0]], path[1:], value)
    return copy


def _change(random: Random, tree: Tree, words: Words, others: Sequence[Tree]) -> Tree:
    path = random.choice(places(tree))
    node = at(tree, path)
    kind = random.randrange(8)
    if kind == 0:
        other = random.choice(others)
        return _put(tree, path, at(other, random.choice(places(other))))
    if kind == 1:
        return _put(tree, path, at(tree, random.choice(places(tree))))
    if isinstance(node, dict) and node:
        return _put(tree, path, _change_mapping(random, node, words))
    if isinstance(node, list) and node:
        return _put(tree, path, _change_list(random, node))
    if kind == 2:
        return _put(tree, path, random.choice(([], {}, "", [node], {"a": node}, None)))
    return _put(tree, path, _scalar(random, node, words))


def _change_mapping(random: Random, node: dict, words: Words) -> dict:
    key = random.choice(list(node))
    match random.randrange(4):
        case 0:
            return {k: v for k, v in node.items() if k != key}
        case 1:
            return {random.choice(words.words) if k == key else k: v for k, v in node.items()}
        case 2:
            return {**node, random.choice(words.words): node[random.choice(list(node))]}
        case _:
            other = random.choice(list(node))
            return {**node, key: node[other], other: node[key]}


def _change_list(random: Random, node: list) -> list:
    i, j = random.randrange(len(node)), random.randrange(len(node))
    match random.randrange(4):
        case 0:
            return node[:i] + node[i + 1 :]
        case 1:
            return [*node[:i], node[j], *node[i:]]
        case 2:
            return node[::-1]
        case _:
            return node * random.choice((2, 5, 40))


def _scalar(random: Random, node: Tree, words: Words) -> Tree:
    if isinstance(node, str):
        match random.randrange(4):
            case 0:
                return random.choice(words.words)
            case 1:
                return random.choice(NUMBERS)
            case _:
                return mutate_text(random, node, words)
    match random.randrange(4):
        case 0:
            return random.choice(
                (0, 1, -1, 2, 63, 64, 1 << 31, 1 << 63, -(1 << 63), 10**30, 1.5, True, False, None, "x")
            )
        case 1 if isinstance(node, int):
            return node + random.choice((1, -1))
        case 2 if isinstance(node, int):
            return node ^ 1 << random.randrange(8)
        case _:
            return not node
