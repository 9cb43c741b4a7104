"""What is right. Wrong files, and what is said about them: tests/bad_input; random ones: tests/fuzzing."""
