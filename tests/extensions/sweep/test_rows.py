"""Rows of sweeps and their file: interrupted anywhere, a sweep that goes on gives the file of one that was not."""

from __future__ import annotations

import csv
import io
import json
import os
import re
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path

import pytest

from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.extensions.sweep import sweeping
from llfsm_verify.extensions.sweep.plan import plan
from llfsm_verify.extensions.sweep.reading import read_sweep
from llfsm_verify.extensions.sweep.rows import row_data, row_from
from llfsm_verify.extensions.sweep.sweeping import Rows, sweep
from llfsm_verify.extensions.sweep.table import text_table
from llfsm_verify.extensions.sweep.task import Outcome, Task
from tests.cli.running import llfsm
from tests.extensions.sweep.counting import written

TEXT = """\
arrangements: [a.yaml, b/faulty.yaml]
properties: [p.ltl]
constants: {LIMIT: [2, 5, 8]}
options: {engine: explicit}
"""


class Known:
    """A scheduler of tasks whose outcomes are known; the task with the number `at` (from 0) raises `error`."""

    def __init__(
        self, outcomes: dict[str, Outcome], at: int | None = None, error: BaseException | None = None, step: int = 1
    ) -> None:
        self.outcomes = outcomes
        self.at = at
        self.error = error
        self.step = step
        self.asked = 0
        self.closed = False

    def run(self, tasks: Iterable[Task], ended: Callable[[Task, Outcome], None]) -> None:
        for number, task in enumerate(list(tasks)[:: self.step]):
            if number == self.at:
                raise self.error or KeyboardInterrupt
            self.asked += 1
            ended(task, self.outcomes[task.key])

    def close(self) -> None:
        self.closed = True


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sweep")
    written(folder, TEXT)
    return folder


@pytest.fixture(scope="module")
def outcomes(folder: Path) -> dict[str, Outcome]:
    """What comes of each task, by its key."""
    found: dict[str, Outcome] = {}
    performed = sweeping.opened(None, 1)
    tasks = [each.task for each in plan(read_sweep(folder / "SWEEP.yaml")).combinations]
    performed.run(tasks, lambda task, outcome: found.update({task.key: outcome}))
    performed.close()
    assert len(found) == 6 and {outcome.state for outcome in found.values()} == {"done"}
    return found


Use = Callable[..., Known]


@pytest.fixture
def use(outcomes: dict[str, Outcome], monkeypatch: pytest.MonkeyPatch) -> Use:
    """Let `Known` perform."""

    def using(*arguments: object, **more: object) -> Known:
        known = Known(outcomes, *arguments, **more)  # type: ignore[arg-type]
        monkeypatch.setattr(sweeping, "opened", lambda *_: known)
        return known

    return using


def plain(path: Path) -> str:
    """The text of a file of results without what differs between two runs."""
    return re.sub(r'"(seconds|memory)": [\d.]+', r'"\1": 0', path.read_text())


def done(folder: Path, results: Path) -> Rows:
    return sweep(folder / "SWEEP.yaml", results=results)


def test_the_file_has_a_line_for_each_row_in_order(folder: Path, use: Use, tmp_path: Path) -> None:
    known = use(step=-1)
    rows = done(folder, tmp_path / "r.jsonl")
    assert known.closed and rows.stopped is None and rows.numbers == (1, 2, 3, 4, 5, 6)
    head, *lines = map(json.loads, (tmp_path / "r.jsonl").read_text().splitlines())
    assert head["kind"] == "sweep of llfsm-verify" and head["combinations"] == 6
    assert [row_from(line) for line in lines] == list(rows)
    assert [(row.values["arrangement"], row.values["LIMIT"]) for row in rows] == [
        (file, limit) for file in ("a.yaml", "b/faulty.yaml") for limit in (2, 5, 8)
    ]
    assert [row.verdict for row in rows] == ["violated"] * 6  # `reaches` needs an input that nothing forces
    assert [row.verdicts["few"] for row in rows] == ["holds", "holds", "violated", "holds", "violated", "violated"]
    for row in rows:
        assert set(row.traces) == {name for name, verdict in row.verdicts.items() if verdict == "violated"}
        for name, file in row.traces.items():
            assert f"name: {name}" in (tmp_path / file).read_text()


