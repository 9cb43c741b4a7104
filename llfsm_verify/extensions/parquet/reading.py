"""Logs as Parquet, read in batches of rows."""

from __future__ import annotations

from collections.abc import Iterator

from llfsm_verify.plug import NoColumn, Row, Unreadable, Wanted, cell_text


def read_parquet(path: str, wanted: Wanted) -> Iterator[Row]:
    """The rows. Raises as `plug.LOGS` says; ModuleNotFoundError: pyarrow is not installed."""
    from pyarrow.parquet import ParquetFile

    if wanted.topic is not None:
        raise NoColumn(wanted.topic, ())
    number = 0
    try:
        with ParquetFile(path) as file:
            names = file.schema_arrow.names
            for name in wanted.columns:
                if name not in names:
                    raise NoColumn(name, names)
            for batch in file.iter_batches(columns=list(wanted.columns)):
                for cells in batch.to_pylist():
                    number += 1
                    texts = ((name, cell_text(value)) for name, value in cells.items())
                    yield Row(f"row {number}", {name: text for name, text in texts if text is not None})
    except (NoColumn, OSError):
        raise
    except Exception as error:  # noqa: BLE001 - what the library raises where a file is damaged, which is many kinds
        raise Unreadable(str(error)) from None
