"""Sweep files: what they mean, and what is said of wrong ones."""

from __future__ import annotations

import re
from itertools import islice
from pathlib import Path
from random import Random

import jsonschema
import pytest

from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.extensions.sweep.plan import plan
from llfsm_verify.extensions.sweep.reading import SWEEP, read_sweep
from llfsm_verify.report.schema import SCHEMAS
from tests.extensions.sweep.counting import written
from tests.fuzzing.mutating import Words, mutate_gently, mutate_text
from tests.quick import examples

A = "arrangements: [a.yaml]\n"
WRONG: dict[str, tuple[str, str, int, int, str]] = {
    "empty": ("", "E011", 0, 0, "empty"),
    "no arrangement": ("properties: [p.ltl]\n", "E034", 1, 1, "write `arrangements: …`"),
    "list": ("- a.yaml\n", "E030", 1, 1, "a sweep must be a mapping"),
    "unknown key": (A + "constats: {LIMIT: [1]}\n", "E033", 2, 1, "did you mean `constants`?"),
    "other word": (A + "constant: {LIMIT: [1]}\n", "E033", 2, 1, "write `constants`"),
    "key twice": (A + A, "E017", 2, 1, "appears twice"),
    "later format": (f"format: 2\n{A}", "E097", 1, 9, "format"),
    "tag": (A + "constants: {LIMIT: !int 3}\n", "E016", 2, 20, "tag"),
    "no values": (A + "constants: {LIMIT: []}\n", "E034", 2, 20, "write at least one"),
    "no paths": ("arrangements: []\n", "E034", 1, 15, "write at least one"),
    "no such file": ("arrangements: [b.yaml]\n", "E001", 1, 16, "there is no such file"),
    "no match": ("arrangements: ['x*.yaml']\n", "E590", 1, 16, "check the pattern"),
    "machines only": ("arrangements: ['*.machine.yaml']\n", "E590", 1, 16, "matches no file that is an arrangement"),
    "a machine": ("arrangements: [m.machine.yaml]\n", "E019", 0, 0, "an arrangement is expected"),
    "path twice": ("arrangements: [a.yaml, ./b/../a.yaml]\n", "E593", 1, 24, "the first one, `a.yaml`, is at line 1"),
    "path and pattern": ("arrangements: [a.yaml, 'a*.yaml']\n", "E593", 1, 24, "two combinations would be one"),
    "number twice": (A + "constants: {LIMIT: [1, 2, 0x1]}\n", "E593", 2, 27, "the first one, `1`, is at line 2"),
    "decimal twice": (A + "initial: {step: [0.5, 0.50]}\n", "E593", 2, 23, "`0.50` is a value of `step`"),
    "property file twice": (A + "properties: [p.ltl, p.ltl]\n", "E593", 2, 21, "leave one of them out"),
    "constant and parameter": (
        A + "constants: {LIMIT: [1, 2]}\nparameters: {left.LIMIT: [3]}\n", "E593", 3, 14, "as a constant already",
    ),
    "name of a column": (A + "constants: {arrangement: [1]}\n", "E593", 2, 13, "already"),
    "no such constant": (A + "constants: {LIMITS: [1]}\n", "E591", 2, 13, "did you mean `LIMIT`?"),
    "no such parameter": (A + "parameters: {middle.LIMIT: [1]}\n", "E591", 2, 14, "did you mean `left.LIMIT`"),
    "no such variable": (A + "initial: {left.cuont: [1]}\n", "E591", 2, 11, "did you mean `left.count`"),
    "not of the faulty one": (
        "arrangements: [a.yaml, c.yaml]\nconstants: {LIMIT: [1]}\n", "E591", 2, 13,
        "write a sweep of its own for those that have it: a.yaml",
    ),
    "out of range": (A + "constants: {LIMIT: [1, 10]}\n", "E128", 2, 24, "10"),
    "range out of range": (A + "constants: {LIMIT: {from: 1, to: 12}}\n", "E128", 2, 34, "10"),
    "initial out of range": (A + "initial: {n: [21]}\n", "E128", 2, 15, "outside `n`'s range"),
    "no enumerator": (A + "initial: {light: [RED, BLUE]}\n", "E110", 2, 24, "BLUE"),
    "no truth": (A + "initial: {go: tru}\n", "E110", 2, 15, "did you mean `true`?"),
    "an array": (A + "initial: {flags: [[true]]}\n", "E050", 2, 19, "2 elements"),
    "no whiteboard variable": (A + "parameters: {left.total: [m]}\n", "E063", 2, 27, "no whiteboard variable `m`"),
    "two at once": (A + "initial: {n: [20], left.COUNT.turns: [4]}\n", "E128", 2, 39, "turns"),
    "no numbers": (A + "constants: {LIMIT: {from: 5, to: 1}}\n", "E594", 2, 34, "no number from 5 to 1"),
    "no step": (A + "constants: {LIMIT: {from: 1, to: 5, step: 0}}\n", "E594", 2, 43, "write a positive one"),
    "a negative step": (A + "constants: {LIMIT: {from: 1, to: 5, step: -2}}\n", "E594", 2, 43, "write a positive one"),
    "dots": (A + "constants: {LIMIT: 1..3}\n", "E594", 2, 20, "write `{from: 1, to: 3}`"),
    "dots in a list": (A + "constants: {LIMIT: [9, 1 .. 3]}\n", "E594", 2, 24, "write `{from: 1, to: 3}`"),
    "dots of decimals": (A + "initial: {step: -0.5...0.7}\n", "E594", 2, 17, "write `{from: -0.5, to: 0.7}`"),
    "no number": (A + "constants: {LIMIT: {from: one, to: 5}}\n", "E594", 2, 27, "`from` cannot be `one`"),
    "no end": (A + "constants: {LIMIT: {from: 1}}\n", "E034", 2, 20, "write `to: …`"),
    "key of a range": (A + "constants: {LIMIT: {from: 1, to: 2, by: 1}}\n", "E033", 2, 37, "known here"),
    "a million": (
        A + "constants: {LIMIT: {from: 1, to: 1000}}\ninitial: {n: {from: 0, to: 999}}\n", "E592", 2, 13,
        "1,000,000 combinations (1,000 of `LIMIT` × 1,000 of `n`)",
    ),
    "a billion": (A + "constants: {LIMIT: {from: 1, to: 999999999999}}\n", "E592", 2, 13, "at most 100,000"),
    "more than 2^63": (A + "constants: {LIMIT: {from: 0, to: 9223372036854775807}}\n", "E592", 2, 13, "10^18"),
    "many names": (
        A + f"constants: {{{', '.join(f'n{i}: [1, 2]' for i in range(15000))}}}\n", "E592", 2, 13,
        "more than 10^4515 combinations (2 of `n0` × 2 of `n1` × 2 of `n2` × 2 of `n3` × 2 of `n4` × 2 of `n5` × …)",
    ),
    "a long key": (A + f"constants: {{{'x' * 60000}: 1}}\n", "E010", 2, 59953, "is missing before"),
    "a path with a zero": ('arrangements: ["a\\0.yaml"]\n', "E001", 1, 16, "the path of a file is expected"),
    "excluded stranger": (A + "constants: {LIMIT: [1]}\nexclude: [{LIMT: 1}]\n", "E595", 3, 12, "`LIMIT`?"),
    "all excluded": (A + "constants: {LIMIT: [1]}\nexclude: [{LIMIT: 1}]\n", "E595", 3, 11, "everything is excluded"),
    "empty exclusion": (A + "exclude: [{}]\n", "E034", 2, 11, "write `NAME: VALUE`"),
    "no list of exclusions": (A + "exclude: {arrangements: a.yaml}\n", "E031", 2, 10, "write `- `"),
    "no option": (A + "options: {time_out: 3}\n", "E033", 2, 11, "did you mean `timeout`?"),
    "no time": (A + "options: {timeout: 3 weeks}\n", "E597", 2, 20, "not a positive time"),
    "no size": (A + "options: {memory: 300}\n", "E597", 2, 19, "has no unit"),
    "no engine": (A + "options: {engine: exact}\n", "E597", 2, 19, "there is no engine `exact`"),
    "no syntax": (A + "options: {syntax: tla}\n", "E597", 2, 19, "there is no syntax `tla`"),
    "no count": (A + "options: {max_states: many}\n", "E597", 2, 23, "a whole number from 1"),
    "not of this engine": (A + "options: {engine: explicit, depth: 3}\n", "E597", 2, 36, "depth"),
    "no checkpoints": (A + "options: {checkpoint: x}\n", "E033", 2, 11, "known keys"),
    "wrong property": (A + "properties: [p.ltl]\n", "E110", 1, 10, "nn"),
    "wrong in its file": (A + "constants: {LIMIT: [1]}\n", "E110", 0, 0, "nothing"),
}  # fmt: skip
"""A sweep, the code of what is said first, its line and column (0: in another file), and words of it."""


