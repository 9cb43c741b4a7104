"""Functions as ports: they get frames and return values, and whatever they do, the loop goes on."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from decimal import Decimal
from pathlib import Path
from typing import Any

import pytest

from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.jsonvalue import Json
from llfsm_verify.runtime.live.frame import NUMBER
from llfsm_verify.runtime.live.run import Run
from llfsm_verify.runtime.ports.callback import Function, callback
from llfsm_verify.runtime.ports.port import PortSpec
from llfsm_verify.values import Shown
from tests.runtime.ports.bench import bench, declared


def echo(function: Function) -> PortSpec:
    """A port that feeds `level` and `speed` from what shows them."""
    of = {"level": "level", "speed": "speed"}
    safe = {"level": "4", "speed": "1"}
    return PortSpec("echo", callback(function), inputs=of, outputs=of, on_failure="safe", safe=safe)


@pytest.mark.slow
def test_a_function_gets_frames_and_returns_values() -> None:
    seen: list[Mapping[str, Shown]] = []

    def count(values: Mapping[str, Shown]) -> Mapping[str, Json | Decimal] | None:
        seen.append(values)
        level, speed = values["level"], values["speed"]
        assert isinstance(level, int) and isinstance(speed, Decimal)
        return {"level": level + 1, "speed": speed + Decimal("0.01")} if level < 4 else None

    with bench(echo(count)) as made:
        made.until(made.has("level", 4))
        made.turn()
        assert [values["level"] for values in seen][:1] == [-1] and str(made.value("speed")) == "0.05"
        calls = len(seen)
        made.ports.serve(0)
        made.ports.serve(0)
        assert len(seen) <= calls + 1, "one call a frame"
        assert made.ports.counts["echo"].taken == 5 and made.said == []


@pytest.mark.parametrize("wrong", ["raises", "returns a list", "returns another type"])
def test_a_function_that_fails(wrong: str) -> None:
    calls = 0

    def fail(_: Mapping[str, Shown]) -> Any:
        nonlocal calls
        calls += 1
        if calls > 3:
            return {"level": 2, "speed": "-0.5"}
        if wrong == "raises":
            raise ValueError("no sensor")
        return [1] if wrong == "returns a list" else {"level": 7}

    with bench(echo(fail)) as made:
        made.until(lambda: calls == 3)
        counts = made.ports.counts["echo"]
        if wrong == "raises":
            made.until(made.has("level", 4))
            assert counts.failures == 2 and made.said[1].startswith(
                "port echo: the function has raised ValueError: no sensor"
            )
        else:
            assert counts.refused + counts.malformed >= 3 and len(made.said) == 1
        made.until(made.has("level", 2))
        assert str(made.value("speed")) == "-0.50"


def test_a_function_that_blocks_does_not_hold_up_the_loop() -> None:
    """It waits for what only the loop can do."""
    called = threading.Event()

    def block(_: Mapping[str, Shown]) -> None:
        called.set()
        while made.loop.frame[NUMBER] < begun + 10_000:
            pass

    with bench(echo(block)) as made:
        begun = made.loop.frame[NUMBER]
        run = Run(made.loop)
        run.start()
        while not called.is_set():
            made.ports.serve(0)
        run.stop()
        assert run.wait() and made.loop.number >= begun + 10_000


def test_a_module_beside_the_file(tmp_path: Path) -> None:
    (tmp_path / "beside_ports.py").write_text("def f(values):\n    return {'level': 3}\nclass C:\n    f = f\nx = 3\n")
    text = "ports: {w: {kind: callback, call: 'beside_ports:%s', inputs: [level], on_failure: stale}}\n"
    for name in ("f", "C.f"):
        with bench(*declared(text % name, tmp_path)) as made:
            made.until(made.has("level", 3))
            assert made.ports.counts["w"].taken >= 1
    (tmp_path / "broken_ports.py").write_text("1 / 0\n")
    (tmp_path / "needy_ports.py").write_text("import not_there_at_all\n")
    for name, why in (
        ("beside_ports:g", "has no `g`"), ("beside_ports:x", "is not a function"), ("nothing_ports:f", "no module"),
        ("broken_ports:f", "ZeroDivisionError"), ("needy_ports:f", "not_there_at_all"),
    ):  # fmt: skip
        specs = declared(text.replace("beside_ports:%s", name), tmp_path)
        with pytest.raises(DiagnosticError, match=why) as caught, bench(*specs):
            pass
        assert [d.code for d in caught.value.diagnostics] == ["E495"]
