"""What ports make of messages, whatever their kind: events, names of the other side, paths, and when they send."""

from __future__ import annotations

import json
import os
import stat
from pathlib import Path
from random import Random

import pytest

from llfsm_verify.api.model import Model
from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.runtime.ports.line_port import shown_json
from tests.runtime.live.runs import code_of
from tests.runtime.ports.bench import Bench, bench, declared, lines_of
from tests.runtime.ports.picker import PICKER, picker, port


def pipes(folder: Path, keys: str) -> tuple[str, int, int]:
    """A port of two pipes, and our ends of them."""
    for name in ("in", "out"):
        os.mkfifo(folder / name)
    readers = [os.open(folder / name, os.O_RDWR | os.O_NONBLOCK) for name in ("in", "out")]
    assert all(stat.S_ISFIFO(os.fstat(one).st_mode) for one in readers)
    return f"ports: {{p: {{kind: stream, read: in, write: out, on_failure: stale, {keys}}}}}", readers[0], readers[1]


EVENTS = "inputs: {start: msg.data}, events: {start: NONE}, outputs: [now], values: {Start now: START, Hold: PAUSE}"


def say(descriptor: int, *texts: str) -> None:
    for text in texts:
        os.write(descriptor, json.dumps({"msg": {"data": text}}).encode() + b"\n")


@pytest.mark.parametrize("seed", range(4))
def test_every_event_has_one_cycle_of_its_own(seed: int, tmp_path: Path) -> None:
    """However many come at once, and although many are equal: as many cycles have each as it was said."""
    text, writer, _ = pipes(tmp_path, EVENTS)
    random = Random(seed)
    with bench(*declared(text, tmp_path, picker()), code=picker()) as made:
        said: list[str] = []
        had: list[object] = []
        for _ in range(100):
            new = random.choices(["Start now", "Hold", "START"], k=random.choice([0, 0, 1, 3]))
            say(writer, *new)
            said += ["START" if one != "Hold" else "PAUSE" for one in new]
            made.turn()
            had.append(made.value("now"))
        while len([one for one in had if one != "NONE"]) < len(said):
            made.turn()
            had.append(made.value("now"))
        for _ in range(5):
            made.turn()
            had.append(made.value("now"))
        assert [one for one in had if one != "NONE"] == said and had[-5:] == ["NONE"] * 5
        assert (made.value("starts"), made.value("pauses")) == (said.count("START"), said.count("PAUSE"))
        assert counts(made) == len(said) and made.said == []


def counts(made: Bench) -> int:
    return made.ports.counts["p"].taken


def test_too_many_events_are_refused_and_counted(tmp_path: Path) -> None:
    text, writer, _ = pipes(tmp_path, EVENTS)
    with bench(*declared(text, tmp_path, picker()), code=picker()) as made:
        for _ in range(40):
            say(writer, *["Hold"] * 50)
            made.ports.serve(0)
        made.ports.serve(0)
        refused = made.ports.counts["p"].refused
        assert 0 < refused < 2000 and made.said == ["port p: an event is refused: 1024 events are waiting already"]
        for _ in range(2100):
            made.turn()
        assert made.value("pauses") == 2000 - refused


def test_a_command_does_not_wait_for_the_events_before_it(tmp_path: Path) -> None:
    text, writer, _ = pipes(tmp_path, EVENTS)
    operated = code_of(build_arrangement({**PICKER, "operators": {"suspend": ["m"]}}))
    with bench(*declared(text, tmp_path, operated), code=operated) as made:
        say(writer, *["Hold"] * 50)
        made.ports.serve(0)
        taken: list[int] = []
        made.board.posts.command("suspend", "m", taken=taken.append)
        for _ in range(5):
            made.turn()
        assert taken and made.value("pauses") <= 3


def test_events_need_cycles_of_one_process(tmp_path: Path) -> None:
    text, _, _ = pipes(tmp_path, EVENTS)
    machines = {"m": PICKER["machines"]["m"], "n": {"inline": {"machine": "N", "states": [{"name": "T"}]}}}  # type: ignore[index]
    document = {name: value for name, value in PICKER.items() if name != "schedule"}
    two = code_of(build_arrangement({**document, "machines": machines, "processes": {"a": ["m"], "b": ["n"]}}))
    with pytest.raises(DiagnosticError) as caught, bench(*declared(text, tmp_path, two), code=two):
        pass
    assert [d.code for d in caught.value.diagnostics] == ["E495"] and "no single cycle" in str(caught.value)


