"""Types of ROS 2's messages, as files ``PACKAGE/msg/NAME.msg`` or ``.idl`` describe them.

The grammars are those of ROS 2's interface definition (design.ros2.org, "Interface definition using .msg/.srv/.action
files" and "Mapping IDL to ROS 2"). Debian's messages of ROS 1 are read as well, where they mean the same: those with
`time`, `duration` or the Header of ROS 1 do not, and have no type here.
"""

from __future__ import annotations

import ast
import math
import os
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from llfsm_verify.extensions.ros.ros1_node.debian import named

WHOLE = {f"{sign}int{bits}": (sign == "u", bits) for sign in ("", "u") for bits in (8, 16, 32, 64)}
"""Whole numbers: whether they have no sign, and their bits."""
NUMBERS = (*WHOLE, "byte", "char", "float32", "float64")
ROS1 = "/usr/share"
"""Where Debian puts the messages of ROS 1."""
MOST = 1_000_000
"""Elements of an array, characters of a string with a bound: every message has all elements of its arrays."""
COUNT = ("count", "length")
"""After an array or a sequence: how many elements it has."""
MOST_DOMAIN = 231
"""The last domain of DDS of which all ports of UDP exist, also of the hundredth participant."""
EMPTY = "structure_needs_at_least_one_member"
"""The field that ROS 2 gives to a message without fields."""


class Unreadable(Exception):
    """A type is not there, or its file is wrong; the message says why."""

    def __init__(self, why: str, hint: str, path: str = "", line: int = 0) -> None:
        super().__init__(why)
        self.hint, self.place = hint, f"{path}:{line}" if line else path


@dataclass(frozen=True, slots=True)
class Plain:
    """`bool`, or one of NUMBERS."""

    name: str


@dataclass(frozen=True, slots=True)
class Text:
    """A string, of so many characters at most."""

    most: int | None = None


@dataclass(frozen=True, slots=True)
class Named:
    """Another message, such as ``std_msgs/msg/Header``."""

    name: str


@dataclass(frozen=True, slots=True)
class Many:
    """An array of `size` elements, or a sequence of `most`."""

    of: Type
    size: int | None = None
    most: int | None = None


Type = Plain | Text | Named | Many
Value = bool | int | float | str | list["Value"]


@dataclass(frozen=True, slots=True)
class Member:
    """A field of a message."""

    name: str
    type: Type
    default: Value | None = None


@dataclass(frozen=True, slots=True)
class Message:
    """A message, with the file that describes it."""

    name: str
    members: tuple[Member, ...]
    path: str

    def member(self, name: str) -> Member | None:
        """The field of this name."""
        return next((one for one in self.members if one.name == name), None)


NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*/msg/[A-Za-z][A-Za-z0-9]*\Z")


class Messages:
    """The messages in some folders, and in those of an installed ROS; each is read when it is asked for."""

    def __init__(self, folders: Iterable[str]) -> None:
        installed = filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep))
        self._folders = [*map(Path, folders), *(Path(one, "share") for one in installed), Path(ROS1)]
        self._known: dict[str, Message] = {}

    def find(self, name: str) -> Message:
        """The message of this name, after those in it. Unreadable."""
        return self._find(name, ())

    def _find(self, name: str, within: tuple[str, ...]) -> Message:
        if name in within:
            raise Unreadable(f"{name} has itself as a part", "write a message without a cycle", self._path(name)[0])
        if name not in self._known:
            path, text = self._path(name)
            read = read_idl(text, path) if path.endswith(".idl") else {name: read_msg(text, name, path)}
            if name not in read:
                raise Unreadable(f"there is no struct {name.replace('/', '::')} in it", "add it", path)
            for member in read[name].members:
                for inner in parts(member.type):
                    self._find(inner, (*within, name))
            self._known[name] = read[name]
        return self._known[name]

    def _path(self, name: str) -> tuple[str, str]:
        for folder in self._folders:
            for ending in (".msg", ".idl"):
                path = folder / f"{name}{ending}"
                try:
                    return str(path), path.read_text("utf-8")
                except (FileNotFoundError, NotADirectoryError):
                    continue
                except (OSError, UnicodeDecodeError) as error:
                    raise Unreadable(f"it cannot be read: {error}", "correct the file", str(path)) from None
        where = f"name a folder with {name}.msg under `messages`, or source the set-up file of a ROS 2"
        raise Unreadable(f"there is no message {name}", where + named(name.partition("/")[0], "ros"))

    def at(self, name: str, path: Iterable[str], *, output: bool = False) -> Plain | Text:
        """The type of the value at a path of fields and numbers of elements in a message. Unreadable."""
        found: Type = Named(name)
        so_far = name
        for step in path:
            if isinstance(found, Named):
                message = self.find(found.name)
                member = message.member(step)
                if member is None:
                    names = ", ".join(one.name for one in message.members)
                    raise Unreadable(f"{so_far} has no field `{step}`", f"its fields are {names}", message.path)
                found = member.type
            elif isinstance(found, Many) and step in COUNT:
                if output:
                    raise Unreadable("how many elements there are cannot be written", f"write `{so_far}.0`")
                found = Plain("uint32")
            elif isinstance(found, Many):
                if not (step.isascii() and step.isdigit() and len(step) < 6) or int(step) >= limit(found):
                    hint = f"write the number of an element, such as `{so_far}.0`"
                    raise Unreadable(f"{so_far} has no element `{step}`", hint)
                found = found.of
            else:
                raise Unreadable(f"{so_far} has no field `{step}`", f"write `{so_far}`")
            so_far = f"{so_far}.{step}"
        if isinstance(found, Named):
            names = ", ".join(f"`{so_far}.{one.name}`" for one in self.find(found.name).members)
            raise Unreadable(f"{so_far} is not a single value", f"write one of {names}")
        if isinstance(found, Many):
            raise Unreadable(
                f"{so_far} has many values", f"write the number of one or their count: `{so_far}.0`, `{so_far}.count`"
            )
        return found


