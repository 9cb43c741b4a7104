"""`llfsm report`: a page for a safety case."""

from __future__ import annotations

import hashlib
from argparse import Namespace
from pathlib import Path

from llfsm_verify.arrangement.granting import policy_digest
from llfsm_verify.checking.verdict import Options
from llfsm_verify.cli.certificates import write_certificate
from llfsm_verify.cli.io.files import ready, write_whole
from llfsm_verify.cli.io.verdicts import EarlyVerdicts
from llfsm_verify.cli.opening import limits_of, open_draft, read_properties, refuse_two_inputs, told
from llfsm_verify.cli.parser import UsageError
from llfsm_verify.report.assurance import Checked, assurance
from llfsm_verify.verification.verify import verify

UNWRITABLE = "E490"


def run(options: Namespace) -> int:
    """Returns the exit code of the check, under --strict; raises DiagnosticError for wrong files, and for what cannot
    be written."""
    if not options.assurance:
        raise UsageError("say which report: --assurance")
    refuse_two_inputs([options.arrangement, *options.properties])
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
        write_certificate(options, result, arrangement, properties, limits)
        path = Path(options.certificate)
        if path.exists():
            certificate = options.certificate, hashlib.sha256(path.read_bytes()).hexdigest()
    page = assurance(Checked(result, arrangement, properties, draft.sources, policy_digest(arrangement), certificate))
    write_whole(page, options.output, UNWRITABLE, "the report")
    return result.exit_code