@pytest.mark.parametrize("name", WRONG)
def test_what_is_said_of_a_wrong_file(name: str, tmp_path: Path) -> None:
    text, code, line, column, said = WRONG[name]
    more = {"c_yaml": "whiteboard: {}\nmachines: {m: {inline: {machine: M, states: [{name: A}]}}}\nschedule: [m]\n"}
    if name == "wrong property":
        more["p_ltl"] = "few: G nn <= 5\n"
    path = written(tmp_path, text, **more)
    if name == "wrong in its file":
        (tmp_path / "a.yaml").write_text((tmp_path / "a.yaml").read_text().replace("total: n", "total: nothing"))
        code = "E063"
    with pytest.raises(DiagnosticError) as raised:
        plan(read_sweep(path))
    first = raised.value.diagnostics[0]
    where = "" if first.span is None else Path(first.span.source.name).name
    assert (first.code, said in first.render()) == (code, True), first.render()
    if name == "wrong property":
        assert where == "p.ltl"
    elif line:
        assert first.span is not None
        assert (where, first.span.line, first.span.column) == ("SWEEP.yaml", line, column), first.render()


def test_a_wrong_constant_is_one_mistake(tmp_path: Path) -> None:
    """Also where an initial value of the machine asks for it."""
    text = A + "constants: {LIMIT: [0]}\n"
    path = written(tmp_path, text)
    machine = tmp_path / "m.machine.yaml"
    machine.write_text(machine.read_text().replace("count: {type: 0..9}", "count: {type: 0..9, init: LIMIT}"))
    with pytest.raises(DiagnosticError) as raised:
        plan(read_sweep(path))
    assert [(d.code, d.span.column) for d in raised.value.diagnostics if d.span] == [("E128", 21)]


