"""The diagnostic codes of all files in YAML, with what each means."""

from __future__ import annotations

CODES: dict[str, str] = {
    "E010": "A file is not YAML.",
    "E011": "A file is empty.",
    "E012": "YAML values are nested too deeply.",
    "E013": "A file has too many YAML values, aliases counted.",
    "E014": "A file has a second YAML document.",
    "E015": "A YAML alias without an anchor before it.",
    "E016": "A YAML tag.",
    "E017": "A key appears twice.",
    "E018": "A key is not a word.",
    "E020": "YAML takes a guard or an action apart: it must be quoted.",
    "E030": "A mapping is expected.",
    "E031": "A list is expected.",
    "E032": "A single value is expected.",
    "E033": "An unknown key.",
    "E034": "A key is missing.",
    "E035": "A value that is not one of the words possible there.",
    "E036": "A name that is not a valid identifier.",
    "E097": "A file is of a later format than this version knows, or its `format` is not a valid number.",
}

HINTS: dict[str, str] = {
    "E010": "check quotes, brackets and indentation here and in the lines before",
    "E011": "write what it is to say, or remove it",
    "E012": "use fewer levels of nesting",
    "E013": "write fewer values, and fewer aliases of large ones",
    "E017": "remove one of them",
    "E030": "write `key: value`, one per line",
    "E032": "write one word, number or text",
}
"""What to write instead, where the place has nothing more exact to say."""
