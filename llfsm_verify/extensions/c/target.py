"""The target `c`: a header and a source of C99."""

from __future__ import annotations

from dataclasses import replace

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.c.codes import OF_C
from llfsm_verify.extensions.c.image import MARK, Image, Meaning
from llfsm_verify.extensions.c.monitors import Monitors
from llfsm_verify.extensions.c.names import foreign, identifier
from llfsm_verify.extensions.c.small import smaller
from llfsm_verify.extensions.c.worlds import world
from llfsm_verify.plug import FRAME_COUNTS as COUNTED
from llfsm_verify.plug import (
    WORLDS,
    Arrangement,
    EventKind,
    Made,
    Vectors,
    Verified,
    Watched,
    leaves,
    lower,
    safe_values,
)
from llfsm_verify.plug import TargetWanted as Wanted


class _C99:
    """See `Target`."""

    worlds = WORLDS
    mark = MARK

    def make(self, arrangement: Arrangement, wanted: Wanted) -> Made:
        """See `Target`."""
        image = _image(arrangement, wanted)
        files = {f"{image.prefix}.h": image.header(), f"{image.prefix}.c": image.source()}
        made = world(wanted.world).make(image, wanted)
        monitors = {} if image.monitors is None else image.monitors.files(MARK)
        promise = () if image.monitors is None else tuple(image.monitors.promise)
        texts = {**files, **monitors, **made.files}
        # A path need not be UTF-8, but what is written is.
        escaped = {name: text.encode("utf-8", "backslashreplace").decode() for name, text in texts.items()}
        return Made(escaped, made.notes, promise)

    def verify(self, arrangement: Arrangement, wanted: Wanted, made: Made, vectors: Vectors | None) -> Verified:
        """See `Target`."""
        from llfsm_verify.extensions.c.verifying.verify import Means, verify

        image = _image(arrangement, wanted)
        program = image_for(arrangement, image.meaning.counted, wanted.monitors).program
        return verify(Means(image, arrangement, program), wanted, made, vectors)


C99 = _C99()


def _image(arrangement: Arrangement, wanted: Wanted) -> Image:
    counted = COUNTED if world(wanted.world).counts else ()
    image = image_for(arrangement, counted, wanted.monitors)
    if wanted.optimize == "speed":
        return image
    read = [v.name for v in image.program.vars] if counted or wanted.monitors is not None else []
    made = Image(smaller(image.program, read, image.meaning.safe), replace(image.meaning, small=True))
    if wanted.monitors is not None:
        made.monitors, made.recorded = Monitors(made.names, wanted.monitors), image.recorded
    return made


def image_for(arrangement: Arrangement, counted: tuple[EventKind, ...] = (), watched: Watched | None = None) -> Image:
    """The image of an arrangement (`images.image_of`), with monitors. DiagnosticError: E525 (C has its name), see
    `Names` (E504) and `Monitors` (E517)."""
    reason = foreign(identifier(arrangement.name))
    if reason:
        message = f"an arrangement called `{arrangement.name}` cannot be C: {reason}"
        raise DiagnosticError(Diagnostic(OF_C, message, arrangement.span, hint="give it another `name:`"))
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
    meaning = Meaning(outputs, safe_values(arrangement), enumerations, arrangement.path, places, counted, arrangement)
    program = lower(arrangement, keep_all_bits=True)
    if watched is None:
        return Image(program, meaning)
    image = Image(watched.program, meaning)
    image.monitors, image.recorded = Monitors(image.names, watched), program
    return image
