"""What the program behind a port answers, and what it does with programs that loop, end, write, or keep things."""

from __future__ import annotations

import os
import random
import signal
import time
from pathlib import Path
from typing import Any

import pytest

from tests.extensions.prolog.asked import BOOL, Bridge, alone, bridge, names, number
from tests.outside import needs

pytestmark = [needs("swipl"), pytest.mark.slow]

COLOURS = names("red", "amber", "GREEN")
LIGHTS = """\
:- discontiguous next/2.
next(X, red) :- light(X, amber).
next(X, amber) :- light(X, 'GREEN').
next(X, 'GREEN') :- light(X, red), \\+ blocked(X).
blocked(ns) :- car_waiting, level(N), N > 3.
blocked(ew) :- light(ns, 'GREEN') ; light(ns, amber).
may_go(X) :- next(X, 'GREEN').
twice(Y) :- level(X), Y is 2*X.
mean(Y) :- level(X), speed(Z), Y is round((X+Z)*5) / 10.0.
"""


def test_answers_are_those_of_a_prolog_for_each_query(tmp_path: Path) -> None:
    file = tmp_path / "lights.pl"
    file.write_text(LIGHTS, encoding="utf-8")
    facts = {"light(ns, Value)": COLOURS, "light(ew, Value)": COLOURS, "car_waiting": BOOL,
             "level(Value)": number(-9, 9), "speed(Value)": number(-99, 99, 1)}  # fmt: skip
    queries = {"next(ns, Value)": COLOURS, "next(ew, Value)": COLOURS, "may_go(ns)": BOOL, "may_go(_)": BOOL,
               "twice(Value)": number(-18, 18), "mean(Value)": number(-99, 99, 1)}  # fmt: skip
    draw = random.Random(81)
    asked = 0
    with bridge(file, facts, queries) as made:
        made.until("hello")
        for _ in range(10):
            values: dict[str, Any] = {
                "light(ns, Value)": draw.choice(COLOURS["labels"]), "light(ew, Value)": draw.choice(COLOURS["labels"]),
                "car_waiting": draw.random() < 0.5, "level(Value)": draw.randint(-9, 9),
                "speed(Value)": f"{draw.randint(-9, 9)}.{draw.randint(0, 9)}",
            }  # fmt: skip
            given = [field.replace("Value", f"'{value}'" if field.startswith("light") else str(value))
                     for field, value in values.items() if value is not False]  # fmt: skip
            text = ":- dynamic car_waiting/0.\n" + LIGHTS
            made.heard.clear()
            answers = made.ask(values)
            for query in draw.sample(sorted(queries), 2):
                expected, got = alone(tmp_path, text, given, query), answers.get(query)
                asked += 1
                if got is None:
                    assert expected == "no" and query.startswith("next")
                elif isinstance(got, bool):
                    assert expected == ("yes" if got else "no")
                else:
                    assert got == expected.strip("'") or float(got) == float(expected), (query, values)
    assert asked == 20


def run(folder: Path, text: str, queries: dict[str, Any], rounds: int = 2, **told: Any) -> Bridge:
    """What is said for rounds with the facts `n(0)`, `n(1)` and so on."""
    file = folder / "program.pl"
    file.write_text(text, encoding="utf-8")
    with bridge(file, {"n(Value)": number(0, 99)}, queries, **told) as made:
        made.until("hello")
        for n in range(rounds):
            made.say({"values": {"n(Value)": n}})
            made.until("values")
    return made


