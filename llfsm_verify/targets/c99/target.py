"""The target `c`: a header and a source of C99."""

from __future__ import annotations

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.runtime.live.plan import safe_values
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.semantics.storage import leaves
from llfsm_verify.targets.c99.image import MARK, Image, Meaning
from llfsm_verify.targets.c99.posix import program, readme
from llfsm_verify.targets.target import Made


class _C99:
    """See `Target`."""

    worlds = ("none", "posix")
    mark = MARK

    def make(self, arrangement: Arrangement, world: str) -> Made:
        """`none`: for a caller that knows its machine itself; `posix`: a program that runs by itself."""
        image = image_for(arrangement)
        source = image.source()
        files = {f"{image.prefix}.h": image.header(), f"{image.prefix}.c": source}
        if world == "posix":
            files |= {f"{image.prefix}_main.c": program(image), "README.md": readme(image)}
            compiled = f"cc -std=c99 -O2 {image.prefix}.c {image.prefix}_main.c -o {image.prefix}"
            return Made(files, (f"Compile it: {compiled}",))
        period = f"{float(arrangement.cycle_ms or 0):g}"
        return Made(files, (f"Call {image.prefix}_cycle once in {period} ms.",))


C99 = _C99()


def image_for(arrangement: Arrangement) -> Image:
    """The image of an arrangement (`images.image_of`). DiagnosticError (E504): see `Names`."""
    outputs = [
        entry.variable.name + leaf.suffix
        for entry in arrangement.whiteboard
        if entry.role == "output"
        for leaf in leaves(entry.variable.type)
    ]
    enumerations = {found.values: found.name for found in arrangement.enumerations}
    places = {entry.variable.name: entry.variable.span for entry in arrangement.whiteboard}
    places |= {found.name: found.span for found in arrangement.declared_types}
    places |= {machine.name: machine.span for machine in arrangement.machines}
    meaning = Meaning(outputs, safe_values(arrangement), enumerations, arrangement.path, places)
    return Image(lower(arrangement, keep_all_bits=True), meaning)
