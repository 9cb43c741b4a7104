"""`llfsm init`: a small arrangement with its properties and tests, to be changed into one's own."""

from __future__ import annotations

import errno
import re
from argparse import Namespace
from contextlib import ExitStack
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from shlex import quote
from string import Template

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.projects.codes import MISNAMED, OVERWRITTEN, UNWRITABLE
from llfsm_verify.plug import CommandParser, Output, ending_of, publish, unfinished

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*", re.ASCII)
ARRANGEMENT = "arrangement" + ending_of("arrangement")
TESTS = "test_model.py.txt"
"""The template of the tests; called so that no tool takes it for a module of ours."""
NAMES = {"gitignore": ".gitignore"}
"""Templates whose files are called otherwise: our own git must not obey this one."""


def arguments(parser: CommandParser) -> None:
    """Add the arguments of `llfsm init`."""
    parser.about(
        "Write a small arrangement with its properties and tests, all of which pass; overwrites nothing.",
        "llfsm init crossing",
        "exit codes: 0 written, 2 wrong usage, 3 a file is there already, or cannot be written",
    )
    add = parser.add_argument
    add(
        "directory",
        metavar="DIR",
        nargs="?",
        default=".",
        help="the folder, made if it does not exist (default: this folder)",
    )
    add("--name", metavar="NAME", help="the name of the arrangement (default: that of the folder)")


def run(options: Namespace) -> int:
    """Write the project; 0. Raises DiagnosticError: a wrong name (E461), files that would be overwritten (E460),
    a folder that cannot be written (E462)."""
    if not options.directory:  # an unset variable of a shell, say
        raise DiagnosticError(Diagnostic(UNWRITABLE, "the path of a folder is expected", file="<empty path>"))
    folder = Path(options.directory)
    name = options.name if options.name is not None else folder.absolute().resolve().name
    if not NAME.fullmatch(name):
        where = "--name" if options.name is not None else str(folder)
        hint = "give one with --name: letters, digits, `_` and `-`, a letter or `_` first"
        raise DiagnosticError(
            Diagnostic(MISNAMED, f"`{name[:80]}` is not a valid name for an arrangement", hint=hint, file=where)
        )
    texts = _texts(name)
    if (folder / ".gitignore").exists():  # of a folder that is kept in git already
        del texts[".gitignore"]
    there = [file for file in texts if (folder / file).exists() or (folder / file).is_symlink()]
    if there:
        message = f"this would overwrite {', '.join(there)}"
        hint = "name another folder, or move these files away"
        raise DiagnosticError(Diagnostic(OVERWRITTEN, message, hint=hint, file=str(folder)))
    _write(folder, texts)
    _tell(options.directory, texts)
    return 0


def _texts(name: str) -> dict[str, str]:
    """The files of the project with their texts."""
    module = name.replace("-", "_")
    sources: list[Traversable] = [source for source in (files(__package__) / "templates").iterdir() if source.is_file()]
    texts = {}
    for source in sorted(sources, key=lambda source: source.name):
        file = f"test_{module}.py" if source.name == TESTS else NAMES.get(source.name, source.name)
        texts[file] = Template(source.read_text(encoding="utf-8")).substitute(name=name, module=module)
    return texts


def _write(folder: Path, texts: dict[str, str]) -> None:
    """All files or none."""
    written: list[Path] = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with ExitStack() as stack:
            ready = []
            for file, text in texts.items():
                out, name = stack.enter_context(unfinished(folder / file))
                out.write(text.encode())
                out.close()
                ready.append((name, folder / file))
            # Their names come last and in no time: hardly a moment in which `kill -9` leaves some files without others.
            for name, path in ready:
                if not publish(name, path):
                    raise FileExistsError(errno.EEXIST, f"{path.name} has been made meanwhile")
                written.append(path)
    except OSError as error:
        for path in written:
            path.unlink(missing_ok=True)
        reason = error.strerror or "input/output error"
        message = f"the project cannot be written there: {reason}"
        hint = "name a new folder in a folder that is there and can be written"
        raise DiagnosticError(Diagnostic(UNWRITABLE, message, hint=hint, file=str(folder))) from None


def _tell(directory: str, texts: dict[str, str]) -> None:
    prefix = "" if directory in (".", "./") else f"{directory.rstrip('/')}/"
    there = "" if not prefix else f"cd {quote(directory)}\n  "
    lines = [*(f"written: {prefix}{file}" for file in texts), "", "Try:"]
    lines.append(f"  {there}llfsm-verify {ARRANGEMENT} properties.ltl\n  pytest")
    Output().plain("\n".join(lines) + "\n")
