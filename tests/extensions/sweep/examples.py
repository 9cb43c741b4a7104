"""Commands that make the program say what is wrong with a sweep."""

from __future__ import annotations

from tests.outputs.provoking import Provoked, does

COUNTER = does("if (n < 9) n += 1;", "n: {type: 0..9}")


def _sweep(*lines: str, after: tuple[str, ...] = (), **more: str) -> Provoked:
    texts = {f"{name}.yaml": f"arrangements: [a.yaml]\n{text}\n" for name, text in more.items()}
    text = "\n".join(line for line in ("arrangements: [a.yaml]", *lines) if line)
    return Provoked(("llfsm sweep s.yaml", *after), {**COUNTER, "s.yaml": f"{text}\n", **texts})


PROVOKED = {
    "E590": Provoked(("llfsm sweep s.yaml",), {**COUNTER, "s.yaml": "arrangements: ['faulty/*.yaml']\n"}),
    "E591": _sweep("initial: {m: [1, 2]}"),
    "E592": _sweep("initial: {n: {from: 1, to: 1000000}}"),
    "E593": _sweep("initial: {n: [1, 0x1]}"),
    "E594": _sweep("initial: {n: {from: 9, to: 1}}"),
    "E595": _sweep("initial: {n: [1, 2]}", "exclude: [{m: 1}]"),
    "E596": Provoked(("llfsm sweep s.yaml --results a.yaml",), {**COUNTER, "s.yaml": "arrangements: [a.yaml]\n"}),
    "E597": _sweep("options: {timeout: soon}"),
    "W590": _sweep("initial: {n: [1, 2]}", "exclude: [{n: 3}]"),
    "W591": _sweep("initial: {n: [1, 2]}", after=("echo '{' >> s.results.jsonl", "llfsm sweep s.yaml")),
    "W592": _sweep(
        "initial: {n: [1, 2]}", after=("llfsm sweep t.yaml --results s.results.jsonl",), t="initial: {n: [1]}"
    ),
    "W593": _sweep("initial: {n: [1, 2]}"),
}