@pytest.mark.parametrize("at", range(6))
@pytest.mark.parametrize("step", [1, -1])
def test_interrupted_anywhere_it_gives_the_same_file(
    at: int, step: int, folder: Path, use: Use, tmp_path: Path
) -> None:
    use()
    whole, again = tmp_path / "whole.jsonl", tmp_path / "again.jsonl"
    done(folder, whole)
    known = use(at, step=step)
    rows = done(folder, again)
    assert isinstance(rows.stopped, KeyboardInterrupt) and rows.exit_code == 130 and len(rows) == at == known.asked
    known = use()
    rows = done(folder, again)
    assert known.asked == 6 - at and rows.stopped is None
    assert plain(again) == plain(whole).replace("whole", "again")


@pytest.mark.parametrize("cut", [1, 40, 10_000])
def test_a_file_that_was_cut_anywhere_goes_on(cut: int, folder: Path, use: Use, tmp_path: Path) -> None:
    use()
    path = tmp_path / "r.jsonl"
    done(folder, path)
    whole = plain(path)
    text = path.read_text()
    path.write_text(text[: max(len(text) - cut, text.index("\n") + 1)])
    known = use()
    done(folder, path)
    assert plain(path) == whole and known.asked == {1: 0, 40: 1, 10_000: 6}[cut]


def test_a_damaged_line_is_said_and_checked_again(folder: Path, use: Use, tmp_path: Path) -> None:
    use()
    path = tmp_path / "r.jsonl"
    done(folder, path)
    whole, lines = plain(path), path.read_text().splitlines()
    lines[2], lines[4] = lines[2].replace('"done"', '"doone"'), lines[4][:30]
    path.write_text("\n".join(lines))
    known, said = use(), []
    sweep(folder / "SWEEP.yaml", results=path, began=lambda _, known, warnings: said.extend([known, *warnings]))
    assert said[0] == 4 and [(d.code, d.span.line) for d in said[1:]] == [("W591", 3), ("W591", 5)]  # type: ignore[union-attr,attr-defined]
    assert known.asked == 2 and plain(path) == whole


@pytest.mark.parametrize(
    "damage",
    [
        {"verdicts": {"below": 1}}, {"reasons": {"below": None}}, {"traces": {"below": ["x"]}}, {"faults": [{}]},
        {"traces": {"below": "\0"}}, {"values": {}, "state": None}, b"\xff", b"[" * 100_000,
    ],
    ids=str,
)  # fmt: skip
def test_no_line_can_be_so_damaged_that_it_ends_a_sweep(
    damage: bytes | dict[str, object], folder: Path, use: Use, tmp_path: Path
) -> None:
    results = tmp_path / "r.jsonl"
    use()
    done(folder, results)
    lines = results.read_bytes().splitlines(keepends=True)
    lines[2] = (damage if isinstance(damage, bytes) else json.dumps(json.loads(lines[2]) | damage).encode()) + b"\n"
    results.write_bytes(b"".join(lines))
    known = use()
    rows = done(folder, results)
    assert known.asked == 1 and len(rows) == 6 and rows.text() and rows.csv() and rows.to_json()


