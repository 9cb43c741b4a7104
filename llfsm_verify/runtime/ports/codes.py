"""The diagnostic codes of ports."""

CODES = {
    "E493": "A file of ports names a kind, an input, a slot or a value that does not exist.",
    "E494": "Two ports, or two entries of one, need the same input, field, pipe or device.",
    "E495": "A port cannot be opened.",
}
UNKNOWN, SHARED, UNOPENED = "E493", "E494", "E495"
