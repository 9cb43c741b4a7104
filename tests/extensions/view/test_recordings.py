"""The document of a recording against its frames: values, cycles and times, for arrangements made at random."""

from __future__ import annotations

import json
from collections import Counter
from importlib.resources import files
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.extensions.view import document
from llfsm_verify.extensions.view.values import exact
from llfsm_verify.runtime.recording.replay import replay
from llfsm_verify.runtime.recording.timeline import recorded
from llfsm_verify.testing.arrangements import Document, arrangements
from tests.quick import AtLeast, examples, spread
from tests.runtime.live import runs

SCHEMA = json.loads(files("llfsm_verify.extensions.view").joinpath("view.schema.json").read_text(encoding="utf-8"))


def value_at(run: Any, signal: int, row: int) -> object:
    at, values = run["changes"][signal]["at"], run["changes"][signal]["values"]
    return next(value for place, value in zip(reversed(at), reversed(values), strict=True) if place <= row)


@pytest.mark.long
def test_rows_are_those_of_frames(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tally: Counter[str] = Counter()

    def check(given: Document, seed: int) -> None:
        arrangement = build_arrangement(given)
        monkeypatch.setattr(document, "arrangement_of", lambda *_: arrangement)
        code = runs.code_of(arrangement)
        _, turns = runs.recorded(code, tmp_path / "r", 12, seed)
        timeline = recorded(arrangement, code, replay(code, turns))
        rows = list(timeline.rows)
        made = document.document_of_file(str(tmp_path / "r"), None)
        jsonschema.Draft202012Validator(SCHEMA).validate(made)
        (run,) = made["runs"]
        assert [signal["name"] for signal in made["signals"]] == [signal.name for signal in timeline.signals]
        seen = {-1}
        for row in rows:
            if row.step in seen:
                continue  # a turn without a ringlet
            seen.add(row.step)
            time = timeline.time_ms(row)
            assert [value_at(run, i, row.step) for i in range(len(row.values))] == [*map(exact, row.values)]
            assert run["rows"]["cycle"][row.step] == row.cycle
            assert time is None or run["rows"]["time_ms"][row.step] == float(time)
            tally["rows"] += 1
        tally["processes"] += len(arrangement.processes) > 1

    amount = settings(max_examples=examples(12), deadline=None, suppress_health_check=list(HealthCheck))
    wanted = AtLeast(tally, {"rows": 40, "processes": 2})
    spread(check, amount, arrangements(), st.integers(1, 1 << 40), size=6, until=wanted)
