"""`--certificate` and `--check-certificate` of `llfsm verify`: what proves a result, written and checked."""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from llfsm_verify.cli.io.files import write_whole
from llfsm_verify.cli.io.output import Output
from llfsm_verify.cli.parser import UsageError
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError

if TYPE_CHECKING:
    from llfsm_verify.arrangement.model import Arrangement
    from llfsm_verify.checking.verdict import Result
    from llfsm_verify.limits import Limits
    from llfsm_verify.logic.properties import PropertySet


def refuse_misuse(options: Namespace) -> None:
    """UsageError: options about certificates do not go together."""
    if options.certificate in ("", "-") or options.check_certificate in ("", "-"):
        raise UsageError("--certificate and --check-certificate need the name of a file")
    if options.certificate is not None and options.check_certificate is not None:
        raise UsageError("--certificate writes a file and --check-certificate reads one: use one of them at a time")
    if options.check_certificate is not None and options.format != "text":
        raise UsageError(f"--check-certificate answers in words: there is no --format {options.format} of that")
    if options.check_certificate is not None:
        unused = {"--save-traces": options.save_traces, "--save-invariants": options.save_invariants}
        needless = [name for name, given in unused.items() if given is not None]
        if needless:
            raise UsageError(f"--check-certificate writes nothing: leave {needless[0]} out")
    if options.checkpoint is not None and options.certificate is not None:
        if Path(options.checkpoint).resolve() == Path(options.certificate).resolve():
            raise UsageError("--certificate and --checkpoint name the same file")


def write_certificate(
    options: Namespace, result: Result, arrangement: Arrangement, properties: PropertySet, limits: Limits
) -> None:
    """Make the certificate and write it; what it does not certify is said on standard error.

    Raises DiagnosticError (E450) when it cannot be written, KeyboardInterrupt, and Disagreement when a proof fails.
    """
    if result.interrupted:
        print("no certificate is made of a check that was interrupted", file=sys.stderr)
        return
    from llfsm_verify.analysis.certificates.making import certificate

    path = Path(options.certificate)
    made = certificate(arrangement, properties, result, path.parent, limits)
    write_whole(made.text, options.certificate, "E450", "the certificate")
    for name, reason in made.missing:
        print(f"not certified: {name}, because {reason}", file=sys.stderr)
    print(f"certificate saved: {options.certificate}", file=sys.stderr)


def check_certificate(
    options: Namespace, result: Result, arrangement: Arrangement, properties: PropertySet, limits: Limits
) -> int:
    """Compare what the certificate's verifier believes with what the files mean, then run the verifier.

    The exit code: 0 all is proved, 1 the certificate is rejected or is one of something else, 4 not all is certified,
    130 the check, which says what the files mean, was interrupted.
    """
    if result.interrupted:
        print("no certificate is checked by a check that was interrupted", file=sys.stderr)
        return result.exit_code
    from llfsm_verify.analysis.certificates.comparing import differences
    from llfsm_verify.analysis.certificates.making import certificate
    from llfsm_verify.certificate import NOT_CERTIFIED, REJECTED, checked

    path = Path(options.check_certificate)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, ValueError) as e:
        reason = (e.strerror if isinstance(e, OSError) else None) or "it is not text"
        message = f"the certificate cannot be read: {reason}"
        raise DiagnosticError(Diagnostic("E450", message, file=str(path))) from None
    lines, code = checked(path, path.parent)
    if code != REJECTED:
        made = certificate(arrangement, properties, result, path.parent, limits)
        found, unlike = differences(text, made.text)
        if found:
            lines, code = [f"rejected: {sentence}" for sentence in found], REJECTED
        elif unlike:
            lines[-1:] = [
                "The program, the formulas and the automata are those that these files give, except for this:",
                *unlike,
            ]
            code = NOT_CERTIFIED
        else:
            lines[-1:] = ["The program, the formulas and the automata are those that these files give: compared."]
    Output().plain("\n".join(lines) + "\n")
    return code
