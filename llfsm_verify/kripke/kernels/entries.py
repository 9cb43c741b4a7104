"""Which module defines which kernel. A kernel is compiled when it is first needed and not in the cache."""

from __future__ import annotations

MODULES = {
    "rebuild": "sets",
    "rehash": "sets",
    "spread": "sets",
    "enter_distinct": "distinct",
    "regroup": "exploration",
    "explore_1": "exploration",
    "explore_2": "exploration",
    "explore_any": "exploration",
    "explore_cycles": "exploration",
    "work_1": "shared",
    "work_2": "shared",
    "work_any": "shared",
    "cycle_pairs": "cycles",
    "chains_1": "chains",
    "chains_2": "chains",
    "chains_any": "chains",
    "count_chains": "counting",
    "product_rehash": "product_store",
    "product_thin": "product_store",
    "product_components": "emptiness",
    "product_start": "paths",
    "product_breadth": "paths",
    "product_edge": "paths",
    "product_silent": "paths",
    "product_live": "live",
    "product_lost": "live",
}
"""By kernel: the module of this package that defines it. Each kernel becomes an object file."""

SHARED = (
    "words",
    "blocks",
    "sets",
    "exploration",
    "chains",
    "chain_blocks",
    "shared_blocks",
    "product_blocks",
    "product_store",
)
"""Modules from which those may import: with a module's own text they decide what its kernels are, and the object files
are named after all of that."""
