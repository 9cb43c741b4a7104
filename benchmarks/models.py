"""The table of the case studies in `models/README.md`: model, configurations, properties, seconds.

Run it from the repository: python -m benchmarks.models [--write PAGE]
"""

from __future__ import annotations

import argparse
from pathlib import Path

from benchmarks import writing
from llfsm_verify.arrangement.loader import load_arrangement
from llfsm_verify.checking.verdict import Verdict
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.logic.reading import read_source
from llfsm_verify.verification.verify import verify

ROOT = Path(__file__).parents[1]
NAME = "benchmarks.models"
HEADINGS = ["model", "configurations", "properties", "seconds"]


def row(folder: Path) -> list[str]:
    """The cells of one line. SystemExit when a property of the model does not hold."""
    arrangement = load_arrangement(folder / "arrangement.yaml")
    properties = parse_properties([read_source(ROOT / "properties" / f"{folder.name}.ltl")])
    verify(arrangement, properties, engine="explicit")  # compiles the kernels, once for an installation
    result = verify(arrangement, properties, engine="explicit")
    if not result.complete or any(p.verdict is not Verdict.HOLDS for p in result.properties):
        raise SystemExit(f"{folder.name}: not every property holds")
    title, page = folder.name.replace("_", " "), f"{folder.name}/README.md"
    return [
        f"[{title}]({page})",
        f"{result.exploration.states:,}",
        str(len(result.properties)),
        f"{result.seconds:.2f}",
    ]


def main(arguments: list[str] | None = None) -> None:
    """Print the table and, with --write, put it into a page. SystemExit when a property does not hold."""
    parser = argparse.ArgumentParser(prog=f"python -m {NAME}", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--write", type=Path, metavar="PAGE", help="put the table into this page as well")
    options = parser.parse_args(arguments)
    if options.write is not None:
        writing.check(parser, options.write, NAME)
    rows = [row(path.parent) for path in sorted((ROOT / "models").glob("*/arrangement.yaml"))]
    body = f"{writing.markdown(HEADINGS, rows, '--:')}\n\n{writing.signature(NAME, 'engine explicit, one run')}"
    print(body)
    if options.write is not None:
        writing.replace(options.write, NAME, body)


if __name__ == "__main__":
    main()
