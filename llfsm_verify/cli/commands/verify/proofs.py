"""Proofs that `llfsm verify` writes down and checks: invariants, and certificates (`--check-certificate`)."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from llfsm_verify.cli.io.files import write_whole
from llfsm_verify.cli.io.output import Output, tell
from llfsm_verify.cli.parser import UsageError
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, without_controls

if TYPE_CHECKING:
    from llfsm_verify.arrangement.model import Arrangement
    from llfsm_verify.checking.verdict import Result
    from llfsm_verify.limits import Limits
    from llfsm_verify.logic.properties import PropertySet


def refuse_misuse(options: Namespace) -> None:
    """UsageError: options about certificates, or about invariants, do not go together."""
    unused = {
        "--save-traces": options.save_traces is not None,
        "--save-invariants": options.save_invariants is not None,
        "--report": bool(options.report),
    }
    _refuse_pair(options, "--certificate", "--check-certificate", "--checkpoint", "writes nothing", unused)
    needless = "searches for nothing and writes nothing"
    _refuse_pair(options, "--save-invariants", "--check-invariants", "--certificate", needless, _unused(options))


def _refuse_pair(
    options: Namespace, write: str, read: str, other: str, needless: str, unused: Mapping[str, bool]
) -> None:
    """Of an option that writes proofs and one that checks them: `other` also writes a file, and `unused` are options
    of which a check makes no use, and whether they are given."""
    written, read_from, beside = (getattr(options, flag[2:].replace("-", "_")) for flag in (write, read, other))
    if {written, read_from} & {"", "-"}:
        raise UsageError(f"{write} and {read} need the name of a file")
    if written is not None and read_from is not None:
        raise UsageError(f"{write} writes a file and {read} reads one: use one of them at a time")
    if read_from is not None and options.format != "text":
        raise UsageError(f"{read} answers in words: there is no --format {options.format} of that")
    given = [name for name, is_given in unused.items() if is_given and read_from is not None]
    if given:
        raise UsageError(f"{read} {needless}: leave {given[0]} out")
    if None not in (written, beside) and Path(written).resolve() == Path(beside).resolve():
        raise UsageError(f"{write} and {other} name the same file")


def _read(file: str, code: str, what: str) -> str:
    """The text of a file of proofs; DiagnosticError with `code`."""
    try:
        return Path(file).read_text(encoding="utf-8")
    except (OSError, ValueError) as e:
        reason = (e.strerror if isinstance(e, OSError) else None) or "it is not text"
        raise DiagnosticError(Diagnostic(code, f"{what} cannot be read: {reason}", file=file)) from None


def _unused(options: Namespace) -> dict[str, bool]:
    """The options that a check of invariants makes no use of, and whether they are given."""
    return {
        "--certificate": options.certificate is not None,
        "--check-certificate": options.check_certificate is not None,
        f"--engine {options.engine}": options.engine != "auto",
        "--depth": options.depth is not None,
        "--save-traces": options.save_traces is not None,
        "--save-as": bool(options.save_as),
        "--report": bool(options.report),
        "--all": options.all > 1,
        "--strict": options.strict,
        "--vacuity": options.vacuity,
        "--accept-vacuity": bool(options.accept_vacuity),
        "--allow-contradiction": options.allow_contradiction,
        "--witness": options.witness,
        "--max-states": options.max_states is not None,
        "--keep-all-bits": options.keep_all_bits,
        f"--cone {options.cone}": options.cone != "auto",
        f"--compression {options.compression}": options.compression != "auto",
        "--labels off": options.labels == "off",
        "--jobs": options.jobs is not None,
        "--checkpoint": options.checkpoint is not None,
        "--all-steps": options.all_steps,
    }


def save_invariants(options: Namespace, result: Result) -> None:
    """Write the proofs of a result, or say that it has no proof. DiagnosticError (E452)."""
    from llfsm_verify.engines.inductive.recheck import saved_text

    if not any((*(p.proofs for p in result.properties), result.faults.proofs)):
        tell("no invariant was found, so none is saved: --engine pdr and induction find some")
        return
    write_whole(saved_text(result), options.save_invariants, "E452", "the file of invariants")
    tell(f"invariants saved: {options.save_invariants}")


def check_invariants(options: Namespace, arrangement: Arrangement, properties: PropertySet, limits: Limits) -> int:
    """Check the proofs of a file; nothing is searched for.

    The exit code: 0 everything is proved, 1 a proof is rejected, 4 something is not proved, 130 interrupted.
    """
    from llfsm_verify.checking.edges import with_edges_as_past
    from llfsm_verify.checking.problem import bind
    from llfsm_verify.engines.inductive.recheck import Rechecking, read_saved
    from llfsm_verify.limits import Budget, LimitReached

    file = options.check_invariants
    saved = read_saved(_read(file, "E452", "the invariants"), file)
    if saved.arrangement not in (None, arrangement.name):
        of = f"the arrangement {saved.arrangement}, and this is {arrangement.name}"
        tell(without_controls(f"note: {file} was saved for {of}"))
    budget = Budget(limits)
    checking = Rechecking(with_edges_as_past(bind(arrangement, properties)), budget)
    code, output = 0, Output()
    try:
        with budget:
            for found in checking.check(saved.proved):
                word = "accepted" if found.accepted else "rejected" if found.wrong else "not proved"
                output.plain(without_controls(f"{word}: {found.name or 'faults'}, {found.reason}") + "\n")
                code = 1 if found.wrong or code == 1 else code if found.accepted else 4
    except LimitReached as limit:
        output.plain(f"not checked to the end, because {limit}\n")
        return 4
    except KeyboardInterrupt:
        output.plain("interrupted\n")
        return 130
    return code


def check_certificate(
    options: Namespace, result: Result, arrangement: Arrangement, properties: PropertySet, limits: Limits
) -> int:
    """Compare what the certificate's verifier believes with what the files mean, then run the verifier.

    The exit code: 0 all is proved, 1 the certificate is rejected or is one of something else, 4 not all is certified,
    130 the check, which says what the files mean, was interrupted.
    """
    if result.interrupted:
        tell("no certificate is checked by a check that was interrupted")
        return result.exit_code
    from llfsm_verify.analysis.certificates.making import certificate, differences
    from llfsm_verify.certificate import NOT_CERTIFIED, REJECTED, checked

    path = Path(options.check_certificate)
    text = _read(options.check_certificate, "E450", "the certificate")
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
