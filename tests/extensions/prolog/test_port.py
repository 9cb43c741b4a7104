"""Ports of Prolog in files of ports and in runs."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from llfsm_verify import DiagnosticError
from llfsm_verify.diagnostics import Source
from tests.cli.running import llfsm
from tests.outside import needs
from tests.runtime.ports.bench import Bench, bench, declared

PROGRAM = """\
level(X) :- go, seen(S), X is max(-3, min(4, S)).
level(4) :- \\+ go.
mode('HIGH') :- now(low).
mode(low) :- now('HIGH').
speed(X) :- drive(D), X is D / 2.
go(yes).
"""
PORTS = """\
ports:
  p:
    kind: prolog
    file: program.pl
    limit: 10s
    patience: 60s
    outputs: {go: go, seen: seen, now: now(Value), drive: drive}
    inputs: [level, mode, speed]
    values: {low: LOW}
    on_failure: stale
"""
WRONG = [
    ("file: program.pl, outputs: {n: '§f(Colour)'}", "E581", "`f(Colour)` is not a fact: it has the variable `Colour`"),
    ("file: program.pl, outputs: {n: §m.S}", "E581", "a term cannot go on with `.S`"),
    ("file: program.pl, inputs: {level: '§f(a'}, on_failure: stale", "E581", "is not a query: a bracket is open"),
    ("file: program.pl, inputs: {level: §a.}, on_failure: stale", "E581", "a term cannot go on with `.`"),
    ("file: §nowhere.pl, outputs: [n]", "E493", "there is no file `nowhere.pl`"),
    ("file: program.pl, limit: §fast, outputs: [n]", "E493", "`fast` is not a positive time"),
    ("file: program.pl, every: §0ms, outputs: [n]", "E493", "`0ms` is not a positive time"),
    ("file: program.pl, limit: §50, outputs: [n]", "E493", "`limit: 50` has no unit"),
    ("file: program.pl, every: §0.5, outputs: [n]", "E493", "`every: 0.5` has no unit"),
]
UNUSABLE = {
    "level: '§f(X)'": (
        "level(1).\nf(1).",
        "E581",
        "`f(X)` has no `Value`, and is the query of a number or an enumerator",
    ),
    "level: §'levl(Value)'": ("level(1).", "E581", "`levl(Value)`: the program has `level/1`, and no `levl/1`"),
    "level: level": ("level(X) :- §now(X).\nlevel(X) :- member(X, [1]).", "E582", "`now/1` is not defined"),
    "level: level(Value) ": ("level(1§ :- a.", "E582", "Syntax error: "),
    "level: level(Value)": ("level(1).\n§n(0).", "E582", "`n(0)` is a fact of the port, and has clauses"),
    " level: level": ("level(1).\n§:- halt.", "E582", "it ends Prolog by `halt`"),
    "  level: level": ("level(1).\n§:- foo(1).", "E582", "Unknown procedure: foo/1"),
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "program.pl").write_text(PROGRAM, encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize(("keys", "code", "why"), WRONG)
def test_what_is_wrong_with_a_port_is_said_at_its_place(keys: str, code: str, why: str, folder: Path) -> None:
    text = f"ports: {{p: {{kind: prolog, {keys}}}}}"
    with pytest.raises(DiagnosticError) as caught:
        declared(text.replace("§", ""), folder)
    (found,) = caught.value.diagnostics
    place = Source("x", text.replace("§", "")).position(text.index("§"))
    assert (found.code, found.span and (found.span.line, found.span.column)) in (
        (code, place),
        (code, (1, place[1] - 1)),
    )
    assert why in found.message and found.hint


def test_a_missing_prolog_is_named_with_its_package(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    specs = declared(PORTS, folder)  # nothing is started yet
    monkeypatch.setattr(shutil, "which", lambda _: None)
    with pytest.raises(DiagnosticError) as caught, bench(*specs):
        pass
    (found,) = caught.value.diagnostics
    assert found.code == "E580" and "swi-prolog-nox" in (found.hint or "")
    assert found.span is not None and found.span.text == "prolog"


@needs("swipl")
@pytest.mark.slow
@pytest.mark.parametrize("inputs", UNUSABLE)
def test_a_program_that_cannot_be_used_is_said_before_the_run(inputs: str, folder: Path) -> None:
    program, code, why = UNUSABLE[inputs]
    (folder / "program.pl").write_text(program.replace("§", ""), encoding="utf-8")
    text = f"ports: {{p: {{kind: prolog, file: program.pl, outputs: [n], inputs: {{{inputs}}}, on_failure: stale}}}}"
    with pytest.raises(DiagnosticError) as caught, bench(*declared(text.replace("§", ""), folder)):
        pass
    (found,) = caught.value.diagnostics
    assert found.code == code and why in found.message and found.hint and found.span is not None
    if code == "E582":
        at = program.index("§")
        assert (found.span.file, found.span.line) == (str(folder / "program.pl"), 1 + program[:at].count("\n"))
        assert "Syntax" in why or found.span.column == 1 or program[at:].startswith("§" + found.span.text)
    else:
        assert found.span.text.strip("'") == inputs.partition(": ")[2].replace("§", "").strip("'")


HINTS = [
    (
        "level(1) :- enn(_).",
        "en(Value)",
        "level",
        "`enn/1` is not defined",
        "gives `en/1`, by `en(Value)`: did you mean",
    ),
    ("level(1) :- few.", "few", "level", "`few/0` is not defined", "gives `few/1`, by `few`: did you mean"),
    ("level.", "n", "level(Value)", "the program has `level/0`, and no `level/1`", "write `level`, without arguments"),
    ("level(1).", "n", "levl(Value)", "the program has `level/1`, and no `levl/1`", "did you mean `level/1`?"),
    (":- use_module(library(no_such)).\nlevel(1).", "n", "level", "`library(no_such)` is not installed", "install it"),
    ("level(1)\nmore.", "n", "level", "Operator expected", "look for a missing `.` or `,`"),
    ("level(1) :- N(_).", "n", "level", "Operator expected", "begin the name of a predicate with a small letter"),
    ("level(1) :- not n(2).", "n", "level", "Operator expected", "write `\\+ p`"),
    ("level(1) <- n(2).", "n", "level", "Operator expected", "write `:-`"),
    ("level(1).\n:- repeat, fail.", "n", "level", "it is not loaded within 1 s", "by `patience`"),
]
"""A program, a fact, a query, what is said and the hint."""


@needs("swipl")
@pytest.mark.slow
@pytest.mark.parametrize(("program", "fact", "query", "why", "hint"), HINTS)
def test_a_program_that_cannot_be_used_gets_a_hint(
    program: str, fact: str, query: str, why: str, hint: str, folder: Path
) -> None:
    (folder / "program.pl").write_text(program, encoding="utf-8")
    patience = "1s" if "repeat" in program else "60s"
    text = f"ports: {{p: {{kind: prolog, file: program.pl, patience: {patience}, outputs: {{n: {fact}}}, "
    with (
        pytest.raises(DiagnosticError) as caught,
        bench(*declared(f"{text}inputs: {{level: {query}}}, on_failure: stale}}}}", folder)),
    ):
        pass
    (found,) = caught.value.diagnostics
    assert why in found.message and hint in (found.hint or "")


def test_terms_without_quotes_are_told_to_have_some(folder: Path) -> None:
    text = "ports: {p: {kind: prolog, file: program.pl, outputs: {n: f(a, Value)}}}"
    with pytest.raises(DiagnosticError) as caught:
        declared(text, folder)
    assert [one.code for one in caught.value.diagnostics] == ["E581", "E032"]
    assert "in quotes" in (caught.value.diagnostics[0].hint or "")


def answered(made: Bench) -> bool:
    return all(not counts.silent for counts in made.ports.counts.values())


@needs("swipl")
@pytest.mark.slow
def test_facts_and_answers_of_all_types(folder: Path) -> None:
    (folder / "program.pl").write_text(PROGRAM.replace("go(yes).\n", ""), encoding="utf-8")
    with bench(*declared(PORTS, folder)) as made:
        made.until(lambda: answered(made))
        made.board.posts.post({"go": True, "far": -2})  # `seen` and `now` follow while `go` is true
        made.until(made.has("seen", -2))
        made.until(made.has("level", -2))
        made.until(made.has("now", "HIGH"))
        made.until(made.has("mode", "LOW"))
        made.until(made.has("mode", "HIGH"))  # the machine copies it, and the answer changes
        made.board.posts.post({"go": False})
        made.until(made.has("level", 4))
        made.end("stopped")
        assert made.said == [] and made.ports.counts["p"].refused == 0


@needs("swipl")
@pytest.mark.slow
def test_the_loop_does_not_wait_for_a_query_that_never_ends(folder: Path) -> None:
    (folder / "program.pl").write_text(
        "level(1) :- open(runs, write, S), close(S), repeat, catch((repeat, fail), _, fail).\n"
    )
    text = PORTS.replace("{go: go, seen: seen, now: now(Value), drive: drive}", "[n]").replace(
        "[level, mode, speed]", "[level]"
    )
    text = (
        text.replace("limit: 10s", "limit: 500ms")
        .replace("stale", "safe\n    safe: {level: -3}")
        .replace("values: {low: LOW}", "")
    )
    with bench(*declared(text, folder)) as made:
        made.until((folder / "runs").exists)
        turns = 0
        while made.ports.counts["p"].failures == 0:
            made.turn()
            turns += 1
        assert turns > 50, "so many cycles within half a second and more"
        made.until(made.has("level", -3))
        assert made.said == [
            "port p: E583: `level` could not be cut at its limit, so Prolog is killed",
            "port p: a query has no answer: `level` gets its safe value",
        ]
        made.end("stopped")


ARRANGEMENT = """\
name: asked
cycle_ms: 10
whiteboard:
  enough: {type: bool, role: input}
  level: {type: 0..200, role: output}
