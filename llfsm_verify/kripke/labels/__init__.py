"""Symbolic transition labels: inputs split into classes by Z3, of each of which one member is stepped."""
