"""A smaller case with the same finding: files without some of their lines, then without some of their characters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from tests.fuzzing.case import Case
from tests.fuzzing.running import Outcome, run_alone

ATTEMPTS = 400


def shrink(case: Case, outcome: Outcome, attempts: int = ATTEMPTS) -> Case:
    """The case with as little as is found in so many attempts."""
    left = [attempts]

    def still(smaller: Case) -> bool:
        if left[0] <= 0:
            return False
        left[0] -= 1
        return run_alone(smaller).place == outcome.place

    for index in range(len(case.files) - 1, -1, -1):
        without = replace(case, files=case.files[:index] + case.files[index + 1 :])
        if still(without):
            case = without
            continue
        for parts in (_lines, _characters):
            case = _shrink_file(case, index, parts, still)
    for index, argument in enumerate(case.arguments):
        if index > 0 and len(argument) > 20:
            case = _shrink_argument(case, index, still)
    return case


def _shrink_file(case: Case, index: int, parts: Callable[[bytes], list[bytes]], still: Callable[[Case], bool]) -> Case:
    name, data = case.files[index]

    def with_data(data: bytes) -> Case:
        return replace(case, files=(*case.files[:index], (name, data), *case.files[index + 1 :]))

    return with_data(_fewer(parts(data), lambda found: still(with_data(found))))


def _shrink_argument(case: Case, index: int, still: Callable[[Case], bool]) -> Case:
    def with_argument(text: bytes) -> Case:
        argument = text.decode("utf-8", "surrogateescape")
        return replace(case, arguments=(*case.arguments[:index], argument, *case.arguments[index + 1 :]))

    pieces = [c.encode("utf-8", "surrogateescape") for c in case.arguments[index]]
    return with_argument(_fewer(pieces, lambda text: still(with_argument(text))))


def _lines(data: bytes) -> list[bytes]:
    return data.splitlines(keepends=True)


def _characters(data: bytes) -> list[bytes]:
    return [data[i : i + 1] for i in range(len(data))]


def _fewer(pieces: list[bytes], still: Callable[[bytes], bool]) -> bytes:
    """Leave out pieces, large runs of them first."""
    size = max(1, len(pieces) // 2)
    while size:
        at = 0
        while at < len(pieces):
            fewer = pieces[:at] + pieces[at + size :]
            if still(b"".join(fewer)):
                pieces = fewer
            else:
                at += size
        size //= 2
    return b"".join(pieces)
