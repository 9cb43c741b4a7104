"""The table of the case studies in `README.md`: model, configurations, properties, seconds.

Run it from the repository: python -m benchmarks.models
"""

from __future__ import annotations

from pathlib import Path

from llfsm_verify.arrangement.loader import load_arrangement
from llfsm_verify.checking.verdict import Verdict
from llfsm_verify.checking.verify import verify
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.logic.reading import read_source

ROOT = Path(__file__).parents[1]


def row(folder: Path) -> str:
    """One line of the table. SystemExit when a property of the model does not hold."""
    arrangement = load_arrangement(folder / "arrangement.yaml")
    properties = parse_properties([read_source(ROOT / "properties" / f"{folder.name}.ltl")])
    verify(arrangement, properties)  # compiles the kernels, once for an installation
    result = verify(arrangement, properties)
    if not result.complete or any(p.verdict is not Verdict.HOLDS for p in result.properties):
        raise SystemExit(f"{folder.name}: not every property holds")
    title, page = folder.name.replace("_", " "), f"models/{folder.name}/README.md"
    return f"| [{title}]({page}) | {result.states:,} | {len(result.properties)} | {result.seconds:.2f} |"


def main() -> None:
    print("| model | configurations | properties | seconds |")
    print("|---|--:|--:|--:|")
    for path in sorted((ROOT / "models").glob("*/arrangement.yaml")):
        print(row(path.parent))


if __name__ == "__main__":
    main()
