"""The diagnostics of property files: each code with its meaning in a line."""

from __future__ import annotations

from typing import Final

from llfsm_verify.diagnostics import Codes

MEANINGS: Final = Codes()

UNREADABLE: Final = MEANINGS.add("E301", "a property file is missing or cannot be read")
DIRECTORY: Final = MEANINGS.add("E302", "a directory is named where a property file is expected")
NOT_TEXT: Final = MEANINGS.add("E303", "a property file is not UTF-8 text")
FILE_TOO_LARGE: Final = MEANINGS.add("E304", "a property file is larger than 4 MiB")
TOO_MANY_WORDS: Final = MEANINGS.add("E305", "a property file has more than 100,000 words and signs")
TOO_DEEP: Final = MEANINGS.add("E306", "brackets or operators are nested too deeply")
CHARACTER: Final = MEANINGS.add("E307", "a character that no formula has")
OPEN_QUOTE: Final = MEANINGS.add("E308", "a quote is not closed on its line")
OPEN_BRACKET: Final = MEANINGS.add("E309", "a bracket is not closed")
STRAY_BRACKET: Final = MEANINGS.add("E310", "a closing bracket closes nothing, or a bracket of another kind")
NAME_MISSING: Final = MEANINGS.add("E311", "`assume`, `enforce` or `forbid` without `name:`")
BAD_NAME: Final = MEANINGS.add("E312", "the text before `:` is not a valid name of a property")
DUPLICATE_NAME: Final = MEANINGS.add("E313", "two properties have one name")
EMPTY: Final = MEANINGS.add("E314", "there is no formula")
REGULAR: Final = MEANINGS.add(
    "E315", "a regular property (`enforce`, `forbid`) where only formulas of temporal logic are taken"
)
FORMAT: Final = MEANINGS.add(
    "E316", "a property file is of a later format than this version knows, or its `# format:` is not a valid number"
)
DEFINITION: Final = MEANINGS.add("E317", "a `define` is empty, appears twice, or depends on itself")
FAMILY: Final = MEANINGS.add("E318", "`for … in …:` before a property is not a valid list of names with their values")
PATTERN: Final = MEANINGS.add("E319", "a specification pattern or its scope lacks a part")
UNFINISHED: Final = MEANINGS.add("E320", "the formula ends where an operand is expected")
OPERAND_MISSING: Final = MEANINGS.add("E321", "an operator or bracket is in the place of an operand")
OPERATOR_MISSING: Final = MEANINGS.add("E322", "two operands follow each other without an operator")
JOINED_OPERATORS: Final = MEANINGS.add("E323", "temporal operators are written together (`GF p`)")
OPERATOR_AS_NAME: Final = MEANINGS.add("E324", "a word that is an operator is used as a name without quotes")
TEMPORAL_CHAIN: Final = MEANINGS.add("E325", "a chain of `U W R M` without parentheses")
IMPLICATION_CHAIN: Final = MEANINGS.add("E326", "a chain of `->` without parentheses")
ASSIGNMENT: Final = MEANINGS.add("E327", "`=` or `:=` where a comparison is meant")
COMPARISON_CHAIN: Final = MEANINGS.add("E328", "a chain of comparisons")
FORMULA_COMPARED: Final = MEANINGS.add("E329", "a formula is compared with `==`, `<`, …")
FORMULA_AS_VALUE: Final = MEANINGS.add("E330", "a formula inside arithmetic, an index or arguments")
NUMBER_AS_FORMULA: Final = MEANINGS.add("E331", "a number where a formula is expected")
QUOTED: Final = MEANINGS.add("E332", "empty quotes, or quoted text that is not a name inside a larger atom")
MISPLACED_SIGN: Final = MEANINGS.add("E333", "a sign that has no meaning there (`?`, `:`, `{`, `}`, `--`)")
BOUND: Final = MEANINGS.add("E334", "the text in brackets after a temporal operator is not a valid bound")
UNTRANSLATED: Final = MEANINGS.add("E335", "an operator, or a kind of property, that a command does not take")
TIMELESS: Final = MEANINGS.add(
    "E336", "a bound in time, but the arrangement is untimed, has no `cycle_ms` or has several processes"
)
TOO_LONG: Final = MEANINGS.add("E337", "a bound in time of more than 2^20 cycles")
TEMPORAL: Final = MEANINGS.add("E338", "a temporal operator in a query, which takes only state formulas")
NO_CYCLE: Final = MEANINGS.add("E339", "a bound in time from below and above, but no cycle begins between the two")
REGULAR_LETTER: Final = MEANINGS.add(
    "E340", "the text in a regular expression is not a valid letter, which says what holds in one step"
)
REPETITION: Final = MEANINGS.add("E341", "a number of repetitions is wrong or too large")
REGULAR_EMPTY: Final = MEANINGS.add("E342", "`forbid` of an expression that the empty word matches")
REGULAR_NOTHING: Final = MEANINGS.add("E344", "no sequence of letters matches a regular expression")
INITIALLY: Final = MEANINGS.add("E345", "`initially` under a temporal operator, or where only one moment is asked for")
UNKNOWN_SYNTAX: Final = MEANINGS.add("E350", "`# syntax:` does not name a syntax")
FOREIGN: Final = MEANINGS.add(
    "E351", "words that do not fit together in the syntax of another tool, or a delay of one, such as `##1`"
)
UNSAYABLE: Final = MEANINGS.add("E352", "a formula has an operator that the syntax asked for lacks")
WORD: Final = MEANINGS.add("E353", "a text is not a valid word, such as `p0&!p1;cycle{p0}`")
MIXTURE: Final = MEANINGS.add(
    "E355", "operators without parentheses that a tool's manual and its parser group differently"
)
HOA: Final = MEANINGS.add("E360", "a file of automata is not in the Hanoi Omega-Automata format")
HOA_ACCEPTANCE: Final = MEANINGS.add("E361", "an automaton has another acceptance than generalised Büchi")
HOA_UNSUPPORTED: Final = MEANINGS.add("E362", "an automaton uses a feature that is not supported")
HOA_NUMBER: Final = MEANINGS.add("E363", "a file of automata holds none or several, and one is expected")
AUTOMATON_COMPLEMENT: Final = MEANINGS.add("E364", "an automaton of the allowed runs is not deterministic")
AUTOMATON_FILE: Final = MEANINGS.add("E365", "the text after `automaton NAME:` is not the name of a file")
LIMIT: Final = MEANINGS.add("W301", "an answer about a formula is not known, because a limit was reached")
INITIAL_ONLY: Final = MEANINGS.add(
    "W302", "a formula, or a part of one, stands under no temporal operator and does not say `initially`"
)
NEVER_EQUAL: Final = MEANINGS.add("W303", "a property compares a number with one that it can never be")
BETWEEN_CYCLES: Final = MEANINGS.add("W304", "a bound in time begins or ends between two cycles")
