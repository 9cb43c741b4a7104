"""Arrangements that run: the loop in machine code, its clock, and what it is told and tells."""
