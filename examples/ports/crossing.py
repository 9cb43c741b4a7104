"""A crossing whose lights are text: a car comes when the other road is green, and leaves when its own road is."""

import json
import sys


def say(**message):
    print(json.dumps(message), flush=True)


for line in sys.stdin:
    message = json.loads(line)
    if "hello" in message:
        say(hello=1, values={"car": False})
    elif "values" in message or "safe" in message:
        lights = message.get("values") or message["safe"]
        print(", ".join(f"{road} {light.lower()}" for road, light in lights.items()), file=sys.stderr)
        if lights["north"] == "GREEN":
            say(values={"car": True})
        elif lights["east"] == "GREEN":
            say(values={"car": False})
