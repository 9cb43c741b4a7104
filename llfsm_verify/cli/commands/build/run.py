"""`llfsm build`: an arrangement as a program for another machine."""

from __future__ import annotations

import errno
from argparse import Namespace
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.cli.commands.build.arguments import PLAIN
from llfsm_verify.cli.io.output import Output, tell
from llfsm_verify.cli.opening import open_draft, read_properties, told
from llfsm_verify.cli.parser import UsageError
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.files import replacing, special_kind
from llfsm_verify.targets import UNWRITABLE
from llfsm_verify.targets.images import image_of
from llfsm_verify.targets.monitors import Watched, watched
from llfsm_verify.targets.target import TARGETS, Wanted

_HINTS = {
    **dict.fromkeys((errno.EEXIST, errno.ENOTDIR), "name a folder: a file is in the way"),
    **dict.fromkeys((errno.ENOSPC, errno.EFBIG, errno.EDQUOT), "make room, or name another folder"),
    **dict.fromkeys((errno.EACCES, errno.EPERM, errno.EROFS), "name a folder in which you may write"),
    errno.ENAMETOOLONG: "give the arrangement a shorter `name:`, or name another folder",
}


def run(options: Namespace) -> int:
    """Returns 0; raises UsageError, or DiagnosticError: wrong files, what has no meaning in an image (E503, E504), or
    files that cannot be written (E505)."""
    target = TARGETS.load(options.target)
    if options.world not in target.worlds:
        raise UsageError(f"--for {options.world[:40]}: {options.target} is made for {', '.join(target.worlds)}")
    if options.output in ("", "-"):
        raise UsageError("--output needs the name of a folder")
    if not 1000 <= options.clock_hz <= 100_000_000:
        raise UsageError(f"--clock-hz {options.clock_hz}: the clock of a microcontroller has 1000 to 100000000 Hz")
    of_avr = [
        f"--{name}"
        for name in ("pins", "mcu", "clock-hz")
        if options.world != "avr" and getattr(options, name.replace("-", "_")) != getattr(PLAIN, name.replace("-", "_"))
    ]
    if of_avr:
        raise UsageError(f"{of_avr[0]} is for --for avr, not {options.world}")
    draft, given = open_draft(options.arrangement)
    image = image_of(given, options.cycle_ms)
    wanted = Wanted(
        options.world,
        pins=options.pins,
        mcu=options.mcu,
        clock_hz=options.clock_hz,
        sources=draft.sources,
        monitors=_watched(options, given, image),
    )
    made = target.make(image, wanted)
    if made.promise:
        Output().plain("".join(f"{line}\n" for line in (*made.promise, "")))
    if given.environment is not None:
        tell("note: the model of the surroundings is left out: the inputs that it wrote come from the world")
    folder = Path(options.output)
    _refuse_others(folder, made.files, target.mark)
    for name in _left_over(folder, made.files, target.mark):
        tell(f"note: {folder / name} is from an earlier build, and no part of this one")
    _write(folder, made.files)
    lines = [*(f"written: {folder / name}" for name in made.files), "", *made.notes]
    Output().plain("\n".join(lines) + "\n")
    return 0


def _watched(options: Namespace, given: Arrangement, image: Arrangement) -> Watched | None:
    """What goes with the image, if properties are given. UsageError, DiagnosticError (E432, E515, E516)."""
    if not options.properties and not options.property:
        return None
    properties = told(read_properties(options), image)
    if not properties.goals:
        raise UsageError("--monitor: there is no property")
    return watched(given, image, properties)


def _refuse_others(folder: Path, files: Mapping[str, str], mark: str) -> None:
    """DiagnosticError (E505): a file is there that `llfsm build` has not written."""
    for name in files:
        path = folder / name
        try:
            if not path.exists() and not path.is_symlink():
                continue
            mode = path.lstat().st_mode
            with_mark = special_kind(mode) is None and not path.is_dir() and mark in _first_line(path)
        except OSError as error:
            raise _unwritable(folder, error) from None
        if not with_mark:
            message = f"{name} is there already, and `llfsm build` has not written it"
            raise DiagnosticError(Diagnostic(UNWRITABLE, message, hint="name another folder", file=str(folder)))


def _left_over(folder: Path, files: Mapping[str, str], mark: str) -> list[str]:
    """Files there that `llfsm build` has written, and writes no more."""
    try:
        others = sorted(path for path in folder.iterdir() if path.name not in files and not path.is_symlink())
        return [path.name for path in others if path.is_file() and mark in _first_line(path)]
    except OSError:
        return []  # the folder is not there yet, or what hinders is said by who writes


def _first_line(path: Path) -> str:
    with path.open(encoding="utf-8", errors="replace") as file:
        return file.readline(1000)


def _write(folder: Path, files: Mapping[str, str]) -> None:
    """All files, each as a whole."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with ExitStack() as stack:
            for name, text in files.items():
                stack.enter_context(replacing(folder / name)).write(text.encode())
    except OSError as error:
        raise _unwritable(folder, error) from None


def _unwritable(folder: Path, error: OSError) -> DiagnosticError:
    reason = error.strerror or "input/output error"
    hint = _HINTS.get(error.errno or 0, "name another folder")
    message = f"the files cannot be written there: {reason}"
    return DiagnosticError(Diagnostic(UNWRITABLE, message, hint=hint, file=str(folder)))
