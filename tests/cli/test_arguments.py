from __future__ import annotations

from argparse import ArgumentTypeError, Namespace
from types import SimpleNamespace

import pytest

from llfsm_verify.checking.engine_option import MOST
from llfsm_verify.cli import opening
from llfsm_verify.cli.arguments import positive, property_text, size
from llfsm_verify.cli.commands import llfsm_parser, verify_parser
from llfsm_verify.cli.commands.trace.arguments import steps
from llfsm_verify.limits import Limits
from llfsm_verify.verification.engines import ENGINES
from tests.cli.running import LIGHTS, llfsm


@pytest.mark.parametrize(
    ("text", "value"),
    [("1B", 1), ("2G", 2 << 30), ("1.5k", 1536), ("500M", 500 << 20), ("3GiB", 3 << 30), ("10 MB", 10 << 20)],
)
def test_sizes(text, value):
    assert size(text) == value


@pytest.mark.parametrize("text", ["", "  ", "# fair: G F car", "#\n\n # b"])
def test_a_text_without_a_property_is_refused(text):
    done = llfsm("verify", LIGHTS, "-p", text)
    assert (done.returncode, done.stdout) == (2, "")
    assert "-p/--property: there is no property in this text" in done.stderr


def test_a_comment_before_a_property_is_none_of_that():
    assert property_text("# all\np: G a") == "# all\np: G a"


@pytest.mark.parametrize("text", ["1", "512", "1.5", " 8 "])
def test_a_size_without_a_unit_is_refused_with_the_units(text):
    done = llfsm("verify", LIGHTS, "--memory", text)
    assert done.returncode == 2 and f"has no unit: write {text.strip()}M (MiB)" in " ".join(done.stderr.split())


def test_a_time_limit_counts_from_the_beginning_of_the_command(monkeypatch):
    monkeypatch.setattr(opening, "time", SimpleNamespace(perf_counter=lambda: 107.0))
    options = Namespace(started=100.0, timeout=10.0, memory=5)
    assert opening.limits_of(options) == Limits(memory=5, timeout=3.0, whole=10.0)
    options.timeout = 6.0
    assert opening.limits_of(options) == Limits(memory=5, timeout=0.0, whole=6.0)
    options.timeout = None
    assert opening.limits_of(options) == Limits(memory=5)


def test_both_commands_take_the_same_arguments():
    arguments = ["a.yaml", "p.ltl", "-p", "G a", "--memory", "2G", "--timeout", "1.5", "-q"]
    assert vars(verify_parser().parse_args(arguments)) == vars(llfsm_parser().parse_args(["verify", *arguments]))


def test_a_drawing_is_not_written_under_a_name_of_another_kind(tmp_path):
    done = llfsm("draw", LIGHTS, "-o", str(tmp_path / "lights.jpg"))
    assert done.returncode == 2 and ".svg" in done.stderr
    assert not (tmp_path / "lights.jpg").exists()


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("verify", LIGHTS, "--depth", "0"), "error: --depth: '0' is not a whole number from 1"),
        (("verify", LIGHTS, "--depth", "x"), "error: --depth: 'x' is not a whole number from 1"),
        (
            ("verify", LIGHTS, "--depth", "99999999999999999999"),
            f"error: --depth: 99999999999999999999 is more than the largest number that is taken, {MOST:,}",
        ),
        (("query", LIGHTS), "error: the following arguments are required: FORMULA (`llfsm query --help` says more)"),
        (("property", "draw", "a", "--nonsense"), "error: unrecognized arguments: --nonsense"),
    ],
)
def test_mistakes_are_one_line(arguments, told):
    done = llfsm(*arguments)
    assert (done.returncode, done.stdout, done.stderr) == (2, "", f"{told}\n")


def test_a_wrong_engine_is_told_with_those_there_are():
    done = llfsm("verify", LIGHTS, "--engine", "magic")
    assert done.returncode == 2 and done.stderr.startswith(
        "error: --engine: there is no engine `magic`; there are: auto"
    )
    assert all(engine in done.stderr for engine in ENGINES) and done.stderr.count("\n") == 1


def test_the_largest_number_and_zeros_before_one():
    assert positive("0" * 30 + "7") == 7
    assert positive("9223372036854775807") == (1 << 63) - 1 == MOST


def test_local_lint_explores_nothing_that_could_be_limited():
    done = llfsm("lint", LIGHTS, "--local", "--max-states", "3")
    assert done.returncode == 2 and "--local" in done.stderr


@pytest.mark.parametrize("text", ["5", "a:5", "5:a", ":-1", "9:3", f"{10**19}:"])
def test_what_is_no_range_of_steps(text):
    with pytest.raises(ArgumentTypeError):
        steps(text)


def test_a_range_of_steps_may_be_open():
    assert (steps(":5"), steps("5:"), steps("5:50")) == ((0, 5), (5, None), (5, 50))
