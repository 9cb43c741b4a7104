"""Guards: a monitor and a switch between machines and their outputs, and the proof of what they warrant."""
