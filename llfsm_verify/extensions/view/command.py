"""`llfsm view`: a page of a saved trace or a recording, written or served, or of a run that goes on."""

from __future__ import annotations

import webbrowser
from argparse import Namespace
from itertools import chain, repeat
from pathlib import Path

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.view.codes import UNWRITTEN
from llfsm_verify.plug import CommandParser, UsageError, other_arrangement, ready_beside, step_range, tell, write_whole

WHOLE = (0, None)
CODE, WHAT = "E490", "the page"
SUFFIXES = (".html", ".htm")


def arguments(parser: CommandParser) -> None:
    """Add the arguments of `llfsm view`."""
    parser.about(
        "Show a run in a browser: a saved trace or a recording step by step, or a run that goes on, by the name of its "
        "whiteboard. It is shown at an address of this computer only, until Ctrl-C; a file needs no server.",
        "llfsm view run.rec -o run.html --steps 1:5000\nllfsm view lift --arrangement lift.yaml --open",
        "exit codes: 0 written or shown, 2 wrong usage, 3 no such file or run, files wrong or unreadable, or nothing "
        "can be served there, 130 interrupted",
    )
    add = parser.add_argument
    add("shown", metavar="FILE|NAME", help="a saved trace, a recording of `llfsm run`, or the whiteboard of a run")
    add("-o", "--output", metavar="FILE", help="write one HTML file that shows it (default: serve it)")
    add("--steps", metavar="A:B", type=step_range, default=WHOLE, help="begin at step A and end at B, for files")
    other_arrangement(parser, "the file names or has; of a run, the one whose machines are drawn")
    add("--port", metavar="N", type=int, default=0, help="serve it at this port of 127.0.0.1 (default: a free one)")
    add("--open", action="store_true", help="also open the browser there")


def run(options: Namespace) -> int:
    """Returns 0. DiagnosticError: there is nothing of this name (E551), what is wrong with the file or the run, a run
    is to be written (E553), or nothing can be written there (E490) or served (E554)."""
    from llfsm_verify.extensions.view.document import document_of_file
    from llfsm_verify.extensions.view.live import absent, view_live, whiteboards
    from llfsm_verify.extensions.view.page import page_html
    from llfsm_verify.extensions.view.server import serve_document

    name, output, port = options.shown, options.output, options.port
    steps = None if options.steps == WHOLE else options.steps

    def told(text: str) -> None:
        tell(text)
        if options.open and not webbrowser.open(text.split(maxsplit=1)[0]):
            tell("no browser was found that can be opened")

    if not Path(name).is_file():
        if output is not None:
            if name not in whiteboards():
                raise absent(name, "")
            message = "a run is written as it is now only: `-o` is for traces and recordings"
            hint = "record it with `llfsm run --record FILE`, then `llfsm view FILE -o out.html`"
            raise DiagnosticError(Diagnostic(UNWRITTEN, message, hint=hint))
        if steps is not None:
            raise UsageError("--steps is for traces and recordings: a run is shown as it goes on")
        view_live(name, options.arrangement, told, port=port)
    elif output is not None:
        if port or options.open:
            raise UsageError("-o writes a file and serves nothing: leave --port and --open out")
        ready_beside([name, *filter(None, [options.arrangement])], output, CODE, WHAT)
        if output != "-" and Path(output).suffix.lower() not in SUFFIXES:
            raise UsageError(f"`{output}` does not end like a page: name it {' or '.join(SUFFIXES)}")
        document = document_of_file(name, options.arrangement, *(steps or WHOLE))
        tell(*(f"note: {note}" for note in document["notes"]))
        write_whole(page_html(document), output, CODE, WHAT)
        if output != "-":
            tell(f"{output} written")
    else:
        asked = chain([steps] if steps else [], repeat(None))
        serve_document(
            lambda *rows: document_of_file(name, options.arrangement, *(next(asked) or rows)), name, told, port=port
        )
    return 0
