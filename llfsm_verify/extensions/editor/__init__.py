"""A language server: diagnostics as you type, completion, hover, definitions, checks of single properties, quick fixes.

What a user writes: an editor starts the server and speaks with it at standard input and output.

    $ llfsm lsp
    > textDocument/didOpen door.ltl: both: G !(ns@GREN && ew@GREEN)
    < textDocument/publishDiagnostics E112 machine `ns` has no state `GREN`; hint: did you mean `GREEN`?
    > textDocument/codeAction
    < Replace `GREN` by `GREEN`
    > workspace/executeCommand llfsm.check ["file:///…/door.ltl", "both"]
    < {"verdict": "violated", "text": "violated", "path": "/tmp/llfsm-…/….html"}

The commands are `llfsm.check URI NAME`, which gives `verdict` and `text`, and `llfsm.show URI NAME`, which gives the
`path` of a page of the violation (or null, and the reason in `message`). `initializationOptions` may say
how long a check may take (`checkSeconds`, 60), reading may take (`longestSeconds`, 10), and how long nothing is typed
before a text is read (`delaySeconds`, 0.2).

Mistakes:

    error[E464]: this needs the package pygls, which is not installed
    information[E560]: no arrangement is known for this property file, so its names are not checked
    information[E562]: it takes longer than 10 s
"""

from __future__ import annotations

from llfsm_verify.plug import CommandEntry, Entry, Package

ENTRIES = {
    "llfsm_verify.codes": (Entry("editor", f"{__name__}.codes:CODES", "A language server"),),
    "llfsm_verify.commands": (
        CommandEntry(
            name="lsp",
            place=f"{__name__}.command:arguments",
            about="serve an editor: diagnostics, completion, checks of properties",
            group="look",
            runs=f"{__name__}.command:run",
            package=Package("pygls", "pygls", "editor"),
        ),
    ),
}
