"""The parts of `runtime.c` that an image needs, and small functions of each width."""

from __future__ import annotations

import re
from functools import cache
from importlib import resources

_PART = re.compile(r"^/\* @(\w+)((?: \w+)*):", re.MULTILINE)
_SMALL = re.compile(r"(min|max|abs|div|mod)_(16|32|64)\Z")


@cache
def _parts() -> dict[str, tuple[tuple[str, ...], str]]:
    """By name: the parts that it calls, and its text."""
    text = resources.files(__package__).joinpath("runtime.c").read_text(encoding="utf-8")
    found = list(_PART.finditer(text))
    ends = [match.start() for match in found[1:]] + [len(text)]
    return {
        match[1]: (tuple(match[2].split()), text[text.index("*/", match.start()) + 2 : end].strip())
        for match, end in zip(found, ends, strict=True)
    }


def _small(name: str) -> str:
    found = _SMALL.match(name)
    assert found is not None, name
    kind, bits = found[1], found[2]
    of = f"int{bits}_t"
    if kind == "abs":
        return f"static inline {of} {name}({of} a)\n{{\n    return ({of})(a < 0 ? -a : a);\n}}"
    value = {"min": "a < b ? a : b", "max": "a > b ? a : b", "div": "a / b", "mod": "a % b"}[kind]
    return f"static inline {of} {name}({of} a, {of} b)\n{{\n    return ({of})({value});\n}}"


def runtime(text: str) -> str:
    """The functions that a text calls, after those that they call."""
    done: dict[str, str] = {}
    called = set(re.findall(r"\b\w+(?=\()", text))
    todo = sorted((name for name in called if name in _parts() or _SMALL.match(name)), reverse=True)
    while todo:
        name = todo[-1]
        calls, body = _parts().get(name) or ((), _small(name))
        missing = [call for call in calls if call not in done]
        if not missing:
            done[todo.pop()] = body
        todo += missing
    return "".join(f"{body}\n\n" for body in done.values())
