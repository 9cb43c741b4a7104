"""Make the LLVM texts of the search kernels that the package has, or see that they are right.

With ``--check`` nothing is written; exit code 1 when a text differs from what numba makes now.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from zipfile import ZIP_LZMA, ZipFile, ZipInfo

os.environ.update(NUMBA_CPU_NAME="generic", NUMBA_CPU_FEATURES="")  # the texts are for any processor of this kind

from llfsm_verify.kripke.kernels.entries import MODULES
from llfsm_verify.kripke.texts import ARCHIVE, INDEX, PACKAGE, origin, shipped, translated

HERE = Path(__file__).parents[1] / PACKAGE.replace(".", "/") / ARCHIVE


def main(arguments: list[str]) -> int:
    """Exit code 2 for an argument that is not known."""
    if arguments not in ([], ["--check"]):
        print("usage: python -m tools.kernels [--check]", file=sys.stderr)
        return 2
    texts = {name: translated(name, module) for name, module in MODULES.items()}
    if arguments:
        wrong = [name for name, module in MODULES.items() if shipped(name, module) != texts[name]]
        for name in wrong:
            print(f"{name}: not what numba makes; run `python -m tools.kernels`")
        return 1 if wrong else 0
    entries = {INDEX: json.dumps({name: origin(module) for name, module in MODULES.items()}, indent=1)}
    entries |= {f"{name}.ll": text for name, text in texts.items()}
    with ZipFile(HERE, "w", ZIP_LZMA) as archive:
        for name, text in entries.items():
            archive.writestr(ZipInfo(name), text, ZIP_LZMA)  # without a date: equal texts are an equal file
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