def limit(of: Many) -> int:
    """How many elements there may be."""
    return next((size for size in (of.size, of.most) if size is not None), 1 << 16)


def parts(of: Type) -> Iterator[str]:
    """The messages that a type has in it."""
    if isinstance(of, Named):
        yield of.name
    elif isinstance(of, Many):
        yield from parts(of.of)


def completed(name: str, members: Iterable[Member], path: str) -> Message:
    """A message; one without fields has that of ROS 2."""
    return Message(name, tuple(members) or (Member(EMPTY, Plain("uint8")),), path)


# ---------------------------------------------------------------- .msg

_LINE = re.compile(
    r"(?P<type>[A-Za-z][\w/]*)(?:<=(?P<text>\d+))?(?P<many>\[(?P<bound><=)?(?P<size>\d*)\])?"
    r"\s+(?P<name>[A-Za-z]\w*)\s*(?P<rest>.*)\Z"
)


def read_msg(text: str, name: str, path: str) -> Message:
    """A file `.msg`. Unreadable."""
    package = name.partition("/")[0]
    members: dict[str, Member] = {}
    for number, line in enumerate(text.splitlines(), 1):
        code = _without_comment(line)
        if not code:
            continue
        match = _LINE.match(code)
        if match is None:
            raise Unreadable(f"`{code[:60]}` is not a field", "write a type and a name: `float64 x`", path, number)
        of = _msg_type(match, package, path, number)
        if match["rest"].startswith("=") and match["many"] is None:
            continue  # a constant has no place in a message
        if match["name"] in members:
            raise Unreadable(f"there are two fields `{match['name']}`", "rename one", path, number)
        default = None if not match["rest"] else _default(match["rest"], of, path, number)
        members[match["name"]] = Member(match["name"], of, default)
    return completed(name, members.values(), path)


def _without_comment(line: str) -> str:
    """A `#` in quotes is none."""
    match = re.match(r"""(?:[^#"']|"(?:[^"\\]|\\.)*"|'(?:[^'\\]|\\.)*'|["'])*""", line)
    return (match[0] if match else line).strip()


def _msg_type(match: re.Match[str], package: str, path: str, line: int) -> Type:
    word, bound = match["type"], match["text"]
    of: Type
    if bound is not None and word not in ("string", "wstring"):
        raise Unreadable(f"only strings have `<={bound}` after the type", "write `string<=…`", path, line)
    if bound is not None and not 0 < int(bound[:12]) <= MOST:
        raise Unreadable(f"`{word}<={bound[:60]}` has no size from 1 to {MOST:,}", "write `string<=10`", path, line)
    if word == "string":
        of = Text(None if bound is None else int(bound))
    elif word == "bool" or word in NUMBERS:
        of = Plain(word)
    elif word in UNKNOWN:
        raise Unreadable(*UNKNOWN[word], path, line)
    else:
        package, _, last = word.rpartition("/") if "/" in word else (package, "", word)
        of = Named(f"{package.removesuffix('/msg')}/msg/{last}")
        if NAME.match(of.name) is None:
            raise Unreadable(f"`{word}` is not a type", "write a type such as `bool` or `std_msgs/Header`", path, line)
    if match["many"] is None:
        return of
    size = None if not match["size"] else int(match["size"][:12])
    if size is not None and size > MOST:
        raise Unreadable(f"`{match['many'][:60]}` has more than {MOST:,} elements", "write a smaller size", path, line)
    if size == 0 or (match["bound"] and size is None):
        raise Unreadable(f"`{match['many']}` has no size above 0", "write `[]`, `[3]` or `[<=3]`", path, line)
    return Many(of, most=size) if match["bound"] else Many(of, size)