UNANSWERED = {
    "bad(_) :- repeat, fail.": "has no answer within its limit of 1000 ms",
    "bad(_) :- repeat, catch((repeat, fail), _, fail).": "could not be cut at its limit, so Prolog is killed",
    "bad(_) :- n(_), halt.": "has ended Prolog by `halt`",
    "bad(_) :- forall(stream_property(S, _), catch(close(S, [force(true)]), _, true)).": "Prolog has ended with code 2",
    "bad(_) :- shell('kill -9 $PPID').": "Prolog was killed",
    "bad(X) :- n(Y),\n    Z is Y + a,\n    X = Z.": "Arithmetic: `a/0' is not a function",
    "bad(_) :- throw(mine).": "uncaught exception mine",
    "bad(_) :- atom_concat(no, where, X), call(X, 1).": "Unknown procedure: nowhere/1",
    "bad(_) :- fail.": "has no answer",
    "bad(X) :- length(X, 2).": "has the answer `[_",
    "bad(_).": "has the answer `_",
    "bad(10).": "has the answer `10`, which is not a value of its input",
    "bad(2.5).": "has the answer `2.5`",
    "bad('3').": "has the answer `3`",
    "bad(X) :- X is inf.": "has the answer `",
    "bad(X) :- X is 7**5000.": "has the answer `30917",
    "bad(X) :- numlist(1, 500, L), atomic_list_concat(L, X).": "has the answer `1234567891011",
    "bad(X) :- X = f(X).": "has the answer `",
    "bad(_) :- numlist(1, 9000000, L), L = [].": "",
}
"""Programs for a query of a number from 0 to 9."""


def test_a_query_without_an_answer_is_lost_and_the_others_are_answered(tmp_path: Path) -> None:
    names_of = [f"bad{at}" for at in range(len(UNANSWERED))]
    text = "".join(clause.replace("bad", name, 1) + "\n" for name, clause in zip(names_of, UNANSWERED, strict=True))
    queries = {f"{name}(Value)": number(0, 9) for name in (*names_of, "good")}
    made = run(tmp_path, f"{text}good(X) :- n(X).\n", queries, 1, limit=1.0)
    assert [m["values"] for m in made.heard if "values" in m] == [{"good(Value)": "0"}]
    lost = [m["lost"] for m in made.heard if "lost" in m]
    assert lost == [[field] for field in queries if field != "good(Value)"]
    for name, why in zip(names_of, UNANSWERED.values(), strict=True):
        (said,) = [said for said in made.said() if f"`{name}(Value)`" in said]
        assert why in said and len(said) < 500
    assert any(said.startswith("program.pl:7: E583: `bad5(Value)`") for said in made.said())


def test_an_answer_that_values_lack_is_told_with_what_to_add(tmp_path: Path) -> None:
    (tmp_path / "program.pl").write_text("good(dock).\nbad(door).\nother(gate).\n", encoding="utf-8")
    of = names("dock", "DOOR")
    with bridge(
        tmp_path / "program.pl", {"n": BOOL}, {"good(Value)": of, "bad(Value)": of, "other(Value)": of}
    ) as made:
        made.until("hello")
        assert made.ask({"n": True}) == {"good(Value)": "dock"}
    first, second = made.said()
    assert first.endswith("`door`, which is not a value of its input: add `door: DOOR` to `values`")
    assert second.endswith("`gate`, which is not a value of its input: add `gate: …` to `values`")


def test_what_a_program_writes_is_told_and_it_reads_nothing(tmp_path: Path) -> None:
    text = (
        "good(yes) :- n(N), N >= 0, write(hello), nl, writeln(é), read(X), print_message(error, format('~w', [X])).\n"
        "good(no) :- shell('echo from a shell'), numlist(1, 90, L), forall(member(X, L), (print(X), nl)), fail.\n"
    )
    made = run(tmp_path, text, {"good(Value)": names("yes"), "good(no)": BOOL})
    assert [m["values"] for m in made.heard if "values" in m][-1] == {"good(Value)": "yes", "good(no)": False}
    said = made.said()
    assert said[:3] == [f"the program writes: {line}" for line in ("hello", "é", "ERROR: end_of_file")]
    assert "the program writes: from a shell" in said and len(said) == 20 and "not shown" in said[-1]


