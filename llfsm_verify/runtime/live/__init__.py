"""Arrangements that run: the loop in machine code, its clock, and what it is told and tells."""

CODES = {
    "E483": "The arrangement cannot run as it is: a machine is only a model, nothing says how long a cycle takes, or "
    "what a property reads leaves 64 bits at first.",
    "E484": "The inputs of a trace cannot be repeated in a run.",
    "E485": "A whiteboard cannot be served under that name.",
    "E486": "A whiteboard is not there, has no such slot, or refuses a value.",
    "E489": "A property needs what frames do not show.",
    "E502": "A run needs more files and sockets than its process may have open.",
}
IMPOSSIBLE, UNREPEATABLE, UNSERVED, ABSENT, UNSEEN, CROWDED = "E483", "E484", "E485", "E486", "E489", "E502"
