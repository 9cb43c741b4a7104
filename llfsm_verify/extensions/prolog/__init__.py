"""Ports that ask a Prolog program: outputs become facts, and the answers to queries are inputs (decision 81).

    ports:
      reasoner:
        kind: prolog
        file: lights.pl
        limit: 50ms
        outputs:
          car: car_waiting
          ns_light: light(ns, Value)
          ew_light: light(ew, Value)
        inputs:
          ns_may_go: may_go(ns)
          ns_next: next(ns, Value)
        values: {red: RED, amber: AMBER, green: GREEN}
        on_failure: safe
        safe: {ns_may_go: false, ns_next: RED}

    $ llfsm run arrangement.yaml --ports lights.ports.yaml

Fields are terms: a name, or a name and arguments, each a name, a quoted name, a whole number, or a variable.

- A fact of an output: `light(ns, Value)` is there with the value of its slot in the place of `Value`. Without `Value`
  it is a truth value: `car_waiting` is there while `car` is true. A bare name of a number or an enumerator stands for
  `name(Value)`. The program has no clauses of its own for facts, and need not declare them.
- A query of an input: true where it can be proved, or with `Value` the value that `Value` has in the first answer.
  Where that has none the input is lost, as `on_failure` says. Variables other than `Value` may have any values.
- Enumerators are names as they are written: `RED` is `'RED'` in the program, or what `values` call it.

All queries are asked when facts have changed, and again after each `every`; their answers are posted together. What one
query does to the dynamic database is undone before the next (`snapshot/1`), and tables are forgotten; global variables,
flags, recorded terms and files are the program's own. A query that takes longer than `limit` is cut, and where that
cannot be done Prolog is killed and started again; its input is lost until it has an answer. The loop never waits for
any of it. The program reads an empty standard input, and what it writes is told to the user.

`verify`, `lint` and `check` start no Prolog: answers are any values there. What the program promises is an assumption
of a property file, such as `assume promise: G !(ns_may_go && ew_may_go)`; `llfsm run --monitor FILE` decides at run
time whether `promise: G !(ns_may_go && ew_may_go)` is kept.

Wrong uses:

    light(ns, Colour)         E581: `light(ns, Colour)` is not a fact: it has the variable `Colour`
    ns_next: next(ns, X)      E581: `next(ns, X)` has no `Value`, and is the query of a number or an enumerator
    next(ns, Y) :- ligt(Y).   E582 at lights.pl:4:16: `ligt/1` is not defined
"""

from __future__ import annotations

from llfsm_verify.plug import Entry

ENTRIES = {
    "llfsm_verify.codes": (Entry("prolog", f"{__name__}.codes:CODES", "Ports that ask Prolog"),),
    "llfsm_verify.ports": (Entry("prolog", f"{__name__}.kind:KIND", "a Prolog program, which SWI-Prolog runs"),),
}
