"""What is right. Wrong guards and actions, and what is said about them: tests/bad_input; random ones: tests/fuzzing."""
