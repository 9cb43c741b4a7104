"""The diagnostic codes of runs."""

CODES = {
    "E483": "The arrangement cannot run as it is: it stands for something else, or has no length of a cycle.",
    "E484": "The inputs of a trace cannot be repeated in a run.",
}
IMPOSSIBLE, UNREPEATABLE = "E483", "E484"