_OF_ROS1 = "it is of ROS 1, and means something else in ROS 2"
UNKNOWN = {
    "wstring": ("`wstring` has no form in CDR on which all vendors agree", "write `string`"),
    "time": (f"`time`: {_OF_ROS1}", "write `builtin_interfaces/Time`, or name a folder of ROS 2's messages"),
    "duration": (
        f"`duration`: {_OF_ROS1}",
        "write `builtin_interfaces/Duration`, or name a folder of ROS 2's messages",
    ),
    "Header": (f"`Header` without a package: {_OF_ROS1}", "write `std_msgs/Header`"),
}
"""Types that are not taken, with why and what to write."""


def _default(text: str, of: Type, path: str, line: int) -> Value:
    try:
        return _value(text, of)
    except (ValueError, SyntaxError) as error:
        why = f": {error}" if str(error) and not isinstance(error, SyntaxError) else ""
        raise Unreadable(f"`{text[:60]}` cannot be its default{why}", "write a value of its type", path, line) from None


def _value(text: str, of: Type) -> Value:
    if isinstance(of, Many):
        found = ast.literal_eval(re.sub(r"\b(true|false)\b", lambda word: word[0].title(), text))
        if not isinstance(found, list) or len(found) > limit(of) or (of.size is not None and len(found) != of.size):
            raise ValueError
        return [_value(str(one), of.of) for one in found]
    if isinstance(of, Text):
        found = ast.literal_eval(text) if text[:1] in ('"', "'") else text
        if not isinstance(found, str) or len(found) > (of.most or len(found)):
            raise ValueError
        return found
    if isinstance(of, Named):
        raise ValueError("only plain fields have one")
    return number(text, of)


def number(text: str, of: Plain) -> Value:
    """A truth value or number of this type. ValueError."""
    if of.name == "bool":
        if text.lower() not in ("true", "false", "1", "0"):
            raise ValueError
        return text.lower() in ("true", "1")
    if of.name.startswith("float"):
        if math.isinf(real := float(text)) and "inf" not in text.lower():
            raise ValueError(f"{text[:20]} is not from -1.8e308 to 1.8e308")
        return real
    unsigned, bits = WHOLE.get(of.name, (True, 8))
    low = 0 if unsigned else -(1 << bits - 1)
    if not low <= (found := int(text, 0)) < low + (1 << bits):
        raise ValueError(f"{found} is not from {low} to {low + (1 << bits) - 1}")
    return found


# ---------------------------------------------------------------- .idl

_TOKEN = re.compile(r'\s+|//[^\n]*|/\*.*?\*/|#[^\n]*|"(?:[^"\\]|\\.)*"|(?:::)?\w+(?:::\w+)*|-?[\d.]+\w*|.', re.DOTALL)
_IDL = {
    "boolean": "bool", "octet": "byte", "char": "uint8", "short": "int16", "long": "int32", "float": "float32",
    "double": "float64", "long long": "int64", "unsigned short": "uint16", "unsigned long": "uint32",
    "unsigned long long": "uint64", **{name: name for name in WHOLE},
}  # fmt: skip


def read_idl(text: str, path: str) -> dict[str, Message]:
    """The structs of a file `.idl`, by their names with `/`. Unreadable."""
    try:
        return _Idl(text, path).read()
    except RecursionError:
        raise Unreadable("a type has more types within it than can be read", "write a simpler one", path, 1) from None


