"""Options: the names of the command line's, with clear errors for names and values that there are not."""

from __future__ import annotations

from pathlib import Path

import pytest

import llfsm_verify as lv
from llfsm_verify.api.options import WANTED, CheckOptions, check_options, checked
from llfsm_verify.checking.verdict import Options
from llfsm_verify.cli.commands import verify_parser
from llfsm_verify.engines.explicit.options import Checkpointing, ExplicitOptions
from llfsm_verify.engines.unrolled.options import UnrolledOptions
from llfsm_verify.limits import Limits


def options(engine: str = "auto", **given: object) -> Options:
    return check_options(checked("check", given, CheckOptions), engine)


def test_a_name_that_there_is_not(lights):
    with pytest.raises(TypeError, match=r"check has no option `time_out`, only timeout, .*; did you mean `timeout`\?"):
        lights.check("G p", time_out=3)
    with pytest.raises(TypeError, match=r"query has no option `strict`, only timeout, .*, jobs, depth$"):
        lights.query("ns@GREEN", strict=True)
    with pytest.raises(TypeError, match="lint has no option `depth`"):
        lights.lint(depth=3)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("timeout", 0), ("timeout", "3"), ("timeout", True), ("memory", 1.5), ("memory", "3"), ("memory", "many"),
        ("max_states", 0), ("max_states", True), ("depth", -1), ("strict", "yes"), ("vacuity", 1), ("cone", "maybe"),
        ("labels", "on"), ("traces", 0), ("accept_vacuity", "a"), ("accept_vacuity", [1]), ("checkpoint", ""),
        ("progress", 3), ("jobs", 0), ("jobs", -1), ("jobs", True), ("jobs", 1.5), ("jobs", 10**9), ("jobs", "2"),
        ("decided", 3),
    ],
)  # fmt: skip
def test_a_value_that_there_is_not(name, value):
    with pytest.raises(ValueError, match=r"needs|has no unit|is not a size"):
        options(**{name: value})


def test_every_option_is_described_and_is_one_of_the_command_line():
    """Where Python has another name than the command line, it is listed here."""
    names = {"witnesses": "witness", "traces": "all"}
    known = {action.dest for action in verify_parser()._actions}
    assert set(WANTED) == set(CheckOptions.__annotations__)
    assert {names.get(name, name) for name in WANTED} - known == {"progress", "decided", "tell"}
    assert known - {names.get(name, name) for name in WANTED} == {
        "help", "version", "command", "arrangement", "properties", "property", "syntax", "engine", "only",  # arguments
        "format", "quiet", "all_steps", "width", "color", "watch", "timings",  # what is done with the result
        "report", "save_traces", "save_as", "certificate", "check_certificate", "save_invariants", "check_invariants",
    } - ({"command"} - known)  # fmt: skip


def test_options_become_those_of_engines():
    assert options() == Options()
    assert options(timeout=None, strict=None) == Options()
    assert options(timeout=2, memory="2G", max_states=7).limits == Limits(7, 2 << 30, 2)
    assert options(memory=5_000_000).limits == Limits(memory=5_000_000)
    assert options(strict=True) == Options(strict=True, vacuity="all")
    assert options(vacuity=True) == Options(vacuity="all")
    assert options(accept_vacuity=["a"], witnesses=True, traces=3) == Options(
        accepted=frozenset({"a"}), witnesses=True, traces=3
    )
    assert options(cone="off", compression="on", labels=False, keep_all_bits=True) == Options(
        keep_all_bits=True, own=(ExplicitOptions(cone="off", compression="on", labels=False),)
    )
    assert options(jobs=3) == Options(own=(ExplicitOptions(jobs=3),))
    assert options(checkpoint="x", resume=True, checkpoint_every=5) == Options(
        own=(ExplicitOptions(checkpoint=Checkpointing(Path("x"), 5, True)),)
    )


