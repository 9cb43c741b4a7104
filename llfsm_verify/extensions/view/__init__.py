"""Runs, verdicts and machines as a page for browsers: from one JSON document, which `view.schema.json` publishes.

What a user writes, and what that prints:

    $ llfsm-verify arrangement.yaml props.ltl --report out.html
    … the text report …
    out.html written
    $ llfsm view run.rec -o run.html --steps 1:5000
    run.html written
    $ llfsm view run.rec
    http://127.0.0.1:40123/?token=… shows run.rec; Ctrl-C ends it
    $ llfsm view lift --arrangement lift.yaml
    http://127.0.0.1:40125/?token=… shows the run `lift`; Ctrl-C ends it

Mistakes:

    error[E551]: there is no whiteboard and no file `lfit`
    hint: `lift` runs; `llfsm whiteboard list` says what there is
    error[E552]: `lift` runs another arrangement than lift.yaml: it has no machine `door`
    hint: name the file that it was started with
    error[E553]: a run is written as it is now only: `-o` is for traces and recordings
    hint: record it with `llfsm run --record FILE`, then `llfsm view FILE -o out.html`
"""

from __future__ import annotations

from llfsm_verify.plug import CommandEntry, Entry, Package, ReportEntry

NEEDED = Package("jinja2", "jinja2", "view")
PAGE = "a page for browsers, in one file"
ENTRIES = {
    "llfsm_verify.codes": (Entry("view", f"{__name__}.codes:CODES", "Pages"),),
    "llfsm_verify.commands": (
        CommandEntry(
            name="view",
            place=f"{__name__}.command:arguments",
            about="show a recording, a saved trace or a run in a browser",
            group="run",
            runs=f"{__name__}.command:run",
            package=NEEDED,
        ),
    ),
    "llfsm_verify.reports.coverage": (ReportEntry("html", f"{__name__}.report:coverage_report", PAGE, package=NEEDED),),
    "llfsm_verify.reports.result": (
        ReportEntry("html", f"{__name__}.report:report", PAGE, (".html",), package=NEEDED),
    ),
    "llfsm_verify.schemas": (Entry("view", f"{__name__}.report:schema", "the data of pages"),),
}
