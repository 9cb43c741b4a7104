"""The diagnostics of property files: each code with its meaning in a line."""

from __future__ import annotations

from typing import Final

UNREADABLE: Final = "E301"
DIRECTORY: Final = "E302"
NOT_TEXT: Final = "E303"
FILE_TOO_LARGE: Final = "E304"
TOO_MANY_WORDS: Final = "E305"
TOO_DEEP: Final = "E306"
CHARACTER: Final = "E307"
OPEN_QUOTE: Final = "E308"
OPEN_BRACKET: Final = "E309"
STRAY_BRACKET: Final = "E310"
NAME_MISSING: Final = "E311"
BAD_NAME: Final = "E312"
DUPLICATE_NAME: Final = "E313"
EMPTY: Final = "E314"
REGULAR: Final = "E315"
FORMAT: Final = "E316"
DEFINITION: Final = "E317"
FAMILY: Final = "E318"
PATTERN: Final = "E319"
UNFINISHED: Final = "E320"
OPERAND_MISSING: Final = "E321"
OPERATOR_MISSING: Final = "E322"
JOINED_OPERATORS: Final = "E323"
OPERATOR_AS_NAME: Final = "E324"
TEMPORAL_CHAIN: Final = "E325"
IMPLICATION_CHAIN: Final = "E326"
ASSIGNMENT: Final = "E327"
COMPARISON_CHAIN: Final = "E328"
FORMULA_COMPARED: Final = "E329"
FORMULA_AS_VALUE: Final = "E330"
NUMBER_AS_FORMULA: Final = "E331"
QUOTED: Final = "E332"
MISPLACED_SIGN: Final = "E333"
BOUND: Final = "E334"
UNTRANSLATED: Final = "E335"
TIMELESS: Final = "E336"
TOO_LONG: Final = "E337"
TEMPORAL: Final = "E338"
NO_CYCLE: Final = "E339"
REGULAR_LETTER: Final = "E340"
REPETITION: Final = "E341"
REGULAR_EMPTY: Final = "E342"
REGULAR_NOTHING: Final = "E344"
INITIALLY: Final = "E345"
UNKNOWN_SYNTAX: Final = "E350"
FOREIGN: Final = "E351"
UNSAYABLE: Final = "E352"
WORD: Final = "E353"
MIXTURE: Final = "E355"
HOA: Final = "E360"
HOA_ACCEPTANCE: Final = "E361"
HOA_UNSUPPORTED: Final = "E362"
HOA_NUMBER: Final = "E363"
AUTOMATON_COMPLEMENT: Final = "E364"
AUTOMATON_FILE: Final = "E365"
LIMIT: Final = "W301"
INITIAL_ONLY: Final = "W302"
NEVER_EQUAL: Final = "W303"

MEANINGS: Final[dict[str, str]] = {
    UNREADABLE: "a property file is missing or cannot be read",
    DIRECTORY: "a directory is named where a property file is expected",
    NOT_TEXT: "a property file is not UTF-8 text",
    FILE_TOO_LARGE: "a property file is larger than 4 MiB",
    TOO_MANY_WORDS: "a property file has more than 100,000 words and signs",
    TOO_DEEP: "brackets or operators are nested too deeply",
    CHARACTER: "a character that no formula has",
    OPEN_QUOTE: "a quote is not closed on its line",
    OPEN_BRACKET: "a bracket is not closed",
    STRAY_BRACKET: "a closing bracket closes nothing, or a bracket of another kind",
    NAME_MISSING: "`assume`, `enforce` or `forbid` without `name:`",
    BAD_NAME: "the text before `:` is not a valid name of a property",
    DUPLICATE_NAME: "two properties have one name",
    EMPTY: "there is no formula",
    REGULAR: "a regular property (`enforce`, `forbid`) where only formulas of temporal logic are taken",
    FORMAT: "a property file is of a later format than this version knows, or its `# format:` is not a valid number",
    DEFINITION: "a `define` is empty, appears twice, or depends on itself",
    FAMILY: "`for … in …:` before a property is not a valid list of names with their values",
    PATTERN: "a specification pattern or its scope lacks a part",
    UNFINISHED: "the formula ends where an operand is expected",
    OPERAND_MISSING: "an operator or bracket is in the place of an operand",
    OPERATOR_MISSING: "two operands follow each other without an operator",
    JOINED_OPERATORS: "temporal operators are written together (`GF p`)",
    OPERATOR_AS_NAME: "a word that is an operator is used as a name without quotes",
    TEMPORAL_CHAIN: "a chain of `U W R M` without parentheses",
    IMPLICATION_CHAIN: "a chain of `->` without parentheses",
    ASSIGNMENT: "`=` or `:=` where a comparison is meant",
    COMPARISON_CHAIN: "a chain of comparisons",
    FORMULA_COMPARED: "a formula is compared with `==`, `<`, …",
    FORMULA_AS_VALUE: "a formula inside arithmetic, an index or arguments",
    NUMBER_AS_FORMULA: "a number where a formula is expected",
    QUOTED: "empty quotes, or quoted text that is not a name inside a larger atom",
    BOUND: "the text in brackets after a temporal operator is not a valid bound",
    UNTRANSLATED: "an operator, or a kind of property, that a command does not take",
    TIMELESS: "a bound in time, but the arrangement is untimed, has no `cycle_ms` or has several processes",
    TOO_LONG: "a bound in time of more than 2^20 cycles",
    NO_CYCLE: "a bound in time from below and above, but no cycle begins between the two",
    TEMPORAL: "a temporal operator in a query, which takes only state formulas",
    REGULAR_LETTER: "the text in a regular expression is not a valid letter, which says what holds in one step",
    REPETITION: "a number of repetitions is wrong or too large",
    REGULAR_EMPTY: "`forbid` of an expression that the empty word matches",
    REGULAR_NOTHING: "no sequence of letters matches a regular expression",
    UNKNOWN_SYNTAX: "`# syntax:` does not name a syntax",
    FOREIGN: "words that do not fit together in the syntax of another tool, or a delay of one, such as `##1`",
    UNSAYABLE: "a formula has an operator that the syntax asked for lacks",
    WORD: "a text is not a valid word, such as `p0&!p1;cycle{p0}`",
    MIXTURE: "operators without parentheses that a tool's manual and its parser group differently",
    HOA: "a file of automata is not in the Hanoi Omega-Automata format",
    HOA_ACCEPTANCE: "an automaton has another acceptance than generalised Büchi",
    HOA_UNSUPPORTED: "an automaton uses a feature that is not supported",
    HOA_NUMBER: "a file of automata holds none or several, and one is expected",
    AUTOMATON_COMPLEMENT: "an automaton of the allowed runs is not deterministic",
    AUTOMATON_FILE: "the text after `automaton NAME:` is not the name of a file",
    INITIALLY: "`initially` under a temporal operator, or where only one moment is asked for",
    LIMIT: "an answer about a formula is not known, because a limit was reached",
    INITIAL_ONLY: "a formula, or a part of one, stands under no temporal operator and does not say `initially`",
    NEVER_EQUAL: "a property compares a number with one that it can never be",
    MISPLACED_SIGN: "a sign that has no meaning there (`?`, `:`, `{`, `}`, `--`)",
}