machines:
  m:
    inline:
      machine: M
      states:
        - name: COUNT
          internal: if (level < 200) level += 1;
          transitions: [{when: enough, to: DONE}]
        - {name: DONE}
schedule: [m]
"""
ENOUGH = "ports: {p: {kind: prolog, file: p.pl, limit: 10s, outputs: [level], inputs: [enough], on_failure: stale}}\n"


@needs("swipl")
@pytest.mark.slow
def test_a_run_is_recorded_with_its_answers_replayed_and_monitored(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(ARRANGEMENT)
    (tmp_path / "p.ports.yaml").write_text(ENOUGH)
    (tmp_path / "p.pl").write_text("enough :- level(L), L >= 20.\n")
    paths = {name: str(tmp_path / name) for name in ("a.yaml", "p.ports.yaml", "run.rec")}
    promise = ("-p", "promise: G (sampled(enough) -> level >= 20)", "-p", "F m@DONE")
    done = llfsm(
        "run", paths["a.yaml"], "--ports", paths["p.ports.yaml"], "--for", "8s", "--record", paths["run.rec"], *promise
    )
    assert done.returncode == 0, done.stderr
    assert "violated" not in done.stdout + done.stderr
    (tmp_path / "p.pl").unlink()  # a replay asks nothing
    again = llfsm("replay", paths["run.rec"])
    assert again.returncode == 0 and "the same bit for bit" in again.stdout + again.stderr
    (tmp_path / "p.pl").write_text("enough :- level(L), L >= 5.\n")
    broken = llfsm("run", paths["a.yaml"], "--ports", paths["p.ports.yaml"], "--for", "2s", *promise)
    assert broken.returncode == 1 and "promise" in broken.stdout + broken.stderr


@pytest.mark.slow
def test_a_promise_is_an_assumption_of_proofs_which_start_no_prolog(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(ARRANGEMENT)
    kept = ("-p", "G (m@DONE -> level >= 20)", "-p", "assume promise: G (sampled(enough) -> level >= 20)")
    assert llfsm("verify", str(tmp_path / "a.yaml"), *kept).returncode == 0
    assert llfsm("verify", str(tmp_path / "a.yaml"), *kept[:2]).returncode == 1


@needs("swipl")
@pytest.mark.slow
def test_prolog_ends_with_its_run(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text(ARRANGEMENT)
    (tmp_path / "p.ports.yaml").write_text(ENOUGH)
    text = "enough :- current_prolog_flag(pid, P), open(pid, write, S), write(S, P), close(S), loop.\n"
    text += "loop :- repeat, catch((repeat, fail), _, fail).\n"
    (tmp_path / "p.pl").write_text(text)
    command = [sys.executable, "-m", "llfsm_verify", "run", "a.yaml", "--ports", "p.ports.yaml"]
    run = subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    while not (tmp_path / "pid").exists() or not (tmp_path / "pid").read_text():
        assert run.poll() is None
        time.sleep(0.001)
    pid = int((tmp_path / "pid").read_text())
    run.send_signal(signal.SIGKILL)
    run.wait()
    while Path(f"/proc/{pid}/stat").exists() and Path(f"/proc/{pid}/stat").read_text().split()[2] != "Z":
        time.sleep(0.001)