def test_names_of_the_other_side_go_both_ways_and_wrong_ones_do_not(tmp_path: Path) -> None:
    text, writer, reader = pipes(tmp_path, EVENTS.replace("events: {start: NONE}, ", "").replace("[now]", "{now: a.b}"))
    with bench(*declared(text, tmp_path, picker()), code=picker()) as made:
        lines = lines_of(reader, made.turn)
        assert json.loads(next(lines)) == {"a": {"b": "NONE"}}
        say(writer, "Start now", "Start later")
        assert json.loads(next(lines)) == {"a": {"b": "Start now"}}
        assert made.ports.counts["p"].refused == 1 and "`Start later` is not one of" in made.said[0]
        say(writer, "PAUSE")
        assert json.loads(next(lines)) == {"a": {"b": "Hold"}}


def test_a_message_goes_out_when_its_slot_changes_and_only_then(tmp_path: Path) -> None:
    keys = "inputs: [level, start], outputs: [doubled, now], when: now"
    text, writer, reader = pipes(tmp_path, keys)
    with bench(*declared(text, tmp_path, picker()), code=picker()) as made:
        for level in (1, 2, 3):
            os.write(writer, b'{"level": %d}\n' % level)
            made.until(made.has("doubled", 2 * level))
        os.write(writer, b'{"start": "PAUSE"}\n')
        assert json.loads(next(lines_of(reader, made.turn))) == {"doubled": 6, "now": "PAUSE"}
        os.write(writer, b'{"level": 0}\n')
        made.until(made.has("doubled", 0))
        made.end("ended")
        with pytest.raises(BlockingIOError):
            os.read(reader, 1)


def test_fields_with_dots_are_paths(tmp_path: Path) -> None:
    text, writer, reader = pipes(
        tmp_path, "inputs: {level: twist.linear.0.x, wants: a.b}, outputs: {doubled: x.y.z, now: x.w}"
    )
    with bench(*declared(text, tmp_path, picker()), code=picker()) as made:
        os.write(writer, b'{"twist": {"linear": [{"x": 3}]}, "a.b": 0}\n{"twist": {"linear": []}}\n{"twist": [1]}\n')
        made.until(made.has("level", 3))
        made.until(lambda: made.ports.counts["p"].malformed == 2)
        assert json.loads(next(lines_of(reader, made.turn))) == {"x": {"y": {"z": 6}, "w": "NONE"}}
    assert shown_json({"a.b.c": 1, "d": True, "a.e": "x", "a.b.f": 2, "..": 3}) == (
        '{"a": {"b": {"c": 1, "f": 2}, "e": "x"}, "d": true, "..": 3}'
    )


def test_parameters_are_read_before_the_run(tmp_path: Path) -> None:
    lines = "for message in messages: pass\n"
    hello = json.dumps({"hello": 1, "values": {"g": {"ain": "seven"}, "level": 2}})
    text = port(tmp_path, lines, "values: {seven: 7}", hello=hello).replace(
        "{level: level}", "{level: level, gain: g.ain}"
    )
    (tmp_path / "a.ports.yaml").write_text(text)
    model = Model(build_arrangement(PICKER))
    run = model.run(ports=tmp_path / "a.ports.yaml", rate=0, cycles=3)
    assert run.wait().cycles == 3 and run.values()["gain"] == 7
    (tmp_path / "a.ports.yaml").write_text(text.replace("seven: 7", "seven: 6, six: 5"))
    assert model.run(ports=tmp_path / "a.ports.yaml", rate=0, cycles=3, inputs={"wants": 0}).wait().cycles == 3
    with pytest.raises(ValueError, match="`gain` is held by `inputs`"):
        model.run(ports=tmp_path / "a.ports.yaml", inputs={"gain": 1})
    for wrong, why in (('{"ain": 11}', "gives `gain` the value 11"), ("3", "no value for `gain`")):
        said = hello.replace('{"ain": "seven"}', wrong)
        port(tmp_path, lines, "", hello=said)
        with pytest.raises(DiagnosticError) as caught:
            model.run(ports=tmp_path / "a.ports.yaml")
        assert [d.code for d in caught.value.diagnostics] == ["E495"] and why in str(caught.value)


def test_events_before_the_first_cycle_keep_their_order(tmp_path: Path) -> None:
    """Also of a port that is open before the run; the newest of other values counts."""
    said = [{"hello": 1, "values": {"start": "START", "level": 1}}] + [
        {"values": values} for values in ({"start": "PAUSE"}, {"level": 2}, {"level": 3}, {"start": "PAUSE"})
    ]
    lines = "".join(json.dumps(one) + "\n" for one in said)
    program = f"os.write(1, {lines!r}.encode())\nfor message in messages: pass\n"
    text = port(tmp_path, program, "events: {start: NONE}", hello="")
    with bench(*declared(text.replace("[level]", "x").replace("{level: level}", "[level, start]"), tmp_path, picker()),
               code=picker()) as made:  # fmt: skip
        had: list[object] = []
        while len([one for one in had if one != "NONE"]) < 3:
            made.turn()
            had.append(made.value("now"))
        assert [one for one in had if one != "NONE"] == ["START", "PAUSE", "PAUSE"] and made.value("level") == 3
