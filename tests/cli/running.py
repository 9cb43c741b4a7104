"""Running the commands: in this process, which is quick, or in one of their own, as users do."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from dataclasses import dataclass
from unittest.mock import patch

from llfsm_verify import cli

LIGHTS = "models/traffic_lights/arrangement.yaml"
FAULTY = "models/traffic_lights/faulty.yaml"
PROPERTIES = "properties/traffic_lights.ltl"
COUNTER = """
name: counter
cycle_ms: 1
whiteboard: {go: {type: bool, init: false, role: input}, n: {type: 0..3, init: 0}}
machines:
  m:
    inline:
      machine: M
      states:
        - name: A
          internal: if (go) n += 1;
          transitions: [{when: n == 3 && go, to: B}]
        - name: B
          on_entry: n += 1;
schedule: [m]
"""


@dataclass(frozen=True, slots=True)
class Done:
    returncode: int
    stdout: str
    stderr: str


def llfsm(*arguments: str, stdin: str | None = "") -> Done:
    """`llfsm` with these arguments, in this process, with streams like real ones; `stdin` None: it is closed."""
    streams = [io.TextIOWrapper(io.BytesIO(data), encoding="utf-8") for data in ((stdin or "").encode(), b"", b"")]
    with (
        patch.object(sys, "stdin", None if stdin is None else streams[0]),
        patch.object(sys, "stdout", streams[1]),
        patch.object(sys, "stderr", streams[2]),
    ):
        try:
            code = cli.main(arguments)
        except SystemExit as leaving:  # argparse's way
            code = int(leaving.code or 0)
    texts = []
    for stream in streams[1:]:
        stream.flush()
        texts.append(stream.buffer.getvalue().decode("utf-8"))
    return Done(code, *texts)


def llfsm_process(*arguments: str, stdin: str = "", **environment: str) -> Done:
    """The same in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-m", "llfsm_verify", *arguments],
        input=stdin,
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
        env={**os.environ, **environment},
    )
    return Done(done.returncode, done.stdout, done.stderr)
