"""Lint by proof: what is wrong with an arrangement whatever its properties (docs/decisions/0023-lint-by-proof.md)."""
