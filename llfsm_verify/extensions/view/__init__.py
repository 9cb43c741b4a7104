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
    error[E552]: `lift` runs another arrangement than lift.yaml: it has no slot `door`
    hint: name the file that it was started with
    error[E553]: a run is written as it is now only: `-o` is for traces and recordings
    hint: record it with `llfsm run --record FILE`, then `llfsm view FILE -o out.html`
"""

from __future__ import annotations

ENTRIES: dict[str, tuple[object, ...]] = {}
