"""`python -m llfsm_verify.testing.conformance NAME`: what the suite says of an engine, a line a case."""

from __future__ import annotations

import sys
from argparse import ArgumentParser

from llfsm_verify.registry import Unregistered
from llfsm_verify.testing.conformance.engines import DRAWN, SEED, engine_cases


def main(arguments: list[str]) -> int:
    """Exit code 0: every case passed; 1: one failed; 2: wrong usage; 3: there is no engine of this name."""
    parser = ArgumentParser(prog="python -m llfsm_verify.testing.conformance", description="look at an engine")
    parser.add_argument("name", metavar="NAME", help="of an engine, ours or registered by another package")
    parser.add_argument("--drawn", metavar="N", type=int, default=DRAWN, help="random arrangements (%(default)s)")
    parser.add_argument("--seed", metavar="N", type=int, default=SEED, help="drawn from this seed (%(default)s)")
    options = parser.parse_args(arguments)
    try:
        cases = engine_cases(options.name, drawn=options.drawn, seed=options.seed)
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
