"""ROSMonitoring's oracle protocol: its monitors send messages as JSON over WebSocket, and get verdicts.

What a user writes, what that prints, and what goes over the wire (https://github.com/autonomy-and-verification-uol/
ROSMonitoring: an event, and the same event with a verdict):

    $ llfsm monitor door.ltl --arrangement door.yaml --mapping door.mapping.yaml --serve 8080
    listening on ws://127.0.0.1:8080
    > {"topic": "door", "time": 1.5, "data": true}
    < {"topic": "door", "time": 1.5, "data": true, "verdict": "unknown"}

The verdict is `false` or `true` when nothing can change it any more, else `unknown`; `spec` has what is violated. With
`--filter` a message that violates a property gets `currently_false` and counts as not sent: a monitor with `action:
filter` keeps it from being passed on. A column `door:data` of the mapping is a field of a topic or service, `data` one
of the mapping's `topic`, whose messages are the letters (without `topic`: all are).

Mistakes:

    error[E550]: it cannot listen on 127.0.0.1:80: Permission denied
    < {"error": "a message is a JSON object with a `topic` or a `service`", "verdict": "unknown"}
    < {"topic": "door", "data": 7, "error": "message 2, column `door:data` (`open`): `7` is …", "verdict": "unknown"}
"""

from __future__ import annotations

from llfsm_verify.plug import Entry, Package

ENTRIES = {
    "llfsm_verify.codes": (Entry("rosmonitoring", f"{__name__}.codes:CODES", "Verdicts for ROSMonitoring"),),
    "llfsm_verify.oracles": (
        Entry(
            "rosmonitoring",
            f"{__name__}.server:serve",
            "JSON over WebSocket",
            package=Package("websockets", "websockets", "rosmonitoring"),
        ),
    ),
}
