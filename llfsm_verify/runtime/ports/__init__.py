"""Ports: how the inputs of a running arrangement come from the world, and its outputs go there."""

CODES = {
    "E493": "A file of ports names a kind, an input, a slot or a value that does not exist.",
    "E494": "Two ports, or two entries of one, need the same input, field, pipe or device.",
    "E495": "A port cannot be opened.",
    "E526": "A request of a port does not fit the arrangement or its plant.",
    "E527": "A port feeds an input that never changes, and its kind reads nothing before the run.",
}
UNKNOWN, SHARED, UNOPENED, MISFIT, UNABLE = "E493", "E494", "E495", "E526", "E527"
