"""The arguments of `llfsm verify`."""

from __future__ import annotations

from argparse import _ArgumentGroup as Group

from llfsm_verify.cli import arguments as shared
from llfsm_verify.cli.arguments import positive, repeatable
from llfsm_verify.cli.engine_options import engine_options
from llfsm_verify.cli.parser import Parser
from llfsm_verify.report.formats import REPORTS
from llfsm_verify.report.timeline.formats import TIMELINES
from llfsm_verify.verification.engines import ENGINES


def arguments(parser: Parser) -> None:
    """Add the arguments of `llfsm verify`, in groups."""
    parser.about(
        "Check properties of an arrangement of logic-labelled finite-state machines, and that no run of it faults.",
        "llfsm verify arrangement.yaml properties.ltl --save-traces traces\n"
        "llfsm verify arrangement.yaml -p 'G !(north@GREEN && east@GREEN)' --timeout 60",
    )
    asked = parser.add_argument_group("what to check")
    shared.arrangement(asked)
    shared.property_files(asked)
    shared.property_lines(asked)
    shared.only(asked)
    _strictness(parser.add_argument_group("what a pass is worth"))
    _search(parser, parser.add_argument_group("how to search"))
    limits = parser.add_argument_group("limits; what is not decided within them is unknown")
    shared.max_states(limits)
    shared.memory_and_timeout(limits)
    _report(parser.add_argument_group("what to print"))
    _files(parser.add_argument_group("files to write and to read"))


def _strictness(group: Group) -> None:
    add = group.add_argument
    add("--strict", action="store_true", help="fail when a property holds only because nothing happens (see --vacuity)")
    add("--vacuity", action="store_true", help="look for subformulas that do not matter in properties that hold")
    repeatable(group, "--accept-vacuity", metavar="NAME", text="under --strict, this property may hold vacuously")
    text = "a property holds vacuously when no run satisfies the assumptions; without this it is unknown"
    add("--allow-contradiction", action="store_true", help=text)
    add("--witness", action="store_true", help="show for each property that holds a run in which something happens")


def _search(parser: Parser, group: Group) -> None:
    shared.engine(group)
    group.add_argument("--keep-all-bits", action="store_true", help="keep values that nothing reads any more")
    engine_options(parser, group, ENGINES.options(ENGINES.ours))


def _report(group: Group) -> None:
    add = group.add_argument
    shared.choice(group, "--format", REPORTS.result, "how to report")
    add("--all", metavar="N", type=positive, default=1, help="N different counterexamples to each violated property")
    shared.all_steps(group)
    add("-q", "--quiet", action="store_true", help="print only the verdicts")
    add("--timings", action="store_true", help="say on standard error where the time went")
    add("--watch", action="store_true", help="check again whenever one of the files is saved, until Ctrl-C")
    shared.colour(group)


def _files(group: Group) -> None:
    add = group.add_argument
    add("--save-traces", metavar="DIR", help="save each trace as DIR/NAME.trace.yaml")
    repeatable(group, "--save-as", choices=TIMELINES, text="save each trace of --save-traces in this format as well")
    endings = ", ".join(f"{ending} {name}" for ending, name in REPORTS.result.suffixes.items())
    repeatable(group, "--report", metavar="FILE", text=f"also write the whole report, by FILE's ending: {endings}")
    add("--certificate", metavar="FILE", help="write a certificate of the verdicts, for llfsm-check-certificate")
    add("--check-certificate", metavar="FILE", help="check a certificate, and that it is about these files")
    add("--save-invariants", metavar="FILE", help="write the invariants that --engine pdr or induction has found")
    add("--check-invariants", metavar="FILE", help="check that the invariants of a file prove the properties")
