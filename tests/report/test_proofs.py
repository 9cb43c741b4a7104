"""Proofs as text."""

from __future__ import annotations

from dataclasses import replace

from llfsm_verify.checking.verdict import Proof
from llfsm_verify.report.json import proof_object
from llfsm_verify.report.text import proof_lines, proofs_text

PROOF = Proof(
    "prefixes", "no bad prefix is reached", None, "cycle", ("n <= 3", "m@A || go"),
    (("go", "the input"), ("m@A", "a state")), 0, ("Z3 4.13.0", "cvc5 1.2"), "(<= n 3)",
)  # fmt: skip
CHECKED = "Checked again by Z3 and cvc5: initiation, consecution and implication."


def test_an_invariant_with_names_of_its_own() -> None:
    assert [*proof_lines(PROOF)] == [
        "Invariant, true in the beginning and after every cycle:",
        "  n <= 3",
        "  m@A || go",
        "where",
        "  go   the input",
        "  m@A  a state",
        CHECKED,
    ]
    assert [line.plain for line in proofs_text("safe", (PROOF, replace(PROOF, invariant=(), legend=())))] == [
        "",
        "safe: proved, since no bad prefix is reached.",
        *proof_lines(PROOF),
        "",
        "safe: proved, since no bad prefix is reached.",
        "Every value is in the range of its type; no other invariant is needed.",
        CHECKED,
    ]
    assert [*proofs_text("safe", ())] == []
    assert [str(line.style) for line in proofs_text("safe", (PROOF,))][:3] == ["", "bold", ""]


def test_inductions_over_several_units() -> None:
    one = replace(PROOF, invariant=(), legend=(), k=1, unit="step", checked_by=("Z3 4.13.0",))
    said = (
        "k-induction, k = 1: this does not happen in the first step of any run; and where it has not happened in a "
        "step, through different configurations, it does not happen in the step after."
    )
    assert [*proof_lines(one)] == [said, "Checked again by Z3: initiation, consecution and implication."]
    said = (
        "k-induction, k = 3: this does not happen in the first 3 cycles of any run; and where it has not happened in "
        "3 cycles in a row, through different configurations, all of which satisfy the invariant, it does not happen "
        "in the cycle after."
    )
    assert [*proof_lines(replace(PROOF, legend=(), k=3))][1:] == ["  n <= 3", "  m@A || go", said, CHECKED]


def test_a_proof_for_programs() -> None:
    assert proof_object(PROOF) == {
        "shows": "prefixes",
        "bound": None,
        "unit": "cycle",
        "invariant": ["n <= 3", "m@A || go"],
        "legend": {"go": "the input", "m@A": "a state"},
        "k": 0,
        "checked_by": ["Z3 4.13.0", "cvc5 1.2"],
        "smt": "(<= n 3)",
    }