def test_names_of_files_need_not_be_unicode_or_on_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path, "arrangements: ['a*.yaml']\n")
    for name in (b"a\xff.yaml", "a\u2028b.yaml".encode(), b"a\nb.yaml"):
        with suppress(OSError):  # not every file system has such names
            Path(os.fsdecode(bytes(tmp_path) + b"/" + name)).write_bytes((tmp_path / "a.yaml").read_bytes())
    keys = [each.task.key for each in plan(read_sweep(path)).combinations]
    known = Known(dict.fromkeys(keys, Outcome("done", {"exit_code": 0, "properties": []})))
    monkeypatch.setattr(sweeping, "opened", lambda *_: known)
    first, again = (sweep(path, results=tmp_path / "r.jsonl") for _ in range(2))
    assert known.asked == len(first) == len(keys) and first.text() and first.csv() and first.to_json()
    assert again.rows == first.rows


@pytest.mark.parametrize("name", ["-", "/dev/null", "/dev/zero", "/dev/stdout", "/dev/fd/1", "pipe", "."])
def test_results_are_kept_in_a_file(
    name: str, folder: Path, use: Use, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe")
    known = use()
    with pytest.raises(DiagnosticError, match="E596"):
        sweep(folder / "SWEEP.yaml", results=name)
    assert not known.asked and [each.name for each in tmp_path.iterdir()] == ["pipe"]


def test_rows_whose_traces_are_gone_are_checked_again(folder: Path, use: Use, tmp_path: Path) -> None:
    use()
    path = tmp_path / "r.jsonl"
    rows = done(folder, path)
    gone = tmp_path / next(iter(rows[3].traces.values()))
    gone.unlink()
    known = use()
    done(folder, path)
    assert known.asked == 1 and gone.is_file()


@pytest.mark.parametrize("state", ["failed", "killed", "timeout", "memory"])
def test_what_failed_or_was_killed_is_checked_again(
    state: str, folder: Path, use: Use, outcomes: dict[str, Outcome], tmp_path: Path
) -> None:
    path, known = tmp_path / "r.jsonl", use()
    key = min(outcomes)
    known.outcomes = {**outcomes, key: Outcome(state, None, "no luck", 0.5)}  # type: ignore[arg-type]
    rows = done(folder, path)
    (row,) = (row for row in rows if row.key == key)
    assert (row.verdict, row.exit_code, row.message) == (state, 3 if state == "failed" else 4, "no luck")
    assert rows.exit_code == (3 if state == "failed" else 1)
    assert f"row {rows.rows.index(row) + 1}: {state}: no luck" in rows.text()
    again = use()
    done(folder, path)
    assert again.asked == (state in ("failed", "killed"))


def test_texts_that_changed_are_checked_again(use: Use, outcomes: dict[str, Outcome], tmp_path: Path) -> None:
    path = written(tmp_path, TEXT)
    use()
    done(tmp_path, tmp_path / "r.jsonl")
    path.write_text(TEXT.replace("[2, 5, 8]", "[8, 2]"))
    known, said = use(), []
    rows = sweep(path, results=tmp_path / "r.jsonl", began=lambda *all_: said.extend(all_[2]))
    assert known.asked == 0 and [row.values["LIMIT"] for row in rows] == [8, 2, 8, 2]
    (warning,) = said
    assert warning.code == "W592" and warning.message.startswith("2 rows of the file belong to no combination")
    (tmp_path / "m.machine.yaml").write_text((tmp_path / "m.machine.yaml").read_text() + "# other\n")
    with pytest.raises(KeyError):  # neither is a task that is known
        done(tmp_path, tmp_path / "r.jsonl")


@pytest.mark.parametrize("at", [0, 1, 3])
def test_rows_of_other_combinations_are_kept(at: int, use: Use, tmp_path: Path) -> None:
    path, results = written(tmp_path, TEXT), tmp_path / "r.jsonl"
    use()
    done(tmp_path, results)
    _, *before = plain(results).splitlines()
    path.write_text(TEXT.replace("[2, 5, 8]", "[8, 2]"))
    head, *lines = results.read_text().splitlines(keepends=True)
    if at:  # it was begun with one row that is known, and ended after some others
        eights = [line for line in lines if '"LIMIT": 8' in line]
        results.write_text("".join([head, eights[0], *(line for line in lines if '"LIMIT": 5' in line)]))
        use(at - 1)
        done(tmp_path, results)
    use()
    rows = done(tmp_path, results)
    _, *after = plain(results).splitlines()
    assert len(rows) == 4 and after == [before[i] for i in (2, 0, 5, 3, 1, 4)]
    path.write_text(TEXT)
    known = use()
    done(tmp_path, results)
    assert known.asked == 0 and plain(results).splitlines()[1:] == before


def test_a_sweep_that_ended_before_its_first_row_goes_on(use: Use, tmp_path: Path) -> None:
    path, results = written(tmp_path, TEXT), tmp_path / "r.jsonl"
    use()
    done(tmp_path, results)
    path.write_text(TEXT.replace("[2, 5, 8]", "[2, 5]") + "# other\n")
    lines = results.read_text().splitlines(keepends=True)
    lines[1:] = [line.replace('"key": "', '"key": "0') if '"LIMIT": 8' not in line else line for line in lines[1:]]
    results.write_text("".join(lines))  # as if texts had changed
    use(0)
    assert len(done(tmp_path, results)) == 0
    assert [json.loads(line)["values"]["LIMIT"] for line in results.read_text().splitlines()[1:]] == [8, 8]
    use()
    assert len(done(tmp_path, results)) == 4 and results.read_text().count("\n") == 7


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("arrangements: [a.yaml]\n", "this is not a file of results of a sweep"),
        ('{"format": 2, "kind": "sweep of llfsm-verify"}\n', "this is not a file of results"),
        ('{"kind": 3}\n', "this is not a file of results"),
        ("\ud8ff", "this is not a file of results"),
    ],
)
def test_other_files_are_not_replaced(text: str, said: str, folder: Path, use: Use, tmp_path: Path) -> None:
    use()
    path = tmp_path / "other"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    with pytest.raises(DiagnosticError, match=said) as raised:
        done(folder, path)
    assert raised.value.diagnostics[0].code == "E596" and path.read_bytes() == text.encode("utf-8", "surrogatepass")


