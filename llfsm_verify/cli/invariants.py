"""`--save-invariants` and `--check-invariants` of `llfsm verify`: proofs written down, and checked again."""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from llfsm_verify.cli.whole_file import write_whole
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError

if TYPE_CHECKING:
    from llfsm_verify.arrangement.model import Arrangement
    from llfsm_verify.checking.verdict import Limits, Result
    from llfsm_verify.logic.properties import PropertySet

PROVERS = ("induction", "pdr")


def invariants_mistake(options: Namespace) -> str | None:
    """What is wrong with the options about invariants."""
    if options.save_invariants in ("", "-") or options.check_invariants in ("", "-"):
        return "--save-invariants and --check-invariants want the name of a file"
    if options.save_invariants is not None and options.check_invariants is not None:
        return "--save-invariants writes a file and --check-invariants reads one: use one of them at a time"
    if options.save_invariants is not None and options.engine not in (*PROVERS, "auto", "all"):
        return "--save-invariants is for engines that prove: --engine pdr or induction"
    if options.check_invariants is not None and options.format != "text":
        return f"--check-invariants answers in words: there is no --format {options.format} of that"
    return None


def save_invariants(options: Namespace, result: Result) -> None:
    """Write the proofs of a result, and say so where there are none. DiagnosticError (E452)."""
    from llfsm_verify.checking.inductive.saved import saved_text

    write_whole(saved_text(result), options.save_invariants, "E452", "the file of invariants")
    if not any((*(p.proofs for p in result.properties), result.faults.proofs)):
        print("no invariant was found, so none is saved: --engine pdr and induction find some", file=sys.stderr)


def check_invariants(options: Namespace, arrangement: Arrangement, properties: PropertySet, limits: Limits) -> int:
    """Check the proofs of a file; nothing is searched for.

    The exit code: 0 everything is proved, 1 a proof is rejected, 4 something is not proved, 130 interrupted.
    """
    from llfsm_verify.checking.binding import bind
    from llfsm_verify.checking.inductive.recheck import Rechecking
    from llfsm_verify.checking.inductive.saved import read_saved
    from llfsm_verify.checking.limits import Budget
    from llfsm_verify.kripke.allowance import LimitReached

    file = options.check_invariants
    try:
        text = Path(file).read_text(encoding="utf-8")
    except (OSError, ValueError) as e:
        reason = (e.strerror if isinstance(e, OSError) else None) or "it is no text"
        raise DiagnosticError(Diagnostic("E452", f"the invariants cannot be read: {reason}", file=file)) from None
    checking = Rechecking(arrangement, bind(arrangement, properties), Budget(limits))
    code = 0
    try:
        for found in checking.check(read_saved(text, file)):
            word = "accepted" if found.accepted else "rejected" if found.wrong else "not proved"
            print(f"{word}: {found.name or 'faults'}, {found.reason}")
            code = 1 if found.wrong or code == 1 else code if found.accepted else 4
    except LimitReached as limit:
        print(f"not checked to the end, because {limit}")
        return 4
    except KeyboardInterrupt:
        print("interrupted")
        return 130
    return code
