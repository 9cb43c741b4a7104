"""Documents in YAML, every part with its place: composed, read by known keys, and written."""
