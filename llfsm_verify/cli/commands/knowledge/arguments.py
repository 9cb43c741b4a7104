"""The arguments of `llfsm knowledge`."""

from __future__ import annotations

from llfsm_verify.cli import arguments as shared
from llfsm_verify.cli.parser import Parser
from llfsm_verify.report.formats import REPORTS

COMPARED = """\
llfsm knowledge equivalent cook.d 'timeLeft && !doorOpen'
llfsm knowledge equivalent cook 'time > 0 && !open' --arrangement arrangement.yaml"""
QUESTIONS = {
    "table": ("print what a theory concludes for all values of its inputs", "llfsm knowledge table cook.d"),
    "explain": (
        "say which rules win for values of inputs, and why",
        "llfsm knowledge explain cook.d doorOpen=true",
    ),
    "equivalent": ("prove that two theories, or a theory and a condition, are the same, or tell them apart", COMPARED),
}
OTHERS = "2 wrong usage, 3 input wrong or unreadable"
CODES = f"exit codes: 0 answered, {OTHERS}"
APART = (
    f"exit codes: 0 proved equal, 1 told apart, {OTHERS}, 4 unknown, 5 a check of a result failed, 70 internal error, "
    "130 interrupted"
)


def arguments(parser: Parser) -> None:
    """Add the arguments of `llfsm knowledge`."""
    about = "Ask questions about theories of plausible logic (.d files), which guards and properties use."
    parser.about(about, "\n".join(example for _, example in QUESTIONS.values()), APART)
    questions = parser.add_subparsers(dest="question", required=True, metavar="QUESTION")
    for name, (text, example) in QUESTIONS.items():
        question = questions.add_parser(name, help=text)
        question.about(text[0].upper() + text[1:] + ".", example, APART if name == "equivalent" else CODES)
        add = question.add_argument
        if name == "equivalent":
            condition = "a theory (FILE.d), or a condition such as 'a && !b' over the inputs of the other side"
            add("left", metavar="A", help=condition)
            add("right", metavar="B", help="the same")
            add("--arrangement", metavar="FILE", help="A and B are conditions, as in properties of this arrangement")
            shared.repeatable(
                question, "--output", metavar="NAME", text="the output of a theory that has several, of A first"
            )
            shared.memory_and_timeout(question, "say `unknown`")
        else:
            add("theory", metavar="FILE", help="the theory, a .d file; - reads standard input")
            shared.repeatable(question, "--output", metavar="NAME", text="only this output")
        if name == "explain":
            add("values", metavar="INPUT=VALUE", nargs="*", default=[], help="true or false; other inputs are false")
        if name == "table":
            add("--all", action="store_true", help="all rows, also when there are more than 1,024")
        shared.choice(question, "--format", REPORTS.knowledge, "how to report")
