"""Wrong theories of plausible logic; ``§`` marks the place of what is said."""

from __future__ import annotations

from typing import NamedTuple

END = 'output {b q, "q"}.\n'
AB = "input {a, b}.\n"


class Wrong(NamedTuple):
    """What is wrong, the text, the code, and how the message and the hint begin."""

    reason: str
    text: str
    code: str
    message: str
    hint: str = ""


WRONG = (
    Wrong("a dot is missing", f"{AB}R: a => §q\n{END}", "E570", "a `.` is missing at the end of `R: a => q`"),
    Wrong("two rules without a dot", f"{AB}R: a => §q S: b => ~q.\n{END}", "E570", "a `.` is missing"),
    Wrong("the last dot is missing", f"{AB}a => q.\n{END[:-3]}§}}", "E570", "a `.` is missing"),
    Wrong("a semicolon", f"{AB}a => q§;\n{END}", "E570", "`.` after `a => q` is expected, and there is `;`"),
    Wrong("no arrow", f"{AB}a => q. a §~q.\n{END}", "E570", "`,` or an arrow (`->`, `=>`, `~>`) is expected"),
    Wrong("a fact without an arrow", f"{AB}q§.\n{END}", "E570", "`,` or an arrow"),
    Wrong("a rule of Prolog", f"{AB}q §:- a.\n{END}", "E570", "`,` or an arrow"),
    Wrong("another negation", f"{AB}R: §!a => q.\n{END}", "E570", "a literal, or `{}`"),
    Wrong("a negation of logic", f"{AB}R: §¬a => q.\n{END}", "E570", "a literal, or", "write `~a` for `not a`"),
    Wrong("another conjunction", f"{AB}a §&& b => q.\n{END}", "E570", "`,` or an arrow"),
    Wrong("a body that is open", f"{AB}R: {{a, b §=> q.\n{END}", "E570", "`}` or `,` is expected", "write `}` before"),
    Wrong("a head with two literals", f"{AB}R: a => q§, b.\n{END}", "E570", "`.` after `R: a => q` is expected"),
    Wrong("a chain of priorities", f"{AB}R: a => q. S: b => ~q. R > S §> R.\n{END}", "E570", "`.` after `R > S`"),
    Wrong("an unknown declaration", f"§inptu {{a, b}}.\n{{}} => q.\n{END}", "E570", "`inptu` is not a declaration"),
    Wrong("a text that is open", f'{AB}a => q.\noutput {{b q, §"q}}.\n', "E570", "the name outside (in quotes)"),
    Wrong("a comment of another language", f"{AB}a => q. §# why\n{END}", "E570", "a literal, or `{}`"),
    Wrong("an output that is negated", f"{AB}a => q.\noutput {{b §~q}}.\n", "E570", "an output is an atom"),
    Wrong("a misspelt input", f"input {{doorOpen}}.\nR: §dooropen => q.\n{END}", "E571", "`dooropen` is not an input"),
    Wrong("only its negation", f"{AB}a => c. §~c => q.\n{END}", "E571", "no rule can conclude `~c`"),
    Wrong("only a defeater", f"{AB}a ~> c. §c => q.\n{END}", "E571", "no rule can conclude `c`, only defeaters"),
    Wrong(
        "an unknown output",
        f'{AB}a => q.\noutput {{b §other, "p"}}.\n',
        "E571",
        "`other` is not",
        "write a rule for it",
    ),
    Wrong("literals in a circle", f"{AB}§q => r. r, a => s. ~s => q. b => ~s.\n{END}", "E572", "`r` depends on itself"),
    Wrong("a literal of itself", f"{AB}a => q. §q => ~q.\n{END}", "E572", "`q` depends on itself: q ← q"),
    Wrong("priorities in a circle", f"{AB}R: a => q. S: b => ~q. R > S. §S > R.\n{END}", "E573", "`"),
    Wrong(
        "a rule stronger than itself", f"{AB}R: a => q. §R > R.\n{END}", "E573", "`R` is stronger than itself: R > R"
    ),
    Wrong(
        "an unknown label",
        f"{AB}Rule1: a => q. §Rule2 > Rule1.\n{END}",
        "E574",
        "no rule has the label `Rule2`",
    ),
    Wrong(
        "a priority of allies", f"{AB}R: a => q. S: b => q. §R > S.\n{END}", "E575", "these rules conclude `q` and `q`"
    ),
    Wrong("a label twice", f"{AB}R: a => q.\n§R: b => q.\n{END}", "E576", "`R` labels a rule twice, first in line 2"),
    Wrong("an input twice", f"{AB}input {{c, §a}}.\nc => q.\n{END}", "E576", "`a` is an input twice, first in line 1"),
    Wrong(
        "an output twice",
        f'{AB}a => q.\n{END}output {{b §q, "p"}}.\n',
        "E576",
        "`q` is an output twice, first in line 3",
    ),
    Wrong("two names", f"name {{X}}. name {{§Y}}.\n{AB}a => q.\n{END}", "E576", "the theory has a name already, `X`"),
    Wrong(
        "an input that is concluded", f"{AB}a => q. a => §~b.\n{END}", "E577", "`b` is an input, whose value is given"
    ),
    Wrong("no output", f"{AB}a => q§.\n", "E578", "the theory has no output"),
    Wrong("another type", f'{AB}a => q.\noutput {{§i q, "q"}}.\n', "E578", "`i` is not a type of outputs"),
    Wrong("no type", f"{AB}a => q.\noutput {{§q}}.\n", "E578", "the type of the output is missing"),
    Wrong("an input as output", f'{AB}a => q.\n{END}output {{b §a, "a"}}.\n', "E578", "`a` is an input"),
    Wrong("an empty name outside", f'{AB}a => q.\noutput {{b §q, ""}}.\n', "E578", "the name outside is empty"),
    Wrong("nothing", "§", "E578", "the theory has no output"),
    Wrong("too many rules", f"{AB}{'a => q. ' * 10_000}§b => q.\n{END}", "E579", "there are more than 10,000 rules"),
    Wrong(
        "too many words", f"{'% not counted' * 9}\n{'a,' * 100_000}§a => q.\n", "E579", "there are more than 200,000"
    ),
    Wrong(
        "a labelled rule of Prolog",
        f"{AB}R: q §:- a. a => q.\n{END}",
        "E570",
        "`,` or an arrow",
        "a rule ends with what it concludes: `BODY => HEAD.`",
    ),
    Wrong(
        "an arrow to the left",
        f"{AB}R: q §<= a. a => q.\n{END}",
        "E570",
        "`,` or an arrow",
        "a rule ends with what it concludes",
    ),
    Wrong(
        "a comparison",
        f"{AB}R: n §> 5 => q. a => q.\n{END}",
        "E570",
        "`,` or an arrow",
        "all is true or false here: declare an input",
    ),
    Wrong(
        "a comparison without a label",
        f"{AB}n > §5 => q. a => q.\n{END}",
        "E570",
        "the label of the weaker",
        "all is true or false here",
    ),
    Wrong(
        "a comparison with a name",
        f"{AB}n > m §=> q. a => q.\n{END}",
        "E570",
        "`.` after `n > m`",
        "all is true or false here",
    ),
    Wrong(
        "another comparison",
        f"{AB}n §>= 5 => q. a => q.\n{END}",
        "E570",
        "`,` or an arrow",
        "all is true or false here",
    ),
    Wrong(
        "a weaker rule first",
        f"{AB}R: a => q. S: b => ~q. R §< S. a => q.\n{END}",
        "E570",
        "`,` or an arrow",
        "write the stronger rule first",
    ),
    Wrong(
        "a hyphen in a name",
        f"{AB}R: a§-b => q. a => q.\n{END}",
        "E570",
        "`,` or an arrow",
        "names have letters from a to z, digits and `_`",
    ),
    Wrong(
        "a letter that is not of English",
        f"{AB}R: b§ö => q. a => q.\n{END}",
        "E570",
        "`,` or an arrow",
        "names have letters from a to z",
    ),
    Wrong(
        "a digit first", f"{AB}R: §2nd => q. a => q.\n{END}", "E570", "a literal, or", "names have letters from a to z"
    ),
    Wrong(
        "a minus as a negation", f"{AB}R: a, §-b => q. a => q.\n{END}", "E570", "a literal is", "write `~a` for `not a`"
    ),
    Wrong(
        "a word as a negation",
        f"{AB}R: a => q. S: b => not §q. S > R. a => q.\n{END}",
        "E570",
        "`.` after `S: b => not`",
        "write `~a` for `not a`",
    ),
    Wrong(
        "a fact by default",
        f"{AB}D: ~q§. a => q.\n{END}",
        "E570",
        "`,` or an arrow",
        "write `{} => ~q.` for what holds by default (`->`",
    ),
    Wrong("no braces", f"{AB}input §c. c => q. a => q.\n{END}", "E570", "`,` or an arrow", "write `input {a, b}.`"),
    Wrong(
        "no colon",
        f"{AB}R §a => q. a => q.\n{END}",
        "E570",
        "`,` or an arrow",
        "a rule is `C1: {a, ~b} => c.`, with `:`",
    ),
    Wrong(
        "round brackets", f"{AB}R: §(a, b) => q. a => q.\n{END}", "E570", "a literal, or", "write `{a, b}` for `(a, b)`"
    ),
    Wrong("an argument", f"{AB}R: a§(X) => q. a => q.\n{END}", "E570", "`,` or an arrow", "literals have no arguments"),
    Wrong(
        "two signs for an arrow", f"{AB}R: a =>§> q. a => q.\n{END}", "E570", "the literal that", "the arrows are `->`"
    ),
    Wrong("an arrow of logic", f"{AB}R: a §⇒ q. a => q.\n{END}", "E570", "`,` or an arrow", "the arrows are `->`"),
    Wrong(
        "an input that is not declared",
        f"{AB}R: §c => q. a => q.\n{END}",
        "E571",
        "`c` is not an input",
        "write `input {c}.`, or a rule for it",
    ),
    Wrong(
        "true",
        f"{AB}R: §true => q. a => q.\n{END}",
        "E571",
        "`true` is not an input",
        "write `{}` for the body of what needs nothing",
    ),
    Wrong(
        "a head in capitals",
        f"{AB}D: {{}} => ~q. R: a => Q. §R > D. a => q.\n{END}",
        "E575",
        "these rules conclude `Q` and `~q`",
        "did you mean `q`?",
    ),
    Wrong(
        "a label twice, and one of a priority",
        f"{AB}R: a => q. §R: b => ~q. S > R. a => q.\n{END}",
        "E576",
        "`R` labels a rule twice",
        "give one of them",
    ),
    Wrong("no quotes", f"{AB}a => q.\noutput {{b q, §q}}.\n", "E570", "the name outside", 'write `output {b q, "q"}.`'),
)
