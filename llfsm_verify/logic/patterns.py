"""The specification patterns by name, as formulas: one for each scope.

Source: Dwyer, Avrunin and Corbett, Patterns in property specifications for finite-state verification, ICSE 1999, with
the formulas of their collection; the bounds in time are those of Konrad and Cheng, Real-time specification patterns,
ICSE 2005. A scope that ends in `before` an event says nothing of runs in which the event does not happen. Three
formulas of chains are mended: after q, `s, t precede p` lacks brackets, and `s, t respond to p` an F, also after q
until r.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

SCOPES: Final = ("globally", "before", "after", "between", "after until")
"""`before` r, `after` q, `between` q and r, `after` q `until` r."""

_TWICE = "!p W (p W (!p W (p W G !p)))"
_TWICE_UNTIL_R = "((!p && !r) U (r || ((p && !r) U (r || ((!p && !r) U (r || ((p && !r) U (r || {}))))))))"
_S_T_PRECEDE = "(!p U (r || (s && !p && X (!p U t))))"
_PRECEDES_S_T = "(!(s && !r && X (!r U (t && !r))) U (r || p))"
_RESPONDS_TO_S_T = "(s && X (!r U t) -> X (!r U (t && F p)))"
_S_T_RESPOND = "(p -> (!r U (s && !r && X (!r U t))))"

PATTERNS: Final[Mapping[str, tuple[str, ...]]] = {
    "absence": (
        "G !p",
        "F r -> (!p U r)",
        "G (q -> G !p)",
        "G (q && !r && F r -> (!p U r))",
        "G (q && !r -> (!p W r))",
    ),
    "existence": (
        "F p",
        "!r W (p && !r)",
        "G !q || F (q && F p)",
        "G (q && !r -> (!r W (p && !r)))",
        "G (q && !r -> (!r U (p && !r)))",
    ),
    "universality": (
        "G p",
        "F r -> (p U r)",
        "G (q -> G p)",
        "G (q && !r && F r -> (p U r))",
        "G (q && !r -> (p W r))",
    ),
    "bounded existence": (
        _TWICE,
        f"F r -> {_TWICE_UNTIL_R.format('(!p U r)')}",
        f"F q -> (!q U (q && ({_TWICE})))",
        f"G (q && F r -> {_TWICE_UNTIL_R.format('(!p U r)')})",
        f"G (q -> {_TWICE_UNTIL_R.format('(!p W r) || G p')})",
    ),
    "s precedes p": (
        "!p W s",
        "F r -> (!p U (s || r))",
        "G !q || F (q && (!p W s))",
        "G (q && !r && F r -> (!p U (s || r)))",
        "G (q && !r -> (!p W (s || r)))",
    ),
    "s, t precede p": (
        "F p -> (!p U (s && !p && X (!p U t)))",
        f"F r -> {_S_T_PRECEDE}",
        "G !q || (!q U (q && (F p -> (!p U (s && !p && X (!p U t))))))",
        f"G (q && F r -> {_S_T_PRECEDE})",
        f"G (q -> (F p -> {_S_T_PRECEDE}))",
    ),
    "p precedes s, t": (
        "F (s && X F t) -> (!s U p)",
        f"F r -> {_PRECEDES_S_T}",
        "G !q || (!q U (q && (F (s && X F t) -> (!s U p))))",
        f"G (q && F r -> {_PRECEDES_S_T})",
        f"G (q -> {_PRECEDES_S_T} || G !(s && X F t))",
    ),
    "s responds to p": (
        "G (p -> F[<=1s] s)",
        "F r -> ((p -> (!r U[<=1s] (s && !r))) U r)",
        "G (q -> G (p -> F[<=1s] s))",
        "G (q && !r && F r -> ((p -> (!r U[<=1s] (s && !r))) U r))",
        "G (q && !r -> ((p -> (!r U[<=1s] (s && !r))) W r))",
    ),
    "p responds to s, t": (
        "G (s && X F t -> X F (t && F p))",
        f"F r -> ({_RESPONDS_TO_S_T} U r)",
        "G (q -> G (s && X F t -> X (!t U (t && F p))))",
        f"G (q && F r -> ({_RESPONDS_TO_S_T} U r))",
        f"G (q -> ({_RESPONDS_TO_S_T} U (r || G {_RESPONDS_TO_S_T})))",
    ),
    "s, t respond to p": (
        "G (p -> F (s && X F t))",
        f"F r -> ({_S_T_RESPOND} U r)",
        "G (q -> G (p -> F (s && X F t)))",
        f"G (q && F r -> ({_S_T_RESPOND} U r))",
        f"G (q -> ({_S_T_RESPOND} U (r || G (p -> F (s && X F t)))))",
    ),
}
"""By name, the formula in each of the scopes. A bound in it stands for that after `within`, or for none."""

SIMPLE: Final = ("absence", "existence", "universality", "bounded existence")
"""The patterns of one event, by the words before `of`."""
