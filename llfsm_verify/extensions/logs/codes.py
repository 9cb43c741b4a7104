"""The codes of what is wrong with a log or its mapping."""

CODES = {
    "E496": "A mapping of a log names a slot, a column or a value that does not exist.",
    "E497": "A log cannot be read, or a cell does not hold a value of its slot.",
    "E498": "A property needs what no column of a log gives.",
}
UNKNOWN, UNREADABLE, NOT_GIVEN = "E496", "E497", "E498"
