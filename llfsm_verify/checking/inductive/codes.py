"""The diagnostic codes of files of invariants, with what each means."""

CODES = {
    "E470": "Invariants cannot be written or read there.",
    "E471": "A file of invariants that is none, or not of this version.",
    "E472": "Invariants would replace a file that is an input of the check.",
}
