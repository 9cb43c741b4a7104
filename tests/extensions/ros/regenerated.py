"""Writes installed types as files, and compares what is generated of them: `python3 regenerated.py FOLDER`.

It prints the names of those that are the same: their checksums, fields, and the bytes of a message.
"""

import importlib
import io
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[2] / "llfsm_verify" / "extensions" / "ros"))
from ros1_node.messages import RULE, Types  # noqa: E402

PACKAGES = ("std_msgs", "geometry_msgs", "actionlib_msgs", "rosgraph_msgs", "actionlib", "move_base_msgs", "roscpp")
folder = Path(sys.argv[1])
installed = {"msg": {}, "srv": {}, "action": {}}
for package in PACKAGES:
    for kind in ("msg", "srv"):
        try:
            module = importlib.import_module(f"{package}.{kind}")
        except ImportError:
            continue
        for name in dir(module):
            found = getattr(module, name)
            if hasattr(found, "_type") and not name.endswith(("Request", "Response")):
                installed[kind][package, name] = found


def own(made):
    return made._full_text.split(RULE)[0]


def write(package, name, kind, text):
    place = folder / package / kind / f"{name}.{kind}"
    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_text(text, encoding="utf-8")


for (package, name), made in installed["msg"].items():
    parts = [installed["msg"].get((package, name[: -len("Action")] + part)) for part in ("Goal", "Result", "Feedback")]
    if name.endswith("Action") and all(parts):
        installed["action"][package, name[: -len("Action")]] = made
        write(package, name[: -len("Action")], "action", "\n---\n".join(map(own, parts)))
    write(package, name, "msg", own(made))
for (package, name), made in installed["srv"].items():
    write(package, name, "srv", f"{own(made._request_class)}\n---\n{own(made._response_class)}")

types = Types([str(folder)])
finders = {"msg": types.message, "srv": types.service, "action": types.action}


def written(made):
    buffer = io.BytesIO()
    made().serialize(buffer)
    return buffer.getvalue()


# Generated classes take the place of those installed in their modules, so what is compared is kept above.
for kind, found in installed.items():
    for (package, name), made in found.items():
        other = finders[kind](f"{package}/{name}")
        assert other is not made, name
        if other._md5sum != made._md5sum:
            print("DIFFERENT", kind, package, name, other._md5sum, made._md5sum)
        elif kind == "srv" or (other.__slots__, written(other)) == (made.__slots__, written(made)):
            print(kind, f"{package}/{name}")
