"""What happened in a run: the file, and what is made of it."""

CODES = {
    "E480": "A recording cannot be written there.",
    "E481": "A file is not a recording, or is damaged before its first frame.",
    "E482": "A recording belongs to another arrangement or version.",
    "E488": "A recording cannot become a saved trace: tests could not perform it, or it shows no failure.",
}
UNWRITABLE, UNREADABLE, OTHER, UNSAVED = "E480", "E481", "E482", "E488"
