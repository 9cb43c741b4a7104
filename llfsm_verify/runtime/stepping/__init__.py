"""Runs that one steps through: random ones, with inputs that are held, with monitors."""
