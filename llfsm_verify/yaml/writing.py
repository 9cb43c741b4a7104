"""Documents as YAML text, which reads back as the same words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from decimal import Decimal

import yaml


def to_yaml(document: Mapping[str, object]) -> str:
    """A document of Python values in the shape of a file, as `build_arrangement` takes it."""
    return yaml.dump(_plain(document), Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=110)


class _Dumper(yaml.SafeDumper):
    """Texts of several lines are blocks, and nothing is an alias."""

    def ignore_aliases(self, data: object) -> bool:  # noqa: ARG002 - the same value may stand in several places
        return True

    def represent_str(self, data: str) -> yaml.ScalarNode:
        return self.represent_scalar("tag:yaml.org,2002:str", data, style="|" if "\n" in data else None)


_Dumper.add_representer(str, _Dumper.represent_str)


def _plain(value: object) -> object:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(item) for item in value]
    if isinstance(value, bool | int) or value is None:
        return value
    return f"{Decimal(str(value)):f}" if isinstance(value, float | Decimal) else str(value)
