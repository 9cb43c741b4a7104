"""Machines that take the places of others in an arrangement that runs."""

from llfsm_verify.limits import Limits

DEFAULT = Limits(timeout=60, memory=1 << 30)
"""What the check of a machine may take before it is loaded, by default."""
