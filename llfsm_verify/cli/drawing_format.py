"""Which format a drawing has: the one asked for, or what the name of its file ends in."""

from __future__ import annotations

from pathlib import Path

from llfsm_verify.cli.parser import UsageError
from llfsm_verify.report.drawing.formats import DRAWINGS

OTHER_PICTURES = frozenset({".jpg", ".jpeg", ".gif", ".webp", ".bmp", ".pdf", ".ps", ".eps"})
"""Endings of formats that we do not draw: nothing of ours is written under such a name."""


def drawing_format(wanted: str | None, output: str | None) -> str:
    """One of `DRAWINGS`, from `--format` and `-o`; UsageError: they do not fit each other."""
    ending = Path(output).suffix.lower() if output is not None and output != "-" else ""
    meant = DRAWINGS.named_by(output or "")
    if ending in OTHER_PICTURES or (wanted is None and ending and meant is None):
        or_say = "" if ending in OTHER_PICTURES else ", or give --format"
        raise UsageError(f"no drawing ends like `{output}`: name it {', '.join(DRAWINGS.suffixes)}{or_say}")
    if wanted is not None and meant not in (None, wanted):
        raise UsageError(f"`{output}` ends like {meant}, and --format says {wanted}")
    chosen = wanted or meant or next(iter(DRAWINGS))
    if chosen in DRAWINGS.binary and output in (None, "-"):
        raise UsageError(f"{chosen} is not text: name a file with -o")
    return chosen
