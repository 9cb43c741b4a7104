"""`llfsm build`: an arrangement as a program for another machine."""

from __future__ import annotations

import errno
import shlex
from argparse import Namespace
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

from llfsm_verify.analysis.coverage.vectorfile import read_vectors
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.cli.commands.build.arguments import PLAIN
from llfsm_verify.cli.io.ending import ending_raises
from llfsm_verify.cli.io.output import Output, tell
from llfsm_verify.cli.opening import chosen, open_draft, read_properties, told
from llfsm_verify.cli.parser import UsageError
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.files import replacing, special_kind
from llfsm_verify.registry import Registry
from llfsm_verify.targets import UNWRITABLE
from llfsm_verify.targets.images import image_of
from llfsm_verify.targets.monitors import Watched, watched
from llfsm_verify.targets.target import TARGETS, Target, Verifying, Wanted

_HINTS = {
    **dict.fromkeys((errno.EEXIST, errno.ENOTDIR), "name a folder: a file is in the way"),
    **dict.fromkeys((errno.ENOSPC, errno.EFBIG, errno.EDQUOT), "make room, or name another folder"),
    **dict.fromkeys((errno.EACCES, errno.EPERM, errno.EROFS), "name a folder in which you may write"),
    errno.ENAMETOOLONG: "give the arrangement a shorter `name:`, or name another folder",
}

PLAIN_OPTIONS = Namespace(
    pins=None, mcu=PLAIN.mcu, clock_hz=PLAIN.clock_hz, vectors=None, cc=PLAIN.compiler, emulator=PLAIN.emulator
)
"""What options are where nobody gives them."""


def run(options: Namespace) -> int:
    """Returns 0, or 1: the built image differs from a run; raises UsageError, or DiagnosticError: wrong files, what has
    no meaning in an image (E503, E504), files that cannot be written (E505), and what `Target` raises."""
    target = TARGETS.load(options.target)
    _check_world(options, target)
    if options.verify and not isinstance(target, Verifying):
        raise UsageError(f"--verify: {options.target} cannot run what it makes")
    wanted = _wanted(options)
    draft, given = open_draft(options.arrangement)
    arrangement = image_of(given, options.cycle_ms)
    wanted = replace(wanted, sources=draft.sources, monitors=_watched(options, given, arrangement, wanted.optimize))
    made = target.make(arrangement, wanted)
    if made.promise:
        Output().plain("".join(f"{line}\n" for line in (*made.promise, "")))
    if given.plants:
        tell("note: the model of the surroundings is left out: the inputs that it wrote come from the world")
    _tell_kept(arrangement)
    if options.output is not None:
        folder = Path(options.output)
        _refuse_others(folder, made.files, target.mark)
        for name in _left_over(folder, made.files, target.mark):
            tell(f"note: {folder / name} is from an earlier build, and this one has nothing to do with it")
        _write(folder, made.files)
        lines = [*(f"written: {folder / name}" for name in made.files), "", *made.notes]
        Output().plain("\n".join(lines) + "\n")
    if not options.verify or not isinstance(target, Verifying):
        return 0
    vectors = None if options.vectors is None else read_vectors(options.vectors)
    with ending_raises():
        verified = target.verify(arrangement, wanted, made, vectors)
    Output().plain("\n".join(verified.lines) + "\n")
    return 0 if verified.difference is None else 1


def _check_world(options: Namespace, target: Target) -> None:
    """UsageError: there is no such world."""
    worlds = target.worlds
    broken = worlds.find_others() if isinstance(worlds, Registry) and options.world not in worlds else []
    if options.world not in worlds:
        made_for = f"--for {options.world[:40]}: {options.target} is made for {', '.join(worlds)}"
        raise UsageError("; ".join([made_for, *broken]))


def _wanted(options: Namespace) -> Wanted:
    """UsageError: options that do not fit each other."""
    if options.output in ("", "-") or (options.output is None and not options.verify):
        raise UsageError("-o/--output needs the name of a folder")
    if not 1000 <= options.clock_hz <= 100_000_000:
        raise UsageError(f"--clock-hz {options.clock_hz}: the clock of a microcontroller has 1000 to 100000000 Hz")
    changed = {name for name, value in vars(PLAIN_OPTIONS).items() if getattr(options, name) != value}
    for names, needs, there in (
        (("pins", "mcu", "clock_hz"), "--for avr", options.world == "avr"),
        (("vectors", "cc", "emulator"), "--verify", options.verify),
        (("cc", "emulator"), "another world than avr", options.world != "avr"),
    ):
        wrong = [name for name in names if name in changed]
        if wrong and not there:
            raise UsageError(f"--{wrong[0].replace('_', '-')} needs {needs}")
    for name, least in (("cc", 1), ("emulator", 0)):
        _check_command(f"--{name}", getattr(options, name), least)
    optimum = "size" if options.world == "avr" else PLAIN.optimize
    return Wanted(
        options.world, pins=options.pins, mcu=options.mcu, clock_hz=options.clock_hz, compiler=options.cc,
        emulator=options.emulator, optimize=options.optimize or optimum,
    )  # fmt: skip


def _tell_kept(arrangement: Arrangement) -> None:
    """Which outputs a fault leaves as they are."""
    kept = [f"`{e.variable.name}`" for e in arrangement.whiteboard if e.role == "output" and e.safe is None]
    if kept:
        keep = "keep their values, since they have" if kept[1:] else "keeps its value, since it has"
        tell(f"note: after a fault {', '.join(kept)} {keep} no `safe:`")


def _check_command(option: str, text: str, least: int) -> None:
    """UsageError: these are not the words of a command."""
    try:
        words = shlex.split(text)
    except ValueError:
        words = []
        least = 1
    if len(words) < least:
        raise UsageError(f"{option} needs a command")


def _watched(options: Namespace, given: Arrangement, image: Arrangement, optimize: str) -> Watched | None:
    """What goes with the image, if properties are given. UsageError, DiagnosticError (E432, E515, E516)."""
    if not options.properties and not options.property:
        if options.only:
            raise UsageError("--only chooses properties of --monitor")
        return None
    properties = told(chosen(read_properties(options), options.only), image)
    if not properties.goals:
        raise UsageError("--monitor: there is no property")
    return watched(given, image, properties, optimize)


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
