"""`python -m llfsm_verify.testing.conformance NAME`: what the suite says of an engine or executor, a line a case."""

from __future__ import annotations

import sys

from llfsm_verify.registry import Unregistered
from llfsm_verify.testing.conformance.engines import engine_cases


def main(arguments: list[str]) -> int:
    """Exit code 0: every case passed; 1: one failed; 3: there is no engine of this name."""
    if len(arguments) != 1:
        sys.stderr.write("usage: python -m llfsm_verify.testing.conformance NAME\n")
        return 3
    try:
        cases = engine_cases(arguments[0])
    except Unregistered as error:
        sys.stderr.write(f"{error}\n")
        return 3
    failed = 0
    for case in cases:
        outcome = case()
        failed += not outcome.passed
        said = "passed" if outcome.passed else "FAILED"
        sys.stdout.write(f"{said}  {outcome.seconds:6.2f} s  {outcome.name}{outcome.wrong and ': ' + outcome.wrong}\n")
        sys.stdout.flush()
    sys.stdout.write(f"{len(cases) - failed} of {len(cases)} passed\n")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
