"""The reader and the writer together."""

from __future__ import annotations

from llfsm_verify.extensions.hoa.reading import is_recognised, read_hoa, read_one
from llfsm_verify.extensions.hoa.writing import write_hoa


class _Hoa:
    """See `AutomataFormat`."""

    read = staticmethod(read_hoa)
    read_one = staticmethod(read_one)
    is_recognised = staticmethod(is_recognised)
    write = staticmethod(write_hoa)


HOA = _Hoa()
