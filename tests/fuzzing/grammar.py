"""Random texts of the languages: most parse, many have wrong types, so that what comes after parsing is reached."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from random import Random

COMPARISONS = ("==", "!=", "<", "<=", ">", ">=")
SMALL = ("0", "1", "2", "3", "7", "15", "100")
LARGE = ("1000", "65536", "2147483647", "9223372036854775807", "9223372036854775808", "99999999999999999999")
BINARY = {
    "llfsm": ("&&", "||", "->", "<->", "xor", "U", "W", "R", "M", "S", "T", "and", "or"),
    "spot": ("&", "|", "->", "<->", "xor", "U", "W", "R", "M", "V", "^", "&&", "||"),
    "spin": ("&&", "||", "->", "<->", "U", "W", "V", "until", "implies", "release"),
    "nusmv": ("&", "|", "->", "<->", "xor", "U", "V", "S", "T", "xnor"),
}
UNARY = {
    "llfsm": ("!", "X", "F", "G", "Y", "Z", "O", "H", "<>", "[]", "not"),
    "spot": ("!", "X", "F", "G", "~", "<>", "[]", "X[!]"),
    "spin": ("!", "X", "<>", "[]", "always", "eventually"),
    "nusmv": ("!", "X", "F", "G", "Y", "Z", "O", "H"),
}
INTEGERS = ("n", "u", "big", "ball.x", "a[2]", "limit", "1", "2", "3")
BOOLEANS = ("car", "mine", "b[1]", "true")
ENUMERATED = ("light", "Colour.RED", "GREEN", "AMBER")
SYNTAXES = tuple(BINARY)


def formula(random: Random, syntax: str, atoms: Sequence[str], depth: int = 4) -> str:
    """A formula of temporal logic; `llfsm` and `spot` with bounds and regular expressions."""

    def below() -> str:
        return formula(random, syntax, atoms, depth - 1)

    kind = random.random()
    if depth <= 0 or kind < 0.15:
        return random.choice((*atoms, *atoms, *atoms, "true", "false", "1", "0"))
    if kind < 0.5:
        return f"{random.choice(UNARY[syntax])} {below()}"
    if kind < 0.85:
        left, operator, right = below(), random.choice(BINARY[syntax]), below()
        return f"({left} {operator} {right})" if random.random() < 0.95 else f"{left} {operator} {right}"
    if syntax == "llfsm":
        return _bounded(random, below)
    if syntax == "spot":
        match random.randrange(4):
            case 0:
                return f"{random.choice('FGX')}[{_steps(random)}] {below()}"
            case 1:
                return f"{{{sere(random, atoms, depth - 1)}}}"
            case 2:
                return f"{{{sere(random, atoms, depth - 1)}}}{random.choice(('!', ''))}"
            case _:
                arrow = random.choice(("[]->", "<>->", "[]=>", "<>=>", "|->", "|=>"))
                return f"{{{sere(random, atoms, depth - 1)}}}{arrow} {below()}"
    return f"({below()})"


def _bounded(random: Random, below: Callable[[], str]) -> str:
    time = f"<={random.choice((*SMALL, '1000', '250'))}{random.choice(('ms', 's', 'ms', 's', 'min', ''))}"
    bound = random.choice((_steps(random), time))
    if random.random() < 0.7:
        return f"{random.choice('FFGGXOH')}[{bound}] ({below()})"
    return f"({below()} {random.choice('UWRM')}[{time}] {below()})"


def _steps(random: Random) -> str:
    first, second = sorted(random.choices((0, 1, 2, 3, 5, 30), k=2))
    if random.random() < 0.1:
        second = random.choice((0, 1000, 1001, 10**9))
    return random.choice((str(second), f"{first}:{second}", f"{first}:{second}", f"{first}..{second}", f"{first}:"))


def sere(random: Random, atoms: Sequence[str], depth: int) -> str:
    """A regular expression of Spot's (and PSL's)."""
    kind = random.random()
    if depth <= 0 or kind < 0.25:
        return random.choice((*atoms, "true", "1", "[*]", "[+]", "0"))
    if kind < 0.6:
        operator = random.choice((";", ":", "|", "&&", "&", "##1", "##[0:2]"))
        return f"({sere(random, atoms, depth - 1)} {operator} {sere(random, atoms, depth - 1)})"
    bound = random.choice(("[*]", "[+]", "[*2]", "[*0..3]", "[*1:]", "[=2]", "[->2]", "[:*2]", "[:+]", "[*0]", "[*50]"))
    return f"({sere(random, atoms, depth - 1)}){bound}"


def regular(random: Random, atoms: Sequence[str], depth: int = 4) -> str:
    """A regular expression of our own."""
    kind = random.random()
    if depth <= 0 or kind < 0.25:
        atom = random.choice(atoms)
        return random.choice((f"[{atom}]", f"[{atom} && {random.choice(atoms)}]", atom, "true", "[!(" + atom + ")]"))
    if kind < 0.75:
        joined = random.choice((" ", " | ", " ", "|", ", "))
        return f"({regular(random, atoms, depth - 1)}{joined}{regular(random, atoms, depth - 1)})"
    times = random.choice(("*", "+", "?", "{2}", "{0}", "{0,2}", "{2,}", "{3,1}", "{30}", "{1,300}"))
    return f"({regular(random, atoms, depth - 1)}){times}"


def line(random: Random, syntax: str, atoms: Sequence[str]) -> str:
    """A line of a property file."""
    name = random.choice(("a", "b", "c", "p-1", "G", "assume", "x"))
    match random.randrange(8):
        case 0 | 1 if syntax == "llfsm":
            kind = random.choice(("enforce", "forbid", "forbid initially"))
            return f"{kind} {name}: {regular(random, atoms)}"
        case 2:
            return f"assume {name}: {formula(random, syntax, atoms, 2)}"
        case 3:
            return formula(random, syntax, atoms)
        case _:
            return f"{name}: {formula(random, syntax, atoms)}"


def condition(random: Random, depth: int = 3) -> str:
    """A guard of the right types over `INTEGERS`, `BOOLEANS` and `ENUMERATED`."""
    kind = random.random()
    if depth <= 0 or kind < 0.2:
        return random.choice(
            (*BOOLEANS, f"{random.choice(ENUMERATED)} {random.choice(('==', '!='))} {random.choice(ENUMERATED)}")
        )
    if kind < 0.55:
        return f"{number(random, depth - 1)} {random.choice(COMPARISONS)} {number(random, depth - 1)}"
    if kind < 0.85:
        return (
            f"({condition(random, depth - 1)} {random.choice(('&&', '||', '==', '!='))} {condition(random, depth - 1)})"
        )
    if kind < 0.95:
        return f"!({condition(random, depth - 1)})"
    return f"({condition(random, depth - 1)} ? {condition(random, depth - 1)} : {condition(random, depth - 1)})"


def number(random: Random, depth: int = 3) -> str:
    """An expression whose value is an integer."""
    kind = random.random()
    if depth <= 0 or kind < 0.3:
        return random.choice((*INTEGERS, *SMALL, random.choice(LARGE)) if random.random() < 0.3 else INTEGERS)
    if kind < 0.75:
        return f"({number(random, depth - 1)} {random.choice(('+', '-', '*', '/', '%'))} {number(random, depth - 1)})"
    if kind < 0.9:
        return f"{random.choice(('min', 'max'))}({number(random, depth - 1)}, {number(random, depth - 1)})"
    one = number(random, depth - 1)
    return random.choice(
        (f"abs({one})", f"-{one}", f"a[{one}]", f"({condition(random, depth - 1)} ? {one} : {SMALL[1]})")
    )


def assignment(random: Random, depth: int = 3) -> str:
    """A statement of the right types."""
    kind = random.randrange(7 if depth > 0 else 4)
    if kind == 0:
        return f"{random.choice(BOOLEANS)} = {condition(random, 2)};"
    if kind < 4:
        place = random.choice(("n", "u", "big", "a[n % 4]", "ball.x", "a[1]"))
        return f"{place} {random.choice(('=', '=', '+=', '-=', '*=', '/='))} {number(random, 2)};"
    body = " ".join(assignment(random, depth - 1) for _ in range(random.choice((1, 2))))
    if kind == 4:
        return f"if ({condition(random, 2)}) {{ {body} }} else {{ {assignment(random, depth - 1)} }}"
    if kind == 5:
        return f"for (i{depth} in 0..{random.choice(('1', '3', '9', '300'))}) {{ {body} }}"
    return f"int k{depth} = {number(random, 2)}; big = k{depth}; {body}"


def expression(random: Random, names: Sequence[str], depth: int = 4) -> str:
    """An expression of guards and actions."""
    kind = random.random()

    def below() -> str:
        return expression(random, names, depth - 1)

    if depth <= 0 or kind < 0.2:
        return random.choice((*names, *names, *SMALL, *SMALL, random.choice(LARGE), "true", "false", "-1"))
    if kind < 0.4:
        return f"({below()} {random.choice(COMPARISONS)} {below()})"
    if kind < 0.6:
        return f"({below()} {random.choice(('+', '-', '*', '/', '%'))} {below()})"
    if kind < 0.8:
        return f"({below()} {random.choice(('&&', '||', 'and', 'or'))} {below()})"
    if kind < 0.88:
        return f"{random.choice(('!', '-', 'not ', '+'))}{below()}"
    if kind < 0.94:
        return f"{random.choice(('min', 'max'))}({below()}, {below()})"
    return random.choice((f"({below()} ? {below()} : {below()})", f"abs({below()})", f"a[{below()}]"))


def actions(random: Random, names: Sequence[str], depth: int = 3) -> str:
    """Statements."""

    def body() -> str:
        return actions(random, names, depth - 1)

    def value() -> str:
        return expression(random, names, 2)

    found: list[str] = []
    for number in range(random.choice((1, 1, 2, 4))):
        place = random.choice(names)
        match random.randrange(9) if depth > 0 else random.randrange(4):
            case 0 | 1:
                found.append(f"{place} = {value()};")
            case 2:
                found.append(f"{place} {random.choice(('+=', '-=', '*=', '/=', '%='))} {value()};")
            case 3:
                found.append(random.choice((f"{place}++;", f"--{place};", f"int k{number} = {value()};", ";")))
            case 4 | 5:
                found.append(f"if ({value()}) {{ {body()} }}" + random.choice(("", f" else {{ {body()} }}")))
            case 6:
                end = random.choice((*SMALL, *SMALL, "10000", "10001", "a"))
                found.append(f"for (i{depth} in 0..{end}) {{ {body()} }}")
            case 7:
                step = random.choice(("i = i + 1", "i++", "i = i * 2", "i--", "i = i"))
                found.append(f"for (i = 0; i < {random.choice(SMALL)}; {step}) {{ {body()} }}")
            case _:
                found.append(
                    f"{random.choice(('suspend', 'resume', 'restart'))}({random.choice(('m', 'other', 'x'))});"
                )
    return " ".join(found)


def word(random: Random, atoms: Sequence[str]) -> str:
    """An ultimately periodic word."""

    def letter() -> str:
        chosen = [random.choice(("", "!", "!!")) + atom for atom in random.sample(atoms, random.randint(1, 3))]
        return random.choice(("&".join(chosen), "1", "&&".join(chosen), "&".join(chosen)))

    stem = "".join(letter() + ";" for _ in range(random.randint(0, 4)))
    return f"{stem}cycle{{{';'.join(letter() for _ in range(random.randint(1, 4)))}}}"
