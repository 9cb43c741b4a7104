"""The diagnostic codes of files of invariants, with what each means."""

CODES = {
    "E452": "Invariants cannot be written or read there.",
    "E453": "A file is not a file of invariants, or is one of another version.",
    "E454": "Invariants would replace a file that is an input of the check.",
}
