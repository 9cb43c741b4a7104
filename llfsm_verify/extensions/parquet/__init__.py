"""Logs in Parquet, the tables of Apache Arrow."""

from __future__ import annotations

from llfsm_verify.plug import Entry, Package

ENTRIES = {
    "llfsm_verify.logs": (
        Entry(
            "parquet",
            f"{__name__}.reading:read_parquet",
            "tables of Apache Arrow",
            (".parquet",),
            package=Package("pyarrow", "pyarrow", "parquet"),
        ),
    ),
}
