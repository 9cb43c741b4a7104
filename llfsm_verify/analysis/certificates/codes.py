"""The diagnostic codes of certificates, with what each means."""

CODES = {
    "E450": "A certificate cannot be written or read there.",
    "E451": "A certificate would replace a file that is an input of the check.",
}
