"""`llfsm report`: a page for a safety case."""

from __future__ import annotations

import hashlib
from argparse import Namespace
from pathlib import Path

from llfsm_verify.cli.arguments import arrangement, engine, memory_and_timeout, output, property_files, property_lines
from llfsm_verify.cli.certificates import write_certificate
from llfsm_verify.cli.io.files import ready, write_whole
from llfsm_verify.cli.opening import limits_of, open_draft, read_properties, told
from llfsm_verify.cli.parser import Parser, UsageError

UNWRITABLE = "E490"


def arguments(parser: Parser) -> None:
    """Add the arguments of `llfsm report`."""
    parser.about(
        "Check an arrangement as `llfsm verify --strict` does, and write a page about it for a safety case (Markdown).",
        "llfsm report --assurance arrangement.yaml properties.ltl --certificate proof.cert -o assurance.md",
    )
    add = parser.add_argument
    arrangement(parser)
    property_files(parser)
    property_lines(parser)
    add("--assurance", action="store_true", help="required: the page has claims, hashes, assumptions, and what is open")
    engine(parser)
    memory_and_timeout(parser)
    add("--certificate", metavar="FILE", help="write what proves the verdicts, and name it on the page")
    output(parser)


def run(options: Namespace) -> int:
    """Returns the exit code of the check, under --strict; raises DiagnosticError for wrong files, and for what cannot
    be written."""
    from llfsm_verify.arrangement.granting import policy_digest
    from llfsm_verify.checking.verdict import Options
    from llfsm_verify.cli.io.verdicts import EarlyVerdicts
    from llfsm_verify.report.assurance import Checked, assurance
    from llfsm_verify.verification.verify import verify

    if not options.assurance:
        raise UsageError("say which report: --assurance")
    draft, arrangement = open_draft(options.arrangement)
    properties = told(read_properties(options), arrangement)
    ready(arrangement, properties, options.certificate, ("E451", "E450"), "the certificate", whole=True)
    ready(arrangement, properties, options.output, (UNWRITABLE, UNWRITABLE), "the report")
    limits = limits_of(options)
    with EarlyVerdicts(p.name for p in properties.goals) as early:
        wanted = Options(limits, vacuity="all", strict=True, decided=early.add)
        result = verify(arrangement, properties, wanted, options.engine)
    certificate = None
    if options.certificate is not None:
        write_certificate(options, result, arrangement, properties, limits_of(options))
        path = Path(options.certificate)
        if path.exists():
            certificate = options.certificate, hashlib.sha256(path.read_bytes()).hexdigest()
    page = assurance(Checked(result, arrangement, properties, draft.sources, policy_digest(arrangement), certificate))
    write_whole(page, options.output, UNWRITABLE, "the report")
    return result.exit_code
