"""Searches run here: their kernels are compiled beforehand."""

from __future__ import annotations

from tests.warm import compiled_kernels

__all__ = ["compiled_kernels"]