def test_nothing_that_a_query_asserts_is_there_for_the_next(tmp_path: Path) -> None:
    text = (
        ":- dynamic([seen/1, kept/1, new/1]).\nkept(a).\n:- table count/1.\ncount(N) :- n(N).\n"
        "good(L) :- findall(X, seen(X), Xs), length(Xs, L), n(N), assertz(seen(N)), assertz(n(77)), asserta(new(N)).\n"
        "good2(L) :- findall(X, n(X), Xs), length(Xs, L), retractall(n(_)), retractall(kept(_)).\n"
        "good3(L) :- findall(X, kept(X), Xs), length(Xs, L), \\+ new(_), count(N), n(N).\n"
        "endless(0) :- assertz(seen(1)), retractall(kept(_)), repeat, fail.\n"
    )
    queries = {f"{name}(Value)": number(0, 9) for name in ("endless", "good", "good2", "good3")}
    made = run(tmp_path, text, queries, limit=1.0)
    answers = {"good(Value)": "0", "good2(Value)": "1", "good3(Value)": "1"}
    assert [m["values"] for m in made.heard if "values" in m] == [answers, answers]


def test_prolog_that_is_killed_from_outside_comes_back(tmp_path: Path) -> None:
    file = tmp_path / "program.pl"
    file.write_text(
        "good(X) :- n(X).\nslow(0) :- n(N), N > 5, open(runs, write, S), close(S), repeat, fail.\nslow(1).\n",
        encoding="utf-8",
    )
    queries = {"good(Value)": number(0, 9), "slow(Value)": number(0, 1)}
    with bridge(file, {"n(Value)": number(0, 9)}, queries, limit=30.0) as made:
        made.until("hello")
        assert made.ask({"n(Value)": 1}) == {"good(Value)": "1", "slow(Value)": "1"}
        first = made.swipl
        os.kill(first, signal.SIGKILL)  # while nothing is asked
        assert made.until("values")["values"] == {"good(Value)": "1", "slow(Value)": "1"}
        assert made.swipl != first and "Prolog was killed, and is started again" in made.said()
        made.say({"values": {"n(Value)": 9}})
        while not (tmp_path / "runs").exists():
            time.sleep(0.001)
        os.kill(made.swipl, signal.SIGKILL)
        assert made.until("lost")["lost"] == ["slow(Value)"] and made.until("values")["values"] == {"good(Value)": "9"}
        pid = made.swipl
        made.say({"end": "stopped"})
        assert made.process.wait() == 0
        assert not Path(f"/proc/{pid}").exists()


def test_a_program_that_cannot_be_loaded_again_ends_the_bridge(tmp_path: Path) -> None:
    file = tmp_path / "program.pl"
    file.write_text("good(X) :- n(X).\n", encoding="utf-8")
    with bridge(file, {"n(Value)": number(0, 9)}, {"good(Value)": number(0, 9)}) as made:
        made.until("hello")
        assert made.ask({"n(Value)": 1}) == {"good(Value)": "1"}
        file.write_text("good(X) :- n(X)\nmore.\n", encoding="utf-8")
        os.kill(made.swipl, signal.SIGKILL)
        made.until("say")
        assert "program.pl:1:17: E582: Syntax error: Operator expected" in made.until("say")["say"]
        assert made.process.wait() == 1
    file.write_text("good(X) :- n(X).\n", encoding="utf-8")
    with bridge(file, {"n(Value)": number(0, 9)}, {"good(Value)": number(0, 9)}, restart=False) as made:
        made.until("hello")
        os.kill(made.swipl, signal.SIGKILL)
        made.until("say")
        assert "E582: Prolog was killed" in made.until("say")["say"] and made.process.wait() == 1


def test_queries_are_asked_again_after_a_time_and_without_facts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LC_ALL", "C")  # nor does the locale of the run count
    (tmp_path / "é 'x").mkdir()
    file = tmp_path / "é 'x" / "program.pl"
    file.write_text("good(N) :- flag(calls, N, (N + 1) mod 9).\n", encoding="utf-8")
    with bridge(file, {}, {"good(Value)": number(0, 9)}, every=0.01) as made:
        made.until("hello")
        assert [made.until("values")["values"]["good(Value)"] for _ in range(4)] == ["0", "1", "2", "3"]