@pytest.mark.parametrize(
    ("engine", "given", "message"),
    [
        ("explicit", {"depth": 3}, "`depth` is for bmc, induction and pdr"),
        ("bmc", {"max_states": 3}, "`max_states` is for explicit"),
        ("pdr", {"traces": 2}, "`traces` is for explicit"),
        ("induction", {"labels": False}, "`labels` is for explicit"),
        ("pdr", {"cone": "on"}, "`cone` is for explicit"),
        ("bmc", {"jobs": 2}, "`jobs` is for explicit"),
        ("bmc", {"vacuity": True}, "`vacuity` is for explicit, induction and pdr"),
        ("all", {"checkpoint": "x"}, "`checkpoint` is for explicit"),
        ("auto", {"resume": True}, "`resume` goes on from the file that the option `checkpoint` names"),
    ],
)
def test_options_that_do_not_go_together(engine, given, message):
    with pytest.raises(ValueError, match=message):
        options(engine, **given)


def test_jobs_of_explorations(lights):
    for jobs in (1, 2, 3, 256, None):
        assert lights.check("G !(ns@GREEN && ew@GREEN)", "explicit", jobs=jobs).verdict == "holds"
        assert lights.query("ns@GREEN", "explicit", jobs=jobs).exit_code == 0
        assert lights.explore(jobs=jobs).complete
    with pytest.raises(ValueError, match="the option `jobs` needs a whole number from 1 to 256, not 257"):
        lights.explore(jobs=257)
    with pytest.raises(ValueError, match="`jobs` is for explicit"):
        lights.query("ns@GREEN", "pdr", jobs=2)


def test_what_the_engine_has_nothing_against_is_taken():
    assert options("pdr", traces=1, labels=True, cone="auto", depth=9).own == (UnrolledOptions(9),)


def test_an_engine_that_there_is_not(lights):
    with pytest.raises(ValueError, match="there is no engine `magic`; there are: auto, explicit, bmc"):
        lights.check("G !ns@AMBER", "magic")


def test_vacuity_is_accepted_by_name(lights):
    line = "v: G (ns@GREEN && ew@GREEN -> F car)"
    assert lights.check(line, strict=True).exit_code == 1
    assert lights.check(line, strict=True, accept_vacuity=["v"]).exit_code == 0
    with pytest.raises(ValueError, match="`accept_vacuity` names no property: w"):
        lights.check(line, accept_vacuity=["v", "w"])


def test_progress_and_checkpoints_arrive(lights, tmp_path):
    saved = tmp_path / "lights.checkpoint"
    first = lights.check("a: G !(ns@GREEN && ew@GREEN)", "explicit", checkpoint=saved, max_states=50)
    assert first.verdict == "unknown" and saved.exists()
    told: list[str] = []
    again = lights.check("a: G !(ns@GREEN && ew@GREEN)", "explicit", checkpoint=saved, resume=True, tell=told.append)
    assert again.verdict == "holds" and again.wrapped.exploration.resumed_from == str(saved)


def test_what_takes_long_is_told(lights, monkeypatch):
    from llfsm_verify.diagnostics import tell
    from llfsm_verify.verification import verify

    told: list[str] = []

    def compiling(engine):
        tell("compiling")
        return found(engine)

    found = verify.checker
    monkeypatch.setattr(verify, "checker", compiling)
    lights.check("G true", tell=told.append)
    number = len(told)
    lights.check("G true")
    assert len(told) == number
    assert set(told) == {"compiling"} and not tell("nothing takes it")


def test_the_default_engine_is_one(lights):
    import inspect

    from llfsm_verify.verification.engines import DEFAULT_ENGINE, ENGINES
    from llfsm_verify.verification.query import ask
    from llfsm_verify.verification.verify import verify

    assert DEFAULT_ENGINE == "auto" in ENGINES
    for function in (verify, ask, lv.Model.check, lv.Model.query):
        assert inspect.signature(function).parameters["engine"].default == DEFAULT_ENGINE
    assert verify_parser().get_default("engine") == DEFAULT_ENGINE
