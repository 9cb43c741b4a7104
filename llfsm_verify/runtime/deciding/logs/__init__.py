"""Logs that others wrote: their columns become slots of an arrangement, and each row is a letter."""
