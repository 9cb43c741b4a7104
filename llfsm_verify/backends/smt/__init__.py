"""Step programs as terms of Z3, in contexts whose objects may be dropped on any thread.

Python drops an object that is in a circle of references on whichever thread allocates next, also while another thread
is inside Z3 with the same context; z3py releases Python's lock there. Z3 then counts references without care, unless it
is told that this happens: it keeps such objects until its next call.
"""

from __future__ import annotations

import z3
from z3.z3core import Z3_enable_concurrent_dec_ref


def tolerant(context: z3.Context) -> z3.Context:
    """The context, whose objects may be dropped on any thread from now on."""
    Z3_enable_concurrent_dec_ref(context.ref())
    return context


def tolerant_main() -> None:
    """Z3's main context, which it has from then on if there was none yet, is `tolerant`."""
    tolerant(z3.main_ctx())


tolerant_main()
