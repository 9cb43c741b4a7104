"""The arguments of `llfsm kripke`."""

from __future__ import annotations

from llfsm_verify.cli import arguments as shared
from llfsm_verify.cli.parser import Parser
from llfsm_verify.engines.explicit.options import JOBS_OPTION
from llfsm_verify.kripke.export.formats import MODELS, STRUCTURES
from llfsm_verify.registry import Choices


def arguments(parser: Parser) -> None:
    """Add the arguments of `llfsm kripke`."""
    parser.about(
        "Write the Kripke structure of an arrangement (json, dot, svg, png, graphml, aut, npz), or a model of it "
        "for another checker (smv: NuSMV and nuXmv, promela: SPIN). The atoms of the properties are what letters show.",
        "llfsm kripke arrangement.yaml properties.ltl -o model.smv",
        "exit codes: 0 written, 2 wrong usage, 3 input files wrong or unreadable, "
        "4 a limit ended the exploration, 70 internal error, 130 interrupted",
    )
    add = parser.add_argument
    shared.arrangement(parser)
    shared.property_files(parser)
    shared.property_lines(parser)
    add("--format", choices=Choices(STRUCTURES, MODELS), help="default: by the ending of FILE, else json")
    shared.output(parser)
    shared.max_states(parser, "end the exploration after N configurations")
    shared.memory_and_timeout(parser, "end it")
    JOBS_OPTION.add_to(parser)
    add("--keep-all-bits", action="store_true", help="keep entered flags that cannot matter any more")
    add("--partial", action="store_true", help="write what a limit has cut short, marked as such")
    add("--large", action="store_true", help="draw more than 300 configurations")