def test_results_of_another_sweep_are_not_replaced(folder: Path, use: Use, tmp_path: Path) -> None:
    use()
    path = tmp_path / "r.jsonl"
    done(folder, path)
    text = path.read_text()
    other = written(tmp_path, "arrangements: [a.yaml]\n")
    with pytest.raises(DiagnosticError, match="this file has 6 rows, none of a combination of this sweep"):
        sweep(other, results=path)
    assert path.read_text() == text


def test_results_that_cannot_be_written(folder: Path, use: Use, tmp_path: Path) -> None:
    use()
    for path in (tmp_path, tmp_path / "no" / "r.jsonl"):
        with pytest.raises(DiagnosticError) as raised:
            done(folder, path)
        assert raised.value.diagnostics[0].code == "E596"


def test_a_lost_scheduler_leaves_what_is_known(folder: Path, use: Use, tmp_path: Path) -> None:
    from llfsm_verify.diagnostics import Diagnostic

    lost = DiagnosticError(Diagnostic("E600", "the scheduler is gone", file="tcp://x:1"))
    use(4, lost)
    path = tmp_path / "r.jsonl"
    rows = done(folder, path)
    assert rows.stopped is lost and len(rows) == 4 == len(path.read_text().splitlines()) - 1
    use(4, lost)
    found = llfsm("sweep", str(folder / "SWEEP.yaml"), "--results", str(tmp_path / "s.jsonl"))
    assert found.returncode == 3 and "error[E600]: the scheduler is gone" in found.stderr
    assert "4 of 6 combinations: violated 4" in found.stdout and "ended after 4 of 6 rows; to go on: " in found.stderr


# ---------------------------------------------------------------- tables


