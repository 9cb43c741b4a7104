"""The arguments of `llfsm property`."""

from __future__ import annotations

from llfsm_verify.cli.arguments import output, seconds, syntax
from llfsm_verify.cli.parser import Parser
from llfsm_verify.logic.syntax_names import SYNTAXES
from llfsm_verify.report.drawing.formats import DRAWINGS

QUESTIONS = {
    "classify": "print the class (S safety, G guarantee, B both, O obligation, R recurrence, P persistence, "
    "T reactivity), a tab and the formula",
    "translate": "print the automaton in the format HOA",
    "accepts": "print whether the formula is true of the word `p0&!p1;cycle{p0}`",
    "equivalent": "print whether two formulas are true of the same words, else a word that tells them apart",
    "implies": "print whether the second formula is true where the first one is, else a word where it is not",
    "simplify": "print a simpler formula that is true of the same words",
    "print": "print the formula in another syntax, fully parenthesised",
    "draw": "draw the automaton",
    "example": "print a word of which the formula is true, a tab and one of which it is not",
}


def arguments(parser: Parser) -> None:
    """Add the arguments of `llfsm property`."""
    codes = (
        "exit codes: 0, or 1 when an equivalence or implication is false, 2 wrong usage, 3 when a line is wrong (the "
        "others are answered), 4 when a limit was reached"
    )
    parser.about(
        "Questions about formulas over free atoms, without an arrangement, answered line by line.",
        "llfsm property equivalent 'a U b' 'b || (a && X (a U b))'",
        f"INPUT is a formula, a file with one per line, a property file, or - for standard input.\n\n{codes}",
    )
    questions = parser.add_subparsers(dest="question", required=True, metavar="QUESTION")
    for name, text in QUESTIONS.items():
        question = questions.add_parser(name, help=text)
        pairs = {"accepts": "FORMULA WORD", "equivalent": "FORMULA FORMULA", "implies": "FORMULA FORMULA"}
        second = {"accepts": " 'a&!b;cycle{b}'", "equivalent": " 'b || (a && X (a U b))'", "implies": " 'F b'"}
        question.about(text[0].upper() + text[1:] + ".", f"llfsm property {name} 'a U b'{second.get(name, '')}", codes)
        add = question.add_argument
        of_pairs = f"; or {pairs[name]}; in files a tab separates the two" if name in pairs else ""
        add(
            "input",
            metavar="INPUT",
            nargs="+",
            help=f"a formula, a file with one per line, a property file, or -{of_pairs}",
        )
        syntax(question)
        if name in ("simplify", "print"):
            add("--to", choices=SYNTAXES, help="how to print them (default: as they are written)")
        if name in ("translate", "draw"):
            add(
                "--buchi", action="store_true", help="a Büchi automaton, whose states accept, and not a generalised one"
            )
        if name == "translate":
            add("--stats", action="store_true", help="states, transitions, acceptance sets, deterministic or not")
        if name == "draw":
            add("--format", choices=DRAWINGS, help="default: by the ending of FILE, else dot")
            output(question)
        add(
            "--timeout", metavar="SECONDS", type=seconds, help="what is not answered after this many seconds is unknown"
        )
