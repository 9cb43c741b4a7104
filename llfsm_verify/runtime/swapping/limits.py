"""What the check of a machine may take before it is loaded."""

from __future__ import annotations

from llfsm_verify.limits import Limits

DEFAULT = Limits(timeout=60, memory=1 << 30)
"""Unless whoever starts the run says otherwise."""
