"""The program behind a port of Prolog, spoken to as the run does; and swipl asked once for each query beside it."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

from llfsm_verify.extensions.prolog.terms import HOLE
from tests.outside import program

Message = dict[str, Any]
BOOL: Message = {"low": 0, "high": 1, "boolean": True, "digits": 0, "labels": []}


def number(low: int, high: int, digits: int = 0) -> Message:
    return {"low": low, "high": high, "boolean": False, "digits": digits, "labels": []}


def names(*labels: str) -> Message:
    return {"low": 0, "high": len(labels) - 1, "boolean": False, "digits": 0, "labels": [*labels]}


class Bridge:
    """A process of `bridge.py`; facts and queries as in a file of ports, with their types."""

    def __init__(self, file: Path, facts: Mapping[str, Message], queries: Mapping[str, Message], **told: Any) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-m", "llfsm_verify.extensions.prolog.bridge"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=file.parent,
        )  # fmt: skip
        terms = {key: {field: field.replace("Value", HOLE) for field in of}
                 for key, of in (("facts", facts), ("queries", queries))}  # fmt: skip
        told = {"file": str(file), "limit": 5.0, "every": None, "values": {}, "patience": 60.0, "restart": True} | told
        self.say({"hello": 1, "port": "p", "cycle_ms": 10, "inputs": queries, "outputs": facts, "requests": {},
                  "told": told | terms})  # fmt: skip
        self.heard: list[Message] = []

    def say(self, message: Message) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps(message).encode() + b"\n")
        self.process.stdin.flush()

    def until(self, key: str) -> Message:
        """The next message that has this key."""
        assert self.process.stdout is not None
        while True:
            line = self.process.stdout.readline()
            assert line, f"it has ended, and has said {self.heard[-5:]}"
            self.heard.append(cast(Message, json.loads(line)))
            if key in self.heard[-1]:
                return self.heard[-1]

    def ask(self, values: Message) -> Message:
        """The answers with these facts."""
        self.say({"values": values})
        return cast(Message, self.until("values")["values"])

    @property
    def swipl(self) -> int:
        """The number of the process of Prolog that it has now."""
        children = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()
        (found,) = [int(child) for child in children if "swipl" in Path(f"/proc/{child}/cmdline").read_text()]
        return found

    def said(self) -> list[str]:
        return [message["say"] for message in self.heard if "say" in message]


@contextmanager
def bridge(file: Path, facts: Mapping[str, Message], queries: Mapping[str, Message], **told: Any) -> Iterator[Bridge]:
    program("swipl")
    made = Bridge(file, facts, queries, **told)
    try:
        yield made
    finally:
        made.process.terminate()
        made.process.communicate()


def swipl(folder: Path, script: str) -> str:
    """What a Prolog of its own prints that loads this text."""
    file = folder / "alone.pl"
    file.write_text(script, encoding="utf-8")
    command = [program("swipl"), "-q", "-f", "none", str(file)]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=True)
    file.unlink()
    return done.stdout.strip()


def alone(folder: Path, text: str, facts: Iterable[str], query: str) -> str:
    """The first answer of a Prolog of its own, which finds the facts in its program; "yes" without a value, or "no"."""
    clauses = "".join(f"{fact}.\n" for fact in facts)
    goal = f"( {query} -> ( nonvar(Value) -> print(Value) ; print(yes) ) ; print(no) )"
    return swipl(folder, f":- encoding(utf8).\n{text}\n{clauses}\n:- initialization(({goal}, nl, halt)).\n")
