"""The diagnostics of theories of plausible logic (`.d` files): each code with its meaning."""

from __future__ import annotations

from typing import Final

from llfsm_verify.diagnostics import Codes

CODES: Final = Codes()

SYNTAX: Final = CODES.add("E570", "A theory cannot be read: something stands in a wrong place.")
UNKNOWN: Final = CODES.add("E571", "A literal in a body, or an output, which no input or rule gives.")
CYCLE: Final = CODES.add("E572", "A literal depends on itself, through the bodies of rules.")
PRIORITY_CYCLE: Final = CODES.add("E573", "A rule is stronger than itself, directly or through others.")
UNKNOWN_LABEL: Final = CODES.add("E574", "A priority names a rule that is not in the theory.")
UNOPPOSED: Final = CODES.add("E575", "A priority between rules whose conclusions are not opposite.")
TWICE: Final = CODES.add("E576", "A label, an input, an output or the name of a theory stands there twice.")
INPUT_CONCLUDED: Final = CODES.add("E577", "A rule concludes an input, whose value is given.")
OUTPUT: Final = CODES.add("E578", "A theory has no output, or an output of another type than `b`.")
TOO_LARGE: Final = CODES.add("E579", "A theory has more than 10,000 rules, or 200,000 words and signs.")
NEITHER: Final = CODES.add("W004", "A theory leaves an output undecided for some inputs, and then it is false.")
BOTH: Final = CODES.add("W005", "A theory proves an output and its negation for some inputs.")
UNASKED: Final = CODES.add("W006", "No output of a theory depends on this input or conclusion.")
