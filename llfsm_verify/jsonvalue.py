"""The type of JSON values."""

from __future__ import annotations

Json = None | bool | int | float | str | list["Json"] | dict[str, "Json"]
"""What `json.dumps` writes and `json.loads` reads."""