def test_mistakes_are_told_together(tmp_path: Path) -> None:
    path = written(tmp_path, A + "constants: {LIMIT: [0, 1, 10]}\n")
    with pytest.raises(DiagnosticError) as raised:
        plan(read_sweep(path))
    assert [d.span.column for d in raised.value.diagnostics if d.span is not None] == [21, 27]


def test_nothing_is_read_of_files_that_are_no_arrangements(tmp_path: Path) -> None:
    path = written(tmp_path, "arrangements: [secret.yaml]\n", secret_yaml="password: hunter2\n")
    with pytest.raises(DiagnosticError) as raised:
        plan(read_sweep(path))
    assert "hunter2" not in str(raised.value)


def test_what_a_file_means(tmp_path: Path) -> None:
    path = written(tmp_path, """\
arrangements: [a.yaml, "b/*.yaml"]
properties: p.ltl
constants: {LIMIT: {from: 1, to: 0x9, step: 4}}
parameters: {left.total: n}
initial:
  step: {from: 0, to: 0.3, step: 0.1}
  flags: [[false, true], [true, true]]
  light: [RED, GREEN]
options: {engine: explicit, timeout: 10 s, memory: 1 GiB, max_states: 100000, strict: true}
""")  # fmt: skip
    found = read_sweep(path)
    values = {axis.name: [each.value for each in axis.values] for axis in found.axes}
    assert values == {
        "arrangement": ["a.yaml", "b/faulty.yaml"], "LIMIT": [1, 5, 9], "left.total": ["n"],
        "step": [0, 0.1, 0.2, 0.3], "flags": [[False, True], [True, True]], "light": ["RED", "GREEN"],
        "properties": ["p.ltl"],
    }  # fmt: skip
    assert (found.timeout, found.memory) == (10.0, 1 << 30)
    assert found.options == {"engine": "explicit", "max_states": 100_000, "strict": True}
    assert len(plan(found).combinations) == 2 * 3 * 4 * 2 * 2


