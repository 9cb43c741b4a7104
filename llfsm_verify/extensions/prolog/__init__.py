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

- A fact of an output: `light(ns, Value)` is there with the value of its slot in the place of `Value`. Without `Value` it
  is a truth value: `car_waiting` is there while `car` is true. A bare name of a number or an enumerator stands for
  `name(Value)`. Nothing else is a fact: the program has no clauses of facts, and needs not declare them.
- A query of an input: true where it can be proved, or with `Value` the value that `Value` has in the first answer.
  Where that has none the input is lost, as `on_failure` says. Variables other than `Value` may have any values.
- Enumerators are names as they are written: `RED` is `'RED'` in the program, or what `values` call it.

All queries are asked when facts have changed, and again after each `every`; their answers are posted together. What one
query does to the dynamic database is undone before the next (`snapshot/1`), and tables are forgotten; global variables,
flags and files are the program's own. A query that takes longer than `limit` is cut, and where that cannot be done
Prolog is killed and started again; the inputs of that query are lost meanwhile. The loop never waits for any of it. The
program reads an empty standard input, and what it writes is told to the user.

`verify`, `lint` and `check` start no Prolog: answers are any values there. What the program promises can be an assumption
of a property file, such as `assume G !(ns_may_go & ew_may_go)`.

Wrong uses:

    light(ns, Colour)      E581: `light(ns, Colour)` is no fact: it has the variable `Colour`    write `Value` for the value
    ns_next: "next(ns, X)" E581: `ns_next` is an enumerator, and its query has no `Value`        write `next(ns, Value)`
    next(ns, Y) :- ligt(Y) E582 at lights.pl:4:1: `ligt/1` is not defined                        define it, or declare it dynamic
"""

from __future__ import annotations

from llfsm_verify.plug import Entry

ENTRIES = {
    "llfsm_verify.codes": (Entry("prolog", f"{__name__}.codes:CODES", "Ports that ask Prolog"),),
    "llfsm_verify.ports": (Entry("prolog", f"{__name__}.kind:KIND", "a Prolog program, which SWI-Prolog runs"),),
}
