"""`--certificate` of `llfsm verify` and `llfsm report`: what proves a result, written."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from llfsm_verify.cli.io.files import write_whole
from llfsm_verify.cli.io.output import tell

if TYPE_CHECKING:
    from llfsm_verify.arrangement.model import Arrangement
    from llfsm_verify.checking.verdict import Result
    from llfsm_verify.limits import Limits
    from llfsm_verify.logic.properties import PropertySet


def write_certificate(
    options: Namespace, result: Result, arrangement: Arrangement, properties: PropertySet, limits: Limits
) -> None:
    """Make the certificate and write it; what it does not certify is said on standard error.

    Raises DiagnosticError (E450) when it cannot be written, KeyboardInterrupt, and Disagreement when a proof fails.
    """
    if result.interrupted:
        tell("no certificate is made of a check that was interrupted")
        return
    from llfsm_verify.analysis.certificates.making import certificate

    path = Path(options.certificate)
    made = certificate(arrangement, properties, result, path.parent, limits)
    write_whole(made.text, options.certificate, "E450", "the certificate")
    for name, reason in made.missing:
        tell(f"not certified: {name}, because {reason}")
    tell(f"certificate saved: {options.certificate}")