class _Idl:
    """Modules, structs, `typedef` and constants: the part of OMG IDL 4.2 that ROS 2 maps."""

    def __init__(self, text: str, path: str) -> None:
        self._path = path
        self._tokens: list[tuple[str, int]] = []
        line = 1
        for match in _TOKEN.finditer(text):
            word = match[0]
            if not word.isspace() and not word.startswith(("//", "/*", "#")):
                self._tokens.append((word, line))
            line += word.count("\n")
        self._at = 0
        self._aliases: dict[str, Type] = {}
        self._found: dict[str, Message] = {}

    def read(self) -> dict[str, Message]:
        modules: list[str] = []
        while self._at < len(self._tokens):
            self._annotations()
            word = self._next()
            if word == "module":
                modules.append(self._next())
                self._expect("{")
            elif word == "}" and modules:
                modules.pop()
                self._expect(";")
            elif word == "struct":
                self._struct(modules)
            elif word == "typedef":
                of = self._type()
                alias = self._next()
                self._aliases[alias] = self._sized(of)
                self._expect(";")
            elif word == "const":
                while self._next() != ";":
                    continue
            else:
                raise self._wrong(f"`{word}` is not expected", "write modules, structs, `typedef` and constants")
        if modules:
            raise self._wrong("a module has no end", "write `};`")
        return self._found

    def _struct(self, modules: list[str]) -> None:
        name = "/".join((*modules, self._next()))
        self._expect("{")
        members: dict[str, Member] = {}
        while self._peek() != "}":
            default = self._annotations()
            of = self._type()
            while True:
                member = self._next()
                if member in members:
                    raise self._wrong(f"there are two fields `{member}`", "rename one")
                of_it = self._sized(of)
                given = None if default is None else _default(default, of_it, self._path, self._line)
                members[member] = Member(member, of_it, given)
                if (word := self._next()) == ";":
                    break
                if word != ",":
                    raise self._wrong(f"`{word}` is not expected", "write `;` after the name of a field")
        self._next()
        self._expect(";")
        self._found[name] = completed(name, members.values(), self._path)

    def _annotations(self) -> str | None:
        """Pass over them; the value of `@default`."""
        default = None
        while self._peek() == "@":
            self._next()
            name = self._next()
            words: list[str] = []
            if self._peek() == "(":
                while (word := self._next()) != ")":
                    words.append(word)
            if name == "default":
                default = "".join(words[1:]).removeprefix("value=")
            elif name in ("key", "optional", "mutable", "appendable", "extensibility"):
                raise self._wrong(f"`@{name}` is not a part of ROS 2's messages", "remove it")
        return default

    def _type(self) -> Type:
        word = self._next()
        if word in ("unsigned", "long"):
            while self._peek() in ("long", "short", "double"):
                word += f" {self._next()}"
        if word == "string":
            return Text(self._bound())
        if word == "sequence":
            self._expect("<")
            of = self._type()
            most = None
            if self._peek() == ",":
                self._next()
                most = self._whole()
            self._expect(">")
            return Many(of, most=most)
        if word in _IDL:
            return Plain(_IDL[word])
        if word in self._aliases:
            return self._aliases[word]
        if "::" in word:
            return Named(word.removeprefix("::").replace("::", "/"))
        raise self._wrong(*UNKNOWN.get(word, (f"there is no type `{word}`", "write a type of ROS 2")))

    def _bound(self) -> int | None:
        if self._peek() != "<":
            return None
        self._next()
        most = self._whole()
        self._expect(">")
        return most

    def _sized(self, of: Type) -> Type:
        sizes = []
        while self._peek() == "[":
            self._next()
            sizes.append(self._whole())
            self._expect("]")
        for size in reversed(sizes):
            of = Many(of, size)
        return of

    def _whole(self) -> int:
        word = self._next()
        if not (word.isascii() and word.isdigit() and 0 < int(word[:12]) <= MOST):
            raise self._wrong(f"`{word[:60]}` is not a size", f"write a number from 1 to {MOST:,}")
        return int(word)

    def _peek(self) -> str:
        return self._tokens[self._at][0] if self._at < len(self._tokens) else ""

    @property
    def _line(self) -> int:
        return self._tokens[min(self._at, len(self._tokens)) - 1][1] if self._tokens else 1

    def _next(self) -> str:
        word = self._peek()
        self._at += 1
        if not word:
            raise self._wrong("it ends too early", "complete the file")
        return word

    def _expect(self, word: str) -> None:
        if (found := self._next()) != word:
            raise self._wrong(f"`{found}` is not expected", f"write `{word}`")

    def _wrong(self, why: str, hint: str) -> Unreadable:
        return Unreadable(why, hint, self._path, self._line)


# ---------------------------------------------------------------- values

Fields = Mapping[str, object]


def starting(messages: Messages, of: Type) -> object:
    """The value of a type before anybody has set it."""
    if isinstance(of, Named):
        found = messages.find(of.name).members
        return {m.name: starting(messages, m.type) if m.default is None else m.default for m in found}
    if isinstance(of, Many):
        return [starting(messages, of.of) for _ in range(of.size or 0)]
    if isinstance(of, Text):
        return ""
    return False if of.name == "bool" else 0.0 if of.name.startswith("float") else 0
