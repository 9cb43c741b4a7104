"""Commands are run here: their kernels are compiled beforehand."""

from tests.warm import compiled_kernels

__all__ = ["compiled_kernels"]
