"""Machines that take the places of others in an arrangement that runs."""
