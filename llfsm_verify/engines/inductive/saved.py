"""Files of invariants: proofs written down so that they can be checked again."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Literal, TypeVar, get_args

from llfsm_verify.checking.proof import Proof
from llfsm_verify.checking.verdict import Result
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source, Span

FORMAT = "llfsm-invariants 1"
Shows = Literal["faults", "prefixes", "rounds", "loops"]
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class SavedProof:
    """What of a `Proof` is needed to check it; `smt` is the invariant as a term of SMT-LIB 2."""

    shows: Shows
    bound: int | None
    k: int
    smt: str


@dataclass(frozen=True, slots=True)
class Saved:
    """The proofs of one property by its name and text; those of the absence of faults have neither."""

    name: str | None
    text: str | None
    proofs: tuple[SavedProof, ...]


@dataclass(frozen=True, slots=True)
class SavedFile:
    """What a file of invariants says; `arrangement`: the name of the one that it was written for."""

    arrangement: str | None
    proved: tuple[Saved, ...]


def saved_text(result: Result) -> str:
    """The proofs in a result, as `read_saved` reads them."""
    items: list[tuple[str | None, str | None, tuple[Proof, ...]]] = [
        *((p.name, p.text, p.proofs) for p in result.properties),
        (None, None, result.faults.proofs),
    ]
    rows = [
        {
            "name": name,
            "text": text,
            "proofs": [
                {"shows": p.shows, "bound": p.bound, "k": p.k, "says": list(p.invariant), "smt": p.smt} for p in proofs
            ],
        }
        for name, text, proofs in items
        if proofs
    ]
    return json.dumps({"format": FORMAT, "arrangement": result.arrangement, "proved": rows}, indent=2) + "\n"


def read_saved(text: str, file: str) -> SavedFile:
    """What a file of invariants says. DiagnosticError (E453)."""
    hint = "write one with --engine pdr --save-invariants FILE"
    try:
        data = _typed(json.loads(text), dict)
        if data.get("format") != FORMAT:
            raise ValueError(f"its format is not `{FORMAT}`")
        named = data.get("arrangement")
        proved = tuple(_saved(row) for row in _typed(data.get("proved"), list))
        return SavedFile(named if isinstance(named, str) else None, proved)
    except json.JSONDecodeError as problem:
        place = Span(Source(file, text), problem.pos, problem.pos + 1) if problem.pos < len(text) else None
        message = "this is not a file of invariants: it is not JSON" + (
            " from here on" if place else ", or not all of it"
        )
        raise DiagnosticError(Diagnostic("E453", message, place, hint=hint, file=file)) from None
    except (ValueError, RecursionError) as problem:
        reason = "its parts are nested too deeply" if isinstance(problem, RecursionError) else problem
        message = f"this is not a file of invariants: {reason}"
        raise DiagnosticError(Diagnostic("E453", message, hint=hint, file=file)) from None


def _saved(row: object) -> Saved:
    fields = _typed(row, dict)
    name, text = fields.get("name"), fields.get("text")
    if name is not None:
        _typed(name, str)
        _typed(text, str)
    return Saved(name, text, tuple(_proof(p) for p in _typed(fields.get("proofs"), list)))


def _proof(row: object) -> SavedProof:
    fields = _typed(row, dict)
    shows, bound, k = fields.get("shows"), fields.get("bound"), _natural(fields.get("k"))
    known: dict[object, Shows] = {name: name for name in get_args(Shows)}
    if not isinstance(shows, str) or shows not in known:
        raise ValueError(f"a proof shows none of {', '.join(get_args(Shows))}")
    limit = _natural(bound) if shows == "rounds" else None
    return SavedProof(known[shows], limit, k, _typed(fields.get("smt"), str))


def _natural(value: object) -> int:
    number = _typed(value, int)
    if isinstance(value, bool) or not 0 <= number < 1 << 16:
        raise ValueError("a number in it is not a valid number, or is too large")
    return number


def _typed(value: object, kind: type[T]) -> T:
    if not isinstance(value, kind):
        raise ValueError(f"something else is in the place of a {kind.__name__}")
    return value
