"""Commands that make the program say what is wrong with what is to be shown."""

from __future__ import annotations

from tests.outputs.provoking import LAMP, Provoked

RUN = (
    "llfsm run a.yaml --set go=true --for 8s --whiteboard {0} > out.txt 2>&1 & "
    "for i in $(seq 100); do llfsm whiteboard list | grep -q {0} && break; done"
)
RECORD = "llfsm run a.yaml --rate 0 --for 1s --set go=true --record lamp.rec"
OTHER = LAMP | {"b.yaml": LAMP["a.yaml"].replace("go", "on")}
PROVOKED = {
    "E551": Provoked((RECORD, "llfsm view lamp.recording -o lamp.html"), LAMP),
    "E552": Provoked((RUN.format("lamp"), "llfsm view lamp --arrangement b.yaml"), OTHER),
    "E553": Provoked((RUN.format("hall"), "llfsm view hall -o hall.html"), LAMP),
    "E554": Provoked((RECORD, "llfsm view lamp.rec --port 70000"), LAMP),
    "E555": Provoked((RECORD, "llfsm view lamp.rec -o lamp.html --steps 50000:"), LAMP),
}
