"""`python -m tests.fuzzing N SEED`: N mutated files through every reader, and what that has found."""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path

from tests.fuzzing.case import Case, case_of, kept_cases
from tests.fuzzing.readers import READERS, make, make_corpus
from tests.fuzzing.running import Outcome, run_all, run_alone
from tests.fuzzing.shrinking import ATTEMPTS, shrink

SLOW_ATTEMPTS = 12


def main() -> int:
    """Exit code 1 when something was found."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzzing", description=__doc__)
    parser.add_argument("count", nargs="?", type=int, default=500, help="cases in all, the same for each reader")
    parser.add_argument("seed", nargs="?", type=int, default=0)
    parser.add_argument("--reader", action="append", help="only this one; may be repeated")
    parser.add_argument("--skip", type=int, default=0, help="begin with the case of this number of each reader")
    parser.add_argument("--kept", action="store_true", help="run the cases that are kept, and no others")
    parser.add_argument("--case", type=Path, help="run the case of this file and show what comes of it")
    parser.add_argument("--save", type=Path, help="a folder for the cases with findings, shrunk")
    parser.add_argument("--processes", action="store_true", help="whole commands, as processes of their own")
    options = parser.parse_args()
    make_corpus()
    if options.case is not None:
        outcome = run_alone(case_of(options.case.read_text("utf-8")))
        print(outcome.code, outcome.found, outcome.detail, sep="\n")
        return int(outcome.found is not None)
    if options.kept:
        kept = kept_cases()
        return _told("kept", {name: partial(_itself, case) for name, case in kept.items()}, None)
    names = options.reader or list(READERS)
    if options.processes:
        from tests.fuzzing.commands import run_commands

        return run_commands(options.count, options.seed, options.skip, names)
    failed = 0
    each = -(-options.count // len(names))
    for name in names:
        numbers = range(options.skip, options.skip + each)
        makers = {f"{name} {options.seed} {number}": partial(make, name, options.seed, number) for number in numbers}
        failed |= _told(name, makers, options.save)
    return failed


def _itself(case: Case) -> Case:
    return case


def _told(title: str, makers: dict[str, Callable[[], Case]], save: Path | None) -> int:
    """Run cases and print counts of exit codes, and each cause that was found once; whether there is one."""
    codes: Counter[str] = Counter()
    found: dict[str, list[tuple[str, Case, Outcome]]] = {}
    for name, (case, outcome) in zip(makers, run_all(list(makers.values())), strict=True):
        codes["found" if outcome.found is not None else str(outcome.code)] += 1
        if outcome.found is not None:
            found.setdefault(outcome.place, []).append((name, case or Case(("(making it)",)), outcome))
    counts = ", ".join(f"{code}: {count}" for code, count in sorted(codes.items()))
    print(f"{title}: {len(makers)} cases; {counts}", flush=True)
    for place, examples in found.items():
        name, case, outcome = min(examples, key=lambda example: len(example[1].to_json()))
        _say(f"  {len(examples)} × {place}", f"    {name}: llfsm {' '.join(case.arguments)[:300]}")
        _say("    " + outcome.detail[-700:].strip().replace("\n", "\n    "))
        if save is not None:
            save.mkdir(parents=True, exist_ok=True)
            slow = "processor time" in place or "blocked" in place
            path = save / (name.replace(" ", "_") + ".json")
            path.write_text(shrink(case, outcome, SLOW_ATTEMPTS if slow else ATTEMPTS).to_json(), "utf-8")
            _say(f"    saved: {path}")
    return int(bool(found))


def _say(*lines: str) -> None:
    for line in lines:
        print(line.encode("utf-8", "replace").decode(), flush=True)


if __name__ == "__main__":
    sys.exit(main())
