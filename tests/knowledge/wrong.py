"""Wrong theories of plausible logic; ``§`` marks the place of what is said."""

from __future__ import annotations

from typing import NamedTuple

END = 'output {b q, "q"}.\n'
AB = "input {a, b}.\n"


class Wrong(NamedTuple):
    """What is wrong, the text, the code, and how the message begins."""

    reason: str
    text: str
    code: str
    message: str


WRONG = (
    Wrong("a dot is missing", f"{AB}R: a => §q\n{END}", "E570", "a `.` is missing at the end of `R: a => q`"),
    Wrong("two rules without a dot", f"{AB}R: a => §q S: b => ~q.\n{END}", "E570", "a `.` is missing"),
    Wrong("the last dot is missing", f"{AB}a => q.\n{END[:-3]}§}}", "E570", "a `.` is missing"),
    Wrong("a semicolon", f"{AB}a => q§;\n{END}", "E570", "`.` after `a => q` is expected, and there is `;`"),
    Wrong("no arrow", f"{AB}a => q. a §~q.\n{END}", "E570", "`,` or an arrow (`->`, `=>`, `~>`) is expected"),
    Wrong("a fact without an arrow", f"{AB}q§.\n{END}", "E570", "`,` or an arrow"),
    Wrong("a rule of Prolog", f"{AB}q :§- a.\n{END}", "E570", "a literal, or `{}` for an empty body is expected"),
    Wrong("another negation", f"{AB}R: §!a => q.\n{END}", "E570", "a literal, or `{}`"),
    Wrong("another conjunction", f"{AB}a §&& b => q.\n{END}", "E570", "`,` or an arrow"),
    Wrong("a body that is open", f"{AB}R: {{a, b §=> q.\n{END}", "E570", "`}` or `,` is expected"),
    Wrong("a head with two literals", f"{AB}R: a => q§, b.\n{END}", "E570", "`.` after `R: a => q` is expected"),
    Wrong("a chain of priorities", f"{AB}R: a => q. S: b => ~q. R > S §> R.\n{END}", "E570", "`.` after `R > S`"),
    Wrong("an unknown declaration", f"§inptu {{a, b}}.\n{{}} => q.\n{END}", "E570", "`inptu` is not a declaration"),
    Wrong("a text that is open", f'{AB}a => q.\noutput {{b q, §"q}}.\n', "E570", "the name outside (in quotes)"),
    Wrong("a comment of another language", f"{AB}a => q. §# why\n{END}", "E570", "a literal, or `{}`"),
    Wrong("an output that is negated", f"{AB}a => q.\noutput {{b §~q}}.\n", "E570", "an output is an atom"),
    Wrong("a misspelt input", f"input {{doorOpen}}.\nR: §dooropen => q.\n{END}", "E571", "`dooropen` is not an input"),
    Wrong("only its negation", f"{AB}a => c. §~c => q.\n{END}", "E571", "no rule can conclude `~c`"),
    Wrong("only a defeater", f"{AB}a ~> c. §c => q.\n{END}", "E571", "no rule can conclude `c`, only defeaters"),
    Wrong("an unknown output", f'{AB}a => q.\noutput {{b §p, "p"}}.\n', "E571", "`p` is not an input"),
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
)
