"""A solver's terms, read as expressions, have the values that the solver gives them."""

from __future__ import annotations

from itertools import product

import pytest
import z3

from llfsm_verify.backends.reference import evaluate
from llfsm_verify.engines.inductive.invariant import Invariant, Unreadable, read
from llfsm_verify.engines.inductive.observers import Faults
from llfsm_verify.program.program import Expr, Get, Int, Unbounded
from llfsm_verify.program.terms import const, get, op

NUMBER, BOOL = Int(-7, 7), Int(0, 1, boolean=True)
TYPES = {"x": NUMBER, "y": NUMBER, "p": BOOL, "q": BOOL}


def parsed(text: str) -> tuple[z3.BoolRef, dict[str, z3.ExprRef]]:
    """A term of SMT-LIB 2, and its constants."""
    constants = {name: z3.Bool(name) if kind is BOOL else z3.Int(name) for name, kind in TYPES.items()}
    return z3.parse_smt2_string(f"(assert {text})", decls=constants)[0], constants


def as_expression(term: z3.BoolRef, constants: dict[str, z3.ExprRef]) -> Expr:
    return read(term, {constant.get_id(): Get(name, None, TYPES[name]) for name, constant in constants.items()})


@pytest.mark.parametrize(
    "text",
    [
        "(= (div x 3) y)",
        "(> (+ (div x 1) (div y 7)) 0)",
        "(= (mod x 3) y)",
        "(< (mod (+ x y) 5) 2)",
        "(<= (- (ite (> x y) x y) (* y 2)) (- x))",
        "(=> p (>= x y))",
        "(xor p q)",
        "(distinct x y 2)",
        "(= p (and q (not (= x y))))",
        "(or (not p) q (< x y))",
    ],
)
def test_the_values_are_the_solvers(text: str) -> None:
    term, constants = parsed(text)
    found = as_expression(term, constants)
    values = set()
    for numbers in product(range(-7, 8, 2), range(-7, 8, 3), (0, 1), (0, 1)):
        given = dict(zip(TYPES, numbers, strict=True))
        literals = [(constants[n], z3.BoolVal(bool(v)) if TYPES[n] is BOOL else z3.IntVal(v)) for n, v in given.items()]
        expected = z3.is_true(z3.simplify(z3.substitute(term, *literals)))
        assert evaluate(found, given, {}) == int(expected)
        values.add(expected)
    assert values == {False, True}


@pytest.mark.parametrize(
    "text", ["(= (div x y) 1)", "(= (mod x y) 1)", "(= (div x 0) 1)", "(= (div x (- 2)) 1)", "(= (mod x (- 2)) 1)"]
)
def test_division_is_by_a_positive_constant(text: str) -> None:
    with pytest.raises(Unreadable, match="it divides by something that is not a positive constant"):
        as_expression(*parsed(text))


def test_an_invariant_is_bounded_where_each_of_its_numbers_is() -> None:
    for kind, bounded in ((NUMBER, True), (Unbounded(), False)):
        formula = op("and", get("p", BOOL), op("le", Get("n", None, kind), const(3)))
        assert Invariant(Faults(), formula).is_bounded == bounded
