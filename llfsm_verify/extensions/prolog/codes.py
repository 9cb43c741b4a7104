"""What can be wrong with a port of Prolog, beside what can be wrong with any port."""

from __future__ import annotations

from typing import Final

NO_PROLOG: Final = "E580"
NO_TERM: Final = "E581"
UNLOADABLE: Final = "E582"
UNANSWERED: Final = "E583"
NO_VALUE: Final = "E584"
CODES: Final = {
    NO_PROLOG: "SWI-Prolog, which a port needs, is not installed.",
    NO_TERM: "A field of a port of Prolog is not a fact or query that its type can have.",
    UNLOADABLE: "A Prolog program cannot be loaded: its syntax is wrong, it calls what is not defined, or it ends.",
    UNANSWERED: "A query of a running program has no answer: an exception, its limit, or the end of Prolog.",
    NO_VALUE: "The answer to a query of a running program is not a value of its input.",
}
MENDS: Final = {
    UNANSWERED: "Correct the program, or give the query more time with `limit`; `safe` says what it is meanwhile.",
    NO_VALUE: "Let the program answer a value of the input, or translate its atom in `values`.",
}