def test_the_same_as_python_data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = A + "constants: {LIMIT: {from: 1, to: 3}}\ninitial: {light: [RED, GREEN]}\n"
    data = {"arrangements": ["a.yaml"], "constants": {"LIMIT": [1, 2, 3]}, "initial": {"light": ["RED", "GREEN"]}}
    path = written(tmp_path, text)
    monkeypatch.chdir(tmp_path)
    keys = [[each.task.key for each in plan(read_sweep(given)).combinations] for given in (path, data)]
    assert keys[0] == keys[1] and len(set(keys[0])) == 6
    with pytest.raises(DiagnosticError) as raised:
        plan(read_sweep({**data, "constants": {"LIMIT": [1, 12]}}))
    assert str(raised.value).startswith("constants.LIMIT[1]:1:1: error[E128]")


def test_a_long_range_is_not_made() -> None:
    (axis,) = (
        axis
        for axis in read_sweep({"arrangements": "a.yaml", "initial": {"n": {"from": -50_000, "to": 49_999}}}).axes
        if axis.name == "n"
    )
    assert len(axis.values) == 100_000
    assert [each.value for each in islice(axis.values, 3)] == [-50_000, -49_999, -49_998]


def test_the_schema_has_the_keys_and_takes_what_is_read(tmp_path: Path) -> None:
    schema = SCHEMAS.load("sweep")("sweep")
    properties = schema["properties"]
    assert isinstance(properties, dict) and tuple(properties) == SWEEP.keys
    checker = jsonschema.Draft202012Validator(schema)
    import yaml

    example = yaml.safe_load(Path("models/microwave/minutes/SWEEP.yaml").read_text())
    assert not list(checker.iter_errors(example))
    for name in ("unknown key", "no arrangement", "no end", "key of a range", "no list of exclusions", "no values"):
        assert list(checker.iter_errors(yaml.safe_load(WRONG[name][0]))), name


WHOLE = """\
arrangements: [a.yaml, "b/*.yaml"]
properties: [p.ltl, q.ltl]
constants: {LIMIT: {from: 1, to: 0x9, step: 4}}
parameters: {left.total: n}
initial:
  step: {from: 0, to: 0.3, step: 0.1}
  flags: [[false, true], [true, true]]
  light: [RED, GREEN]
exclude: [{LIMIT: [1, 5], arrangements: b/faulty.yaml, properties: "q*"}, {light: RED}]
options: {engine: explicit, timeout: 10 s, memory: 1 GiB, strict: true, accept_vacuity: [few]}
"""


@pytest.mark.slow
def test_files_that_were_changed_at_random_are_read_or_refused(tmp_path: Path) -> None:
    path = written(tmp_path, WHOLE)
    words = Words((*re.findall(r"[^\s:,]+", WHOLE), "-1", "1e9", "999999999999999999", "**", "..", "/", "~"), (WHOLE,))
    refused: list[str] = []
    for number in range(examples(120)):
        random = Random(f"sweep {number}")
        text = mutate_gently(random, WHOLE) if number % 2 else mutate_text(random, WHOLE, words)
        path.write_bytes(text.encode("utf-8", "surrogatepass"))
        try:
            plan(read_sweep(path))
        except DiagnosticError as error:
            refused += [diagnostic.render() for diagnostic in error.diagnostics]
    assert len(refused) > 10 and all(refused)
