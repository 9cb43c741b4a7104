"""`--save-invariants` and `--check-invariants` of `llfsm verify`: proofs written down, and checked again."""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from llfsm_verify.cli.io.files import write_whole
from llfsm_verify.cli.io.output import Output
from llfsm_verify.cli.parser import UsageError
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, without_controls

if TYPE_CHECKING:
    from llfsm_verify.arrangement.model import Arrangement
    from llfsm_verify.checking.verdict import Result
    from llfsm_verify.limits import Limits
    from llfsm_verify.logic.properties import PropertySet


def refuse_misuse(options: Namespace) -> None:
    """UsageError: options about invariants do not go together."""
    if options.save_invariants in ("", "-") or options.check_invariants in ("", "-"):
        raise UsageError("--save-invariants and --check-invariants need the name of a file")
    if options.save_invariants is not None and options.check_invariants is not None:
        raise UsageError("--save-invariants writes a file and --check-invariants reads one: use one of them at a time")
    if options.check_invariants is not None and options.format != "text":
        raise UsageError(f"--check-invariants answers in words: there is no --format {options.format} of that")
    if options.check_invariants is not None:
        needless = [name for name, given in _unused(options).items() if given]
        if needless:
            raise UsageError(f"--check-invariants searches for nothing and writes nothing: leave {needless[0]} out")
    if options.save_invariants is not None and options.certificate is not None:
        if Path(options.save_invariants).resolve() == Path(options.certificate).resolve():
            raise UsageError("--save-invariants and --certificate name the same file")


def _unused(options: Namespace) -> dict[str, bool]:
    """The options that a check of invariants makes no use of, and whether they are given."""
    return {
        "--certificate": options.certificate is not None,
        "--check-certificate": options.check_certificate is not None,
        f"--engine {options.engine}": options.engine != "auto",
        "--depth": options.depth is not None,
        "--save-traces": options.save_traces is not None,
        "--save-as": bool(options.save_as),
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
        "--checkpoint": options.checkpoint is not None,
        "--all-steps": options.all_steps,
    }


def save_invariants(options: Namespace, result: Result) -> None:
    """Write the proofs of a result; where there are none, only say so. DiagnosticError (E452)."""
    from llfsm_verify.engines.inductive.recheck import saved_text

    if not any((*(p.proofs for p in result.properties), result.faults.proofs)):
        print("no invariant was found, so none is saved: --engine pdr and induction find some", file=sys.stderr)
        return
    write_whole(saved_text(result), options.save_invariants, "E452", "the file of invariants")
    print(f"invariants saved: {options.save_invariants}", file=sys.stderr)


def check_invariants(options: Namespace, arrangement: Arrangement, properties: PropertySet, limits: Limits) -> int:
    """Check the proofs of a file; nothing is searched for.

    The exit code: 0 everything is proved, 1 a proof is rejected, 4 something is not proved, 130 interrupted.
    """
    from llfsm_verify.checking.problem import bind
    from llfsm_verify.engines.inductive.recheck import Rechecking, read_saved
    from llfsm_verify.limits import Budget, LimitReached

    file = options.check_invariants
    try:
        text = Path(file).read_text(encoding="utf-8")
    except (OSError, ValueError) as e:
        reason = (e.strerror if isinstance(e, OSError) else None) or "it is not text"
        raise DiagnosticError(Diagnostic("E452", f"the invariants cannot be read: {reason}", file=file)) from None
    saved = read_saved(text, file)
    if saved.arrangement not in (None, arrangement.name):
        of = f"the arrangement {saved.arrangement}, and this is {arrangement.name}"
        print(without_controls(f"note: {file} was saved for {of}"), file=sys.stderr)
    budget = Budget(limits)
    checking = Rechecking(bind(arrangement, properties), budget)
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
