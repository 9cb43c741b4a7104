"""What happened in a run: the file, and what is made of it."""