def test_rows_go_through_json(folder: Path, use: Use) -> None:
    use()
    for row in sweep(folder / "SWEEP.yaml"):
        assert row_from(json.loads(json.dumps(row_data(row)))) == row and row.traces == {}


def test_the_formats_say_the_same(folder: Path, use: Use, tmp_path: Path) -> None:
    use()
    found = {}
    for name in ("text", "json", "csv"):
        run = llfsm("sweep", str(folder / "SWEEP.yaml"), "--results", str(tmp_path / "r.jsonl"), "--format", name)
        assert run.returncode == 1, run
        found[name] = run.stdout
    data = json.loads(found["json"])
    assert data["exit_code"] == 1 and data["combinations"] == 6
    lines = list(csv.DictReader(io.StringIO(found["csv"])))
    assert len(lines) == len(data["rows"]) == 6
    for line, row in zip(lines, data["rows"], strict=True):
        assert int(line["row"]) == row["row"] and line["LIMIT"] == str(row["values"]["LIMIT"])
        assert {name: line[name] for name in row["verdicts"]} == row["verdicts"]
        assert line["traces"].split("; ") == list(row["traces"].values())
    table = re.sub(r"\d+\.\d\d  *[\d–]+", "", found["text"])
    assert (
        [line.rstrip() for line in table.splitlines()]
        == """\
In all rows: properties = p.ltl, reaches violated, faults holds

row  arrangement    LIMIT  verdict   few       filled    seconds  MiB
  1  a.yaml             2  violated  holds     holds
  2  a.yaml             5  violated  holds     holds
  3  a.yaml             8  violated  violated  violated
  4  b/faulty.yaml      2  violated  holds     holds
  5  b/faulty.yaml      5  violated  violated  holds
  6  b/faulty.yaml      8  violated  violated  violated

6 combinations: violated 6""".splitlines()
    )


def test_a_narrow_table_names_what_does_not_hold(folder: Path, use: Use) -> None:
    use()
    rows = sweep(folder / "SWEEP.yaml")
    lines = rows.text(64).splitlines()
    assert lines[2].split() == ["row", "arrangement", "LIMIT", "verdict", "seconds", "MiB", "not", "holding"]
    assert lines[5].endswith("violated: few, filled, reaches")
    assert text_table([], [], 80).strip().startswith("row")


def test_one_row_is_shown_whole(folder: Path, use: Use) -> None:
    use()
    rows = sweep(folder / "SWEEP.yaml")
    (head, line) = text_table(rows[:1], [1], 120).splitlines()
    assert head.split()[:4] == ["row", "arrangement", "LIMIT", "properties"] and "a.yaml" in line


def test_reasons_are_said_once_with_their_rows(folder: Path, tmp_path: Path) -> None:
    path = written(tmp_path, TEXT.replace("explicit", "explicit, max_states: 2"))
    rows = sweep(path, jobs=1)
    assert rows.exit_code in (1, 4)
    notes = [line for line in rows.text().splitlines() if "because" in line]
    assert notes and all("because the limit of 2 configurations was reached" in line for line in notes)
    told = {name: sum(name in row.reasons for row in rows) for row in rows for name in row.reasons}
    for name, number in told.items():
        (note,) = (line for line in notes if f": {name} is unknown because" in line)
        assert len(note.partition(":")[0].split()) == 1 + number
    assert len(notes) == len(told) and max(told.values()) > 1


def test_two_sweeps_do_not_write_one_file(folder: Path, use: Use, tmp_path: Path) -> None:
    """The second one is told before it checks anything; afterwards the file can be used again."""
    results, said = tmp_path / "rows.jsonl", []
    use()

    def again(*_: object) -> None:
        with pytest.raises(DiagnosticError, match="another sweep is writing this file") as refused:
            sweep(folder / "SWEEP.yaml", results=results)
        said.append(refused.value)

    sweep(folder / "SWEEP.yaml", results=results, ended=again)
    assert len(said) == 6
    assert len(done(folder, results).rows) == 6
